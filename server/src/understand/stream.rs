//! What a stream's messages ask for.

use nalgebra::{Point3, Vector3};
use retina_core::effects::{inertia, viscoelasticity};
use retina_core::needle::NeedleShape;
use retina_core::predict::budget::DEFAULT_LEVEL;
use retina_core::predict::{Control, EffectChoice, Request};
use retina_core::sequence::{Sequence, Step};
use serde_json::json;

use super::scene::filling;
use super::sequence::{level, steps};
use super::{Shared, force, needle, shared};
use crate::problem::{Kind, Problem};
use crate::wire::fixed::Vector;
use crate::wire::stream::{MemorySpec, OpenSpec, StreamPose};

/// Where a session has the steps that it is planned from.
pub const REHEARSAL: &str = "memory.rehearsal";

/// What holds for every pose of a session; the scene is looked up apart, see [`crate::scenes`].
#[derive(Clone, Debug)]
pub struct Opening {
    /// The needle.
    pub shape: NeedleShape,
    /// What all poses share.
    pub shared: Shared,
    /// What a session with memory is planned from.
    pub rehearsal: Option<Sequence>,
}

/// What a session is opened with; a rehearsal may have so many steps.
///
/// # Errors
/// A problem that names the field.
pub fn opening(spec: &OpenSpec, most_steps: usize) -> Result<Opening, Problem> {
    let shared = shared(spec.accuracy.as_ref(), spec.effects.as_ref())?;
    let shape = needle::shape(spec.needle.as_ref().unwrap_or(&Default::default()))?;
    let rehearsal = match &spec.memory {
        Some(memory) => Some(Sequence {
            needle: needle::placed(shape, "needle", first_tip(memory)?, None, None, None)?,
            steps: steps(REHEARSAL, &memory.rehearsal, most_steps)?,
            level: level(spec.accuracy.as_ref())?,
            effects: shared.effects.clone(),
        }),
        None => {
            refuse_time(&shared.effects)?;
            None
        }
    };
    Ok(Opening { shape, shared, rehearsal })
}

/// Where the needle of a session with memory is at time 0.
fn first_tip(memory: &MemorySpec) -> Result<Vector, Problem> {
    match memory.rehearsal.first() {
        Some(step) => step.tip_mm.ok_or_else(|| {
            let detail = format!("{REHEARSAL}[0].tip_mm is missing; it says where the needle is at time 0");
            Problem::field(Kind::InvalidRequest, format!("{REHEARSAL}[0].tip_mm"), None, "required", detail)
        }),
        // Refused by their number.
        None => Ok(Vector([0.0; 3])),
    }
}

/// Refuses effects of time in a session without memory.
fn refuse_time(effects: &EffectChoice) -> Result<(), Problem> {
    if let EffectChoice::Named(names) = effects {
        let remembers = |name: &String| [viscoelasticity::NAME, inertia::NAME].contains(&name.as_str());
        if let Some(index) = names.iter().position(remembers) {
            let detail = format!(
                "`{}` remembers what came before: it needs a session with \"memory\", or POST /v1/simulate, which takes a timed list of poses",
                names[index]
            );
            let allowed = "effects of no time, or a session with memory, or POST /v1/simulate";
            let field = format!("effects[{index}]");
            return Err(Problem::field(Kind::UnknownName, field, Some(json!(names[index])), allowed, detail));
        }
    }
    Ok(())
}

/// The core's step of a pose in a session with memory, where it is reached at `time_s`.
///
/// # Errors
/// A problem that names the field as a single prediction would.
pub fn step(pose: &StreamPose, time_s: f64) -> Result<Step, Problem> {
    Ok(Step {
        time_s,
        tip_mm: pose.tip_mm.map(|Vector(tip_mm)| Point3::from(tip_mm)),
        orientation: needle::orientation("needle", pose.orientation_xyzw.as_ref(), pose.direction.as_ref())?,
        force_mn: pose.force_mn.map(|force_mn| force("force_mn", force_mn)).transpose()?,
        fluid: pose.bleb.as_ref().map(|spec| filling("bleb", spec)).transpose()?,
    })
}

/// The core's request of a pose in a session without memory, its level that of one that asks for none.
///
/// # Errors
/// A problem that names the field as a single prediction would.
pub fn pose(opening: &Opening, pose: &StreamPose) -> Result<Request, Problem> {
    let only_remembered = |field: &str, given: Option<f64>, allowed: &str| {
        let detail = format!("pose.{field} must be {allowed} in a session without \"memory\"");
        Problem::field(Kind::InvalidRequest, field, given.map(|number| json!(number)), allowed, detail)
    };
    if pose.time_s.is_some() {
        return Err(only_remembered("time_s", pose.time_s, "left out"));
    }
    if pose.bleb.is_some() {
        return Err(only_remembered("bleb", None, "left out"));
    }
    let needle = needle::placed(
        opening.shape,
        "needle",
        pose.tip_mm.ok_or_else(|| only_remembered("tip_mm", None, "given"))?,
        pose.orientation_xyzw.as_ref(),
        pose.direction.as_ref(),
        None,
    )?;
    let force: Option<Vector3<f64>> = pose.force_mn.map(|force_mn| force("force_mn", force_mn)).transpose()?;
    Ok(Request {
        needle,
        control: force.map_or(Control::Pose, Control::Force),
        level: DEFAULT_LEVEL,
        effects: opening.shared.effects.clone(),
    })
}
