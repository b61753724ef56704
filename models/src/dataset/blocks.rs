//! Finished work on disk: blocks of consecutive paths, each a shard with a record beside it.
//!
//! The record is written after the samples and says how each path ended; a block without one was not finished and is computed again. So a run
//! that is killed loses what its threads were at, and nothing else.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::error::DatasetError;
use super::path::PathOutcome;
use crate::sample::Sample;
use crate::shard;

/// Paths of a block.
pub const PATHS_PER_BLOCK: u32 = 8;

/// How a path ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathRecord {
    /// Its number.
    pub path: u32,
    /// Samples that it gave.
    pub samples: usize,
    /// Name of the cause that ended it early.
    pub ended_by: Option<String>,
    /// Newton iterations of its truth.
    pub iterations: usize,
}

/// What is beside a block's samples.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockRecord {
    /// Its paths.
    pub paths: Vec<PathRecord>,
    /// SHA-256 of the samples' file; `None` if there are no samples.
    pub sha256: Option<String>,
}

/// A folder of blocks.
pub struct Blocks {
    folder: PathBuf,
}

impl Blocks {
    /// The blocks in `folder`, which is made.
    ///
    /// # Errors
    /// [`DatasetError::Io`].
    pub fn open(folder: &Path) -> Result<Self, DatasetError> {
        std::fs::create_dir_all(folder).map_err(DatasetError::io(folder))?;
        Ok(Blocks { folder: folder.to_owned() })
    }

    fn samples_file(&self, block: u32) -> PathBuf {
        self.folder.join(format!("block-{block:05}.safetensors"))
    }

    fn record_file(&self, block: u32) -> PathBuf {
        self.folder.join(format!("block-{block:05}.json"))
    }

    /// Keeps the finished paths of `block`.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn keep(&self, block: u32, outcomes: &[(u32, PathOutcome)]) -> Result<(), DatasetError> {
        let samples: Vec<Sample> = outcomes.iter().flat_map(|(_, outcome)| outcome.samples.iter().copied()).collect();
        let file = self.samples_file(block);
        let mut sha256 = None;
        if !samples.is_empty() {
            shard::write(&file, &samples)?;
            sha256 = Some(file_hash(&file)?);
        }
        let paths = outcomes
            .iter()
            .map(|(path, outcome)| PathRecord {
                path: *path,
                samples: outcome.samples.len(),
                ended_by: outcome.ended_by.map(|cause| cause.name().to_owned()),
                iterations: outcome.iterations,
            })
            .collect();
        write_json(&self.record_file(block), &BlockRecord { paths, sha256 })
    }

    /// The record of `block` if it is finished, with just the paths `from` to `to` (exclusive).
    ///
    /// # Errors
    /// [`DatasetError::Malformed`] for a record that is none.
    pub fn record(&self, block: u32, from: u32, to: u32) -> Result<Option<BlockRecord>, DatasetError> {
        let file = self.record_file(block);
        let record: BlockRecord = match read_json(&file)? {
            Some(record) => record,
            None => return Ok(None),
        };
        Ok(record.paths.iter().map(|path| path.path).eq(from..to).then_some(record))
    }

    /// The samples of a finished block.
    ///
    /// # Errors
    /// [`DatasetError::Malformed`] if the file is not the one that was finished.
    pub fn samples(&self, block: u32, record: &BlockRecord) -> Result<Vec<Sample>, DatasetError> {
        let Some(sha256) = &record.sha256 else { return Ok(Vec::new()) };
        let file = self.samples_file(block);
        let found = file_hash(&file)?;
        if found != *sha256 {
            let problem = format!(
                "its SHA-256 is {found}, not {sha256} as when it was finished: delete it and its record, and it is made again"
            );
            return Err(DatasetError::malformed(&file, problem));
        }
        Ok(shard::read(&file)?)
    }
}

/// SHA-256 of a file, in hexadecimal digits.
///
/// # Errors
/// [`DatasetError::Io`].
pub fn file_hash(file: &Path) -> Result<String, DatasetError> {
    let bytes = std::fs::read(file).map_err(DatasetError::io(file))?;
    Ok(Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Writes `value` to `file`, whole or not at all.
///
/// # Errors
/// [`DatasetError`].
pub fn write_json(file: &Path, value: &impl Serialize) -> Result<(), DatasetError> {
    let text = serde_json::to_string_pretty(value).map_err(|error| DatasetError::malformed(file, error))?;
    let unfinished = file.with_extension("json-unfinished");
    std::fs::write(&unfinished, text + "\n").map_err(DatasetError::io(&unfinished))?;
    std::fs::rename(&unfinished, file).map_err(DatasetError::io(file))
}

/// The value in `file`; `None` if there is no such file.
///
/// # Errors
/// [`DatasetError`].
pub fn read_json<T: for<'a> Deserialize<'a>>(file: &Path) -> Result<Option<T>, DatasetError> {
    let text = match std::fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(DatasetError::io(file)(error)),
    };
    serde_json::from_str(&text).map(Some).map_err(|error| DatasetError::malformed(file, error))
}
