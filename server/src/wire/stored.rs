//! Scenes of one's own: what is told of one that is stored.

use serde::Serialize;
use utoipa::ToSchema;

use super::fixed::Vector;
use super::scene::{SceneSpec, SurfaceKind};

/// A scene as a form, for meshes as they lie on a disk.
#[derive(ToSchema)]
pub struct SceneForm {
    /// The bytes of a PLY, OBJ or STL file in mm; its name ends in .ply, .obj or .stl, or its media type says what it is.
    #[schema(format = Binary, content_media_type = "application/octet-stream")]
    pub mesh: String,
    /// The rest of the scene as JSON, without a surface; the defaults when left out.
    pub scene: Option<SceneSpec>,
}

/// A scene that can be named, and how far it is.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "id": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    "state": "preparing",
    "durable": true,
    "bytes": 48213,
    "progress": {"step": "coarse", "done": 2, "of": 3},
    "surface": {"kind": "mesh", "vertices": 441, "triangles": 800}
}))]
pub struct StoredScene {
    /// What a request writes as its `scene`: the SHA-256 of the scene with every number written out, or the name of a built-in one.
    pub id: String,
    /// How far it is. A scene that is being prepared can be used already; the first answers wait for it.
    pub state: SceneState,
    /// Whether it is still there when the service has ended and begun again.
    pub durable: bool,
    /// Size of what is stored; 0 for a built-in one.
    pub bytes: u64,
    /// `preparing`: how far.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub progress: Option<SceneProgress>,
    /// What its surface is; left out until it has been read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceSummary>,
    /// `ready`: a needle and a force that have been answered, to begin with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchSpec>,
    /// `failed`, `corrupt`: why.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
}

/// How far a stored scene is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneState {
    /// It is being read and touched for the first time.
    Preparing,
    /// It has answered.
    Ready,
    /// It is stored, but nowhere on its surface does a light touch have an answer.
    Failed,
    /// What is stored is not what was given; it is never used. Delete it and store it again.
    Corrupt,
}

/// How far the preparation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct SceneProgress {
    /// What is being done: `waiting`, `read`, `linear` or `coarse`.
    pub step: &'static str,
    /// Steps that are done.
    pub done: u8,
    /// Steps in all.
    pub of: u8,
}

/// What a surface is, in short.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct SurfaceSummary {
    /// The kind.
    pub kind: SurfaceKind,
    /// `mesh`: its vertices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// `mesh`: its triangles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<usize>,
}

/// The part of a request that says where a needle presses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, ToSchema)]
pub struct TouchSpec {
    /// The needle.
    pub needle: TouchNeedle,
    /// Its force on the tissue, scene frame, mN.
    pub force_mn: Vector,
}

/// A needle of the usual size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, ToSchema)]
pub struct TouchNeedle {
    /// Foremost point of the needle, scene frame, mm.
    pub tip_mm: Vector,
    /// The way it points, scene frame.
    pub direction: Vector,
}

/// Where stored scenes are kept, and what room there is.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct StoreEntry {
    /// Whether they are still there when the service has ended and begun again; without `--scene-store` they are kept in memory alone.
    pub durable: bool,
    /// How many there are.
    pub scenes: usize,
    /// What they take.
    pub bytes: u64,
    /// How many there may be.
    pub most_scenes: usize,
    /// What one may take.
    pub most_bytes_each: u64,
    /// What they may take together.
    pub most_bytes: u64,
    /// Why the place could not be asked just now; then the list is what was known before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unavailable: Option<String>,
}
