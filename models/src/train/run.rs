//! One training: epochs of shuffled minibatches, Adam under a cosine, the best parameters on the validation split.
//!
//! Everything follows from the seed and the number of epochs, whatever the number of threads: a batch is cut into chunks of fixed size, each chunk's
//! gradient is computed on some thread, and they are added in order. A run stopped at any moment goes on from its last finished epoch.

use std::path::Path;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::adam::{Adam, rate};
use super::checkpoint::{self, CheckpointError};
use super::parameters::Layout;
use super::score::Score;

/// What can be trained.
pub trait Learner: Sync {
    /// Its name in weights and records.
    fn network(&self) -> &'static str;
    /// Names and places of its parameters.
    fn layout(&self) -> &Layout;
    /// Parameters to begin with.
    fn initial(&self, random: &mut fastrand::Rng) -> Vec<f32>;
    /// Number of samples of the training and of the validation split.
    fn counts(&self) -> [usize; 2];
    /// Score of these samples of the training split in `epoch`, and `weight` times its derivative added to `gradient`.
    fn learn(&self, parameters: &[f32], samples: &[usize], epoch: usize, weight: f32, gradient: &mut [f32]) -> Score;
    /// Score of these samples of the validation split.
    fn judge(&self, parameters: &[f32], samples: &[usize]) -> Score;
}

/// How to train.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Everything random follows from it.
    pub seed: u64,
    /// Passes over the training split.
    pub epochs: usize,
    /// Samples a step.
    pub batch: usize,
    /// Samples whose gradient one thread computes at once; part of the result's last bits.
    pub chunk: usize,
    /// Largest step of Adam.
    pub rate: f32,
    /// Weight decay per unit of step.
    pub decay: f32,
    /// Epochs without a better validation after which the run ends.
    pub patience: usize,
}

/// One epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Over the training split, while it was learned.
    pub train: Score,
    /// Over the validation split, after it.
    pub validation: Score,
    /// Seconds since the run began, those of earlier parts of it included.
    pub seconds: f64,
}

/// Where a run stands.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The parameters.
    pub parameters: Vec<f32>,
    /// Adam's memory.
    pub adam: Adam,
    /// The best parameters on the validation split.
    pub best: Vec<f32>,
    /// Epochs done.
    pub curve: Vec<Epoch>,
}

impl State {
    /// The epoch with the lowest validation loss.
    pub fn best_epoch(&self) -> Option<usize> {
        (0..self.curve.len())
            .min_by(|&a, &b| f64::total_cmp(&self.curve[a].validation.total, &self.curve[b].validation.total))
    }
}

/// Batches that are timed to find how many epochs fit into a time.
const TIMED_BATCHES: usize = 12;
/// What validation and checkpoints add to the batches, as a factor.
const OVERHEAD: f64 = 1.15;

/// Epochs that fit into `minutes`, by timing some batches.
pub fn epochs_within(learner: &dyn Learner, settings: &Settings, minutes: f64) -> usize {
    let [count, _] = learner.counts();
    let parameters = learner.initial(&mut fastrand::Rng::with_seed(settings.seed));
    let batch: Vec<usize> = (0..count.min(settings.batch)).collect();
    let mut gradient = vec![0.0; parameters.len()];
    let mut seconds = Vec::new();
    for _ in 0..TIMED_BATCHES {
        let start = Instant::now();
        step_gradient(learner, settings, &parameters, &batch, 0, &mut gradient);
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    let epoch = OVERHEAD * seconds[TIMED_BATCHES / 2] * count.div_ceil(settings.batch) as f64;
    ((60.0 * minutes / epoch) as usize).max(1)
}

/// Numbers of a gradient that one thread adds up at once.
const SUMMED: usize = 1 << 14;

fn step_gradient(
    learner: &dyn Learner,
    settings: &Settings,
    parameters: &[f32],
    batch: &[usize],
    epoch: usize,
    gradient: &mut [f32],
) -> Score {
    let weight = 1.0 / batch.len() as f32;
    let parts: Vec<(Score, Vec<f32>)> = batch
        .par_chunks(settings.chunk)
        .map(|chunk| {
            let mut part = vec![0.0; parameters.len()];
            (learner.learn(parameters, chunk, epoch, weight, &mut part), part)
        })
        .collect();
    // Each number is summed in the order of the parts, so the number of threads does not show.
    gradient.par_chunks_mut(SUMMED).enumerate().for_each(|(at, sum)| {
        sum.fill(0.0);
        for (_, part) in &parts {
            sum.iter_mut().zip(&part[at * SUMMED..]).for_each(|(sum, g)| *sum += g);
        }
    });
    let mut score = Score::default();
    parts.into_iter().for_each(|(part, _)| score += part);
    score
}

/// Samples judged at once.
const JUDGED: usize = 32;

fn validate(learner: &dyn Learner, parameters: &[f32]) -> Score {
    let [_, count] = learner.counts();
    let all: Vec<usize> = (0..count).collect();
    let parts: Vec<Score> = all.par_chunks(JUDGED).map(|chunk| learner.judge(parameters, chunk)).collect();
    let mut score = Score::default();
    parts.into_iter().for_each(|part| score += part);
    score.over(count)
}

/// Trains until the epochs are done or validation stops it; keeps a checkpoint in `folder` after every epoch and goes on from one found there.
///
/// # Errors
/// [`CheckpointError`].
pub fn train(learner: &dyn Learner, settings: &Settings, folder: &Path) -> Result<State, CheckpointError> {
    let [count, _] = learner.counts();
    let initial = || {
        let parameters = learner.initial(&mut fastrand::Rng::with_seed(settings.seed));
        let adam = Adam::new(parameters.len(), settings.decay);
        State { best: parameters.clone(), parameters, adam, curve: Vec::new() }
    };
    let mut state = checkpoint::read(folder, learner, settings)?.unwrap_or_else(initial);
    let style = ProgressStyle::with_template("{bar:30} epoch {pos}/{len} {elapsed}+{eta} {msg}");
    let bar =
        ProgressBar::new(settings.epochs as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_position(state.curve.len() as u64);
    bar.reset_eta();
    let before = state.curve.last().map_or(0.0, |epoch| epoch.seconds);
    let start = Instant::now();
    let batches = count.div_ceil(settings.batch);
    let mut gradient = vec![0.0; state.parameters.len()];
    while state.curve.len() < settings.epochs {
        let epoch = state.curve.len();
        let mut order: Vec<usize> = (0..count).collect();
        // A stream of its own for each epoch, so that a resumed run draws the same.
        fastrand::Rng::with_seed(settings.seed ^ (epoch as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
            .shuffle(&mut order);
        let mut train = Score::default();
        for (at, batch) in order.chunks(settings.batch).enumerate() {
            train += step_gradient(learner, settings, &state.parameters, batch, epoch, &mut gradient);
            let progress = (epoch as f32 + at as f32 / batches as f32) / settings.epochs as f32;
            state.adam.step(&mut state.parameters, &gradient, rate(settings.rate, progress));
        }
        let validation = validate(learner, &state.parameters);
        let seconds = before + start.elapsed().as_secs_f64();
        let train = train.over(count);
        state.curve.push(Epoch { train, validation, seconds });
        let best = state.best_epoch().unwrap_or(epoch);
        if best == epoch {
            state.best.clone_from(&state.parameters);
        }
        checkpoint::write(folder, learner, settings, &state)?;
        bar.set_position(state.curve.len() as u64);
        bar.set_message(format!(
            "nodes {:.2} µm, validation {:.2} µm, travel {:.2} µm, best at {}",
            train.node_um,
            validation.node_um,
            validation.travel_um,
            best + 1
        ));
        if !validation.total.is_finite() || epoch - best >= settings.patience {
            break;
        }
    }
    bar.abandon();
    Ok(state)
}
