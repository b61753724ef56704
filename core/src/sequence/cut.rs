//! A step that finds no equilibrium at once is gone in two halves of its time, and each of them again, up to [`MOST_CUTS`] times.
//!
//! The load of a step grows linearly from that of the step before ([`Step`]), so its half is known: the needle halfway between its places and orientations, the
//! force halfway between what the tissue bore along it and what is asked, half of what fluid comes or goes. What is remembered advances with every part, so the parts are the same motion computed
//! more finely. Nothing changes where a step is found at once, and without memory a step is an equilibrium of its own that no other can help.

use nalgebra::Vector3;

use super::{Simulation, Step};
use crate::equilibrium::error::EquilibriumError;
use crate::predict::{PredictError, Prediction};
use crate::progress::Progress;
use crate::solve::newton::NewtonError;

/// How often a part may be halved.
pub const MOST_CUTS: usize = 3;

impl Simulation {
    /// The answer to `step`, and whether a mesh was laid for it.
    pub(super) fn advance(
        &mut self,
        step: &Step,
        progress: &mut dyn Progress,
    ) -> Result<(Prediction, bool), PredictError> {
        let mut parts = 0;
        let (mut prediction, laid) = self.advance_in_parts(step, MOST_CUTS, &mut parts, progress)?;
        if parts > 1 {
            prediction
                .warnings
                .push(format!("the step was computed in {parts} parts of its time: it had no equilibrium at once"));
        }
        Ok((prediction, laid))
    }

    /// The same with at most so many more `cuts`; adds to the `parts` that were computed.
    fn advance_in_parts(
        &mut self,
        step: &Step,
        cuts: usize,
        parts: &mut usize,
        progress: &mut dyn Progress,
    ) -> Result<(Prediction, bool), PredictError> {
        let failure = match self.advance_at_once(step, progress) {
            Ok(found) => {
                *parts += 1;
                self.state.time_s = step.time_s;
                self.state.reaction_mn = found.0.needle.reaction_mn;
                return Ok(found);
            }
            Err(failure) => failure,
        };
        let Some(half) = self.half(step).filter(|_| cuts > 0 && self.remembers() && is_unsettled(&failure)) else {
            return Err(failure);
        };
        let (first, laid) = self.advance_in_parts(&half, cuts - 1, parts, progress)?;
        let (mut prediction, laid_again) = self.advance_in_parts(step, cuts - 1, parts, progress)?;
        prediction.solver.iterations += first.solver.iterations;
        if step.tip_mm.is_none() {
            prediction.needle.travel_mm += first.needle.travel_mm;
        }
        Ok((prediction, laid || laid_again))
    }

    /// Half of the way to `step`; `None` for a needle that is withdrawn.
    fn half(&self, step: &Step) -> Option<Step> {
        let force_mn = match step.force_mn {
            Some(force) if force == Vector3::zeros() => return None,
            Some(force) => {
                let borne_mn = (-self.state.reaction_mn.dot(&force.normalize())).max(0.0);
                Some(force.normalize() * (0.5 * (borne_mn + force.norm())))
            }
            None => None,
        };
        let middle = |tip| nalgebra::center(&self.state.needle.tip_mm, &tip);
        Some(Step {
            time_s: 0.5 * (self.state.time_s + step.time_s),
            tip_mm: step.tip_mm.map(middle),
            orientation: step.orientation.map(|end| self.state.needle.orientation.nlerp(&end, 0.5)),
            force_mn,
            fluid: step.fluid.map(|end| self.state.filling.map_or(end, |start| start.halfway(end))),
        })
    }
}

/// Whether the equilibrium was not found, and might be by smaller parts.
fn is_unsettled(failure: &PredictError) -> bool {
    match failure {
        PredictError::Solver { cause, .. } | PredictError::Bleb { cause, .. } => match cause {
            EquilibriumError::Newton(cause) => {
                matches!(cause, NewtonError::NotConverged { .. } | NewtonError::NoStep { .. })
            }
            EquilibriumError::NotSettled { .. } | EquilibriumError::Torn { .. } => true,
        },
        _ => false,
    }
}
