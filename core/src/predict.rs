//! One call from a question to an answer: scene, needle, force and level in; surface, normals and report out.
//!
//! [`PreparedScene`] holds what depends on the scene alone; [`Workspace`] is a thread's memory. Not here: HTTP, clocks, threads.

pub mod finite_element;
pub mod types;

pub use types::*;

use crate::progress::Progress;
use crate::scene::Scene;

/// A scene with everything that depends on it alone. Shared between threads.
pub struct PreparedScene {
    scene: Scene,
}

/// A thread's memory, reused between predictions.
#[derive(Default)]
pub struct Workspace {}

impl PreparedScene {
    /// Validates and prepares `scene`.
    ///
    /// # Errors
    /// [`PredictError::OutOfRange`] naming the field; [`PredictError::Linear`].
    pub fn new(scene: Scene) -> Result<Self, PredictError> {
        scene.validate()?;
        Ok(PreparedScene { scene })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Memory that the preparation holds [bytes].
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
    }

    /// Answers `request`.
    ///
    /// # Errors
    /// [`PredictError`].
    pub fn predict(
        &self,
        request: &Request,
        _workspace: &mut Workspace,
        _progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        Err(PredictError::Linear(format!("{:?} is not there yet", request.level)))
    }
}
