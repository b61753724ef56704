//! What linear elasticity expects of a needle whose shaft bends: where its tip ends up, so that the mesh and the first displacements stand there.
//!
//! The normal force N on the tip bends the shaft by u = −N P n / k, with n the inward normal, P the projection across the shaft and k its stiffness. Under force control N is given and the
//! guide goes further until the depth is the same; under pose control the tip evades, and with the bed's secant stiffness N/depth the force falls to N/(1 + N |P n|²/(k depth)).

use nalgebra::Vector3;

use super::choice::tool_flex::Bending;
use super::finite_element::ContactEstimate;
use super::linear::LinearAnswer;
use super::question::Question;

/// Where a bent needle is expected, against a rigid one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bent {
    /// Deflection of the tip (mm).
    pub deflection: Vector3<f64>,
    /// Further way of the guide (mm).
    pub further_mm: f64,
    /// Shift of the contact along the surface (mm).
    pub shift: Vector3<f64>,
}

impl Question<'_> {
    /// What is expected to bend the shaft.
    pub(crate) fn bending(&self, linear: Option<&LinearAnswer>) -> Bending {
        let axis = self.tool.patch_from_needle.rotation * -Vector3::z_axis();
        Bending {
            across_mn: linear
                .map_or(0.0, |linear| linear.normal_force_mn * linear.press.touch.inward.cross(&axis).norm()),
            cosine: axis.dot(&self.motion.direction),
            stiffness_mn_per_mm: self.request.needle.stiffness_mn_per_mm,
        }
    }

    /// Where the needle of `linear` is expected if its shaft bends; nowhere else if it does not.
    pub(crate) fn bent(&self, linear: &LinearAnswer, bends: bool) -> Bent {
        let Some(stiffness) = self.request.needle.stiffness_mn_per_mm.filter(|_| bends) else {
            return Bent::default();
        };
        let axis = (self.tool.patch_from_needle.rotation * -Vector3::z_axis()).into_inner();
        let inward = linear.press.touch.inward.into_inner();
        let across = inward - axis * axis.dot(&inward);
        let evading = match self.motion.force_mn {
            Some(_) => 1.0,
            None => 1.0 + linear.normal_force_mn * across.norm_squared() / (stiffness * linear.depth_mm),
        };
        let deflection = across * (-linear.normal_force_mn / evading / stiffness);
        let further_mm = match self.motion.force_mn {
            Some(_) => -deflection.dot(&inward) / linear.press.cosine,
            None => 0.0,
        };
        let way = self.motion.direction.into_inner() * further_mm + deflection;
        Bent { deflection, further_mm, shift: way - inward * inward.dot(&way) }
    }

    /// The contact that linear elasticity expects.
    pub(crate) fn estimate(&self, linear: &LinearAnswer, bends: bool) -> ContactEstimate {
        let bent = self.bent(linear, bends);
        ContactEstimate {
            center: [linear.center[0] + bent.shift.x, linear.center[1] + bent.shift.y],
            radius_mm: linear.contact_radius_mm,
            touch_mm: linear.press.touch.travel_mm,
            travel_mm: linear.travel_mm() + bent.further_mm,
            deflection: bent.deflection,
        }
    }
}
