//! What a stream's messages ask for.

use nalgebra::Vector3;
use retina_core::effects::{inertia, viscoelasticity};
use retina_core::needle::NeedleShape;
use retina_core::predict::budget::DEFAULT_LEVEL;
use retina_core::predict::{Control, EffectChoice, Request};
use serde_json::json;

use super::{Shared, force, needle, shared};
use crate::problem::{Kind, Problem};
use crate::wire::stream::{OpenSpec, StreamPose};

/// What holds for every pose of a session; the scene is looked up apart, see [`crate::scenes`].
#[derive(Clone, Debug)]
pub struct Opening {
    /// The needle.
    pub shape: NeedleShape,
    /// What all poses share.
    pub shared: Shared,
}

/// What a session is opened with.
///
/// # Errors
/// A problem that names the field.
pub fn opening(spec: &OpenSpec) -> Result<Opening, Problem> {
    let shared = shared(spec.accuracy.as_ref(), spec.effects.as_ref())?;
    if let EffectChoice::Named(names) = &shared.effects {
        let remembers = |name: &String| [viscoelasticity::NAME, inertia::NAME].contains(&name.as_str());
        if let Some(index) = names.iter().position(remembers) {
            let detail = format!(
                "`{}` remembers what came before and must know what comes, which a stream does not; POST /v1/simulate takes a timed list of \
                 poses with it",
                names[index]
            );
            let allowed = "effects without memory, or POST /v1/simulate";
            let field = format!("effects[{index}]");
            return Err(Problem::field(Kind::UnknownName, field, Some(json!(names[index])), allowed, detail));
        }
    }
    let shape = needle::shape(spec.needle.as_ref().unwrap_or(&Default::default()))?;
    Ok(Opening { shape, shared })
}

/// The core's request of a pose, its level that of one that asks for none.
///
/// # Errors
/// A problem that names the field as a single prediction would.
pub fn pose(opening: &Opening, pose: &StreamPose) -> Result<Request, Problem> {
    let needle = needle::placed(
        opening.shape,
        "needle",
        pose.tip_mm,
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
