//! Prepared scenes, kept: the built-in ones for good, those of requests and those that are stored as long as they fit.
//!
//! Contract: a scene is prepared once, even when several requests bring it at the same time; the key of a scene is its whole content
//! as canonical JSON, or the id that stands for it, so that two scenes are never confused; above the limit the one that was unused for longest
//! goes first, and one that is in use stays.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point3;
use retina_core::predict::PreparedScene;
use retina_core::scene::{Scene, SceneSurface};

use crate::library::Id;
use crate::library::reader::Reader;
use crate::problem::{Problem, from_predict};
use crate::understand::{self, DEFAULT_SCENE};
use crate::wire::SceneSpec;
use crate::wire::request::SceneChoice;

/// Scenes of requests that are kept, however small: each is looked at when room is made.
const MOST_INLINE: usize = 256;

/// A place for a scene. Its lock is held while the scene is prepared, so whoever wants the same scene waits for it.
type Slot = Mutex<Option<Arc<PreparedScene>>>;

/// The prepared scenes.
pub struct Scenes {
    built_in: Vec<(&'static str, Slot)>,
    inline: Mutex<Inline>,
    limit_bytes: usize,
    stored: Reader,
}

#[derive(Default)]
struct Inline {
    entries: HashMap<Vec<u8>, Entry>,
    uses: u64,
}

struct Entry {
    slot: Arc<Slot>,
    last_use: u64,
}

impl Scenes {
    /// Nothing is prepared yet; scenes of requests and those that are `stored` are kept up to `limit_bytes`.
    pub fn new(limit_bytes: usize, stored: Reader) -> Self {
        let slot = |&name| (name, Slot::default());
        let built_in = Scene::built_in_names().iter().map(slot).collect();
        Self { built_in, inline: Mutex::default(), limit_bytes, stored }
    }

    /// The scene that a request chooses, prepared.
    ///
    /// # Errors
    /// A problem that names the field.
    pub fn get(&self, choice: Option<&SceneChoice>) -> Result<Arc<PreparedScene>, Problem> {
        match choice {
            None => self.built_in(DEFAULT_SCENE),
            Some(SceneChoice::Name(name)) => match Id::parse(name) {
                Some(id) => self.stored(id),
                None => self.built_in(name),
            },
            Some(SceneChoice::Inline(spec)) => self.inline(spec),
        }
    }

    fn built_in(&self, name: &str) -> Result<Arc<PreparedScene>, Problem> {
        let scene = || understand::built_in(name);
        match self.built_in.iter().find(|(known, _)| *known == name) {
            Some((_, slot)) => fill(slot, scene),
            None => scene().and_then(prepare),
        }
    }

    fn inline(&self, spec: &SceneSpec) -> Result<Arc<PreparedScene>, Problem> {
        let key = serde_json::to_vec(spec).map_err(Problem::internal)?;
        self.kept(&key, || understand::scene(spec))
    }

    /// The stored scene of that id, prepared. Waits for the place where it is kept if it is not in memory.
    ///
    /// # Errors
    /// A problem that names the field.
    pub fn stored(&self, id: Id) -> Result<Arc<PreparedScene>, Problem> {
        // A scene that is written out begins with a brace, so the two kinds of keys never meet.
        self.kept(id.to_string().as_bytes(), || self.stored.scene(id))
    }

    /// Forgets a stored scene that is no longer there.
    pub fn forget(&self, id: Id) {
        lock(&self.inline).entries.remove(id.to_string().as_bytes());
    }

    /// Forgets the stored scenes that are not among these.
    pub fn forget_all_but(&self, there: &[Id]) {
        let is_gone = |id: Id| !there.contains(&id);
        let stored = |key: &[u8]| std::str::from_utf8(key).ok().and_then(Id::parse);
        lock(&self.inline).entries.retain(|key, _| !stored(key).is_some_and(is_gone));
    }

    fn kept(&self, key: &[u8], scene: impl FnOnce() -> Result<Scene, Problem>) -> Result<Arc<PreparedScene>, Problem> {
        let slot = self.slot(key);
        let prepared = fill(&slot, scene);
        drop(slot);
        self.tidy(key);
        prepared
    }

    fn slot(&self, key: &[u8]) -> Arc<Slot> {
        let mut inline = lock(&self.inline);
        inline.uses += 1;
        let last_use = inline.uses;
        if let Some(entry) = inline.entries.get_mut(key) {
            entry.last_use = last_use;
            return Arc::clone(&entry.slot);
        }
        let slot = Arc::<Slot>::default();
        let entry = Entry { slot: Arc::clone(&slot), last_use };
        inline.entries.insert(key.to_vec(), entry);
        slot
    }

    /// Forgets the scene of `key` if it could not be prepared, and what is too much.
    fn tidy(&self, key: &[u8]) {
        let mut inline = lock(&self.inline);
        if inline.entries.get(key).is_some_and(|entry| entry.idle_bytes() == Some(0)) {
            inline.entries.remove(key);
        }
        while inline.entries.len() > MOST_INLINE || inline.bytes() > self.limit_bytes {
            let idle = inline.entries.iter().filter(|(_, entry)| entry.idle_bytes().is_some());
            let Some((oldest, _)) = idle.min_by_key(|(_, entry)| entry.last_use) else {
                return;
            };
            let oldest = oldest.clone();
            inline.entries.remove(&oldest);
        }
    }

    /// Memory of the scenes of requests and of those that are stored, keys included, bytes.
    pub fn inline_bytes(&self) -> usize {
        lock(&self.inline).bytes()
    }
}

impl Inline {
    fn bytes(&self) -> usize {
        self.entries.iter().map(|(key, entry)| key.len() + entry.bytes()).sum()
    }
}

impl Entry {
    /// Zero for a scene that is being prepared.
    fn bytes(&self) -> usize {
        match self.slot.try_lock() {
            Ok(slot) => slot.as_ref().map_or(0, |prepared| prepared.memory_bytes()),
            Err(_) => 0,
        }
    }

    /// The bytes of a scene that nobody uses; `None` where somebody does.
    fn idle_bytes(&self) -> Option<usize> {
        if Arc::strong_count(&self.slot) > 1 {
            return None;
        }
        let slot = lock(&self.slot);
        match slot.as_ref() {
            None => Some(0),
            Some(prepared) if Arc::strong_count(prepared) == 1 => Some(prepared.memory_bytes()),
            Some(_) => None,
        }
    }
}

/// Triangles between the nodes of every surface of a scene; none for a mesh, whose patch depends on the contact.
///
/// # Errors
/// Never for a scene that is prepared.
pub fn shared_triangles(scene: &PreparedScene) -> Result<Vec<[usize; 3]>, Problem> {
    match scene.scene().surface {
        SceneSurface::Mesh(_) => Ok(Vec::new()),
        _ => scene.scene().patch(&Point3::origin()).map(|patch| patch.triangles).map_err(Problem::internal),
    }
}

fn fill(slot: &Slot, scene: impl FnOnce() -> Result<Scene, Problem>) -> Result<Arc<PreparedScene>, Problem> {
    let mut place = lock(slot);
    if let Some(prepared) = place.as_ref() {
        return Ok(Arc::clone(prepared));
    }
    let prepared = prepare(scene()?)?;
    *place = Some(Arc::clone(&prepared));
    Ok(prepared)
}

fn prepare(scene: Scene) -> Result<Arc<PreparedScene>, Problem> {
    PreparedScene::new(scene).map(Arc::new).map_err(from_predict)
}

/// A panic while a scene was prepared leaves its place empty, which is in order.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
