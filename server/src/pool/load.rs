//! What waits and what is at work, and how long a job that comes now would wait.

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::gauge::Gauge;

use super::Ticket;

/// How much the last job counts in the ratio of times to expectations.
const NEWEST_SHARE: f64 = 0.05;

/// Bounds of that ratio.
const RATIO: (f64, f64) = (0.2, 10.0);

/// What waits and what is at work, kept by the threads.
pub struct Load {
    /// Jobs that wait.
    pub waiting: Gauge,
    /// Jobs that panicked.
    pub panics: Counter,
    began: Instant,
    /// Jobs that have come since the beginning.
    arrived: AtomicU64,
    waiting_cost_us: AtomicI64,
    /// What jobs took over what they were expected to take, a running mean; the bits of an f64.
    ratio: AtomicU64,
    /// When each thread is expected to be free, µs after the beginning; zero for one that is idle.
    busy_until_us: Vec<AtomicU64>,
}

impl Load {
    /// Nothing to do for so many threads.
    pub(super) fn new(threads: usize) -> Self {
        Self {
            waiting: Gauge::default(),
            panics: Counter::default(),
            began: Instant::now(),
            arrived: AtomicU64::new(0),
            waiting_cost_us: AtomicI64::new(0),
            ratio: AtomicU64::new(1f64.to_bits()),
            busy_until_us: (0..threads).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    fn now_us(&self) -> u64 {
        // Never zero, which stands for an idle thread.
        self.began.elapsed().as_micros() as u64 + 1
    }

    /// How long a job that comes now is expected to wait: what is waiting and what is left of the work, over the threads.
    pub fn expected_wait(&self) -> Duration {
        let now_us = self.now_us();
        let mut left_us = 0;
        for until in &self.busy_until_us {
            match until.load(Ordering::Relaxed) {
                0 if self.waiting.get() == 0 => return Duration::ZERO,
                until_us => left_us += until_us.saturating_sub(now_us),
            }
        }
        let waiting_us = self.waiting_cost_us.load(Ordering::Relaxed).max(0) as u64;
        let waiting_us = (waiting_us as f64 * self.ratio()) as u64;
        Duration::from_micros((left_us + waiting_us) / self.busy_until_us.len() as u64)
    }

    /// Jobs that have come since the beginning.
    pub fn arrived(&self) -> u64 {
        self.arrived.load(Ordering::Relaxed)
    }

    /// Whether no job waits and none is at work.
    pub fn is_idle(&self) -> bool {
        self.waiting.get() == 0 && self.busy_until_us.iter().all(|until| until.load(Ordering::Relaxed) == 0)
    }

    fn ratio(&self) -> f64 {
        f64::from_bits(self.ratio.load(Ordering::Relaxed))
    }

    /// A job that was expected to take `cost` took `time`. Two threads that tell at once may lose one of both, which is as good.
    pub(super) fn took(&self, cost: Duration, time: Duration) {
        if cost > Duration::ZERO {
            let ratio = (time.as_secs_f64() / cost.as_secs_f64()).clamp(RATIO.0, RATIO.1);
            let mean = self.ratio() + NEWEST_SHARE * (ratio - self.ratio());
            self.ratio.store(mean.to_bits(), Ordering::Relaxed);
        }
    }

    /// That thread begins the job of a ticket.
    pub(super) fn begun(&self, thread: usize, ticket: Ticket) {
        let until_us = self.now_us() + (ticket.cost.as_micros() as f64 * self.ratio()) as u64;
        self.busy_until_us[thread].store(until_us, Ordering::Relaxed);
    }

    /// That thread has nothing to do.
    pub(super) fn idle(&self, thread: usize) {
        self.busy_until_us[thread].store(0, Ordering::Relaxed);
    }

    /// A job has come to the queue (`sign` 1), or has left it (-1).
    pub(super) fn queued(&self, ticket: Ticket, sign: i64) {
        if sign > 0 {
            self.arrived.fetch_add(1, Ordering::Relaxed);
        }
        self.waiting.inc_by(sign);
        self.waiting_cost_us.fetch_add(sign * ticket.cost.as_micros() as i64, Ordering::Relaxed);
    }
}
