//! The paper's network as something to be trained, and its weights when it is.

use rayon::prelude::*;
use retina_core::network::faithful::NAME;

use super::network::Network;
use super::prepared::{Prepared, SYMMETRIES, View};
use super::variant::Variant;
use crate::describe;
use crate::sample::{Sample, Split};
use crate::train::export::Named;
use crate::train::parameters::Layout;
use crate::train::run::Learner;
use crate::train::score::Score;

/// The network with the samples that it learns from.
pub struct FaithfulLearner {
    /// The network.
    pub network: Network,
    variant: Variant,
    train: Vec<Prepared>,
    validation: Vec<Prepared>,
}

impl FaithfulLearner {
    /// Prepares the samples of the splits `train` and `validation`.
    pub fn new(samples: &[Sample], variant: Variant) -> Self {
        let of = |split: Split| -> Vec<Prepared> {
            let chosen: Vec<&Sample> = samples.iter().filter(|sample| sample.split == split).collect();
            chosen.into_par_iter().map(Prepared::new).collect()
        };
        FaithfulLearner {
            network: Network::new(describe::graph(), variant.backbone),
            variant,
            train: of(Split::Train),
            validation: of(Split::Validation),
        }
    }

    /// All tensors of the weights.
    pub fn tensors(&self, parameters: &[f32]) -> Vec<Named> {
        let tensors = self.network.layout.tensors.iter();
        tensors.map(|t| (t.name.clone(), t.shape.clone(), parameters[t.range.clone()].to_vec())).collect()
    }
}

/// The symmetry under which a sample is seen in an epoch: all eight in turn, from another one for each sample.
fn symmetry_of(sample: usize, epoch: usize) -> usize {
    (sample.wrapping_mul(5) + epoch) % SYMMETRIES
}

impl Learner for FaithfulLearner {
    fn network(&self) -> &'static str {
        NAME
    }

    fn layout(&self) -> &Layout {
        &self.network.layout
    }

    fn initial(&self, random: &mut fastrand::Rng) -> Vec<f32> {
        self.network.initial(random)
    }

    fn counts(&self) -> [usize; 2] {
        [self.train.len(), self.validation.len()]
    }

    fn learn(&self, parameters: &[f32], samples: &[usize], epoch: usize, weight: f32, gradient: &mut [f32]) -> Score {
        let mut score = Score::default();
        let mut view = View::default();
        for &sample in samples {
            self.train[sample].view(symmetry_of(sample, epoch), &mut view);
            self.variant.seen.hide(&mut view);
            let pass = self.network.forward(parameters, &view);
            let (one, slope) = self.network.loss(&pass.rows[pass.rows.len() - 1], &view.target, weight);
            self.network.backward(parameters, &pass, slope, gradient);
            score += one;
        }
        score
    }

    fn judge(&self, parameters: &[f32], samples: &[usize]) -> Score {
        let mut score = Score::default();
        let mut view = View::default();
        for &sample in samples {
            self.validation[sample].view(0, &mut view);
            self.variant.seen.hide(&mut view);
            let pass = self.network.forward(parameters, &view);
            score += self.network.loss(&pass.rows[pass.rows.len() - 1], &view.target, 0.0).0;
        }
        score
    }
}
