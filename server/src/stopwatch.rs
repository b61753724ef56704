//! The server's side of a computation's progress: how long each stage takes, and when to stop.
//!
//! The core names its stages and knows no clock; this is the clock.

use std::time::{Duration, Instant};

use retina_core::progress::Progress;

/// Times stages; asks for a stop when nobody waits for the answer or the time is up.
pub struct Stopwatch<'a> {
    stages: Vec<(&'static str, f64)>,
    current: &'static str,
    since: Instant,
    deadline: Instant,
    abandoned: &'a dyn Fn() -> bool,
}

impl<'a> Stopwatch<'a> {
    /// Starts at the end of a wait in the queue that began at `accepted`, with the stage `read`.
    pub fn start(accepted: Instant, limit: Duration, abandoned: &'a dyn Fn() -> bool) -> Self {
        let now = Instant::now();
        Self {
            stages: vec![("queue", micros(now - accepted))],
            current: "read",
            since: now,
            deadline: now + limit,
            abandoned,
        }
    }

    /// Ends the last stage; the stages so far with their times, µs.
    pub fn finish(&mut self) -> &[(&'static str, f64)] {
        self.lap();
        &self.stages
    }

    /// A stage that comes again adds to its first time.
    fn lap(&mut self) {
        let now = Instant::now();
        let time_us = micros(now - self.since);
        self.since = now;
        match self
            .stages
            .iter_mut()
            .find(|(name, _)| *name == self.current)
        {
            Some((_, total)) => *total += time_us,
            None => self.stages.push((self.current, time_us)),
        }
    }
}

impl Progress for Stopwatch<'_> {
    fn stage(&mut self, name: &'static str) {
        self.lap();
        self.current = name;
    }

    fn interrupted(&mut self) -> bool {
        (self.abandoned)() || Instant::now() >= self.deadline
    }
}

fn micros(duration: Duration) -> f64 {
    duration.as_nanos() as f64 * 1e-3
}
