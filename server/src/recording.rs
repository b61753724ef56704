//! Recordings for the rerun viewer: of a running service, and of reviews.
//!
//! Contract: recording is a guest. An answer is the same bits with and without it, never waits for it and never fails because of it;
//! what it cannot keep up with is dropped and counted. Without the cargo feature `rerun` nothing can be recorded, and whoever asks
//! for it is told how to get it.
//!
//! Read `recorder` (the queue and its thread), then `entities` (what is written where, in which unit, on which timeline), `layout`
//! (what the viewer shows when it opens). Not here: which requests a review asks (`review`).

mod destination;
mod recorder;

#[cfg(feature = "rerun")]
mod colours;
#[cfg(feature = "rerun")]
pub mod entities;
#[cfg(feature = "rerun")]
mod layout;
#[cfg(feature = "rerun")]
pub mod needle_mesh;
#[cfg(feature = "rerun")]
mod request_text;
#[cfg(feature = "rerun")]
mod shapes;
#[cfg(feature = "rerun")]
mod stream;

pub use destination::{Destination, RecordingError};
pub use recorder::{Exchange, QUEUE, Recorder, Sink, Totals};

/// Starts to record a service.
///
/// # Errors
/// [`RecordingError::NotBuilt`] without the cargo feature `rerun`, [`RecordingError::Open`] if the destination cannot be used.
pub fn start(destination: &Destination) -> Result<Recorder, RecordingError> {
    #[cfg(feature = "rerun")]
    return Recorder::start(entities::ServiceLog::open(destination)?, QUEUE);
    #[cfg(not(feature = "rerun"))]
    {
        let _ = destination;
        Err(RecordingError::NotBuilt)
    }
}
