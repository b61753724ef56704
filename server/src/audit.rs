//! Live audit: a sample of the answers is computed again at level `reference` while the service has nothing else to do, and what they were off by is held
//! against what they promised.
//!
//! Contract: never at the expense of an answer. One thread of its own, of the lowest priority, begins when no job waits or is at work and has not for
//! `QUIET`; when any job comes, it stops at the next iteration and begins again later. What it cannot keep up with is dropped and counted.
//!
//! Not here: what is counted (`metrics`), which level answers.

pub mod metrics;

use std::collections::VecDeque;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;
use retina_core::comparison::node_errors_um;
use retina_core::predict::expected_error::ExpectedError;
use retina_core::predict::{Level, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Progress;
use thread_priority::{ThreadPriority, set_current_thread_priority};

use crate::pool::Load;
use crate::recording::Recorder;
use metrics::{AuditMetrics, Outcome};

/// How long nothing must have come before an audit begins.
const QUIET: Duration = Duration::from_millis(50);

/// Answers that may wait to be audited; one more takes the place of the oldest.
const WAITING: usize = 32;

/// Times that one audit may be begun.
const MOST_TRIES: u32 = 20;

/// An answer with what led to it.
struct Sample {
    scene: Arc<PreparedScene>,
    request: Request,
    vertices: Vec<Point3<f64>>,
    promised: ExpectedError,
    tries: u32,
}

/// An answer that was computed again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Audited {
    /// The level that had answered.
    pub level: Level,
    /// How far its worst node was from that of `reference` (µm).
    pub measured_um: f64,
    /// What it had promised.
    pub promised: ExpectedError,
}

/// The audit of a service. Its thread ends when this is dropped.
pub struct Audit(Arc<Shared>);

struct Shared {
    /// Share of the answers that are audited.
    rate: f64,
    offered: AtomicU64,
    waiting: Mutex<VecDeque<Sample>>,
    news: Condvar,
    stop: AtomicBool,
    load: Arc<Load>,
    metrics: AuditMetrics,
    recorder: Option<Recorder>,
}

impl Audit {
    /// Starts the thread; `rate` of the answers, 0 to 1, are audited.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(rate: f64, load: Arc<Load>, metrics: AuditMetrics, recorder: Option<Recorder>) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            rate,
            offered: AtomicU64::new(0),
            waiting: Mutex::default(),
            news: Condvar::new(),
            stop: AtomicBool::new(false),
            load,
            metrics,
            recorder,
        });
        let working = Arc::clone(&shared);
        thread::Builder::new().name("audit".to_owned()).spawn(move || working.work())?;
        Ok(Self(shared))
    }

    /// Takes an answer into the sample, or not.
    pub fn offer(&self, scene: &Arc<PreparedScene>, request: &Request, prediction: &Prediction) {
        let shared = &self.0;
        if request.level == Level::Reference || !drawn(shared.offered.fetch_add(1, Ordering::Relaxed), shared.rate) {
            return;
        }
        let sample = Sample {
            scene: Arc::clone(scene),
            request: request.clone(),
            vertices: prediction.vertices.clone(),
            promised: prediction.expected_error,
            tries: 0,
        };
        shared.push(sample);
    }
}

impl Drop for Audit {
    fn drop(&mut self) {
        self.0.stop.store(true, Ordering::Relaxed);
        self.0.news.notify_all();
    }
}

/// Whether the `number`-th answer is drawn: a hash of the number (the finalizer of splitmix64), so that no rhythm of the requests meets one of the draws.
fn drawn(number: u64, rate: f64) -> bool {
    let mut hash = number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    hash ^= hash >> 31;
    // 53 bits are those of an f64.
    ((hash >> 11) as f64) < rate * (1u64 << 53) as f64
}

/// Stops a computation when a job comes.
struct UntilAJobComes<'a> {
    shared: &'a Shared,
    arrived: u64,
    interrupted: bool,
}

impl Progress for UntilAJobComes<'_> {
    fn stage(&mut self, _name: &'static str) {}

    fn interrupted(&mut self) -> bool {
        self.interrupted |= self.shared.load.arrived() != self.arrived || self.shared.stop.load(Ordering::Relaxed);
        self.interrupted
    }
}

impl Shared {
    fn push(&self, sample: Sample) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.push_back(sample);
        if waiting.len() > WAITING
            && let Some(oldest) = waiting.pop_front()
        {
            self.metrics.ended(oldest.request.level, Outcome::Overtaken);
        }
        drop(waiting);
        self.news.notify_one();
    }

    /// The newest sample; `None` at the end.
    fn next(&self) -> Option<Sample> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return None;
            }
            if let Some(sample) = waiting.pop_back() {
                return Some(sample);
            }
            waiting = self.news.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn work(&self) {
        if let Err(error) = set_current_thread_priority(ThreadPriority::Min) {
            tracing::debug!(?error, "the audit runs at the priority of the others");
        }
        let mut workspace = Workspace::default();
        while let Some(mut sample) = self.next() {
            let arrived = self.wait_for_quiet();
            let mut progress = UntilAJobComes { shared: self, arrived, interrupted: false };
            let level = sample.request.level;
            let request = Request { level: Level::Reference, ..sample.request.clone() };
            let truth = catch_unwind(AssertUnwindSafe(|| {
                sample.scene.predict(&request, &mut workspace, &mut progress).map(|truth| truth.vertices)
            }));
            match truth {
                Ok(Ok(truth)) => self.tell(&sample, &truth),
                Ok(Err(_)) if progress.interrupted => {
                    self.metrics.ended(level, Outcome::Interrupted);
                    sample.tries += 1;
                    if sample.tries < MOST_TRIES {
                        self.push(sample);
                    }
                }
                Ok(Err(error)) => {
                    tracing::info!(level = level.name(), %error, "an audited answer has no reference");
                    self.metrics.ended(level, Outcome::NoReference);
                }
                Err(_) => {
                    self.load.panics.inc();
                    workspace = Workspace::default();
                }
            }
        }
    }

    /// Waits until no job has come or been at work for a while; how many had come by then.
    fn wait_for_quiet(&self) -> u64 {
        loop {
            let arrived = self.load.arrived();
            thread::sleep(QUIET);
            let quiet = self.load.is_idle() && self.load.arrived() == arrived;
            if quiet || self.stop.load(Ordering::Relaxed) {
                return arrived;
            }
        }
    }

    fn tell(&self, sample: &Sample, truth: &[Point3<f64>]) {
        let measured_um = node_errors_um(&sample.vertices, truth).into_iter().fold(0.0, f64::max);
        let audited = Audited { level: sample.request.level, measured_um, promised: sample.promised };
        self.metrics.audited(&audited);
        if let Some(recorder) = &self.recorder {
            recorder.audited(audited);
        }
        tracing::debug!(
            level = audited.level.name(),
            measured_um,
            promised_p95_um = audited.promised.p95_um,
            "audited an answer"
        );
    }
}
