//! The threads' refusals, told to the caller.

use super::{Kind, Problem};
use crate::pool::PoolError;

impl From<PoolError> for Problem {
    fn from(error: PoolError) -> Self {
        match error {
            PoolError::Full => {
                Problem::new(Kind::Busy, "The queue of the numerical threads is full; try again in a second.")
            }
            PoolError::Panicked => Problem::internal(error),
        }
    }
}
