//! The server's side of a computation's progress: how long each stage takes, and when to stop.
//!
//! The core names its stages and knows no clock; this is the clock.

use std::time::{Duration, Instant};

use retina_core::progress::Progress;

/// Times stages; asks for a stop when nobody waits for the answer or the time is up.
pub struct Stopwatch<'a> {
    stages: Vec<(&'static str, Duration)>,
    current: &'static str,
    since: Instant,
    deadline: Instant,
    abandoned: &'a dyn Fn() -> bool,
}

impl<'a> Stopwatch<'a> {
    /// Starts at the end of a wait in the queue that began at `accepted`, with the stage `read`.
    pub fn start(accepted: Instant, limit: Duration, abandoned: &'a dyn Fn() -> bool) -> Self {
        let now = Instant::now();
        Self { stages: vec![("queue", now - accepted)], current: "read", since: now, deadline: now + limit, abandoned }
    }

    /// Time since the request was accepted.
    pub fn elapsed(&self) -> Duration {
        self.stages.iter().map(|(_, time)| *time).sum::<Duration>() + self.since.elapsed()
    }

    /// Ends the last stage; the stages so far with their times.
    pub fn finish(&mut self) -> &[(&'static str, Duration)] {
        self.lap();
        &self.stages
    }

    /// The stages that have ended.
    pub fn stages(&self) -> &[(&'static str, Duration)] {
        &self.stages
    }

    /// Ends the last stage; gives the stages so far away and goes on with `next`.
    pub fn take(&mut self, next: &'static str) -> Vec<(&'static str, Duration)> {
        self.lap();
        self.current = next;
        std::mem::take(&mut self.stages)
    }

    /// A stage that comes again adds to its first time.
    fn lap(&mut self) {
        let now = Instant::now();
        let time = now - self.since;
        self.since = now;
        match self.stages.iter_mut().find(|(name, _)| *name == self.current) {
            Some((_, total)) => *total += time,
            None => self.stages.push((self.current, time)),
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
