//! Where the contents of scenes lie: in memory, in a folder, or in an object store that several machines share.
//!
//! Contract: a content is there whole or not at all, whenever the program or the machine stops: in a folder it is written beside its place, brought to
//! the disk and then renamed. What the place holds besides contents is not touched. Every call ends within `PATIENCE`.
//!
//! Not here: what the contents mean (`content`), how many there may be (`quota`).

use std::error::Error;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt as _;
use object_store::local::LocalFileSystem;
use object_store::memory::InMemory;
use object_store::path::Path as Key;
use object_store::{ObjectStore, ObjectStoreExt as _};
use thiserror::Error;
use tokio::time::timeout;

use super::content::Id;
use super::leftovers;

/// How long a call may take.
const PATIENCE: Duration = Duration::from_secs(10);

/// Ending of the names of contents.
const ENDING: &str = ".json";

/// Why a place did not do what it should.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StoreError {
    /// No room is left where the scenes are kept.
    #[error("no room is left where scenes are kept")]
    Full,
    /// It cannot be opened, read or written.
    #[error("{0}")]
    Unavailable(String),
}

/// A place for contents.
#[derive(Clone)]
pub struct Store {
    objects: Arc<dyn ObjectStore>,
    below: Key,
    /// Whether contents outlive the program.
    pub durable: bool,
}

impl Store {
    /// Contents are kept as long as the program runs.
    pub fn in_memory() -> Self {
        Self { objects: Arc::new(InMemory::new()), below: Key::default(), durable: false }
    }

    /// The place that a setting names: a folder, or a URL such as `s3://bucket/scenes`, of which variables such as `AWS_ENDPOINT_URL` and
    /// `AWS_ACCESS_KEY_ID` say the rest; others are passed over.
    ///
    /// # Errors
    /// [`StoreError::Unavailable`] with what is wrong.
    pub fn open(place: &str, variables: impl Iterator<Item = (String, String)>) -> Result<Self, StoreError> {
        let unusable = |reason: String| StoreError::Unavailable(format!("{place}: {reason}"));
        if !place.contains("://") {
            return folder(Path::new(place)).map_err(|error| unusable(error.to_string()));
        }
        let url = url::Url::parse(place).map_err(|error| unusable(error.to_string()))?;
        if url.scheme() == "file" {
            let path = url.to_file_path().map_err(|()| unusable("not the path of a folder".to_owned()))?;
            return folder(&path).map_err(|error| unusable(error.to_string()));
        }
        let (objects, below) = object_store::parse_url_opts(&url, variables).map_err(|error| {
            let hint = if cfg!(feature = "s3") { "" } else { "; for s3:// build with the cargo feature `s3`" };
            unusable(format!("{}{hint}", whole(&error)))
        })?;
        let durable = url.scheme() != "memory";
        Ok(Self { objects: Arc::from(objects), below, durable })
    }

    /// Any other place.
    pub fn of(objects: Arc<dyn ObjectStore>, durable: bool) -> Self {
        Self { objects, below: Key::default(), durable }
    }

    fn key(&self, id: Id) -> Key {
        self.below.clone().join(format!("{id}{ENDING}"))
    }

    /// The contents that there are, with their sizes in bytes.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn list(&self) -> Result<Vec<(Id, u64)>, StoreError> {
        let listed = self.objects.list_with_delimiter(Some(&self.below));
        let listed = within(listed).await?;
        let id = |key: &Key| Id::parse(key.filename()?.strip_suffix(ENDING)?);
        Ok(listed.objects.iter().filter_map(|object| Some((id(&object.location)?, object.size))).collect())
    }

    /// The content of that name; `None` where there is none.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn read(&self, id: Id) -> Result<Option<Vec<u8>>, StoreError> {
        let content = async {
            let pieces: Vec<_> = self.objects.get(&self.key(id)).await?.into_stream().try_collect().await?;
            Ok(pieces.concat())
        };
        match within(content).await {
            Err(Failure::Missing) => Ok(None),
            content => Ok(Some(content?)),
        }
    }

    /// Puts a content in its place.
    ///
    /// # Errors
    /// [`StoreError`]; then it is not there.
    pub async fn write(&self, id: Id, content: Vec<u8>) -> Result<(), StoreError> {
        within(self.objects.put(&self.key(id), content.into())).await.map(|_| ()).map_err(StoreError::from)
    }

    /// Takes a content away, and says whether it was there.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn remove(&self, id: Id) -> Result<bool, StoreError> {
        let key = self.key(id);
        // An object store takes away what is not there without a word.
        match within(self.objects.head(&key)).await {
            Err(Failure::Missing) => return Ok(false),
            there => there.map(|_| ())?,
        }
        match within(self.objects.delete(&key)).await {
            Err(Failure::Missing) => Ok(false),
            removed => removed.map(|()| true).map_err(StoreError::from),
        }
    }
}

fn folder(path: &Path) -> io::Result<Store> {
    std::fs::create_dir_all(path)?;
    let path: PathBuf = path.canonicalize()?;
    leftovers::remove(&path);
    let objects = LocalFileSystem::new_with_prefix(&path).map_err(io::Error::other)?.with_fsync(true);
    Ok(Store { objects: Arc::new(objects), below: Key::default(), durable: true })
}

enum Failure {
    Missing,
    Other(StoreError),
}

impl From<Failure> for StoreError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Missing => Self::Unavailable("what was there is gone".to_owned()),
            Failure::Other(error) => error,
        }
    }
}

async fn within<T>(call: impl Future<Output = object_store::Result<T>>) -> Result<T, Failure> {
    let unavailable = |reason: String| Failure::Other(StoreError::Unavailable(reason));
    match timeout(PATIENCE, call).await {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(object_store::Error::NotFound { .. })) => Err(Failure::Missing),
        Ok(Err(error)) if is_full(&error) => Err(Failure::Other(StoreError::Full)),
        Ok(Err(error)) => Err(unavailable(whole(&error))),
        Err(_) => Err(unavailable(format!("no answer within {} s", PATIENCE.as_secs()))),
    }
}

/// An error and its causes, outermost first.
fn causes<'a>(error: &'a (dyn Error + 'static)) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    std::iter::successors(Some(error), |error: &&'a (dyn Error + 'static)| (*error).source())
}

fn is_full(error: &(dyn Error + 'static)) -> bool {
    let full = |kind| matches!(kind, ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge);
    causes(error).filter_map(|cause| cause.downcast_ref::<io::Error>()).any(|cause| full(cause.kind()))
}

fn whole(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    for cause in causes(error).skip(1).map(ToString::to_string) {
        // Many errors repeat their cause.
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}
