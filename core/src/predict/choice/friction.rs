//! When friction matters.
//!
//! Without friction the needle slides along the surface by its travel's part along it, depth × tan(angle between motion and normal). Friction
//! drags the surface along, at most that far, and with no more than µ times the normal force; a layer yields about as easily along its surface as across it, so by no more
//! than µ × depth. The smaller of the two moves the surface sideways; and because friction then carries part of a leaning force, it changes the depth too, by that times the tangent.
//!
//! In a sequence the pressed needle also moves along the surface from step to step, and drags it as far, with no more than µ × depth again.

use super::super::types::{EffectChoice, EffectReport, Level};
use super::criterion::Criterion;
use crate::effects::friction;

/// What a straight push spreads the tissue under the needle, over its depth, and full friction prevents: computed at level `coarse` for a 25G ball on the
/// default tissue, where µ = 2 moves a node by 0.023 of the depth.
const SPREAD: f64 = 0.025;

/// What the linear answer says about sliding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sliding {
    /// Coulomb's coefficient.
    pub coefficient: f64,
    /// Depth of the needle (mm).
    pub depth_mm: f64,
    /// Tangent of the angle between the motion and the inward normal.
    pub tangent: f64,
    /// How far the pressed needle has moved along the surface in the steps of a sequence (mm); 0 in a single prediction.
    pub along_mm: f64,
}

impl Sliding {
    /// How far friction may drag the surface along (µm).
    pub fn dragged_um(&self) -> f64 {
        let leaning = self.coefficient.min(self.tangent) * (1.0 + self.tangent);
        let spreading = SPREAD * self.coefficient.min(1.0);
        let along_mm = self.along_mm.min(self.coefficient * self.depth_mm);
        ((leaning + spreading) * self.depth_mm + along_mm) * 1e3
    }
}

/// The decision about friction.
pub fn report(choice: &EffectChoice, level: Level, contact: bool, sliding: &Sliding) -> EffectReport {
    let ruled_out = if sliding.coefficient == 0.0 {
        Some("the scene's coefficient of friction is zero")
    } else if !contact {
        Some("contact is not simulated")
    } else if level == Level::Linear {
        Some("level `linear` is frictionless by construction")
    } else {
        None
    };
    Criterion {
        name: friction::NAME,
        value: sliding.dragged_um(),
        threshold: choice.tolerance_um(),
        quantity: "what friction may drag the surface along [µm]",
        ruled_out,
    }
    .settle(choice)
}
