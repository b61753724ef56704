//! When the bending of the shaft matters: when it moves the tip by more than may be neglected.
//!
//! Frictionless contact presses along the surface's normal, so of the normal force N that linear elasticity expects, N sin(angle between shaft and normal) acts across the shaft and
//! bends it by that over its stiffness. The tip takes the surface along at most as far.

use super::super::types::{EffectChoice, EffectReport, Level};
use super::criterion::Criterion;
use crate::effects::tool_flex::{LEAST_COSINE, NAME};

/// What bends the shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bending {
    /// Expected force across the shaft (mN).
    pub across_mn: f64,
    /// Cosine between the way the needle points and its motion.
    pub cosine: f64,
    /// Force for a deflection of the tip (mN/mm); `None`: the shaft is rigid.
    pub stiffness_mn_per_mm: Option<f64>,
}

impl Bending {
    /// Expected deflection of the tip (µm).
    pub fn deflection_um(&self) -> f64 {
        self.stiffness_mn_per_mm.map_or(0.0, |stiffness| self.across_mn / stiffness * 1e3)
    }
}

/// The decision about the shaft.
pub fn report(choice: &EffectChoice, level: Level, contact: bool, bending: &Bending) -> EffectReport {
    let ruled_out = if bending.stiffness_mn_per_mm.is_none() {
        Some("the needle's shaft is rigid")
    } else if !contact {
        Some("contact is not simulated")
    } else if level == Level::Linear {
        Some("level `linear` has a rigid needle by construction")
    } else if level.is_learned() {
        Some("the level learned with rigid needles")
    } else if bending.cosine < LEAST_COSINE {
        Some(
            "the needle moves across its shaft by more than 60 degrees, which the model of a pushed shaft does not hold for",
        )
    } else {
        None
    };
    Criterion {
        name: NAME,
        value: bending.deflection_um(),
        threshold: choice.tolerance_um(),
        quantity: "the deflection of the tip under the expected force across the shaft [µm]",
        ruled_out,
    }
    .settle(choice)
}
