//! Held-out samples of the data sets, asked again through the whole prediction: what every level errs by, in groups.
//!
//! `tests/data/held_out_samples.safetensors` holds samples of the test split with the truth of the data sets; scene, needle and direction of a sample follow from the
//! seed and the number of its path, so a request is asked as a user would ask it. `tests/data/held_out_samples.json` holds what the levels erred by when it
//! was made. Both are written by the program `held_out_samples`. Units: mm, mN, errors in µm.
//!
//! Not here: the judgement (tier `accuracy`).

use std::collections::BTreeMap;

use nalgebra::Point3;
use retina_core::comparison::{node_errors_um, quantile};
use retina_core::predict::indentation::EFFECTS;
use retina_core::predict::{Control, EffectChoice, Level, PredictError, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_models::dataset::draw::{Depths, Tips, plan};
use retina_models::evaluate::report::TIPS;
use retina_models::sample::Sample;
use serde::{Deserialize, Serialize};

/// The samples.
pub const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/held_out_samples.safetensors");
/// What the levels erred by.
pub const ERRORS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/held_out_samples.json");
/// Seed of the data set that the samples are from; its scenes are all the built-in ones.
pub const SEED: u64 = 1;
/// Levels that are asked: all but `reference`, against which the truth was held.
pub const LEVELS: [Level; 4] = [Level::Linear, Level::Network, Level::Coarse, Level::Corrected];
/// Upper end of the radius of thin needles (mm): 27G belongs to them, 25G to the thick ones.
const THIN_MM: f32 = 0.22;

/// Errors of a level over a group of samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupErrors {
    /// Samples of the group.
    pub samples: usize,
    /// Samples without an answer.
    pub failed: usize,
    /// Mean error of all nodes (µm).
    pub mean_um: f64,
    /// 99 % of the nodes are no further off (µm).
    pub p99_um: f64,
}

/// Errors by level and group, `LEVEL · GROUP`.
pub type Errors = BTreeMap<String, GroupErrors>;

/// The question whose answer a sample holds; `None` for a sample that its seed does not lead to.
pub fn question(sample: &Sample) -> Option<(Scene, Request)> {
    let scenes: Vec<u8> = (0..Scene::built_in_names().len() as u8).collect();
    let plan = plan(SEED, sample.path, &scenes, Depths::Deep, Tips::All)?;
    let request = Request {
        needle: plan.needle,
        control: Control::Force(plan.direction.into_inner() * f64::from(sample.force_mn)),
        level: Level::Linear,
        effects: EffectChoice::Named(EFFECTS.map(str::to_owned).to_vec()),
    };
    Some((plan.scene, request))
}

/// The groups of a sample: all, its scene, its tip, its needle.
fn groups(sample: &Sample) -> [String; 4] {
    let needle = if sample.tip.radius_mm < THIN_MM { "27G and thinner" } else { "thicker than 27G" };
    let scene = Scene::built_in_names()[usize::from(sample.scene)];
    ["all", scene, TIPS[usize::from(sample.tip.kind)], needle].map(str::to_owned)
}

/// Asks every sample at every level.
///
/// # Errors
/// When a scene cannot be prepared.
pub fn measure(samples: &[Sample]) -> Result<Errors, PredictError> {
    let mut workspace = Workspace::default();
    let mut nodes: BTreeMap<String, (usize, usize, Vec<f64>)> = BTreeMap::new();
    for path in samples.chunk_by(|a, b| a.path == b.path) {
        let Some((scene, _)) = question(&path[0]) else { continue };
        let scene = PreparedScene::new(scene)?;
        for (sample, (_, request)) in path.iter().filter_map(|sample| Some((sample, question(sample)?))) {
            let truth: Vec<Point3<f64>> = (0..sample.rest_mm.len())
                .map(|node| {
                    let moved = |k: usize| {
                        f64::from(sample.rest_mm[node][k]) + f64::from(sample.truth.displacement_mm[node][k])
                    };
                    Point3::new(moved(0), moved(1), moved(2))
                })
                .collect();
            for level in LEVELS {
                let answer = scene.predict(&Request { level, ..request.clone() }, &mut workspace, &mut Silent);
                let errors = answer.map(|answer| node_errors_um(&answer.vertices, &truth));
                for group in groups(sample) {
                    let (count, failed, all) = nodes.entry(format!("{} · {group}", level.name())).or_default();
                    *count += 1;
                    match &errors {
                        Ok(errors) => all.extend(errors),
                        Err(_) => *failed += 1,
                    }
                }
            }
        }
    }
    let group = |(samples, failed, nodes): (usize, usize, Vec<f64>)| GroupErrors {
        samples,
        failed,
        mean_um: nodes.iter().sum::<f64>() / nodes.len() as f64,
        p99_um: quantile(&nodes, 0.99),
    };
    Ok(nodes.into_iter().map(|(name, nodes)| (name, group(nodes))).collect())
}
