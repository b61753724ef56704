//! Where a recording goes, and what may be wrong with it.

use std::error::Error;
use std::fmt::{self, Display, Formatter};
use std::path::PathBuf;

use thiserror::Error;

/// Where a recording goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// A file that `rerun FILE.rrd` opens; what was in it is lost.
    File(PathBuf),
    /// A running viewer, as `rerun+http://127.0.0.1:9876/proxy`.
    Viewer(String),
}

impl Display for Destination {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Destination::File(path) => write!(formatter, "{}", path.display()),
            Destination::Viewer(url) => write!(formatter, "{url}"),
        }
    }
}

/// Why nothing is recorded.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The program was built without its recorder.
    #[error(
        "this program was built without its recorder, which takes some minutes more to build; \
         build it with `cargo build --release --features rerun`"
    )]
    NotBuilt,
    /// The destination cannot be used.
    #[error("cannot record to {destination}: {cause}")]
    Open {
        /// Where to.
        destination: Destination,
        /// What is wrong with it.
        cause: Box<dyn Error + Send + Sync>,
    },
    /// Something could not be written.
    #[error("cannot write to the recording: {0}")]
    Write(Box<dyn Error + Send + Sync>),
    /// What was written did not all arrive.
    #[error("the recording is not complete: {0}")]
    Close(Box<dyn Error + Send + Sync>),
    /// The thread that writes could not be started.
    #[error("no thread for the recording: {0}")]
    Thread(std::io::Error),
}
