//! A network's parameters: one vector of numbers, of which each tensor is a named part.
//!
//! Gradient and Adam's moments are vectors of the same layout.

use std::ops::Range;

use retina_core::network::weights::{Weights, WeightsError};

/// One tensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Its name in the weights.
    pub name: String,
    /// Its shape.
    pub shape: Vec<usize>,
    /// Where it lies.
    pub range: Range<usize>,
}

/// Names and places of all tensors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// The tensors, in order.
    pub tensors: Vec<Tensor>,
}

impl Layout {
    /// Numbers in all.
    pub fn len(&self) -> usize {
        self.tensors.last().map_or(0, |tensor| tensor.range.end)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.tensors.is_empty()
    }

    /// Adds a tensor and says where it lies.
    pub fn add(&mut self, name: &str, shape: &[usize]) -> Range<usize> {
        let start = self.len();
        let range = start..start + shape.iter().product::<usize>();
        self.tensors.push(Tensor { name: name.to_owned(), shape: shape.to_vec(), range: range.clone() });
        range
    }
}

impl Layout {
    /// The parameters that a weight file holds for this layout.
    ///
    /// # Errors
    /// A tensor that is missing or has another shape.
    pub fn read(&self, weights: &Weights) -> Result<Vec<f32>, WeightsError> {
        let mut parameters = vec![0.0; self.len()];
        for tensor in &self.tensors {
            parameters[tensor.range.clone()].copy_from_slice(&weights.take(&tensor.name, &tensor.shape)?);
        }
        Ok(parameters)
    }
}

/// Fills `weight` (of `inner` rows) with normal numbers of variance `gain / inner`: what keeps the size of the activations.
pub fn draw(weight: &mut [f32], inner: usize, gain: f32, random: &mut fastrand::Rng) {
    let deviation = (gain / inner as f32).sqrt();
    for pair in weight.chunks_mut(2) {
        // Box and Muller's transform of two uniform numbers.
        let radius = (-2.0 * random.f32().max(f32::MIN_POSITIVE).ln()).sqrt();
        let (sin, cos) = (std::f32::consts::TAU * random.f32()).sin_cos();
        for (number, normal) in pair.iter_mut().zip([radius * cos, radius * sin]) {
            *number = deviation * normal;
        }
    }
}
