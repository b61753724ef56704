//! Why a data set was not made or not read.

use std::path::Path;

use retina_core::predict::PredictError;
use thiserror::Error;

use crate::shard::ShardError;

/// Why a data set was not made or not read.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// The file system's word.
    #[error("{path}: {cause}")]
    Io {
        /// The file or folder.
        path: String,
        /// The cause.
        cause: std::io::Error,
    },
    /// A shard that is not one.
    #[error(transparent)]
    Shard(#[from] ShardError),
    /// A file that is not what it should be.
    #[error("{path}: {problem}")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        problem: String,
    },
    /// The folder holds a data set made otherwise.
    #[error(
        "{path} was made with {field} {found}, not {wanted}: choose another folder, or the settings that it was made with"
    )]
    OtherSettings {
        /// The manifest.
        path: String,
        /// The setting.
        field: &'static str,
        /// What the folder was made with.
        found: String,
        /// What was asked for.
        wanted: String,
    },
    /// A value that cannot be.
    #[error("{field} is {value}; allowed: {allowed}")]
    Value {
        /// The argument.
        field: &'static str,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// A scene could not be prepared.
    #[error(transparent)]
    Scene(#[from] PredictError),
}

impl DatasetError {
    /// The error of the file system at `path`.
    pub fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        move |cause| Self::Io { path: path.display().to_string(), cause }
    }

    /// A file whose content is wrong.
    pub fn malformed(path: &Path, problem: impl ToString) -> Self {
        Self::Malformed { path: path.display().to_string(), problem: problem.to_string() }
    }
}
