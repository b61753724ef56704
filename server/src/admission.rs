//! Who is let in: what a request is expected to take and how long it can bear to wait, from a look at its body.
//!
//! Contract: a look costs microseconds, so it is done by the thread that talks, and bodies too long for that are not looked at; a body that is
//! not in order is taken for a usual request, and the numerical thread that reads it says what is wrong.

use std::time::Duration;

use retina_core::predict::Level;
use retina_core::predict::budget::{Budget, DEFAULT_LEVEL};
use serde::Deserialize;

use crate::pool::Ticket;
use crate::times::Times;
use crate::understand::MAX_TIME;

/// Longest body that is looked at, bytes.
const SHORT: usize = 16 << 10;

/// What it may take to hand a job to an idle thread while the machine is busy: a shorter promise is kept or broken by the level chosen, and is no
/// reason to refuse.
const HAND_OVER: Duration = Duration::from_millis(20);

/// The part of a request that is looked at.
#[derive(Default, Deserialize)]
struct Glance {
    accuracy: Option<Promise>,
}

#[derive(Default, Deserialize)]
struct Promise {
    level: Option<String>,
    max_time_ms: Option<f64>,
}

/// The ticket of the prediction in `body`, where a request may wait for `longest_wait`.
pub fn ticket(body: &[u8], times: &Times, longest_wait: Option<Duration>) -> Ticket {
    let short = (body.len() <= SHORT).then_some(body);
    let glance: Glance = short.and_then(|body| serde_json::from_slice(body).ok()).unwrap_or_default();
    let promise = glance.accuracy.unwrap_or_default();
    let named = |name: &String| Level::ALL.into_iter().find(|level| level.name() == name);
    let level = promise.level.as_ref().and_then(named);
    let budget = Budget { level, max_time_ms: promise.max_time_ms, ..Budget::default() };
    of_budget(&budget, times, longest_wait)
}

/// The ticket of a prediction that must keep `budget`, where it may wait for `longest_wait`.
pub fn of_budget(budget: &Budget, times: &Times, longest_wait: Option<Duration>) -> Ticket {
    let usual = times.mean(budget.level.unwrap_or(DEFAULT_LEVEL));
    let max_time = budget
        .max_time_ms
        .filter(|ms| (MAX_TIME.min..=MAX_TIME.max).contains(ms))
        .map(|ms| Duration::from_secs_f64(ms * 1e-3));
    Ticket {
        // Who asks for no level gets one that is in time.
        cost: if budget.level.is_none() { max_time.map_or(usual, |most| usual.min(most)) } else { usual },
        longest_wait: shorter(max_time.map(|time| time.max(HAND_OVER)), longest_wait),
    }
}

fn shorter(one: Option<Duration>, other: Option<Duration>) -> Option<Duration> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}
