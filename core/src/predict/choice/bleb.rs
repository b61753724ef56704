//! When the fluid under the retina matters: when it lifts the surface, which it does by itself, needle or not.

use super::super::types::{EffectChoice, EffectReport, Level};
use super::criterion::Criterion;
use crate::effects::bleb;

/// The decision about the bleb, from the rise of the surface that a plate over all of the fluid has (µm); `None`: there is no fluid.
pub fn report(choice: &EffectChoice, level: Level, rise_um: Option<f64>) -> EffectReport {
    let ruled_out = if rise_um.is_none() {
        Some("the scene has no fluid under the retina")
    } else if level == Level::Linear {
        Some("level `linear` has no cavity under the retina")
    } else {
        None
    };
    Criterion {
        name: bleb::NAME,
        value: rise_um.unwrap_or(0.0),
        threshold: choice.tolerance_um(),
        quantity: "the expected rise of the surface over the fluid [µm]",
        ruled_out,
    }
    .settle(choice)
}
