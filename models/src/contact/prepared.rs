//! Samples as the contact networks are trained on: described once, before the first epoch.

use nalgebra::{Matrix3, Vector3};
use retina_core::needle::Tip;
use retina_core::network::contact::STRAIN;
use retina_core::network::features::{BASIS, Features, SIDES};
use retina_core::patch::NODE_COUNT;

use crate::describe;
use crate::sample::Sample;

/// Micrometres in a millimetre.
pub const UM: f32 = 1e3;

/// One described sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// Standardised numbers of the nodes.
    pub local: Vec<f32>,
    /// Standardised numbers of the request.
    pub global: Vec<f32>,
    /// Basis vectors of each node times its scale (µm).
    pub basis_um: Vec<[Vector3<f32>; BASIS]>,
    /// Weights of the pooling.
    pub pool: Vec<f32>,
    /// What the start's displacements have too much (µm).
    pub excess_um: Vec<Vector3<f32>>,
    /// What the start's travel has too much (µm).
    pub travel_excess_um: f32,
    /// What the start's reaction has too much across the direction, over the force.
    pub reaction_excess: Vector3<f32>,
    /// The reaction's sides across the direction.
    pub sides: [Vector3<f32>; SIDES],
    /// Depth of the linear answer (µm).
    pub depth_um: f32,
    /// That depth over the thickness of what yields.
    pub strain: f32,
    /// Whether the tip has an edge.
    pub edged: bool,
}

impl Prepared {
    /// Describes `sample` for the network that corrects `coarse` or the linear answer; `None` where there is no such answer.
    pub fn new(sample: &Sample, coarse: bool) -> Option<Self> {
        let input = describe::input(sample);
        let start = if coarse { input.coarse? } else { input.linear };
        let truth = describe::answer(&sample.truth);
        let mut features = Features::default();
        features.describe(&input, coarse.then_some(&start));
        let across = Matrix3::identity() - input.direction * input.direction.transpose();
        let basis = features.basis.iter().zip(&features.scale_mm);
        Some(Prepared {
            basis_um: basis.map(|(basis, scale)| basis.map(|vector| vector * (scale * UM))).collect(),
            excess_um: (0..NODE_COUNT)
                .map(|node| (start.displacement_mm[node] - truth.displacement_mm[node]) * UM)
                .collect(),
            travel_excess_um: (start.travel_mm - truth.travel_mm) * UM,
            reaction_excess: across * (start.reaction_mn - truth.reaction_mn) / input.force_mn,
            sides: features.sides.map(|side| across * side),
            depth_um: input.depth_mm * UM,
            strain: features.global[STRAIN],
            edged: input.shape.tip != Tip::Hemispherical,
            local: features.local,
            global: features.global,
            pool: features.pool,
        })
    }
}

/// Means, inverse deviations and extremes of columns of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Normaliser {
    /// Means.
    pub mean: Vec<f32>,
    /// Inverse standard deviations; 0 for a number that does not vary.
    pub scale: Vec<f32>,
    /// Smallest.
    pub low: Vec<f32>,
    /// Largest.
    pub high: Vec<f32>,
}

/// A deviation below this share of the mean is rounding.
const VARIES: f64 = 1e-5;

impl Normaliser {
    /// Of rows of `width` numbers.
    pub fn new<'a>(rows: impl Iterator<Item = &'a [f32]>, width: usize) -> Self {
        let (mut sums, mut squares, mut count) = (vec![0.0_f64; width], vec![0.0_f64; width], 0.0_f64);
        let (mut low, mut high) = (vec![f32::INFINITY; width], vec![f32::NEG_INFINITY; width]);
        for row in rows.flat_map(|rows| rows.chunks_exact(width)) {
            count += 1.0;
            for (k, &number) in row.iter().enumerate() {
                sums[k] += f64::from(number);
                squares[k] += f64::from(number) * f64::from(number);
                low[k] = low[k].min(number);
                high[k] = high[k].max(number);
            }
        }
        let mean: Vec<f64> = sums.iter().map(|sum| sum / count).collect();
        let deviation = |k: usize| (squares[k] / count - mean[k] * mean[k]).max(0.0).sqrt();
        let inverse = |k: usize| {
            let deviation = deviation(k);
            if deviation > VARIES * (1.0 + mean[k].abs()) { (1.0 / deviation) as f32 } else { 0.0 }
        };
        let scale = (0..width).map(inverse).collect();
        Normaliser { mean: mean.into_iter().map(|mean| mean as f32).collect(), scale, low, high }
    }

    /// Standardises rows in place.
    pub fn apply(&self, rows: &mut [f32]) {
        for row in rows.chunks_exact_mut(self.mean.len()) {
            for (number, (mean, scale)) in row.iter_mut().zip(self.mean.iter().zip(&self.scale)) {
                *number = (*number - mean) * scale;
            }
        }
    }
}
