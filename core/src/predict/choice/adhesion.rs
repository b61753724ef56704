//! When the bond between retina and choroid matters: when something near its strength pulls at it.
//!
//! Under a push nothing tears the retina off its bed as strongly as it shears it: by Boussinesq the normal force N through a depth h shears the plane at h with at most
//! 0.137 N/h² (τ = 3 N r h² / (2 π (r² + h²)^(5/2)) at r = h/2), and presses it together everywhere. A layered bed and a contact of some width change that by less than the factor of two
//! between the threshold and the strength. Below the strength the bond is intact, and an intact bond moves nothing.
//!
//! Friction adds the shear of a force T along the surface, at most 0.089 T/h² at that depth (Cerruti: τ = 3 T x² h / (2 π (x² + h²)^(5/2)) at x² = ⅔ h²), T being no more than µ N and
//! no more than the motion's part along the surface asks for.
//!
//! A fall of the eye's pressure pulls at all of the retina alike, with the fall itself: a wide wall carries it through every layer (`equilibrium::settled`). The bond feels the
//! length of the traction, so the two add as the sides of a right angle. A fall of more than the strength leaves no equilibrium: there is nowhere for the retina to hold on.

use super::super::types::{EffectChoice, EffectReport, Level};
use super::criterion::Criterion;
use crate::effects::adhesion;

/// Largest shear of a plane under a point force, over force per squared depth.
const BOUSSINESQ_SHEAR: f64 = 0.1366;
/// The same under a force along the surface.
const CERRUTI_SHEAR: f64 = 0.0888;
/// Share of the strength from which on the bond is simulated.
const NEAR_STRENGTH: f64 = 0.5;

/// What pulls at the bond, and what it bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Normal force of the needle (mN).
    pub normal_force_mn: f64,
    /// Force along the surface over the normal one, at most.
    pub tangential_share: f64,
    /// Depth of the bond under the contact (mm).
    pub depth_mm: f64,
    /// Fall of the eye's pressure (kPa), where it is simulated; 0 for a rise.
    pub suction_kpa: f64,
    /// Strength of the bond (kPa).
    pub strength_kpa: f64,
}

impl Pull {
    /// Expected traction on the bond (kPa).
    pub fn traction_kpa(&self) -> f64 {
        let shear = BOUSSINESQ_SHEAR + CERRUTI_SHEAR * self.tangential_share;
        let shear_kpa = shear * self.normal_force_mn / (self.depth_mm * self.depth_mm);
        shear_kpa.hypot(self.suction_kpa)
    }

    /// Whether the fall of the pressure alone tears the whole retina off.
    pub fn tears_all_off(&self) -> bool {
        self.suction_kpa >= self.strength_kpa
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
