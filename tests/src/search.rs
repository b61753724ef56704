//! One trial of the random search: a request asked at `linear` and `coarse`, and what it came to.
//!
//! Not here: drawing (`random_scene`), the laws (`laws`), the report (`bin/random_scenes`).

use retina_core::effects::{adhesion, friction, pressure};
use retina_core::predict::{Level, PreparedScene, Workspace};
use retina_core::progress::Silent;
use serde::{Deserialize, Serialize};

use crate::laws::{Kind, broken, cause, is_simulated};
use crate::random_scene::{REQUEST_UNITS, RequestNumbers, SCENE_UNITS, SceneNumbers, units};

/// Requests asked of every random tissue: preparing one takes as long as some ten answers.
pub const REQUESTS_PER_TISSUE: u64 = 50;
/// The streams that scenes and requests are drawn from.
const STREAMS: [u64; 2] = [1, 2];

/// What a trial came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// An answer that obeys every law.
    Answered {
        /// What it was computed with.
        class: Class,
        /// Newton iterations in all.
        iterations: usize,
    },
    /// A refusal, by its cause.
    Refused(String),
    /// No answer where there should be one, by its cause.
    Failed(String),
    /// An answer that breaks a law.
    Broken(String),
}

/// What an answer was computed with, for iterations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Class {
    /// Nothing was solved: nothing touches.
    Still,
    /// Tissue and contact alone.
    Contact,
    /// A changed pressure besides.
    Pressure,
    /// Friction, with or without pressure.
    Friction,
    /// A bond that may part, without friction.
    Adhesion,
    /// Friction and a bond that may part.
    Both,
}

/// The tissue of number `index`.
pub fn tissue(seed: u64, index: u64) -> SceneNumbers {
    SceneNumbers::draw(&units(seed, STREAMS[0], index, SCENE_UNITS))
}

/// Trial `index` on its tissue.
pub fn request(seed: u64, index: u64, tissue: &SceneNumbers) -> RequestNumbers {
    RequestNumbers::draw(&units(seed, STREAMS[1], index, REQUEST_UNITS), tissue)
}

/// Asks `request` at every fast level; what `coarse` came to, and every law that either breaks.
pub fn ask(scene: &PreparedScene, request: &RequestNumbers, workspace: &mut Workspace) -> Outcome {
    let mut coarse = Outcome::Refused(String::new());
    for level in [Level::Linear, Level::Coarse] {
        let asked = request.request(level);
        coarse = match scene.predict(&asked, workspace, &mut Silent) {
            Ok(answer) => {
                if let Some(law) = broken(scene.scene(), &asked, &answer).into_iter().next() {
                    return Outcome::Broken(format!("{}: {law}", level.name()));
                }
                let on = |name| is_simulated(&answer, name);
                let class = match (on(friction::NAME), on(adhesion::NAME), on(pressure::NAME)) {
                    _ if answer.solver.iterations == 0 => Class::Still,
                    (true, true, _) => Class::Both,
                    (true, ..) => Class::Friction,
                    (_, true, _) => Class::Adhesion,
                    (.., true) => Class::Pressure,
                    _ => Class::Contact,
                };
                Outcome::Answered { class, iterations: answer.solver.iterations }
            }
            Err(error) => match cause(&error) {
                (Kind::Refused, cause) => Outcome::Refused(cause.to_owned()),
                (Kind::Failed, cause) => Outcome::Failed(cause.to_owned()),
            },
        };
    }
    coarse
}

/// What a tissue that is refused as a whole came to; none where it is prepared.
///
/// # Errors
/// The outcome of each of its requests.
pub fn prepare(tissue: &SceneNumbers) -> Result<PreparedScene, Outcome> {
    PreparedScene::new(tissue.scene()).map_err(|error| match cause(&error) {
        (Kind::Refused, cause) => Outcome::Refused(cause.to_owned()),
        (Kind::Failed, cause) => Outcome::Failed(cause.to_owned()),
    })
}
