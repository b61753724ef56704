//! What decides about the effects of a motion: the worst of all its steps so far, by linear elasticity.
//!
//! A plan meets every step before it decides. Steps that come one by one are met as they come, and where they call for an effect that the plan left out their answers say
//! so.

use nalgebra::UnitQuaternion;

use super::Simulation;
use crate::predict::choice::Expected;
use crate::predict::linear::LinearAnswer;
use crate::predict::{EffectChoice, PredictError, Question, Sink};

/// What was worst so far of what decides about the effects.
#[derive(Clone, Copy, Debug)]
pub(super) struct Worst {
    /// The deepest contact with the largest slide, pull and bending of any.
    pub expected: Expected,
    /// The depth of that contact (mm).
    depth_mm: f64,
    /// How far the pressed needle has moved along the surface (mm).
    along_mm: f64,
    /// Contact centre (patch parameters) and orientation of the step before, if it pressed.
    before: Option<([f64; 2], UnitQuaternion<f64>)>,
}

impl Worst {
    /// Of a motion that has pressed nothing.
    pub fn unpressed(expected: Expected) -> Self {
        Worst { expected, depth_mm: 0.0, along_mm: 0.0, before: None }
    }

    /// Takes a step into account.
    pub fn meet(&mut self, question: &Question, linear: Option<&LinearAnswer>, sink: &Sink) {
        let bending = question.bending(linear);
        let worst = &mut self.expected;
        if bending.across_mn > worst.bending.across_mn {
            worst.bending = bending;
        }
        let orientation = question.request.needle.orientation;
        let Some(linear) = linear else {
            self.before = None;
            return;
        };
        if let Some((center, before)) = self.before {
            let [x, y] = [0, 1].map(|k| linear.center[k] - center[k]);
            // A needle that turns drags along what lies at the edge of its contact.
            self.along_mm += x.hypot(y) + before.angle_to(&orientation) * linear.contact_radius_mm;
        }
        self.before = Some((linear.center, orientation));
        let mut expected = question.expected(linear, sink);
        expected.sliding.along_mm = self.along_mm;
        let share = (self.along_mm / linear.depth_mm).min(expected.sliding.coefficient);
        let share = share.max(expected.pull.tangential_share).max(worst.pull.tangential_share);
        if linear.depth_mm > self.depth_mm {
            self.depth_mm = linear.depth_mm;
            let sliding = worst.sliding;
            *worst = Expected { sliding, bending: worst.bending, ..expected };
        }
        worst.pull.tangential_share = share;
        if expected.sliding.dragged_um() > worst.sliding.dragged_um() {
            worst.sliding = expected.sliding;
        }
    }
}

impl Simulation {
    /// The motion so far with one more step, and what the caller should know of effects that it calls for and the plan did not.
    pub(super) fn met(
        &self,
        question: &Question,
        linear: Option<&LinearAnswer>,
        sink: &Sink,
    ) -> Result<(Worst, Vec<String>), PredictError> {
        let mut met = self.state.met;
        met.meet(question, linear, sink);
        if self.sequence.effects != EffectChoice::Auto {
            return Ok((met, Vec::new()));
        }
        let called_for = question.decide(met.expected, sink)?;
        let planned = |name: &str| self.effects().iter().any(|report| report.name == name && report.simulated);
        let missed = called_for.reports.iter().filter(|report| report.simulated);
        let told = missed.filter(|report| !planned(report.name)).map(|report| {
            format!(
                "the motion so far calls for `{}`, which the plan did not foresee: it is not simulated",
                report.name
            )
        });
        Ok((met, told.collect()))
    }
}
