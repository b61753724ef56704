//! Where the fields of a single prediction stand in a stream.

use retina_core::sequence::{SequenceError, StepError};
use serde_json::json;

use super::sequence::own_filling;
use super::{Kind, Problem, from_predict, from_sequence};
use crate::understand::REHEARSAL;

/// The problem of a pose: what the core or a request calls `needle.tip_mm` is `pose.tip_mm`, and what the session was opened with is under
/// `open`.
pub fn of_pose(mut problem: Problem) -> Problem {
    for error in &mut problem.errors {
        let field = own_filling(&error.field).unwrap_or(&error.field);
        let number = field.strip_prefix("needle.").unwrap_or(field);
        let of_pose = ["tip_mm", "direction", "orientation_xyzw", "force_mn", "time_s", "bleb"]
            .iter()
            .any(|own| number.starts_with(own));
        error.field = if of_pose { format!("pose.{number}") } else { format!("open.{}", error.field) };
    }
    problem
}

/// The problem of a pose at `time_s` in a session with memory.
pub fn of_step(error: StepError, time_s: f64) -> Problem {
    match error {
        StepError::Time { step_s, min_s, max_s } => {
            let before_s = time_s - step_s;
            let allowed = format!("{min_s} to {max_s} s after {before_s} s, up to which the motion has come");
            let detail = format!("pose.time_s is {time_s} s, and must be {allowed}");
            Problem::field(Kind::OutOfRange, "pose.time_s", Some(json!(time_s)), allowed, detail)
        }
        StepError::Predict(cause) => of_pose(from_predict(cause)),
    }
}

/// The problem of what a session with memory is planned from: its steps stand elsewhere than those of a simulation.
pub fn of_rehearsal(error: SequenceError) -> Problem {
    let mut problem = from_sequence(error);
    let moved = |text: &str| text.strip_prefix("steps").map(|rest| format!("{REHEARSAL}{rest}"));
    for error in &mut problem.errors {
        error.field = moved(&error.field).unwrap_or(std::mem::take(&mut error.field));
    }
    problem.detail = moved(&problem.detail).unwrap_or(problem.detail);
    problem
}
