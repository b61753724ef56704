//! Fluid under the retina during a motion: how much of it there may be, and where the needle may press.
//!
//! The disc is the scene's, and stays as wide as it is; what a step tells is what is on it at the step's time. A disc without fluid is detached all the same: its retina lies on what is below.
//! Not here: the equilibrium over fluid (`equilibrium::bleb`), a single prediction (`predict::over_fluid`).

use super::Step;
use super::plan::Plan;
use crate::needle::Body;
use crate::predict::finite_element::{ContactEstimate, Resolution};
use crate::predict::over_fluid::check_over;
use crate::predict::{PredictError, PreparedScene};
use crate::scene::bleb::Filling;

impl Plan {
    /// Refuses contacts that are not over the fluid, where there is any, and a mesh that lasts but does not fit into the detached disc.
    ///
    /// # Errors
    /// The first step at fault, or the one that reaches farthest, and why.
    pub(super) fn check_over_fluid(
        &self,
        body: &Body,
        resolution: &Resolution,
        lasts: bool,
    ) -> Result<(), (usize, PredictError)> {
        let Some(bleb) = &self.bleb else { return Ok(()) };
        for (index, contact) in &self.contacts {
            check_over(bleb, body, resolution, contact).map_err(|cause| (*index, cause))?;
        }
        let reach_mm = |contact: &ContactEstimate| {
            (contact.center[0] - bleb.center[0]).hypot(contact.center[1] - bleb.center[1]) + contact.radius_mm
        };
        let farthest = self.contacts.iter().max_by(|(_, a), (_, b)| reach_mm(a).total_cmp(&reach_mm(b)));
        match (&self.around, farthest) {
            (Some((mesh, _)), Some((index, _))) if lasts => {
                check_over(bleb, body, resolution, mesh).map_err(|cause| (*index, cause))
            }
            _ => Ok(()),
        }
    }
}

/// Checks what a step wants of the fluid under the retina.
///
/// # Errors
/// [`PredictError::OutOfRange`], and [`PredictError::NoBleb`] where the scene has no detached disc.
pub(super) fn check_filling(prepared: &PreparedScene, filling: Option<Filling>) -> Result<(), PredictError> {
    let Some(filling) = filling else { return Ok(()) };
    filling.validate()?;
    prepared.scene().bleb.map(|_| ()).ok_or(PredictError::NoBleb)
}

/// The filling of the fullest step, or the scene's; `None` where there is no detached disc.
pub(super) fn fullest(prepared: &PreparedScene, steps: &[Step]) -> Option<Filling> {
    let own = prepared.scene().bleb?.filling;
    let all = steps.iter().filter_map(|step| step.fluid).chain([own]);
    all.max_by(|a, b| prepared.volume_mm3(*a).total_cmp(&prepared.volume_mm3(*b)))
}
