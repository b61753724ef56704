//! When the bond between retina and choroid matters: when something near its strength pulls at it.
//!
//! Under a push nothing tears the retina off its bed as strongly as it shears it: by Boussinesq the normal force N through a depth h shears the plane at h with at most
//! 0.137 N/h² (τ = 3 N r h² / (2 π (r² + h²)^(5/2)) at r = h/2), and presses it together everywhere. A layered bed and a contact of some width change that by less than the factor of two
//! between the threshold and the strength. Below the strength the bond is intact, and an intact bond moves nothing.

use super::super::types::{EffectChoice, EffectReport, Level};
use super::criterion::Criterion;
use crate::effects::adhesion;

/// Largest shear of a plane under a point force, over force per squared depth.
const BOUSSINESQ_SHEAR: f64 = 0.1366;
/// Share of the strength from which on the bond is simulated.
const NEAR_STRENGTH: f64 = 0.5;

/// What pulls at the bond, and what it bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Normal force of the needle (mN).
    pub normal_force_mn: f64,
    /// Depth of the bond under the contact (mm).
    pub depth_mm: f64,
    /// Strength of the bond (kPa).
    pub strength_kpa: f64,
}

impl Pull {
    /// Expected traction on the bond (kPa).
    pub fn traction_kpa(&self) -> f64 {
        BOUSSINESQ_SHEAR * self.normal_force_mn / (self.depth_mm * self.depth_mm)
    }
}

/// The decision about adhesion.
pub fn report(choice: &EffectChoice, level: Level, contact: bool, pull: &Pull) -> EffectReport {
    let ruled_out = if !contact {
        Some("contact is not simulated")
    } else if level == Level::Linear {
        Some("level `linear` holds its layers together by construction")
    } else {
        None
    };
    Criterion {
        name: adhesion::NAME,
        value: pull.traction_kpa(),
        threshold: NEAR_STRENGTH * pull.strength_kpa,
        quantity: "the traction on the bond of the retina, against half its strength, [kPa]",
        ruled_out,
    }
    .settle(choice)
}
