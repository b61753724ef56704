//! How long the levels take on this machine, as measured by the predictions themselves.
//!
//! A level is expected to take as long as the slowest of its last predictions, so that about one in a hundred takes longer. Until there
//! are enough of them, a generous first guess counts as one more, so that a promise made early is rather kept.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use retina_core::predict::Level;
use retina_core::predict::budget::LevelTimes;

/// Predictions of each level that are remembered.
const REMEMBERED: usize = 100;
/// Predictions of a level from which on the first guess is forgotten.
const ENOUGH: usize = 20;
/// First guesses, ms, in the order of [`Level::ALL`]; (unverified) about twice what a 2.5 GHz core takes.
const FIRST_GUESS_MS: LevelTimes = [0.3, 1.0, 25.0, 26.0, 10_000.0];

/// The last predictions' times.
#[derive(Debug, Default)]
pub struct Times {
    recent_ms: [Mutex<VecDeque<f64>>; Level::ALL.len()],
}

impl Times {
    /// Remembers one prediction.
    pub fn record(&self, level: Level, time: Duration) {
        let at = Level::ALL.iter().position(|known| *known == level);
        let Some(recent) = at.map(|at| &self.recent_ms[at]) else { return };
        let mut recent = recent.lock().unwrap_or_else(PoisonError::into_inner);
        if recent.len() == REMEMBERED {
            recent.pop_front();
        }
        recent.push_back(time.as_secs_f64() * 1e3);
    }

    /// What a prediction of that level takes on average.
    pub fn mean(&self, level: Level) -> Duration {
        let at = Level::ALL.iter().position(|known| *known == level).unwrap_or_default();
        let recent = self.recent_ms[at].lock().unwrap_or_else(PoisonError::into_inner);
        let mean_ms = match recent.len() {
            0 => FIRST_GUESS_MS[at],
            count => recent.iter().sum::<f64>() / count as f64,
        };
        Duration::from_secs_f64(mean_ms * 1e-3)
    }

    /// What each level is expected to take, ms.
    pub fn expected_ms(&self) -> LevelTimes {
        let mut expected = FIRST_GUESS_MS;
        for (expected, recent) in expected.iter_mut().zip(&self.recent_ms) {
            let recent = recent.lock().unwrap_or_else(PoisonError::into_inner);
            let slowest = recent.iter().copied().fold(0.0, f64::max);
            *expected = if recent.len() < ENOUGH { expected.max(slowest) } else { slowest };
        }
        expected
    }
}
