//! How long the levels take on this machine, as measured by the predictions themselves, and what an answer takes around its prediction.
//!
//! Each is expected to take as long as the slowest of the last, so that about one in a hundred takes longer. Until there
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
/// The same of what an answer takes around its prediction, ms.
const AROUND_GUESS_MS: f64 = 0.5;

/// The last predictions' times.
#[derive(Debug, Default)]
pub struct Times {
    recent_ms: [Recent; Level::ALL.len()],
    around_ms: Recent,
}

/// The last times of one kind (ms).
#[derive(Debug, Default)]
struct Recent(Mutex<VecDeque<f64>>);

impl Recent {
    fn record(&self, time: Duration) {
        let mut recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if recent.len() == REMEMBERED {
            recent.pop_front();
        }
        recent.push_back(time.as_secs_f64() * 1e3);
    }

    /// The mean, or the first guess before there is any.
    fn mean_ms(&self, first_guess_ms: f64) -> f64 {
        let recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match recent.len() {
            0 => first_guess_ms,
            count => recent.iter().sum::<f64>() / count as f64,
        }
    }

    /// The slowest, or the first guess where that is slower and there are not enough yet.
    fn slowest_ms(&self, first_guess_ms: f64) -> f64 {
        let recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let slowest = recent.iter().copied().fold(0.0, f64::max);
        if recent.len() < ENOUGH { first_guess_ms.max(slowest) } else { slowest }
    }
}

impl Times {
    /// Remembers one prediction.
    pub fn record(&self, level: Level, time: Duration) {
        if let Some(at) = Level::ALL.iter().position(|known| *known == level) {
            self.recent_ms[at].record(time);
        }
    }

    /// Remembers what an answer with a promise took besides waiting and its prediction: choosing the level, writing, handing over.
    pub fn record_around(&self, time: Duration) {
        self.around_ms.record(time);
    }

    /// What a prediction of that level takes on average.
    pub fn mean(&self, level: Level) -> Duration {
        let at = Level::ALL.iter().position(|known| *known == level).unwrap_or_default();
        Duration::from_secs_f64(self.recent_ms[at].mean_ms(FIRST_GUESS_MS[at]) * 1e-3)
    }

    /// What each level is expected to take, ms.
    pub fn expected_ms(&self) -> LevelTimes {
        std::array::from_fn(|at| self.recent_ms[at].slowest_ms(FIRST_GUESS_MS[at]))
    }

    /// What an answer with a promise is expected to take around its prediction, ms.
    pub fn around_ms(&self) -> f64 {
        self.around_ms.slowest_ms(AROUND_GUESS_MS)
    }
}
