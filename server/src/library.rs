//! Scenes of one's own: stored, prepared in the background, listed, deleted.
//!
//! Contract: a scene is there whole or not at all, whenever the program ends; what is there but is not what was given is told by name and never
//! used. Several services may share a place: each sees what the others store or delete when it is asked for a list, and every
//! `LOOK_AGAIN` besides. Preparation waits for the numerical threads as everybody does, one scene at a time and a step at a time.
//!
//! Read `content` (what is stored, and its name), `store` (where), `quota`, `entry` (what is known of a scene), `touch` and `prepare` (what the
//! background does), `reader` (how a request comes to a stored scene). Not here: the forms in which a scene is sent (`upload`).

pub mod content;
mod entry;
mod leftovers;
mod prepare;
pub mod quota;
pub mod reader;
pub mod store;
mod touch;

use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::runtime::{Builder, Handle, Runtime};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::sleep;

use crate::pool::Pool;
use crate::problem::{Kind, Problem};
use crate::scenes::Scenes;
use crate::times::Times;
use crate::wire::stored::{StoreEntry, StoredScene};

pub use content::Id;
pub use entry::built_in;
pub use quota::Quota;
pub use store::{Store, StoreError};

use entry::{Entry, State};

/// How often the place is looked at without being asked to.
const LOOK_AGAIN: Duration = Duration::from_secs(10);

/// The thread in the background that reads, writes and waits. It ends when this is dropped.
pub struct Background(Option<Runtime>);

impl Background {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the system gives none.
    pub fn start() -> io::Result<Self> {
        let runtime = Builder::new_multi_thread().worker_threads(1).thread_name("scenes").enable_all().build()?;
        Ok(Self(Some(runtime)))
    }

    /// What puts work on it; `None` never happens before the drop.
    pub fn handle(&self) -> Option<Handle> {
        self.0.as_ref().map(|runtime| runtime.handle().clone())
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        if let Some(runtime) = self.0.take() {
            // Waiting for it is not possible where a runtime drops this.
            runtime.shutdown_background();
        }
    }
}

/// The stored scenes of a service.
pub struct Library {
    store: Store,
    quota: Quota,
    background: Handle,
    scenes: Arc<Scenes>,
    pool: Arc<Pool>,
    times: Arc<Times>,
    entries: Mutex<BTreeMap<Id, Entry>>,
    /// Held while the place is compared with what is known, and while it is written to.
    changing: tokio::sync::Mutex<()>,
    to_prepare: UnboundedSender<Id>,
}

impl Library {
    /// Looks at what is stored and begins to prepare it.
    pub fn start(
        store: Store,
        quota: Quota,
        background: Handle,
        (scenes, pool, times): (Arc<Scenes>, Arc<Pool>, Arc<Times>),
    ) -> Arc<Self> {
        let (to_prepare, waiting) = unbounded_channel();
        let library = Arc::new(Self {
            store,
            quota,
            background: background.clone(),
            scenes,
            pool,
            times,
            entries: Mutex::default(),
            changing: tokio::sync::Mutex::default(),
            to_prepare,
        });
        background.spawn(prepare_each(Arc::clone(&library), waiting));
        background.spawn(look_again(Arc::clone(&library)));
        library
    }

    /// Keeps a content, unless it is there; says what is known of it and whether it is new.
    ///
    /// # Errors
    /// [`Kind::SceneTooLarge`], [`Kind::StoreFull`], [`Kind::StoreUnavailable`].
    pub async fn keep(self: &Arc<Self>, content: Vec<u8>) -> Result<(StoredScene, bool), Problem> {
        let library = Arc::clone(self);
        // Done to its end even when the caller goes.
        let kept = self.background.spawn(async move {
            let (id, bytes) = (Id::of(&content), content.len() as u64);
            library.quota.check_size(bytes)?;
            let _changing = library.changing.lock().await;
            let there = library.compare().await.map_err(problem)?;
            let is_there = there.iter().any(|(known, _)| *known == id);
            let is_corrupt = |entry: &Entry| matches!(entry.state, State::Corrupt(_));
            if is_there && !library.entries().get(&id).is_some_and(is_corrupt) {
                return Ok((library.told(id), false));
            }
            let others: Vec<u64> = there.iter().filter(|(known, _)| *known != id).map(|(_, bytes)| *bytes).collect();
            library.quota.check_room(bytes, &others)?;
            library.store.write(id, content).await.map_err(problem)?;
            library.begin(id, bytes);
            tracing::info!(%id, bytes, "a scene is stored");
            Ok::<_, Problem>((library.told(id), true))
        });
        let (told, is_new) = kept.await.map_err(Problem::internal)??;
        let told = told.ok_or_else(|| Problem::internal("a scene is gone that was just stored"))?;
        Ok((told, is_new))
    }

    /// What is stored, by id, and the place.
    pub async fn list(self: &Arc<Self>) -> (Vec<StoredScene>, StoreEntry) {
        let unavailable = self.look().await.err().map(|error| error.to_string());
        let entries = self.entries();
        let scenes = entries.iter().map(|(id, entry)| entry.told(*id, self.store.durable)).collect();
        let store = StoreEntry {
            durable: self.store.durable,
            scenes: entries.len(),
            bytes: entries.values().map(|entry| entry.bytes).sum(),
            most_scenes: self.quota.scenes,
            most_bytes_each: self.quota.each,
            most_bytes: self.quota.total,
            unavailable,
        };
        (scenes, store)
    }

    /// What is known of a scene; `None` where there is none.
    ///
    /// # Errors
    /// [`Kind::StoreUnavailable`].
    pub async fn get(self: &Arc<Self>, id: Id) -> Result<Option<StoredScene>, Problem> {
        if let Some(told) = self.told(id) {
            return Ok(Some(told));
        }
        // Another service may have stored it.
        self.look().await.map_err(problem)?;
        Ok(self.told(id))
    }

    /// Deletes a scene, and says whether it was there. Requests that are at work with it are answered.
    ///
    /// # Errors
    /// [`Kind::StoreUnavailable`].
    pub async fn delete(self: &Arc<Self>, id: Id) -> Result<bool, Problem> {
        let library = Arc::clone(self);
        let deleted = self.background.spawn(async move {
            let _changing = library.changing.lock().await;
            let was_there = library.store.remove(id).await.map_err(problem)?;
            library.forget(id);
            if was_there {
                tracing::info!(%id, "a scene is deleted");
            }
            Ok(was_there)
        });
        deleted.await.map_err(Problem::internal)?
    }

    fn told(&self, id: Id) -> Option<StoredScene> {
        self.entries().get(&id).map(|entry| entry.told(id, self.store.durable))
    }

    async fn look(self: &Arc<Self>) -> Result<(), StoreError> {
        let library = Arc::clone(self);
        let looked = self.background.spawn(async move {
            let _changing = library.changing.lock().await;
            library.compare().await.map(|_| ())
        });
        looked.await.map_err(|error| StoreError::Unavailable(error.to_string()))?
    }

    /// Holds what is known against the place: what is new there is prepared, what is gone is forgotten.
    async fn compare(&self) -> Result<Vec<(Id, u64)>, StoreError> {
        let there = self.store.list().await?;
        for (id, bytes) in &there {
            // Another size is another content, whoever wrote it.
            let known = self.entries().get(id).map(|entry| entry.bytes);
            if known != Some(*bytes) {
                self.begin(*id, *bytes);
            }
        }
        let is_gone = |id: &Id| !there.iter().any(|(known, _)| known == id);
        let gone: Vec<Id> = self.entries().keys().copied().filter(is_gone).collect();
        gone.into_iter().for_each(|id| self.forget(id));
        // A request may have brought one that was gone before anybody looked.
        self.scenes.forget_all_but(&there.iter().map(|(id, _)| *id).collect::<Vec<_>>());
        Ok(there)
    }

    fn begin(&self, id: Id, bytes: u64) {
        self.entries().insert(id, Entry::new(bytes));
        // The receiver lives as long as the background, and then nothing is prepared any more.
        let _ = self.to_prepare.send(id);
    }

    fn forget(&self, id: Id) {
        self.entries().remove(&id);
        self.scenes.forget(id);
    }

    /// Tells how far a scene is, unless it was deleted meanwhile.
    fn tell(&self, id: Id, change: impl FnOnce(&mut Entry)) {
        if let Some(entry) = self.entries().get_mut(&id) {
            change(entry);
        }
    }

    fn entries(&self) -> MutexGuard<'_, BTreeMap<Id, Entry>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

async fn look_again(library: Arc<Library>) {
    loop {
        if let Err(error) = library.look().await {
            tracing::warn!(%error, "the place of the stored scenes does not answer");
        }
        sleep(LOOK_AGAIN).await;
    }
}

async fn prepare_each(library: Arc<Library>, mut waiting: UnboundedReceiver<Id>) {
    while let Some(id) = waiting.recv().await {
        if library.entries().contains_key(&id) {
            prepare::prepare(&library, id).await;
        }
    }
}

/// What the caller is told of a place that did not do what it should; the cause stays in the log.
fn problem(error: StoreError) -> Problem {
    tracing::error!(%error, "stored scenes");
    match error {
        StoreError::Full => Problem::new(Kind::StoreFull, "No room is left where scenes are kept; nothing was stored."),
        StoreError::Unavailable(_) => {
            Problem::new(Kind::StoreUnavailable, "The place where scenes are kept does not answer as it should.")
        }
    }
}
