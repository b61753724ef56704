//! One call from a question to an answer: scene, needle, force and level in; surface, normals and report out.
//!
//! [`PreparedScene`] holds what depends on the scene alone; [`Workspace`] is a thread's memory. Read on in `types` (what goes in and comes
//! out), `question` (a request in the patch's frame), `answer` (level by level), `linear` (the layered answer, start of all others),
//! `finite_element` and `resolution` (the levels on meshes), `held` (the interface), `over_fluid` (a bleb), `networks` and `learned` (the learned levels), `choice` (effects), `budget`, `expected_error` and `sampled` (levels),
//! `indentation` (many steps of one needle). Not here: HTTP, clocks, threads.

pub(crate) mod answer;
pub mod beds;
mod bent;
pub(crate) mod bond;
pub mod budget;
pub mod calibration;
pub mod choice;
pub mod expected_error;
pub mod finite_element;
pub(crate) mod held;
pub mod indentation;
mod learned;
pub mod linear;
pub mod networks;
pub(crate) mod over_fluid;
mod question;
mod refinement;
mod resolution;
pub mod sampled;
pub(crate) mod topologies;
pub mod types;

pub use types::*;

use std::sync::Arc;

use nalgebra::Point3;

use crate::mesh::wall::WallTopology;
use crate::needle::Body;
use crate::network::contact::Memory;
use crate::patch::Patch;
use crate::progress::Progress;
use crate::range::ParameterRange;
use crate::scene::puncture::PRESSURE_PER_MODULUS;
use crate::scene::{Scene, SceneSurface};
use crate::solve::newton;
use beds::Beds;
use budget::{Budget, Choice, LevelTimes};
use expected_error::Situation;
use finite_element::{COARSE, REFERENCE, Resolution};
use learned::RestPatch;
use linear::press;
use networks::Networks;
use question::Begun;
pub(crate) use question::{CutOrGrid, Question, Sink};

/// Normal force over the needle's cross-section, in Young's moduli of the softest retina, beyond which a force is refused: there the finite-element levels
/// no longer converge throughout. A scene may let its tissue puncture earlier, which is told in the answer.
pub const PUNCTURE_PRESSURE_PER_MODULUS: f64 = PRESSURE_PER_MODULUS.max;

/// Depth beyond which no answer is given, as a share of retina and choroid under the contact.
pub const MAX_DEPTH_SHARE: f64 = 0.7;

/// A component of the force. What a tissue bears is checked for each request: see [`PUNCTURE_PRESSURE_PER_MODULUS`].
pub const FORCE_COMPONENT: ParameterRange = ParameterRange {
    name: "component of the force",
    unit: "mN",
    default: 0.0,
    min: -1e6,
    max: 1e6,
    source: "bound of this program: 1 kN, beyond which nothing is a force on a retina",
};

/// Strain by which a change of the eye's pressure may squeeze or stretch a layer by itself: a layer that is pulled to twice its thickness nears the limit point of
/// the neo-Hookean law in confinement, beyond which it bears nothing more.
pub const MAX_SETTLED_STRAIN: f64 = 1.0;

/// Penetration of the needle into the predicted surface from which on an answer warns of it (mm).
pub const PENETRATION_WARNING_MM: f64 = 5e-3;

/// Distance between the contact and the rim of a user's mesh from which on an answer warns of it (mm): as far as a needle moves the surface by
/// micrometres.
pub const RIM_WARNING_MM: f64 = 0.6;

/// A scene with everything that depends on it alone. Shared between threads.
pub struct PreparedScene {
    scene: Scene,
    beds: Arc<Beds>,
    /// The patch, where it does not depend on the contact.
    patch: Option<Patch>,
    /// What the networks need of it.
    rest: Option<RestPatch>,
    networks: Arc<Networks>,
}

/// A thread's memory, reused between predictions.
#[derive(Default)]
pub struct Workspace {
    coarse: Option<(Arc<WallTopology>, newton::Workspace)>,
    network: Memory,
}

impl PreparedScene {
    /// Validates and prepares `scene`.
    ///
    /// # Errors
    /// [`PredictError::OutOfRange`] naming the field.
    pub fn new(scene: Scene) -> Result<Self, PredictError> {
        scene.validate()?;
        let patch = match scene.surface {
            SceneSurface::Mesh(_) => None,
            _ => Some(scene.patch(&Point3::origin())?),
        };
        let rest = patch.as_ref().map(RestPatch::new);
        Ok(PreparedScene { beds: Arc::new(Beds::new(&scene)), scene, patch, rest, networks: Networks::shipped() })
    }

    /// The same scene with other networks, sharing what is prepared.
    pub fn with_networks(&self, networks: Arc<Networks>) -> Self {
        let PreparedScene { scene, beds, patch, rest, .. } = self;
        PreparedScene { scene: scene.clone(), beds: beds.clone(), patch: patch.clone(), rest: rest.clone(), networks }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Memory that the preparation holds (bytes).
    pub fn memory_bytes(&self) -> usize {
        let mesh = match &self.scene.surface {
            SceneSurface::Mesh(mesh) => size_of_val(mesh.vertices()) + size_of_val(mesh.triangles()),
            _ => 0,
        };
        size_of::<Self>() + self.beds.memory_bytes() + mesh
    }

    /// Answers `request`.
    ///
    /// # Errors
    /// [`PredictError`].
    pub fn predict(
        &self,
        request: &Request,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        let resolution = if request.level == Level::Coarse { &COARSE } else { &REFERENCE };
        self.predict_at(request, resolution, workspace, progress)
    }

    /// As [`PreparedScene::predict`], with `resolution` in place of that of the request's finite-element level: for measuring what a setting changes.
    ///
    /// # Errors
    /// [`PredictError`].
    pub fn predict_at(
        &self,
        request: &Request,
        resolution: &Resolution,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        progress.stage("linear");
        let body = request.needle.shape.body();
        self.aimed(request, &body)?.answer(resolution, workspace, progress)
    }

    /// The level that answers `request` (whose own level does not matter) within `budget`, where the levels take `times_ms`.
    ///
    /// # Errors
    /// [`PredictError::Budget`] for a strict budget that no level keeps; what [`PreparedScene::predict`] would refuse.
    pub fn choose(&self, request: &Request, budget: &Budget, times_ms: &LevelTimes) -> Result<Choice, PredictError> {
        budget.choose(&self.situation(request)?, times_ms)
    }

    /// What is known of `request` before a level computes it.
    ///
    /// # Errors
    /// What [`PreparedScene::predict`] would refuse.
    pub fn situation(&self, request: &Request) -> Result<Situation, PredictError> {
        let body = request.needle.shape.body();
        let question = self.aimed(request, &body)?;
        let sink = question.sink();
        Ok(match question.begin(&question.raised(&sink))? {
            Begun::Still(_) => {
                let lifted = question.lifting(Level::Coarse).simulated;
                Situation { lifted, ..question.situation(0.0, 0.0, None) }
            }
            Begun::Pressed(linear) => {
                let expected = question.expected(&linear, &sink);
                let error = |level| question.learned_error(level, &linear, expected, &sink);
                Situation {
                    network: error(Level::Network),
                    corrected: error(Level::Corrected),
                    ..question.situation_under(&linear)
                }
            }
        })
    }

    /// The request in the frame of the patch where the needle touches.
    fn aimed<'a>(&'a self, request: &'a Request, body: &'a Body) -> Result<Question<'a>, PredictError> {
        request.needle.validate()?;
        if let Control::Force(force) = request.control {
            for (index, &component) in force.iter().enumerate() {
                FORCE_COMPONENT.check(&format!("force_mn[{index}]"), component)?;
            }
        }
        Ok(Question::new(self, request, body, self.patch_for(request, body)?))
    }

    /// The patch of a request: the scene's own, or the nodes of its mesh nearest to where the needle touches.
    pub(crate) fn patch_for(&self, request: &Request, body: &Body) -> Result<CutOrGrid<'_>, PredictError> {
        if let Some(patch) = &self.patch {
            return Ok(CutOrGrid::Grid(patch));
        }
        let tip = request.needle.tip_mm;
        let first = Question::new(self, request, body, self.patch_around(&tip)?);
        let around = press(first.patch(), &first.tool, &first.motion).map(|press| {
            let [x, y] = press.touch.parameter;
            first.patch().scene_from_patch * first.patch().surface.column(x, y).surface
        });
        self.patch_around(&around.unwrap_or(tip))
    }

    /// The patch of a contact (scene coordinates).
    fn patch_around(&self, contact: &Point3<f64>) -> Result<CutOrGrid<'_>, PredictError> {
        Ok(match &self.patch {
            Some(patch) => CutOrGrid::Grid(patch),
            None => CutOrGrid::Cut(Box::new(self.scene.patch(contact)?)),
        })
    }
}
