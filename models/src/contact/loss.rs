//! What the contact networks are trained for.
//!
//! For the nodes, the travel and the reaction the pseudo-Huber length `√(|e|² + ε²) − ε`: a distance for large errors, a square for those below `ε`, so that
//! neither outliers nor rounding rule. For the error's quantiles the pinball loss `max(p y, (p − 1) y)` of `y = ln(worst/depth) − q`, whose minimum is the
//! p-quantile (Koenker & Bassett 1978).

use nalgebra::Vector3;
use retina_core::network::contact::{MOTION, QUANTILES};
use retina_core::network::features::BASIS;
use retina_core::patch::NODE_COUNT;

use super::network::{Pass, Slopes};
use super::prepared::Prepared;
use crate::train::score::Score;

/// Errors of nodes below this count by their squares (µm).
const NODE_UM: f32 = 1.0;
/// The same for the travel (µm).
const TRAVEL_UM: f32 = 1.0;
/// Weight of a micrometre of travel against one of a node.
const TRAVEL_WEIGHT: f32 = 0.1;
/// The same for the reaction, in percent of the force.
const REACTION_PERCENT: f32 = 0.5;
/// Weight of a percent of reaction against a micrometre of a node.
const REACTION_WEIGHT: f32 = 0.1;
/// Which quantiles of the error are learned.
pub const LEVELS: [f32; QUANTILES] = [0.5, 0.95];
/// Weight of the quantiles: they share nothing with the rest but the step's size.
const QUANTILE_WEIGHT: f32 = 1.0;
/// Errors below this are as good as none (µm).
pub const SMALLEST_UM: f32 = 1e-3;
/// Percents in one.
const PERCENT: f32 = 100.0;

/// `√(|e|² + ε²) − ε` and its derivative by e.
fn pseudo_huber(error: Vector3<f32>, soft: f32) -> (f32, Vector3<f32>) {
    let length = (error.norm_squared() + soft * soft).sqrt();
    (length - soft, error / length)
}

/// Error of each node of a sample (µm), given its rows of coefficients.
pub fn node_errors_um<'a>(sample: &'a Prepared, out: &'a [f32]) -> impl Iterator<Item = Vector3<f32>> + 'a {
    sample.excess_um.iter().zip(&sample.basis_um).zip(out.chunks_exact(BASIS)).map(|((excess, basis), coefficients)| {
        basis.iter().zip(coefficients).fold(*excess, |error, (vector, coefficient)| error + vector * *coefficient)
    })
}

/// The loss over `samples`, and its derivatives times `weight` into `slopes`.
pub fn loss(samples: &[&Prepared], pass: &Pass, weight: f32, slopes: &mut Slopes) -> Score {
    let mut score = of_motion(samples, pass, weight, slopes);
    score.total += of_quantiles(samples, pass, weight, slopes);
    score
}

/// The part of nodes, travel and reaction.
pub fn of_motion(samples: &[&Prepared], pass: &Pass, weight: f32, slopes: &mut Slopes) -> Score {
    let mut score = Score::default();
    slopes.out.clear();
    slopes.motion.clear();
    let per_node = 1.0 / NODE_COUNT as f32;
    let outs = pass.out.chunks_exact(NODE_COUNT * BASIS);
    for ((sample, out), motion) in samples.iter().zip(outs).zip(pass.motion.chunks_exact(MOTION)) {
        let mut total = 0.0;
        for (error, basis) in node_errors_um(sample, out).zip(&sample.basis_um) {
            let (value, slope) = pseudo_huber(error, NODE_UM);
            total += per_node * value;
            score.node_um += f64::from(per_node * error.norm());
            slopes.out.extend(basis.iter().map(|vector| weight * per_node * vector.dot(&slope)));
        }
        let travel = Vector3::x() * (sample.travel_excess_um + sample.depth_um * motion[0]);
        let (value, slope) = pseudo_huber(travel, TRAVEL_UM);
        total += TRAVEL_WEIGHT * value;
        score.travel_um += f64::from(travel.x.abs());
        slopes.motion.push(weight * TRAVEL_WEIGHT * slope.x * sample.depth_um);
        let sides = sample.sides.iter().zip(&motion[1..]);
        let reaction = sides.fold(sample.reaction_excess, |error, (side, c)| error + side * *c);
        score.reaction += f64::from(reaction.norm());
        let (value, slope) = pseudo_huber(reaction * PERCENT, REACTION_PERCENT);
        total += REACTION_WEIGHT * value;
        slopes.motion.extend(sample.sides.map(|side| weight * REACTION_WEIGHT * PERCENT * slope.dot(&side)));
        score.total += f64::from(total);
    }
    score
}

/// The part of the error's quantiles; the error itself counts as given.
pub fn of_quantiles(samples: &[&Prepared], pass: &Pass, weight: f32, slopes: &mut Slopes) -> f64 {
    let mut total = 0.0;
    slopes.quantile.clear();
    let outs = pass.out.chunks_exact(NODE_COUNT * BASIS);
    for ((sample, out), quantiles) in samples.iter().zip(outs).zip(pass.quantile.chunks_exact(QUANTILES)) {
        let target = (worst_um(sample, out) / sample.depth_um).ln();
        for (quantile, level) in quantiles.iter().zip(LEVELS) {
            let above = target - quantile;
            let (value, slope) =
                if above > 0.0 { (level * above, -level) } else { ((level - 1.0) * above, 1.0 - level) };
            total += f64::from(QUANTILE_WEIGHT * value);
            slopes.quantile.push(weight * QUANTILE_WEIGHT * slope);
        }
    }
    total
}

/// Error of a sample's worst node (µm), not less than [`SMALLEST_UM`].
pub fn worst_um(sample: &Prepared, out: &[f32]) -> f32 {
    node_errors_um(sample, out).map(|error| error.norm()).fold(SMALLEST_UM, f32::max)
}
