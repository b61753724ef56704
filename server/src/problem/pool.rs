//! The threads' refusals, told to the caller.

use std::time::Duration;

use super::{Kind, Problem};
use crate::pool::PoolError;

impl From<PoolError> for Problem {
    fn from(error: PoolError) -> Self {
        match error {
            PoolError::Full(wait) => {
                let seconds = seconds(wait);
                let detail = format!("The queue of the numerical threads is full; try again in {}.", counted(seconds));
                Problem::new(Kind::Busy, detail).retry_after(seconds)
            }
            PoolError::TooLate(wait) => {
                let detail = format!(
                    "A numerical thread is not free for about {:.0} ms, and then the answer would be too late.",
                    wait.as_secs_f64() * 1e3
                );
                Problem::new(Kind::TooLate, detail).retry_after(seconds(wait))
            }
            PoolError::Panicked => Problem::internal(error),
        }
    }
}

fn counted(seconds: u32) -> String {
    if seconds == 1 { "a second".to_owned() } else { format!("{seconds} seconds") }
}

/// Whole seconds, at least one.
fn seconds(wait: Duration) -> u32 {
    wait.as_secs_f64().ceil().max(1.0) as u32
}
