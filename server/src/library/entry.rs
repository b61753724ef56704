//! What is known of a stored scene, and how it is told.

use retina_core::scene::{Scene, SceneSurface};

use super::content::Id;
use super::touch::Touch;
use crate::wire::scene::SurfaceKind;
use crate::wire::stored::{SceneProgress, SceneState, StoredScene, SurfaceSummary};

/// Steps of a preparation, in order.
pub const STEPS: [&str; 3] = ["read", "linear", "coarse"];

/// How far a stored scene is.
#[derive(Clone, Debug)]
pub enum State {
    /// Not begun.
    Waiting,
    /// At this of [`STEPS`].
    At(usize),
    /// It has answered this touch.
    Ready(Touch),
    /// It has no answer, for this reason.
    Failed(String),
    /// Its bytes are not what was given.
    Corrupt(String),
}

/// What is known of a stored scene.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Size of its content.
    pub bytes: u64,
    /// How far it is.
    pub state: State,
    /// What its surface is, once it has been read.
    pub surface: Option<SurfaceSummary>,
}

impl Entry {
    /// One of which the size alone is known.
    pub fn new(bytes: u64) -> Self {
        Self { bytes, state: State::Waiting, surface: None }
    }

    /// What the caller is told.
    pub fn told(&self, id: Id, durable: bool) -> StoredScene {
        let progress = |step, done: usize| SceneProgress { step, done: done as u8, of: STEPS.len() as u8 };
        let (state, progress, touch, cause) = match &self.state {
            State::Waiting => (SceneState::Preparing, Some(progress("waiting", 0)), None, None),
            State::At(step) => (SceneState::Preparing, Some(progress(STEPS[*step], *step)), None, None),
            State::Ready(touch) => (SceneState::Ready, None, Some(touch.told()), None),
            State::Failed(cause) => (SceneState::Failed, None, None, Some(cause.clone())),
            State::Corrupt(cause) => (SceneState::Corrupt, None, None, Some(cause.clone())),
        };
        StoredScene {
            id: id.to_string(),
            state,
            durable,
            bytes: self.bytes,
            progress,
            surface: self.surface,
            touch,
            cause,
        }
    }
}

/// What is told of a built-in scene.
pub fn built_in(scene: &Scene) -> StoredScene {
    StoredScene {
        id: scene.name.clone(),
        state: SceneState::Ready,
        durable: true,
        bytes: 0,
        progress: None,
        surface: Some(summary(scene)),
        touch: None,
        cause: None,
    }
}

/// What the surface of a scene is.
pub fn summary(scene: &Scene) -> SurfaceSummary {
    let (kind, counts) = match &scene.surface {
        SceneSurface::Flat => (SurfaceKind::Flat, None),
        SceneSurface::Sphere { .. } => (SurfaceKind::Sphere, None),
        SceneSurface::FovealPit { .. } => (SurfaceKind::FovealPit, None),
        SceneSurface::Mesh(mesh) => (SurfaceKind::Mesh, Some((mesh.vertices().len(), mesh.triangles().len()))),
    };
    SurfaceSummary { kind, vertices: counts.map(|(vertices, _)| vertices), triangles: counts.map(|(_, count)| count) }
}
