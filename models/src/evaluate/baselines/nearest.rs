//! Nearest neighbours: what the linear answer lacks is that of the most alike training samples, weighted with inverse distances.

use nalgebra::Vector3;
use retina_core::network::input::{Field, Input};

use super::numbers;
use crate::contact::prepared::Normaliser;
use crate::evaluate::predictors::Predictor;
use crate::sample::{NODES, Sample};

/// Neighbours asked.
const NEIGHBOURS: usize = 5;
/// Added to every distance, so that one that is met exactly does not divide by zero.
const SOFT: f32 = 1e-3;

/// See the module.
pub struct Nearest {
    rows: Vec<Vec<f32>>,
    /// What the linear answer lacks, over its depth.
    lacks: Vec<Field>,
    normaliser: Normaliser,
}

impl Nearest {
    /// Remembers the samples.
    pub fn new(samples: &[&Sample]) -> Self {
        let (rows, normaliser) = numbers::standardised(samples);
        let lacks = samples.iter().map(|sample| lack(sample)).collect();
        Nearest { rows, lacks, normaliser }
    }
}

/// What the linear answer lacks, over its depth.
pub fn lack(sample: &Sample) -> Field {
    std::array::from_fn(|node| {
        let truth = Vector3::from(sample.truth.displacement_mm[node]);
        (truth - Vector3::from(sample.linear.displacement_mm[node])) / sample.linear_depth_mm
    })
}

impl Predictor for Nearest {
    fn name(&self) -> String {
        format!("{NEIGHBOURS} nearest neighbours on `linear`")
    }

    fn displacement(&mut self, sample: &Sample, input: &Input) -> Option<Field> {
        let mut row = numbers::of(sample);
        self.normaliser.apply(&mut row);
        let squared = |other: &Vec<f32>| row.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        let mut distances: Vec<(f32, usize)> =
            self.rows.iter().enumerate().map(|(at, other)| (squared(other).sqrt(), at)).collect();
        let count = NEIGHBOURS.min(distances.len());
        if count == 0 {
            return None;
        }
        distances.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
        let weights: Vec<(f32, usize)> = distances[..count].iter().map(|&(d, at)| (1.0 / (d + SOFT), at)).collect();
        let total: f32 = weights.iter().map(|(weight, _)| weight).sum();
        let mut moved: [Vector3<f32>; NODES] = input.linear.displacement_mm;
        for (weight, at) in weights {
            for (moved, lack) in moved.iter_mut().zip(&self.lacks[at]) {
                *moved += lack * (sample.linear_depth_mm * weight / total);
            }
        }
        Some(moved)
    }
}
