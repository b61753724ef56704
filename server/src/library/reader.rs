//! How a numerical thread comes to a stored scene that it does not have yet.

use retina_core::scene::Scene;
use serde_json::json;
use tokio::runtime::Handle;

use super::content::{self, Id};
use super::store::Store;
use crate::problem::{Kind, Problem};

/// Reads stored scenes for threads that may wait.
#[derive(Clone)]
pub struct Reader {
    store: Store,
    background: Handle,
}

impl Reader {
    /// Reads from that place.
    pub fn new(store: Store, background: Handle) -> Self {
        Self { store, background }
    }

    /// The scene, read and held against its name. Waits for the place; never called by a thread that talks.
    ///
    /// # Errors
    /// [`Kind::UnknownName`] where there is none, [`Kind::CorruptScene`], [`Kind::StoreUnavailable`], or what is wrong with the scene.
    pub fn scene(&self, id: Id) -> Result<Scene, Problem> {
        let content = self.background.block_on(self.store.read(id)).map_err(super::problem)?;
        let Some(content) = content else {
            let (allowed, value) = ("the id of a scene that is stored, see GET /v1/scenes", json!(id.to_string()));
            let detail = format!("scene: no scene is stored under {id}");
            return Err(Problem::field(Kind::UnknownName, "scene", Some(value), allowed, detail));
        };
        content::scene(id, &content)
    }
}
