//! Measures how far `linear` and `coarse` are from `reference`, in the bins of `core/src/predict/expected_error.rs`, and writes
//! `core/src/predict/calibration.rs`.
//!
//! `cargo run --release -p retina-tests --bin calibrate [-- REQUESTS [SEED]]` takes some seconds a request. What is measured is kept in
//! `target/calibration-SEED.jsonl` as it comes, so an interrupted run goes on where it stopped. Requests are those of the working range over the
//! built-in scenes, all tips; what `reference` does not answer is counted and left out.

use std::collections::HashMap;
use std::error::Error;
use std::fs::{self, OpenOptions};
use std::io::Write as _;

use indicatif::{ProgressBar, ProgressStyle};
use retina_core::comparison::{node_errors_um, quantile};
use retina_core::needle::Tip;
use retina_core::predict::expected_error::{BINS, STRAIN_BINS, bin};
use retina_core::predict::{Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;
use serde::{Deserialize, Serialize};

/// Requests per run unless told.
const REQUESTS: usize = 300;
/// The seed unless told.
const SEED: u64 = 77;
/// Where the quantiles go.
const OUTPUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../core/src/predict/calibration.rs");
/// Share of samples below the upper bound.
const COVERAGE: f64 = 0.95;

/// One request at every level.
#[derive(Serialize, Deserialize)]
struct Measured {
    index: usize,
    edged: bool,
    strain: f64,
    depth_um: f64,
    /// Error of the worst node at `linear` and `coarse` (µm); none where a level failed.
    worst_um: Option<[f64; 2]>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let requests: usize = arguments.next().map_or(Ok(REQUESTS), |a| a.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(SEED), |a| a.parse())?;
    let journal = format!("{}/../target/calibration-{seed}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let mut known: HashMap<usize, Measured> = HashMap::new();
    for line in fs::read_to_string(&journal).unwrap_or_default().lines() {
        // A line cut short by an interruption is measured again.
        if let Ok(measured) = serde_json::from_str::<Measured>(line) {
            known.insert(measured.index, measured);
        }
    }
    let mut journal = OpenOptions::new().create(true).append(true).open(&journal)?;
    let scenes: Vec<PreparedScene> = Scene::built_in_names()
        .iter()
        .filter_map(|name| Scene::built_in(name))
        .map(PreparedScene::new)
        .collect::<Result<_, _>>()?;
    let mut ranges: Vec<WorkingRange> =
        scenes.iter().zip(seed..).map(|(s, seed)| WorkingRange::new(&s.scene().tissue, seed)).collect();
    let mut workspace = Workspace::default();
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {eta}")?;
    let bar = ProgressBar::new(requests as u64).with_style(style);
    let mut samples = Vec::with_capacity(requests);
    for index in 0..requests {
        let which = index % scenes.len();
        let scene = &scenes[which];
        let request = loop {
            let request = ranges[which].request(Level::Linear);
            if scene.predict(&request, &mut workspace, &mut Silent).is_ok() {
                break request;
            }
        };
        let measured = match known.remove(&index) {
            Some(measured) => measured,
            None => {
                let measured = measure(index, scene, &request, &mut workspace)?;
                writeln!(journal, "{}", serde_json::to_string(&measured)?)?;
                measured
            }
        };
        samples.push(measured);
        bar.inc(1);
    }
    bar.finish();
    fs::write(OUTPUT, source(&samples, seed))?;
    let failed = samples.iter().filter(|sample| sample.worst_um.is_none()).count();
    println!("{requests} requests, {failed} without an answer; wrote {OUTPUT}");
    Ok(())
}

fn measure(
    index: usize,
    scene: &PreparedScene,
    request: &Request,
    workspace: &mut Workspace,
) -> Result<Measured, Box<dyn Error>> {
    let situation = scene.situation(request)?;
    let mut answer = |level| scene.predict(&Request { level, ..request.clone() }, workspace, &mut Silent);
    let worst_um = match (answer(Level::Reference), answer(Level::Linear), answer(Level::Coarse)) {
        (Ok(truth), Ok(linear), Ok(coarse)) => Some(
            [linear, coarse]
                .map(|answer| node_errors_um(&answer.vertices, &truth.vertices).into_iter().fold(0.0, f64::max)),
        ),
        _ => None,
    };
    let edged = request.needle.shape.tip != Tip::Hemispherical;
    Ok(Measured { index, edged, strain: situation.strain, depth_um: situation.depth_um, worst_um })
}

/// The text of `calibration.rs`.
fn source(samples: &[Measured], seed: u64) -> String {
    let table = |level: usize| {
        let rows = [false, true].map(|edged| {
            let bins = (0..BINS).map(|at| {
                let here = samples.iter().filter(|s| s.edged == edged && bin(s.strain) == at);
                let ratios: Vec<f64> = here.filter_map(|s| Some(s.worst_um?[level] / s.depth_um)).collect();
                entry(ratios)
            });
            format!("    [{}],\n", bins.collect::<Vec<_>>().join(", "))
        });
        rows.concat()
    };
    let measured = samples.iter().filter(|s| s.worst_um.is_some()).count();
    let ends = STRAIN_BINS.map(|end| end.to_string()).join(", ");
    format!(
        "//! Quantiles of the worst node's error over the linear depth. Written by\n\
         //! `cargo run --release -p retina-tests --bin calibrate -- {} {seed}`; not by hand.\n//!\n\
         //! {measured} of {} requests answered at every level. Bins of mean strain end at {ends}.\n\n\
         use super::expected_error::{{BINS, Quantiles}};\n\n\
         const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {{\n    Quantiles {{ median, p95, samples }}\n}}\n\n\
         /// Level `linear`: round tips, then edged ones; by bin of strain.\n#[rustfmt::skip]\n\
         pub const LINEAR: [[Quantiles; BINS]; 2] = [\n{}];\n\n\
         /// Level `coarse`: round tips, then edged ones; by bin of strain.\n#[rustfmt::skip]\n\
         pub const COARSE: [[Quantiles; BINS]; 2] = [\n{}];\n",
        samples.len(),
        samples.len(),
        table(0),
        table(1)
    )
}

fn entry(mut ratios: Vec<f64>) -> String {
    ratios.sort_by(f64::total_cmp);
    let count = ratios.len();
    let rank = (COVERAGE * (count + 1) as f64).ceil() as usize;
    let median = if count == 0 { 0.0 } else { quantile(&ratios, 0.5) };
    match ratios.get(rank.wrapping_sub(1)) {
        Some(p95) => format!("of({median:.5}, {p95:.5}, {count})"),
        None => format!("of({median:.5}, f64::INFINITY, {count})"),
    }
}
