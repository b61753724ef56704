//! The core's errors of sequences, told to the caller in the words of the wire.

use retina_core::sequence::SequenceError;
use serde_json::json;

use super::{Kind, Problem, from_predict};

/// The problem that the caller is told of.
pub fn from_sequence(error: SequenceError) -> Problem {
    let detail = error.to_string();
    match error {
        SequenceError::NoSteps => {
            Problem::field(Kind::OutOfRange, "steps", Some(json!(0)), "at least one step", detail)
        }
        SequenceError::Time { step, step_s, min_s, max_s } => Problem::field(
            Kind::OutOfRange,
            format!("steps[{step}].time_s"),
            Some(json!(step_s)),
            format!("{min_s} to {max_s} s after the step before, or after 0"),
            detail,
        ),
        SequenceError::Level { level } => {
            Problem::field(Kind::UnknownName, "accuracy.level", Some(json!(level)), "coarse, reference", detail)
        }
        SequenceError::At { step, cause, .. } => {
            let mut problem = from_predict(cause);
            for error in &mut problem.errors {
                error.field = at_step(&error.field, step);
            }
            if problem.kind != Kind::TookTooLong && problem.kind != Kind::Internal {
                problem.detail = detail;
            }
            problem
        }
    }
}

/// The place in a step of how much fluid there is, which a scene has too; what the scene has was checked before any step.
pub(super) fn own_filling(field: &str) -> Option<&str> {
    let own = field.strip_prefix("scene.")?;
    ["bleb.volume_mm3", "bleb.pressure_kpa"].contains(&own).then_some(own)
}

/// The place in a sequence of a field that a single request has.
fn at_step(field: &str, step: usize) -> String {
    let number = field.strip_prefix("needle.").unwrap_or(own_filling(field).unwrap_or(field));
    let of_step =
        ["tip_mm", "direction", "orientation_xyzw", "force_mn", "bleb"].iter().any(|own| number.starts_with(own));
    if of_step { format!("steps[{step}].{number}") } else { field.to_owned() }
}
