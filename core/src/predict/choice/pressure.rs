//! When the eye's pressure matters: it does when it moves the surface, which it does by itself, needle or not.

use super::super::types::{EffectChoice, EffectReport};
use super::criterion::Criterion;
use crate::effects::pressure;

/// The decision about pressure, from the change of pressure (kPa) and the sinking of the patch's node that sinks most (µm): by linear or by
/// neo-Hookean elasticity, whichever is more.
pub fn report(choice: &EffectChoice, change_kpa: f64, sink_um: f64) -> EffectReport {
    let ruled_out = (change_kpa == 0.0).then_some("the eye's pressure is that at which the surface was measured");
    Criterion {
        name: pressure::NAME,
        value: sink_um.abs(),
        threshold: choice.tolerance_um(),
        quantity: "the sinking of the surface under the change of pressure [µm]",
        ruled_out,
    }
    .settle(choice)
}
