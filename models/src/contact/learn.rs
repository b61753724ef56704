//! The contact networks as something to be trained, and their weights when they are.

use std::cell::RefCell;

use rayon::prelude::*;
use retina_core::network::contact::{PRIOR_STRAINS, QUANTILES, Start, TIP_BINS, strain_bin};
use retina_core::network::features::Features;

use super::loss::{LEVELS, loss, of_motion, worst_um};
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

/// Of n numbers the ⌈p (n + 1)⌉-th smallest, where there are as many.
fn conformal(mut numbers: Vec<f32>, level: f32) -> Option<f32> {
    numbers.sort_by(f32::total_cmp);
    let rank = (f64::from(level) * (numbers.len() + 1) as f64).ceil() as usize;
    numbers.get(rank.wrapping_sub(1)).copied()
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

    /// The logarithms of the worst node's error over the depth, less the predicted quantiles, for every sample of the validation split.
    fn surprises(&self, parameters: &[f32]) -> [Vec<f32>; QUANTILES] {
        let mut surprises: [Vec<f32>; QUANTILES] = Default::default();
        let mut pass = Pass::default();
        for sample in &self.validation {
            self.network.forward(parameters, &[sample], &mut pass);
            let target = (worst_um(sample, &pass.out) / sample.depth_um).ln();
            for (surprises, quantile) in surprises.iter_mut().zip(&pass.quantile) {
                surprises.push(target - quantile);
            }
        }
        surprises
    }

    /// Quantiles of the worst node's error over the depth, in the core's bins of tip and strain, conformal as the shifts are.
    fn prior(&self, parameters: &[f32]) -> Vec<f32> {
        let mut bins = vec![Vec::new(); TIP_BINS * (PRIOR_STRAINS.len() + 1)];
        let mut pass = Pass::default();
        for sample in &self.validation {
            self.network.forward(parameters, &[sample], &mut pass);
            let bin = usize::from(sample.edged) * (PRIOR_STRAINS.len() + 1) + strain_bin(sample.strain);
            bins[bin].push(worst_um(sample, &pass.out) / sample.depth_um);
        }
        let all: Vec<f32> = bins.concat();
        // A bin with too few samples for a bound has that of all samples twice over.
        bins.into_iter()
            .flat_map(|ratios| {
                LEVELS.map(|level| conformal(ratios.clone(), level).or(conformal(all.clone(), level).map(|q| 2.0 * q)))
            })
            .map(|quantile| quantile.unwrap_or(1.0))
            .collect()
    }

    /// What has to be added to the quantiles' logarithms so that they hold on the validation split: of n surprises the ⌈p (n + 1)⌉-th smallest
    /// (conformalised quantile regression: Romano, Patterson & Candès 2019).
    fn shifts(&self, parameters: &[f32]) -> Vec<f32> {
        let shift = |(surprises, level): (Vec<f32>, f32)| {
            let largest = surprises.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            conformal(surprises, level).unwrap_or(largest)
        };
        self.surprises(parameters).into_iter().zip(LEVELS).map(shift).collect()
    }

    /// What the trainer computes for the first sample of the validation split.
    pub fn parity(&self, parameters: &[f32]) -> Option<Parity> {
        let sample = self.validation.first()?;
        let mut pass = Pass::default();
        self.network.forward(parameters, &[sample], &mut pass);
        let sum = |numbers: &[f32]| numbers.iter().map(|&number| f64::from(number)).sum();
        let shifted = pass.quantile.iter().zip(self.shifts(parameters)).map(|(quantile, shift)| quantile + shift);
        Some(Parity {
            features: [sum(&sample.local), sum(&sample.global)],
            quantiles: shifted.collect(),
            coefficients: pass.out,
            motion: pass.motion,
        })
    }

    /// All tensors of the weights.
    pub fn tensors(&self, parameters: &[f32]) -> Vec<Named> {
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
            named("quantile.shift", &self.shifts(parameters)),
        ]);
        let prior = vec![TIP_BINS, PRIOR_STRAINS.len() + 1, QUANTILES];
        tensors.push(("prior".to_owned(), prior, self.prior(parameters)));
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
