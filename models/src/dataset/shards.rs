//! The samples by split: shards of a few hundred, filled in the order of the paths.
//!
//! A shard ends with the path that fills it, so no path lies in two. The last shard of each split is written too, and again as it grows: what is on disk
//! can be used at any time.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::blocks::file_hash;
use super::error::DatasetError;
use crate::sample::{Sample, Split};
use crate::shard;

/// Samples after which a shard is full.
pub const SAMPLES_PER_SHARD: usize = 500;

/// A shard, as the manifest lists it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardRecord {
    /// File name beside the manifest.
    pub file: String,
    /// Name of its split.
    pub split: String,
    /// Samples in it.
    pub samples: usize,
    /// SHA-256 of the file.
    pub sha256: String,
}

/// The shard of a split that is being filled.
#[derive(Default)]
struct Open {
    number: usize,
    samples: Vec<Sample>,
    written: usize,
}

/// The shards of a data set, being written.
pub struct Shards {
    folder: PathBuf,
    open: [Open; Split::ALL.len()],
    records: Vec<ShardRecord>,
}

impl Shards {
    /// New shards in `folder`; those that are there are replaced by the same.
    pub fn new(folder: &Path) -> Self {
        Shards { folder: folder.to_owned(), open: Default::default(), records: Vec::new() }
    }

    /// Adds the samples of paths that are finished whole, in their order.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn add(&mut self, samples: &[Sample]) -> Result<(), DatasetError> {
        for path in samples.chunk_by(|a, b| a.path == b.path) {
            let split = path[0].split as usize;
            self.open[split].samples.extend_from_slice(path);
            if self.open[split].samples.len() >= SAMPLES_PER_SHARD {
                self.write(split)?;
                self.open[split] = Open { number: self.open[split].number + 1, ..Open::default() };
            }
        }
        Ok(())
    }

    /// Writes what is not yet on disk, and lists all shards.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn flush(&mut self) -> Result<Vec<ShardRecord>, DatasetError> {
        for split in 0..self.open.len() {
            if self.open[split].samples.len() > self.open[split].written {
                self.write(split)?;
            }
        }
        let mut records = self.records.clone();
        records.sort_by(|a, b| a.file.cmp(&b.file));
        Ok(records)
    }

    fn write(&mut self, split: usize) -> Result<(), DatasetError> {
        let name = Split::ALL[split].name();
        let open = &mut self.open[split];
        let file = format!("{name}-{:03}.safetensors", open.number);
        let path = self.folder.join(&file);
        shard::write(&path, &open.samples)?;
        open.written = open.samples.len();
        let record =
            ShardRecord { file, split: name.to_owned(), samples: open.samples.len(), sha256: file_hash(&path)? };
        self.records.retain(|known| known.file != record.file);
        self.records.push(record);
        Ok(())
    }
}
