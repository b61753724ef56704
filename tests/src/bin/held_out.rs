//! Makes `tests/data/held_out.json` anew: requests on every built-in scene from fixed seeds, answered by level `reference`.
//!
//! `cargo run --release -p retina-tests --bin held_out [-- REQUESTS_PER_SCENE]` takes some seconds a request. Its output moves only with a change of the physics
//! or of the reference's mesh, in a commit that says why. Limits of the cheaper levels are their errors now with [`MARGIN`].

use std::error::Error;

use retina_core::predict::{Level, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;
use retina_tests::held_out::{HeldOut, Limit, PATH, ROUNDING_UM, Sample, displacements_um, prepare};

/// Requests per scene unless told.
const PER_SCENE: usize = 8;
/// Seed of the first scene; the others follow. Unlike those of the measuring programs' defaults: held out.
const SEED: u64 = 9001;
/// Limits over errors when the sample is made: room for another machine's rounding, less than any worthwhile change of a mesh.
const MARGIN: f64 = 1.02;

fn main() -> Result<(), Box<dyn Error>> {
    let per_scene = std::env::args().nth(1).map_or(Ok(PER_SCENE), |count| count.parse())?;
    let levels = [Level::Linear, Level::Coarse];
    let mut errors: [Vec<f64>; 2] = Default::default();
    let mut samples = Vec::new();
    let mut workspace = Workspace::default();
    for (name, seed) in Scene::built_in_names().iter().zip(SEED..) {
        let (scene, rest) = prepare(name)?;
        let mut range = WorkingRange::new(&scene.scene().tissue, seed);
        let mut found = 0;
        while found < per_scene {
            let mut request = range.request(Level::Linear);
            if let Err(refusal) = scene.predict(&request, &mut workspace, &mut Silent) {
                eprintln!("{name}: skipped, {refusal}");
                continue;
            }
            request.level = Level::Reference;
            let Some(mut sample) = Sample::new(name, &request) else { continue };
            // What is stored is what is asked again: numbers pass through the text of the file unchanged.
            let answer = match scene.predict(&sample.request(Level::Reference), &mut workspace, &mut Silent) {
                Ok(answer) => answer,
                Err(failure) => {
                    eprintln!("{name}: FAILED, {failure}: {request:?}");
                    continue;
                }
            };
            let rounded = |value: f64| (value / ROUNDING_UM).round() * ROUNDING_UM;
            sample.reference_um =
                displacements_um(&rest, &answer).iter().map(|u| [0, 1, 2].map(|k| tidy(rounded(u[k])))).collect();
            for (errors, level) in errors.iter_mut().zip(levels) {
                let answer = scene.predict(&sample.request(level), &mut workspace, &mut Silent)?;
                errors.extend(sample.errors_um(&rest, &answer));
            }
            let largest = answer.displacement_um.iter().copied().fold(0.0, f64::max);
            eprintln!("{name}: {} of {:.3} mm, {largest:.1} µm", sample.tip, sample.radius_mm);
            samples.push(sample);
            found += 1;
        }
    }
    let limits = levels.iter().zip(&errors).map(|(level, errors)| {
        let mean_um = errors.iter().sum::<f64>() / errors.len() as f64;
        let worst_um = errors.iter().copied().fold(0.0, f64::max);
        println!("{}: mean {mean_um:.3} µm, worst {worst_um:.3} µm", level.name());
        Limit {
            level: level.name().to_owned(),
            mean_um: tidy(mean_um),
            worst_um: tidy(worst_um),
            mean_limit_um: tidy(mean_um * MARGIN),
            worst_limit_um: tidy(worst_um * MARGIN),
        }
    });
    let sample = HeldOut { limits: limits.collect(), samples };
    std::fs::write(PATH, lines(&sample)?)?;
    Ok(())
}

/// Three decimals, so that the text is short.
fn tidy(value: f64) -> f64 {
    (value * 1e3).round() / 1e3 + 0.0
}

/// JSON with one line per limit and sample, so that a change of one is seen as such.
fn lines(sample: &HeldOut) -> Result<String, serde_json::Error> {
    let list = |items: Vec<String>| items.join(",\n");
    let limits = sample.limits.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    let samples = sample.samples.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    Ok(format!("{{\"limits\": [\n{}\n],\n\"samples\": [\n{}\n]}}\n", list(limits), list(samples)))
}
