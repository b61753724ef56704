//! How fine the truth is, and how far it may be from a finer one.
//!
//! What a fine mesh costs is the factorisation of its matrix; what its answer hangs on is the nine cells under the contact and the first rings around
//! it. The truth keeps these and saves on the rest. [`compare`] measures what that changes, on paths of their own seed, and [`error_mm`] states it.

use retina_core::comparison::quantile;
use retina_core::equilibrium::ContactSettings;
use retina_core::predict::finite_element::{REFERENCE, Resolution};
use retina_core::predict::{PredictError, PreparedScene};

use super::draw::{Depths, STEPS, Tips, plan};
use super::path::{Path, PathMemory};
use super::report::largest_um;
use crate::sample::Sample;

/// The truth's mesh: eight rings, graded towards the contact, two elements through the retina, and a rigid sclera.
pub const TRUTH: Resolution =
    Resolution { rings: 8, ring_grading: 1.25, retina_elements: 2, sclera_elements: 0, ..FINER };

/// The mesh that it is held against: twelve rings in equal ratios, three elements through the retina and one through the sclera. A step that starts from the one before
/// needs no softened approach.
const FINER: Resolution = Resolution {
    rings: 12,
    ring_grading: 1.0,
    retina_elements: 3,
    sclera_elements: 1,
    contact: ContactSettings { softening: 1.0, ..REFERENCE.contact },
    ..REFERENCE
};

/// Its name, in the manifest.
pub const NAME: &str = "disc-3-8-2-graded";
/// Name of the finer one.
pub const FINER_NAME: &str = "disc-3-12-3";

/// Names of the tips, in the order of [`TipShape::kind`](crate::sample::TipShape::kind).
pub const TIPS: [&str; 3] = ["half ball", "flat", "bevelled"];

/// Where the estimated error comes from.
pub const ERROR_BASIS: &str = "distance of the worst node to that on the mesh disc-3-12-3: the smaller of its 95 % quantile and that of its share of the largest \
                               displacement, by tip, as `truth-error` measured them";

/// 95 % of the measured distances of the worst node (µm), and 95 % of their shares of the largest displacement, by tip: what `truth-error --paths 24 --seed 77` printed
/// for 66, 36 and 22 samples.
pub const MEASURED: [[f64; 2]; TIPS.len()] = [[1.33, 0.0209], [6.54, 0.0505], [13.64, 0.1799]];

/// Estimated error of the truth's worst node (mm).
pub fn error_mm(sample: &Sample) -> f32 {
    let tip = usize::from(sample.tip.kind).min(TIPS.len() - 1);
    (1e-3 * estimated_um(tip, largest_um(&sample.truth.displacement_mm))) as f32
}

/// The estimate for a tip and the largest displacement (µm).
fn estimated_um(tip: usize, largest_um: f64) -> f64 {
    let [distance_um, share] = MEASURED[tip];
    distance_um.min(share * largest_um)
}

/// The truth of one step held against that on the finer mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Number of the tip among [`TIPS`].
    pub tip: usize,
    /// Distance of the worst node (µm).
    pub worst_um: f64,
    /// Largest displacement of a node (µm).
    pub largest_um: f64,
    /// Difference of the forces over the force.
    pub force: f64,
}

/// Holds the truth against that on the finer mesh on path number `path` of `seed`, step by step, until one of the two finds no equilibrium.
///
/// # Errors
/// If the path's scene cannot be prepared.
pub fn compare(seed: u64, path: u32, scenes: &[u8]) -> Result<Vec<Comparison>, PredictError> {
    let mut comparisons = Vec::new();
    let Some(plan) = plan(seed, path, scenes, Depths::Deep, Tips::All) else { return Ok(comparisons) };
    let prepared = PreparedScene::new(plan.scene.clone())?;
    let tip = plan.needle.shape.tip.kind();
    let meshes = [TRUTH, FINER].map(|mesh| Path::new(&plan, &prepared, mesh));
    let [Ok(mut truth), Ok(mut finer)] = meshes else { return Ok(comparisons) };
    let mut memories = [PathMemory::default(), PathMemory::default()];
    for step in 0..STEPS {
        let ours = truth.truth(step, &mut memories[0]);
        let theirs = finer.truth(step, &mut memories[1]);
        let (Ok(ours), Ok(theirs)) = (ours, theirs) else { break };
        let pairs = ours.displacements.iter().zip(&theirs.displacements);
        let along = |reaction: &nalgebra::Vector3<f64>| -reaction.dot(&plan.direction);
        comparisons.push(Comparison {
            tip,
            worst_um: 1e3 * pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max),
            largest_um: 1e3 * theirs.displacements.iter().map(|moved| moved.norm()).fold(0.0, f64::max),
            force: along(&ours.reaction_mn) / along(&theirs.reaction_mn) - 1.0,
        });
    }
    Ok(comparisons)
}

/// The table of many comparisons, as Markdown.
pub fn table(comparisons: &[Comparison]) -> String {
    let mut text = String::from(
        "| tip | samples | worst node µm: median | 95 % | max | % of the largest displacement: median | 95 % | beyond 1 µm and 1 % | beyond the estimate | force off by %: median | 95 % |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, tips) in [("all", 0..3)].into_iter().chain(TIPS.iter().enumerate().map(|(i, tip)| (*tip, i..i + 1))) {
        let of: Vec<&Comparison> = comparisons.iter().filter(|c| tips.contains(&c.tip)).collect();
        if of.is_empty() {
            continue;
        }
        let numbers = |number: fn(&Comparison) -> f64| of.iter().map(|c| number(c)).collect::<Vec<f64>>();
        let worst = numbers(|c| c.worst_um);
        let share = numbers(|c| 100.0 * c.worst_um / c.largest_um);
        let force = numbers(|c| 100.0 * c.force.abs());
        let unforeseen = of.iter().filter(|c| c.worst_um > estimated_um(c.tip, c.largest_um)).count();
        let beyond = of.iter().filter(|c| c.worst_um > (0.01 * c.largest_um).max(1.0)).count();
        text += &format!(
            "| {name} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.0} % | {:.0} % | {:.2} | {:.2} |\n",
            of.len(),
            quantile(&worst, 0.5),
            quantile(&worst, 0.95),
            quantile(&worst, 1.0),
            quantile(&share, 0.5),
            quantile(&share, 0.95),
            100.0 * beyond as f64 / of.len() as f64,
            100.0 * unforeseen as f64 / of.len() as f64,
            quantile(&force, 0.5),
            quantile(&force, 0.95)
        );
    }
    text
}
