//! How a computation tells its caller where it stands, without knowing clocks or threads.

/// Receives stages; may ask to stop.
pub trait Progress {
    /// A named stage of the computation begins; the previous one ends.
    fn stage(&mut self, _name: &'static str) {}

    /// Whether the caller wants no answer any more. Asked once per Newton iteration.
    fn interrupted(&mut self) -> bool {
        false
    }
}

/// Tells nobody, never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}
