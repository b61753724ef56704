//! The record of a run, beside its weights: on what, from which seed, how it went.

use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::run::{Epoch, Settings};

/// See the module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Which network.
    pub network: String,
    /// Parameters that it has.
    pub parameters: usize,
    /// SHA-256 over the data set's shards.
    pub data_sha256: String,
    /// Samples of the training and of the validation split.
    pub samples: [usize; 2],
    /// The program's commit, if it is known.
    pub commit: Option<String>,
    /// How it was trained.
    pub settings: Settings,
    /// The epoch whose parameters were kept, from 0.
    pub best_epoch: usize,
    /// All epochs.
    pub curve: Vec<Epoch>,
}

/// The commit of the checkout that this package was built from, if Git knows it.
pub fn commit() -> Option<String> {
    let run = Command::new("git")
        .args(["rev-parse", "HEAD"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")))
        .output()
        .ok()?;
    let text = String::from_utf8(run.stdout).ok()?;
    run.status.success().then(|| text.trim().to_owned()).filter(|text| !text.is_empty())
}
