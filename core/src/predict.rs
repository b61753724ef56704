//! One call from a question to an answer: scene, needle, force and level in; surface, normals and report out.
//!
//! [`PreparedScene`] holds what depends on the scene alone; [`Workspace`] is a thread's memory. Read on in `types` (what goes in and comes
//! out), `question` (a request in the patch's frame), `answer` (level by level), `linear` (the layered answer, start of all others),
//! `finite_element` (the levels on meshes), `choice` (effects), `budget` and `expected_error` (levels). Not here: HTTP, clocks, threads.

mod answer;
pub mod beds;
pub mod budget;
pub mod calibration;
pub mod choice;
pub mod expected_error;
pub mod finite_element;
pub mod linear;
mod question;
pub(crate) mod topologies;
pub mod types;

pub use types::*;

use std::sync::Arc;

use nalgebra::Point3;

use crate::mesh::wall::WallTopology;
use crate::needle::Body;
use crate::patch::Patch;
use crate::progress::Progress;
use crate::range::ParameterRange;
use crate::scene::{Scene, SceneSurface};
use crate::solve::newton;
use beds::Beds;
use budget::{Budget, Choice, LevelTimes};
use expected_error::Situation;
use finite_element::{REFERENCE, Resolution};
use linear::press;
use question::Begun;
pub(crate) use question::{CutOrGrid, Question};

/// Normal force over the needle's cross-section, in Young's moduli of the innermost retina, beyond which tissue models of this kind do not
/// hold: the needle punctures. Chosen where the finite-element levels still converge throughout; no puncture force of the retina is
/// published.
pub const PUNCTURE_PRESSURE_PER_MODULUS: f64 = 0.75;

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
    beds: Beds,
    /// The patch, where it does not depend on the contact.
    patch: Option<Patch>,
}

/// A thread's memory, reused between predictions.
#[derive(Default)]
pub struct Workspace {
    coarse: Option<(Arc<WallTopology>, newton::Workspace)>,
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
        Ok(PreparedScene { beds: Beds::new(&scene), scene, patch })
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
        self.predict_at(request, &REFERENCE, workspace, progress)
    }

    /// As [`PreparedScene::predict`], with `resolution` in place of that of level `reference`: for measuring what refinement changes.
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
        Ok(match question.begin(&question.raised(&question.sink()))? {
            Begun::Still(_) => question.situation(0.0, 0.0, None),
            Begun::Pressed(linear) => question.situation_under(&linear),
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
