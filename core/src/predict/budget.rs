//! Which level keeps a promise: an error, a time, or both.

use super::expected_error::{ExpectedError, Situation};
use super::types::{Level, PredictError};

/// The level of a request that asks for none and promises nothing.
pub const DEFAULT_LEVEL: Level = Level::Coarse;

/// What a request wants to be true of its answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Largest error of the worst node, kept in 95 of 100 requests (µm).
    pub max_error_um: Option<f64>,
    /// Longest time (ms).
    pub max_time_ms: Option<f64>,
    /// The level that answers whatever the promises say.
    pub level: Option<Level>,
    /// A promise that cannot be kept is an error, and not a warning with the best there is.
    pub strict: bool,
}

/// How long each level is known to take, one request in a hundred longer (ms), in the order of [`Level::ALL`].
pub type LevelTimes = [f64; Level::ALL.len()];

/// The level chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// It.
    pub level: Level,
    /// Promises that it is not expected to keep.
    pub broken: Vec<String>,
}

impl Budget {
    /// Whether anything is promised.
    pub fn promises(&self) -> bool {
        self.max_error_um.is_some() || self.max_time_ms.is_some()
    }

    /// The cheapest level that keeps every promise; the most accurate one in time where only a time is given.
    ///
    /// # Errors
    /// [`PredictError::Budget`] where no level keeps the promises and the budget is strict.
    pub fn choose(&self, situation: &Situation, times_ms: &LevelTimes) -> Result<Choice, PredictError> {
        let all =
            || Level::ALL.into_iter().zip(*times_ms).map(|(level, ms)| (level, ms, situation.expected_error(level)));
        let entries = || all().filter(|(level, ..)| situation.has(*level));
        let in_time = |ms: f64| self.max_time_ms.is_none_or(|most| ms <= most);
        let exact = |error: &ExpectedError| self.max_error_um.is_none_or(|most| error.p95_um <= most);
        // Of two that are equally good, or of neither of which anything is known, the dearer.
        let best_in_time = || {
            let in_time = entries().filter(|(_, ms, _)| in_time(*ms));
            in_time.reduce(|best, next| if next.2.p95_um <= best.2.p95_um { next } else { best })
        };
        let cheapest = || entries().next();
        let (level, ms, error) = match (self.level, self.max_error_um, self.max_time_ms) {
            (Some(level), ..) => all().find(|(entry, ..)| *entry == level),
            (None, None, None) => entries().find(|(entry, ..)| *entry == DEFAULT_LEVEL),
            (None, None, Some(_)) => best_in_time().or_else(cheapest),
            (None, Some(_), _) => {
                entries().find(|(_, ms, error)| in_time(*ms) && exact(error)).or_else(best_in_time).or_else(cheapest)
            }
        }
        .unwrap_or((DEFAULT_LEVEL, f64::INFINITY, situation.expected_error(DEFAULT_LEVEL)));
        let mut broken = Vec::new();
        if let Some(most) = self.max_error_um.filter(|_| !exact(&error)) {
            let why = if error.p95_um.is_finite() {
                format!("is expected to err by up to {:.2} µm (95 %), more than the {most} µm asked for", error.p95_um)
            } else {
                format!("has no measured error here, so the {most} µm asked for cannot be promised")
            };
            broken.push(format!("level `{}` {why}", level.name()));
        }
        if let Some(most) = self.max_time_ms.filter(|_| !in_time(ms)) {
            broken.push(format!(
                "level `{}` is expected to take {ms:.3} ms, more than the {most} ms asked for",
                level.name()
            ));
        }
        if self.strict && !broken.is_empty() {
            return Err(PredictError::Budget { problem: broken.join("; ") });
        }
        Ok(Choice { level, broken })
    }
}
