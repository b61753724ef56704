//! The sequence of a request.

use nalgebra::{Point3, Vector3};
use retina_core::predict::Level;
use retina_core::predict::budget::{Budget, DEFAULT_LEVEL};
use retina_core::sequence::{Sequence, Step};
use serde_json::json;

use super::scene::filling;
use super::{budget, effects, force, needle};
use crate::problem::{Kind, Problem};
use crate::wire::SimulateRequest;
use crate::wire::request::AccuracySpec;
use crate::wire::sequence::StepSpec;

/// Where a sequence has its steps.
const STEPS: &str = "steps";

/// The core's sequence with at most `most_steps` steps; the scene is looked up apart, see [`crate::scenes`].
///
/// # Errors
/// A problem that names the field.
pub fn sequence(request: &SimulateRequest, most_steps: usize) -> Result<Sequence, Problem> {
    let steps = steps(STEPS, &request.steps, most_steps)?;
    Ok(Sequence {
        needle: needle::needle(&request.needle)?,
        steps,
        level: level(request.accuracy.as_ref())?,
        effects: effects(request.effects.as_ref(), &Budget::default())?,
    })
}

/// The core's steps of the list at `path`, at most so many.
pub(super) fn steps(path: &str, list: &[StepSpec], most: usize) -> Result<Vec<Step>, Problem> {
    let count = list.len();
    if count == 0 || count > most {
        let detail = format!("{path} has {count} steps, and may have 1 to {most}");
        return Err(Problem::field(Kind::OutOfRange, path, Some(json!(count)), format!("1 to {most}"), detail));
    }
    list.iter().enumerate().map(|(index, spec)| step(format!("{path}[{index}]"), spec)).collect()
}

fn step(path: String, spec: &StepSpec) -> Result<Step, Problem> {
    let force_mn: Option<Vector3<f64>> =
        spec.force_mn.map(|force_mn| force(&format!("{path}.force_mn"), force_mn)).transpose()?;
    Ok(Step {
        time_s: spec.time_s,
        tip_mm: spec.tip_mm.map(|tip_mm| Point3::from(tip_mm.0)),
        orientation: needle::orientation(&path, spec.orientation_xyzw.as_ref(), spec.direction.as_ref())?,
        force_mn,
        fluid: spec.bleb.as_ref().map(|spec| filling(&format!("{path}.bleb"), spec)).transpose()?,
    })
}

/// The level of all steps: what a sequence computes is one motion, so its steps cannot choose for themselves.
pub(super) fn level(accuracy: Option<&AccuracySpec>) -> Result<Level, Problem> {
    let budget = budget(accuracy)?;
    if budget.promises() {
        let detail = "a sequence is computed at one level, so accuracy takes a level and no promise";
        return Err(Problem::field(Kind::InvalidRequest, "accuracy", None, "a level", detail));
    }
    Ok(budget.level.unwrap_or(DEFAULT_LEVEL))
}
