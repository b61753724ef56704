//! Whether the tissue stays whole: always checked, first on what linear elasticity expects, then on what the level found.

use super::super::types::EffectReport;
use crate::effects::puncture::{Burden, Limits, NAME};

/// The report: the measure nearest to its limit, and both in words.
pub fn report(limits: &Limits, burden: &Burden) -> EffectReport {
    let nearest = limits.nearest(burden);
    let unit = if nearest.unit == "1" { String::new() } else { format!(", [{}]", nearest.unit) };
    EffectReport {
        name: NAME,
        simulated: true,
        reason: format!(
            "always checked: {:.4} of {:.4} mN under the needle, a strain of {:.4} of {:.4}; nearest to its limit is the {}{unit}",
            burden.force_mn, limits.force_mn, burden.strain, limits.strain, nearest.measure
        ),
        value: Some(nearest.value),
        threshold: Some(nearest.limit),
    }
}
