//! The guide that holds the needle, rigidly or through a shaft that bends: how the tip is freed, and where it ends up.

use nalgebra::Vector3;

use super::{Motion, Wall};
use crate::effects::tool_flex::ToolFlex;
use crate::solve::newton::Drive;

impl Wall<'_> {
    /// The bending of the shaft, if it bends.
    pub(super) fn flex(&self, motion: &Motion) -> Option<ToolFlex> {
        let pose = &self.tool.patch_from_needle;
        self.tool.stiffness_mn_per_mm.map(|stiffness_mn_per_mm| ToolFlex {
            origin: pose.translation.vector,
            axis: pose.rotation * -Vector3::z_axis(),
            direction: motion.direction,
            stiffness_mn_per_mm,
        })
    }

    /// How the tip moves under `share` of the force.
    pub(super) fn drive(&self, motion: &Motion, share: f64) -> Drive {
        let direction = motion.direction.into_inner();
        let advance = motion.force_mn.map(|force_mn| (direction, share * force_mn));
        match (self.flex(motion), advance) {
            (Some(flex), advance) => Drive::Guided { advance, aside: flex.sides() },
            (None, Some((direction, force_mn))) => Drive::Force { direction, force_mn },
            (None, None) => Drive::Held,
        }
    }

    /// Moves the guide of a held needle to `travel_mm`, the tip as far aside of it as it is.
    pub(super) fn hold_at(&self, positions: &mut [f64], motion: &Motion, travel_mm: f64) {
        let aside = self.ended(positions, motion).1.unwrap_or_default();
        self.place_tip(positions, &(motion.direction.into_inner() * travel_mm + aside));
    }

    /// Travel of the guide (mm), and the tip's deflection (mm) if the shaft bends.
    pub(super) fn ended(&self, positions: &[f64], motion: &Motion) -> (f64, Option<Vector3<f64>>) {
        let tip = Vector3::from_row_slice(&positions[3 * self.topology.needle()..]);
        match self.flex(motion) {
            Some(flex) => {
                let travel_mm = if motion.force_mn.is_some() { flex.travel_mm(&tip) } else { motion.travel_mm };
                (travel_mm, Some(flex.deflection(&tip)))
            }
            None => ((tip - self.tool.patch_from_needle.translation.vector).dot(&motion.direction), None),
        }
    }
}
