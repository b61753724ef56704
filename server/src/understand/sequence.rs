//! The sequence of a request.

use nalgebra::{Point3, Vector3};
use retina_core::predict::Level;
use retina_core::predict::budget::{Budget, DEFAULT_LEVEL};
use retina_core::sequence::{Sequence, Step};
use serde_json::json;

use super::{budget, effects, force, needle};
use crate::problem::{Kind, Problem};
use crate::wire::SimulateRequest;
use crate::wire::request::AccuracySpec;
use crate::wire::sequence::StepSpec;

/// The core's sequence with at most `most_steps` steps; the scene is looked up apart, see [`crate::scenes`].
///
/// # Errors
/// A problem that names the field.
pub fn sequence(request: &SimulateRequest, most_steps: usize) -> Result<Sequence, Problem> {
    let count = request.steps.len();
    if count == 0 || count > most_steps {
        let detail = format!("there are {count} steps; one simulation may have 1 to {most_steps}");
        return Err(Problem::field(
            Kind::OutOfRange,
            "steps",
            Some(json!(count)),
            format!("1 to {most_steps}"),
            detail,
        ));
    }
    Ok(Sequence {
        needle: needle::needle(&request.needle)?,
        steps: request.steps.iter().enumerate().map(step).collect::<Result<_, _>>()?,
        level: level(request.accuracy.as_ref())?,
        effects: effects(request.effects.as_ref(), &Budget::default())?,
    })
}

fn step((index, spec): (usize, &StepSpec)) -> Result<Step, Problem> {
    let path = format!("steps[{index}]");
    let force_mn: Option<Vector3<f64>> =
        spec.force_mn.map(|force_mn| force(&format!("{path}.force_mn"), force_mn)).transpose()?;
    Ok(Step {
        time_s: spec.time_s,
        tip_mm: spec.tip_mm.map(|tip_mm| Point3::from(tip_mm.0)),
        orientation: needle::orientation(&path, spec.orientation_xyzw.as_ref(), spec.direction.as_ref())?,
        force_mn,
    })
}

/// The level of all steps: what a sequence computes is one motion, so its steps cannot choose for themselves.
fn level(accuracy: Option<&AccuracySpec>) -> Result<Level, Problem> {
    let budget = budget(accuracy)?;
    if budget.promises() {
        let detail = "a sequence is computed at one level, so accuracy takes a level and no promise";
        return Err(Problem::field(Kind::InvalidRequest, "accuracy", None, "a level", detail));
    }
    Ok(budget.level.unwrap_or(DEFAULT_LEVEL))
}
