//! Adam with decoupled weight decay, and the schedule of its step.
//!
//! `m ← β₁m + (1−β₁)g`, `v ← β₂v + (1−β₂)g²`, `θ ← θ − η (m̂/(√v̂ + ε) + λθ)` with the bias-corrected `m̂`, `v̂` (Kingma & Ba 2015; Loshchilov & Hutter
//! 2019). The gradient is scaled down to `LARGEST_NORM` first.

use rayon::prelude::*;

/// Decay of the first moment.
const BETA_1: f32 = 0.9;
/// Decay of the second moment.
const BETA_2: f32 = 0.999;
/// Keeps the division finite.
const EPSILON: f32 = 1e-8;
/// Largest length of a gradient, in units of its usual length: one odd batch does not undo the others.
const LARGEST_NORM: f32 = 5.0;
/// Weight of the newest gradient in the usual length.
const NORM_RATE: f32 = 0.02;

/// Parameters that one thread moves at once.
const MOVED: usize = 1 << 14;

/// Moments and step count.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam {
    /// First moment.
    pub m: Vec<f32>,
    /// Second moment.
    pub v: Vec<f32>,
    /// Steps done.
    pub steps: u32,
    /// Usual length of a gradient.
    pub usual_norm: f32,
    /// Weight decay per unit of step.
    pub decay: f32,
}

impl Adam {
    /// For `len` parameters.
    pub fn new(len: usize, decay: f32) -> Self {
        Adam { m: vec![0.0; len], v: vec![0.0; len], steps: 0, usual_norm: 0.0, decay }
    }

    /// One step of size `rate` against `gradient`.
    pub fn step(&mut self, parameters: &mut [f32], gradient: &[f32], rate: f32) {
        self.steps += 1;
        let norm = gradient.iter().map(|&g| f64::from(g) * f64::from(g)).sum::<f64>().sqrt() as f32;
        if self.steps == 1 {
            self.usual_norm = norm;
        }
        let largest = LARGEST_NORM * self.usual_norm;
        let scale = if norm > largest { largest / norm } else { 1.0 };
        self.usual_norm += NORM_RATE * (norm.min(largest) - self.usual_norm);
        let first = 1.0 - BETA_1.powf(self.steps as f32);
        let second = 1.0 - BETA_2.powf(self.steps as f32);
        let decay = self.decay;
        let moments = self.m.par_chunks_mut(MOVED).zip(self.v.par_chunks_mut(MOVED));
        parameters.par_chunks_mut(MOVED).zip(gradient.par_chunks(MOVED)).zip(moments).for_each(
            |((parameters, gradient), (m, v))| {
                for (((parameter, g), m), v) in parameters.iter_mut().zip(gradient).zip(m).zip(v) {
                    let g = g * scale;
                    *m += (1.0 - BETA_1) * (g - *m);
                    *v += (1.0 - BETA_2) * (g * g - *v);
                    *parameter -= rate * ((*m / first) / ((*v / second).sqrt() + EPSILON) + decay * *parameter);
                }
            },
        );
    }
}

/// The step's size: a linear rise over the first `WARM_UP` of the run, then half a cosine down to zero.
pub fn rate(largest: f32, progress: f32) -> f32 {
    if progress < WARM_UP {
        return largest * progress / WARM_UP;
    }
    let left = ((progress - WARM_UP) / (1.0 - WARM_UP)).min(1.0);
    largest * 0.5 * (1.0 + (std::f32::consts::PI * left).cos())
}

/// Share of the run in which the step rises.
const WARM_UP: f32 = 0.02;
