//! How far a level's answer is likely to be from the converged one, before it is computed.
//!
//! The error is that of the worst of the patch's nodes (µm). It is read from quantiles measured once (`calibration.rs`, written by
//! `retina-models calibrate` from a data set) in bins of what the linear answer knows: the kind of tip and the mean strain. In a bin the error scales with the
//! depth, so the quantiles are of error over depth. What they were measured against is no finer than level `reference`, whose own error is what refinement still changes
//! (`refinement.rs`, written by `retina-models reference-error`); the two have different causes and are added as independent ones, by their squares. The 95 % bound of n samples is their ⌈0.95 (n + 1)⌉-th smallest, which a new sample of the same
//! kind stays below with at least that probability, whatever the distribution (split conformal prediction: Vovk et al.,
//! *Algorithmic Learning in a Random World*, 2005). Outside of what was sampled the numbers are still given, and called uncalibrated.

use super::calibration::{COARSE, LINEAR};
use super::refinement::REFERENCE;
use super::sampled;
use super::types::Level;
use crate::needle::{NeedleShape, Tip};
use crate::scene::Scene;

/// Upper ends of the bins of mean strain; the last bin has none.
pub const STRAIN_BINS: [f64; 5] = [0.05, 0.1, 0.2, 0.3, 0.45];
/// Number of bins.
pub const BINS: usize = STRAIN_BINS.len() + 1;
/// Kinds of tip, see [`Tip::kind`].
pub const TIPS: usize = Tip::KINDS;

/// The unit of what refinement changes at level `reference`: this much (µm) or [`REFERENCE_SHARE`] of the depth, whichever is more.
pub const REFERENCE_ERROR_UM: f64 = 0.5;
/// See [`REFERENCE_ERROR_UM`]; both are what the `refinement` program holds every scene and gauge against.
pub const REFERENCE_SHARE: f64 = 0.01;

/// Quantiles of an error in one bin, in what the table that they stand in counts by: the linear depth, or what refining a mesh may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantiles {
    /// Half of the samples are below.
    pub median: f64,
    /// Nineteen of twenty are below; infinite where there are too few samples to say.
    pub p95: f64,
    /// Number of samples.
    pub samples: usize,
}

/// What is known of a request before a level computes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Kind of the tip, see [`Tip::kind`].
    pub tip: usize,
    /// Depth of the linear answer (µm).
    pub depth_um: f64,
    /// That depth over the thickness of what yields.
    pub strain: f64,
    /// Whether needles, poses and tissues like this one were sampled.
    pub sampled: bool,
    /// Expected deflection of the tip, where the bending of the shaft is called for (µm).
    pub deflection_um: f64,
    /// Whether fluid under the retina is called for, over which no error was measured.
    pub lifted: bool,
    /// What level `network` expects of its own answer; `None` where it has none.
    pub network: Option<ExpectedError>,
    /// The same of level `corrected`.
    pub corrected: Option<ExpectedError>,
}

/// The expected error of the worst node of the patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedError {
    /// Median (µm).
    pub median_um: f64,
    /// 95 % bound (µm).
    pub p95_um: f64,
    /// Whether the numbers were measured on requests like this one.
    pub calibrated: bool,
}

impl ExpectedError {
    /// Nothing was measured that could say.
    pub const UNKNOWN: Self = ExpectedError { median_um: f64::INFINITY, p95_um: f64::INFINITY, calibrated: false };
}

/// Measured quantiles of `level`, where it has a table, under a kind of tip at a mean strain: of the error over the depth, and at level `reference` over
/// [`refinement_unit_um`].
pub fn quantiles(level: Level, tip: usize, strain: f64) -> Option<&'static Quantiles> {
    match level {
        Level::Linear => Some(&LINEAR[tip][bin(strain)]),
        Level::Coarse => Some(&COARSE[tip][bin(strain)]),
        Level::Reference => Some(&REFERENCE[tip]),
        Level::Network | Level::Corrected => None,
    }
}

/// The bin of a mean strain.
pub fn bin(strain: f64) -> usize {
    STRAIN_BINS.iter().filter(|&&end| strain >= end).count()
}

/// The unit (µm) in which what refinement changes at level `reference` is counted, at a depth of the linear answer (µm).
pub fn refinement_unit_um(depth_um: f64) -> f64 {
    REFERENCE_ERROR_UM.max(REFERENCE_SHARE * depth_um)
}

impl Situation {
    /// The situation of `shape` in `scene`, `angle_deg` off the normal, at the linear answer's depth and strain.
    pub fn new(scene: &Scene, shape: &NeedleShape, angle_deg: f64, depth_mm: f64, strain: f64) -> Self {
        let sampled = sampled::has_scene(scene) && sampled::has_needle(shape) && angle_deg <= sampled::ANGLE_DEG;
        Situation {
            tip: shape.tip.kind(),
            depth_um: depth_mm * 1e3,
            strain,
            sampled,
            deflection_um: 0.0,
            lifted: false,
            network: None,
            corrected: None,
        }
    }

    /// The expected error of `level` here.
    pub fn expected_error(&self, level: Level) -> ExpectedError {
        if self.lifted {
            return ExpectedError::UNKNOWN;
        }
        if self.depth_um == 0.0 {
            // Nothing moves, exactly.
            return ExpectedError { median_um: 0.0, p95_um: 0.0, calibrated: true };
        }
        let unit_um = if level == Level::Reference { refinement_unit_um(self.depth_um) } else { self.depth_um };
        let Some(quantiles) = quantiles(level, self.tip, self.strain) else {
            let own = if level == Level::Network { self.network } else { self.corrected };
            return own.unwrap_or(ExpectedError::UNKNOWN);
        };
        let (median_um, p95_um) = (quantiles.median * unit_um, quantiles.p95 * unit_um);
        let calibrated = self.sampled && quantiles.p95.is_finite();
        match level {
            Level::Linear => self.with_rigid_needle(median_um, p95_um, calibrated),
            Level::Reference => ExpectedError { median_um, p95_um, calibrated },
            _ => self.with_reference_error(median_um, p95_um, calibrated),
        }
    }

    /// As [`Self::with_reference_error`], of a level that holds the needle rigid: the surface follows a tip that evades, at most as far.
    pub fn with_rigid_needle(&self, median_um: f64, p95_um: f64, calibrated: bool) -> ExpectedError {
        let left_out_um = self.deflection_um;
        self.with_reference_error(median_um + left_out_um, p95_um + left_out_um, calibrated && left_out_um == 0.0)
    }

    /// An error against an answer as fine as that of level `reference` as one against the converged answer.
    pub fn with_reference_error(&self, median_um: f64, p95_um: f64, calibrated: bool) -> ExpectedError {
        let own = self.expected_error(Level::Reference);
        ExpectedError { median_um: median_um.hypot(own.median_um), p95_um: p95_um.hypot(own.p95_um), calibrated }
    }

    /// Whether `level` has an answer here, as far as that is known.
    pub fn has(&self, level: Level) -> bool {
        match level {
            Level::Network => self.depth_um == 0.0 || self.network.is_some(),
            Level::Corrected => self.depth_um == 0.0 || self.corrected.is_some(),
            Level::Linear | Level::Coarse | Level::Reference => true,
        }
    }
}
