//! Folders of shards, read whole.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sha2::{Digest as _, Sha256};

use crate::sample::{Sample, Split};
use crate::shard::{self, ShardError};

/// Samples with the hash of the files that they came from.
pub struct Data {
    /// The samples, shard by shard in the order of their names.
    pub samples: Vec<Sample>,
    /// SHA-256 over names and bytes of the shards.
    pub sha256: String,
}

impl Data {
    /// Every shard of `folders`. Paths are numbered on from folder to folder.
    ///
    /// # Errors
    /// [`ShardError`]; a folder without shards is one.
    pub fn read(folders: &[PathBuf]) -> Result<Self, ShardError> {
        let mut digest = Sha256::new();
        let mut samples: Vec<Sample> = Vec::new();
        for folder in folders {
            let paths = shards(folder)?;
            for path in &paths {
                digest.update(path.file_name().unwrap_or_default().as_encoded_bytes());
                digest.update(std::fs::read(path).map_err(|cause| io(path, cause))?);
            }
            let read: Vec<Vec<Sample>> = paths.par_iter().map(|path| shard::read(path)).collect::<Result<_, _>>()?;
            let first = samples.iter().map(|sample| sample.path + 1).max().unwrap_or(0);
            samples.extend(read.into_iter().flatten().map(|sample| Sample { path: first + sample.path, ..sample }));
        }
        let sha256 = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Data { samples, sha256 })
    }

    /// The samples of a split.
    pub fn of(&self, split: Split) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(move |sample| sample.split == split)
    }
}

fn io(path: &Path, cause: std::io::Error) -> ShardError {
    ShardError::Io { path: path.display().to_string(), cause }
}

/// The shards of a folder in the order of their names.
fn shards(folder: &Path) -> Result<Vec<PathBuf>, ShardError> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .map_err(|cause| io(folder, cause))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "safetensors"))
        .collect();
    paths.sort();
    if paths.is_empty() {
        let cause = "there are no shards here".to_owned();
        return Err(ShardError::Format { path: folder.display().to_string(), cause });
    }
    Ok(paths)
}
