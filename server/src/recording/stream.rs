//! A stream of rerun's that goes to a destination and opens in a layout.

use std::error::Error;
use std::time::Duration;

use rerun::{RecordingStream, RecordingStreamBuilder};

use super::layout::Layout;
use super::{Destination, RecordingError};

/// How long a viewer may take to receive what is on its way.
const CLOSE_PATIENCE: Duration = Duration::from_secs(8);

/// Opens `destination` for an application of this name, whose recordings share a layout.
///
/// # Errors
/// [`RecordingError::Open`].
pub fn open(
    destination: &Destination,
    application: &'static str,
    layout: Layout,
) -> Result<RecordingStream, RecordingError> {
    let refuse = |cause: Box<dyn Error + Send + Sync>| RecordingError::Open { destination: destination.clone(), cause };
    // Whoever asks for a recording gets it, whatever the environment variable RERUN says.
    let builder = RecordingStreamBuilder::new(application).enabled(true);
    let stream = match destination {
        Destination::File(path) => builder.save(path.as_path()),
        Destination::Viewer(url) => builder.connect_grpc_opts(url.as_str()),
    };
    let stream = stream.map_err(|error| refuse(error.into()))?;
    // The timelines are those that `entities` names, and no others.
    stream.set_log_tick_enabled(false);
    stream.set_log_time_enabled(false);
    layout.send(&stream, application).map_err(|error| refuse(error.into()))?;
    Ok(stream)
}

/// Waits until everything has arrived.
///
/// # Errors
/// [`RecordingError::Close`] if it has not, for instance because no viewer listens.
pub fn close(stream: &RecordingStream) -> Result<(), RecordingError> {
    stream.flush_with_timeout(CLOSE_PATIENCE).map_err(|error| RecordingError::Close(error.into()))
}
