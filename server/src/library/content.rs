//! What is stored of a scene: every number of it, as JSON, and the name that follows from those bytes.
//!
//! Contract: two requests that mean the same scene have the same bytes, whatever was left out, in which format the mesh came and in which order the
//! fields stood; so a stored scene stays what it was when a default changes. Its id is the SHA-256 of the bytes, and bytes of another hash are
//! never taken for it.

use std::fmt;

use retina_core::scene::{Scene, SceneSurface};
use sha2::{Digest as _, Sha256};

use crate::catalog;
use crate::problem::{Kind, Problem};
use crate::read::read;
use crate::understand;
use crate::wire::fixed::{Quaternion, Triangle, Vector};
use crate::wire::scene::{PoseSpec, SceneSpec};

/// The name of a stored scene: the SHA-256 of its content, written as 64 small hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id([u8; 32]);

impl Id {
    /// The name of this content.
    pub fn of(content: &[u8]) -> Self {
        Self(Sha256::digest(content).into())
    }

    /// The name that is written so; `None` for any other text.
    pub fn parse(text: &str) -> Option<Self> {
        let digits = text.as_bytes();
        if digits.len() != 64 || !digits.iter().all(|digit| matches!(digit, b'0'..=b'9' | b'a'..=b'f')) {
            return None;
        }
        let mut id = [0; 32];
        for (byte, at) in id.iter_mut().zip((0..64).step_by(2)) {
            *byte = u8::from_str_radix(&text[at..at + 2], 16).ok()?;
        }
        Some(Self(id))
    }
}

impl fmt::Display for Id {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

/// The bytes that are stored of a scene that is understood; `pose` is what the caller wrote of it.
///
/// # Errors
/// None for a scene that is understood: its numbers are finite.
pub fn content(scene: &Scene, pose: Option<&PoseSpec>) -> Result<Vec<u8>, Problem> {
    let mut whole: SceneSpec = catalog::spec(scene);
    if let (SceneSurface::Mesh(mesh), Some(surface)) = (&scene.surface, whole.surface.as_mut()) {
        surface.vertices_mm = Some(mesh.vertices().iter().map(|vertex| Vector(vertex.coords.into())).collect());
        surface.triangles = Some(mesh.triangles().iter().copied().map(Triangle).collect());
    }
    let here = PoseSpec {
        position_mm: Some(pose.and_then(|pose| pose.position_mm).unwrap_or(Vector([0.0; 3]))),
        orientation_xyzw: Some(pose.and_then(|pose| pose.orientation_xyzw).unwrap_or(Quaternion([0.0, 0.0, 0.0, 1.0]))),
    };
    whole.pose = (!matches!(scene.surface, SceneSurface::Mesh(_))).then_some(here);
    serde_json::to_vec(&whole).map_err(Problem::internal)
}

/// The scene in the bytes that are stored under `id`.
///
/// # Errors
/// [`Kind::CorruptScene`] for bytes of another hash; what is wrong with a scene that this program does not take, which another version may have
/// written.
pub fn scene(id: Id, content: &[u8]) -> Result<Scene, Problem> {
    let found = Id::of(content);
    if found != id {
        let detail = format!("the stored scene {id} is corrupt: what is there has the hash {found}");
        let allowed = "another scene, or this one once it is deleted and stored again";
        return Err(Problem::field(Kind::CorruptScene, "scene", None, allowed, detail));
    }
    let spec: SceneSpec = read(content)?;
    understand::scene(&spec)
}
