//! A light touch on every built-in scene before the first request, so that what depends on the scene alone is there.

use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use retina_core::needle::shape::RADIUS;
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::budget::Budget;
use retina_core::predict::{Control, EffectChoice, Level, Request, Workspace};
use retina_core::scene::Scene;

use crate::answer::{Question, predict};
use crate::problem::Problem;
use crate::scenes::Scenes;
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::wire::request::SceneChoice;
use crate::write::Layout;

/// Force of the touch, mN: enough for contact, far from any limit.
const FORCE_MN: f64 = 0.1;

/// How long each prediction may take.
const LIMIT: Duration = Duration::from_secs(60);

/// Touches every built-in scene at the levels that a simulator uses.
///
/// # Errors
/// The problem of a scene that could not be prepared.
pub fn prepare_built_in(scenes: &Scenes, times: &Times, workspace: &mut Workspace) -> Result<(), Problem> {
    let shape = NeedleShape::hemispherical(RADIUS.default);
    let needle = Needle::pointing(shape, Point3::origin(), &-Vector3::z_axis());
    for name in Scene::built_in_names() {
        let scene = scenes.get(Some(&SceneChoice::Name((*name).to_owned())))?;
        for level in Level::ALL.into_iter().filter(|level| *level != Level::Reference) {
            let request = Request {
                needle,
                control: Control::Force(Vector3::new(0.0, 0.0, -FORCE_MN)),
                level,
                effects: EffectChoice::Auto,
            };
            let budget = Budget { level: Some(level), ..Budget::default() };
            let mut stopwatch = Stopwatch::start(Instant::now(), LIMIT, &|| false);
            let warm = predict(&scene, Question { request, budget, times }, workspace, &mut stopwatch, Layout::Compact);
            // Without usable weights a learned level has no answer; the others do.
            if let (Err(problem), false) = (warm, level.is_learned()) {
                return Err(problem);
            }
        }
    }
    Ok(())
}
