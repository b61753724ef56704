//! Measures every level on random requests of the working range in one run: time, error against `reference`, failures.
//!
//! `cargo run --release -p retina-tests --bin levels [-- REQUESTS [SEED [hemispherical]]]` prints the table that the README shows. One core, one
//! thread; times are those of a whole prediction, the scene prepared and the workspace warm.

use std::time::Instant;

use retina_core::comparison::{node_errors_um, quantile};
use retina_core::needle::NeedleShape;
use retina_core::predict::{Level, PredictError, Prediction, PreparedScene, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;

/// Requests per run unless told.
const REQUESTS: usize = 100;

#[derive(Default)]
struct Column {
    milliseconds: Vec<f64>,
    errors_um: Vec<f64>,
    worst_um: Vec<f64>,
    squared_um2: f64,
    iterations: Vec<f64>,
    failures: Vec<String>,
}

fn main() -> Result<(), PredictError> {
    let mut arguments = std::env::args().skip(1);
    let requests = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(REQUESTS);
    let seed = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(1_u64);
    let scenes: Vec<PreparedScene> = Scene::built_in_names()
        .iter()
        .filter_map(|name| Scene::built_in(name))
        .map(PreparedScene::new)
        .collect::<Result<_, _>>()?;
    let only = arguments.next();
    let mut redrawn = 0;
    let mut ranges: Vec<WorkingRange> =
        scenes.iter().zip(seed..).map(|(s, seed)| WorkingRange::new(&s.scene().tissue, seed)).collect();
    let mut workspace = Workspace::default();
    let mut columns: [Column; Level::ALL.len()] = Default::default();
    let (mut motion_um, mut moved) = (0.0, Vec::new());
    for index in 0..requests {
        let which = index % scenes.len();
        let mut request = loop {
            let request = match &only {
                Some(_) => {
                    let radius_mm = ranges[which].radius_mm();
                    ranges[which].request_with(NeedleShape::hemispherical(radius_mm), Level::Linear)
                }
                None => ranges[which].request(Level::Linear),
            };
            // Outside of the range (too deep, off the patch) is refused at every level alike: draw again.
            match scenes[which].predict(&request, &mut workspace, &mut Silent) {
                Ok(_) => break request,
                Err(_) => redrawn += 1,
            }
        };
        let mut answers: [Option<Prediction>; Level::ALL.len()] = Default::default();
        for (at, level) in Level::ALL.into_iter().enumerate() {
            request.level = level;
            // Once for the caches, once for the clock; the slow level needs no warm-up.
            if level != Level::Reference {
                let _ = scenes[which].predict(&request, &mut workspace, &mut Silent);
            }
            let start = Instant::now();
            let answer = scenes[which].predict(&request, &mut workspace, &mut Silent);
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            match answer {
                Ok(answer) => {
                    columns[at].milliseconds.push(milliseconds);
                    columns[at].iterations.push(answer.solver.iterations as f64);
                    answers[at] = Some(answer);
                }
                Err(error) => columns[at].failures.push(format!("{}: {error}", scenes[which].scene().name)),
            }
        }
        let Some(Some(truth)) = answers.last() else { continue };
        let motion = &truth.displacement_um;
        motion_um += motion.iter().map(|u| u * u).sum::<f64>();
        moved.push(motion.iter().copied().fold(0.0, f64::max));
        for (column, answer) in columns.iter_mut().zip(&answers) {
            let Some(answer) = answer else { continue };
            let errors = node_errors_um(&answer.vertices, &truth.vertices);
            column.squared_um2 += errors.iter().map(|e| e * e).sum::<f64>();
            column.worst_um.push(errors.iter().copied().fold(0.0, f64::max));
            column.errors_um.extend(errors);
        }
        eprint!("\r{}/{requests}", index + 1);
    }
    eprintln!();
    println!(
        "{requests} requests ({}), seed {seed}, {redrawn} refused and drawn again; largest displacement per request: median {:.1} µm, p95 {:.1} µm\n",
        only.as_deref().unwrap_or("all tips"),
        quantile(&moved, 0.5),
        quantile(&moved, 0.95)
    );
    println!(
        "| level | median ms | p99 ms | MAE µm | p99 node µm | worst node: median / max µm | % of RMS displacement | Newton median / p99 | failed |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (level, column) in Level::ALL.iter().zip(&columns) {
        let errors = &column.errors_um;
        println!(
            "| `{}` | {:.3} | {:.3} | {:.2} | {:.2} | {:.2} / {:.2} | {:.1} | {:.0} / {:.0} | {} |",
            level.name(),
            quantile(&column.milliseconds, 0.5),
            quantile(&column.milliseconds, 0.99),
            errors.iter().sum::<f64>() / errors.len() as f64,
            quantile(errors, 0.99),
            quantile(&column.worst_um, 0.5),
            quantile(&column.worst_um, 1.0),
            100.0 * (column.squared_um2 / motion_um).sqrt(),
            quantile(&column.iterations, 0.5),
            quantile(&column.iterations, 0.99),
            column.failures.len()
        );
    }
    for column in &columns {
        for failure in &column.failures {
            println!("- failed: {failure}");
        }
    }
    Ok(())
}
