//! How far a level's answer is likely to be from `reference`, before it is computed.
//!
//! The error is that of the worst of the patch's nodes (µm). It is read from quantiles measured once (`calibration.rs`, written by the
//! `calibrate` program) in bins of what the linear answer knows: the kind of tip and the mean strain. In a bin the error scales with the
//! depth, so the quantiles are of error over depth. The 95 % bound of n samples is their ⌈0.95 (n + 1)⌉-th smallest, which a new sample of the same
//! kind stays below with at least that probability, whatever the distribution (split conformal prediction: Vovk et al.,
//! *Algorithmic Learning in a Random World*, 2005). Outside of what was sampled the numbers are still given, and called uncalibrated.

use super::calibration::{COARSE, LINEAR};
use super::types::Level;
use crate::needle::{Gauge, NeedleShape, Tip};
use crate::scene::{Scene, SceneSurface};

/// Upper ends of the bins of mean strain; the last bin has none.
pub const STRAIN_BINS: [f64; 1] = [0.1];
/// Number of bins.
pub const BINS: usize = STRAIN_BINS.len() + 1;
/// Gauges between which needles were sampled, thin to thick.
pub const CALIBRATED_GAUGES: [&str; 2] = ["41G", "23G"];
/// Largest angle of the needle to the inward normal that was sampled (degrees): 60 to the patch's z axis and the eye's curvature.
pub const CALIBRATED_ANGLE_DEG: f64 = 65.0;

/// What refinement may still change at level `reference`: this much (µm) or [`REFERENCE_SHARE`] of the depth, whichever is more.
pub const REFERENCE_ERROR_UM: f64 = 0.5;
/// See [`REFERENCE_ERROR_UM`]; both are what the `refinement` program holds every scene and gauge against.
pub const REFERENCE_SHARE: f64 = 0.01;
/// Median of what refinement changed over that bound (nine scenes and gauges, `refinement`): 0.10 to 0.39.
const REFERENCE_MEDIAN_SHARE: f64 = 0.22;

/// Quantiles of the worst node's error over the linear depth, in one bin.
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
    /// Whether the tip has an edge.
    pub edged: bool,
    /// Depth of the linear answer (µm).
    pub depth_um: f64,
    /// That depth over the thickness of what yields.
    pub strain: f64,
    /// Whether needles, poses and tissues like this one were sampled.
    pub sampled: bool,
    /// Expected deflection of the tip, where the bending of the shaft is called for (µm).
    pub deflection_um: f64,
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

/// The bin of a mean strain.
pub fn bin(strain: f64) -> usize {
    STRAIN_BINS.iter().filter(|&&end| strain >= end).count()
}

impl Situation {
    /// The situation of `shape` in `scene`, `angle_deg` off the normal, at the linear answer's depth and strain.
    pub fn new(scene: &Scene, shape: &NeedleShape, angle_deg: f64, depth_mm: f64, strain: f64) -> Self {
        let radius_mm = |name| Gauge::from_name(name).map_or(f64::NAN, |gauge| gauge.radius_mm());
        let [thin_mm, thick_mm] = CALIBRATED_GAUGES.map(radius_mm);
        let default_tip = match shape.tip {
            Tip::Hemispherical => true,
            Tip::Flat { .. } => *shape == NeedleShape::flat(shape.radius_mm),
            Tip::Bevelled { .. } => *shape == NeedleShape::bevelled(shape.radius_mm),
        };
        let built_in = Scene::built_in_names().iter().filter_map(|name| Scene::built_in(name));
        let sampled = !matches!(scene.surface, SceneSurface::Mesh(_))
            && built_in.into_iter().any(|known| known.tissue == scene.tissue && known.surface == scene.surface)
            && scene.friction_coefficient == 0.0
            && scene.pressure_change_kpa() == 0.0
            && (thin_mm..=thick_mm).contains(&shape.radius_mm)
            && default_tip
            && angle_deg <= CALIBRATED_ANGLE_DEG;
        Situation {
            edged: shape.tip != Tip::Hemispherical,
            depth_um: depth_mm * 1e3,
            strain,
            sampled,
            deflection_um: 0.0,
            network: None,
            corrected: None,
        }
    }

    /// The expected error of `level` here.
    pub fn expected_error(&self, level: Level) -> ExpectedError {
        if self.depth_um == 0.0 {
            // Nothing moves, exactly.
            return ExpectedError { median_um: 0.0, p95_um: 0.0, calibrated: true };
        }
        let table = match level {
            Level::Linear => &LINEAR,
            Level::Coarse => &COARSE,
            Level::Network => return self.network.unwrap_or(ExpectedError::UNKNOWN),
            Level::Corrected => return self.corrected.unwrap_or(ExpectedError::UNKNOWN),
            Level::Reference => {
                let bound = REFERENCE_ERROR_UM.max(REFERENCE_SHARE * self.depth_um);
                return ExpectedError {
                    median_um: REFERENCE_MEDIAN_SHARE * bound,
                    p95_um: bound,
                    calibrated: self.sampled,
                };
            }
        };
        let quantiles = &table[usize::from(self.edged)][bin(self.strain)];
        let (median_um, p95_um) = (quantiles.median * self.depth_um, quantiles.p95 * self.depth_um);
        let calibrated = self.sampled && quantiles.p95.is_finite();
        match level {
            Level::Linear => self.with_rigid_needle(median_um, p95_um, calibrated),
            _ => self.with_reference_error(median_um, p95_um, calibrated),
        }
    }

    /// As [`Self::with_reference_error`], of a level that holds the needle rigid: the surface follows a tip that evades, at most as far.
    pub fn with_rigid_needle(&self, median_um: f64, p95_um: f64, calibrated: bool) -> ExpectedError {
        let left_out_um = self.deflection_um;
        self.with_reference_error(median_um + left_out_um, p95_um + left_out_um, calibrated && left_out_um == 0.0)
    }

    /// An error against level `reference` as one against the truth: what was compared with has an error itself.
    pub fn with_reference_error(&self, median_um: f64, p95_um: f64, calibrated: bool) -> ExpectedError {
        let own = self.expected_error(Level::Reference);
        ExpectedError { median_um: median_um.hypot(own.median_um), p95_um: p95_um + own.p95_um, calibrated }
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
