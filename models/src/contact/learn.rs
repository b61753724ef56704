//! The contact networks as something to be trained, and their weights when they are.

use std::cell::RefCell;

use rayon::prelude::*;
use retina_core::network::contact::{QUANTILES, Start, strain_bin};
use retina_core::network::features::Features;

use super::bounds;
use super::loss::{loss, of_motion};
use super::network::{Form, Network, Pass, Slopes};
use super::prepared::{Normaliser, Prepared};
use crate::describe;
use crate::sample::{Sample, Split};
use crate::train::card::Parity;
use crate::train::export::Named;
use crate::train::parameters::Layout;
use crate::train::run::Learner;
use crate::train::score::Score;

/// A contact network with the samples that it learns from.
pub struct ContactLearner {
    /// The network.
    pub network: Network,
    local: Normaliser,
    global: Normaliser,
    train: Vec<Prepared>,
    validation: Vec<Prepared>,
}

thread_local! {
    /// A thread's memory.
    static KEPT: RefCell<(Pass, Slopes)> = RefCell::default();
}

impl ContactLearner {
    /// Describes and standardises the samples of the splits `train` and `validation`.
    pub fn new(form: Form, samples: &[Sample]) -> Self {
        let of = |split: Split| -> Vec<Prepared> {
            let chosen: Vec<&Sample> = samples.iter().filter(|sample| sample.split == split).collect();
            chosen.into_par_iter().filter_map(|sample| Prepared::new(sample, form.coarse)).collect()
        };
        let (mut train, mut validation) = (of(Split::Train), of(Split::Validation));
        let rows = |of: fn(&Prepared) -> &[f32], width| Normaliser::new(train.iter().map(of), width);
        let local = rows(|sample| &sample.local, Features::local_width(form.coarse));
        let global = rows(|sample| &sample.global, Features::global_width(form.coarse));
        for sample in train.iter_mut().chain(&mut validation) {
            local.apply(&mut sample.local);
            global.apply(&mut sample.global);
        }
        ContactLearner { network: Network::new(form, describe::graph()), local, global, train, validation }
    }

    /// The standardised samples of the validation split.
    pub fn validation(&self) -> &[Prepared] {
        &self.validation
    }

    /// What the trainer computes for the first sample of the validation split.
    pub fn parity(&self, parameters: &[f32]) -> Option<Parity> {
        let sample = self.validation.first()?;
        let mut pass = Pass::default();
        self.network.forward(parameters, &[sample], &mut pass);
        let sum = |numbers: &[f32]| numbers.iter().map(|&number| f64::from(number)).sum();
        let shifts = bounds::shifts(&bounds::judge(&self.network, parameters, &self.validation));
        let shift = &shifts[strain_bin(sample.strain) * QUANTILES..];
        let shifted = pass.quantile.iter().zip(shift).map(|(quantile, shift)| quantile + shift);
        Some(Parity {
            features: [sum(&sample.local), sum(&sample.global)],
            quantiles: shifted.collect(),
            coefficients: pass.out,
            motion: pass.motion,
        })
    }

    /// All tensors of the weights.
    pub fn tensors(&self, parameters: &[f32]) -> Vec<Named> {
        let judged = bounds::judge(&self.network, parameters, &self.validation);
        let named = |name: &str, numbers: &[f32]| (name.to_owned(), vec![numbers.len()], numbers.to_vec());
        let mut tensors: Vec<Named> = self
            .network
            .layout
            .tensors
            .iter()
            .map(|tensor| (tensor.name.clone(), tensor.shape.clone(), parameters[tensor.range.clone()].to_vec()))
            .collect();
        tensors.extend([
            named("normaliser.local.mean", &self.local.mean),
            named("normaliser.local.scale", &self.local.scale),
            named("normaliser.global.mean", &self.global.mean),
            named("normaliser.global.scale", &self.global.scale),
            named("range.global.low", &self.global.low),
            named("range.global.high", &self.global.high),
        ]);
        tensors.extend(bounds::tensors(&judged));
        tensors
    }
}

impl Learner for ContactLearner {
    fn network(&self) -> &'static str {
        if self.network.form.coarse { Start::Coarse.network() } else { Start::Linear.network() }
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

    fn learn(&self, parameters: &[f32], samples: &[usize], _epoch: usize, weight: f32, gradient: &mut [f32]) -> Score {
        let chosen: Vec<&Prepared> = samples.iter().map(|&index| &self.train[index]).collect();
        KEPT.with_borrow_mut(|(pass, slopes)| {
            self.network.forward(parameters, &chosen, pass);
            let score = loss(&chosen, pass, weight, slopes);
            self.network.backward(parameters, &chosen, pass, slopes, gradient);
            score
        })
    }

    fn judge(&self, parameters: &[f32], samples: &[usize]) -> Score {
        let chosen: Vec<&Prepared> = samples.iter().map(|&index| &self.validation[index]).collect();
        KEPT.with_borrow_mut(|(pass, slopes)| {
            self.network.forward(parameters, &chosen, pass);
            // The quantiles are set right on this split afterwards, whatever they are.
            of_motion(&chosen, pass, 0.0, slopes)
        })
    }
}
