//! The queue between the threads that answer and the one that records.
//!
//! Contract: [`Recorder::record`] copies at most [`LONGEST_TEXT`] bytes, takes one place in a bounded queue or counts a drop, and
//! returns; what a sink does, be it slow, failing or panicking, is never seen by a request. Requests are numbered from 1 in the
//! order in which they are answered, dropped ones too, so a gap in a recording is a drop.
//!
//! Not here: what is written (`entities`).

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use retina_core::predict::{Prediction, Request};

use super::RecordingError;
use crate::answer::Answer;
use crate::audit::Audited;
use crate::problem::Problem;

/// Exchanges that may wait to be written: some megabytes.
pub const QUEUE: usize = 256;

/// Of a request's text no more than this is recorded, bytes: all of it but for scenes with meshes.
const LONGEST_TEXT: usize = 4096;

/// How long to wait before asking again for a place in the queue when the recording ends.
const RETRY: Duration = Duration::from_millis(5);

/// One request with what was answered.
#[derive(Debug)]
pub struct Exchange {
    /// Counted from 1, drops included.
    pub number: u64,
    /// When the request had arrived.
    pub arrived: SystemTime,
    /// From then until the answer was written, the wait in the queue included.
    pub took: Duration,
    /// The body of the request, cut where it is long; empty where it was not read.
    pub asked: String,
    /// The question and its answer, or the problem that the caller was told of.
    pub outcome: Result<(Request, Prediction), Problem>,
}

/// Writes exchanges somewhere. Runs on a thread of its own.
pub trait Sink: Send + 'static {
    /// Writes one exchange; `dropped` were lost up to now.
    ///
    /// # Errors
    /// If it could not be written.
    fn write(&mut self, exchange: &Exchange, dropped: u64) -> Result<(), RecordingError>;

    /// Writes what an audit found; a sink that has no place for it does nothing.
    ///
    /// # Errors
    /// If it could not be written.
    fn audited(&mut self, audited: &Audited) -> Result<(), RecordingError> {
        let _ = audited;
        Ok(())
    }

    /// Everything was written.
    ///
    /// # Errors
    /// If what was written did not arrive.
    fn close(&mut self) -> Result<(), RecordingError>;
}

/// What became of the exchanges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Exchanges that the sink took.
    pub written: u64,
    /// Exchanges that found the queue full, or the sink gone.
    pub dropped: u64,
    /// Exchanges that the sink could not write.
    pub failed: u64,
    /// Whether the sink closed in time and without an error.
    pub closed: bool,
}

enum Message {
    Exchange(Box<Exchange>),
    Audited(Audited),
    End,
}

#[derive(Default)]
struct Counters {
    answered: AtomicU64,
    written: AtomicU64,
    dropped: AtomicU64,
    failed: AtomicU64,
}

/// The recording, as seen from the threads that answer. Copies share one queue.
#[derive(Clone)]
pub struct Recorder {
    queue: SyncSender<Message>,
    counters: Arc<Counters>,
    closed: Arc<Mutex<Receiver<bool>>>,
}

impl Recorder {
    /// Starts the thread that writes to `sink`, with a queue of `capacity` exchanges.
    ///
    /// # Errors
    /// [`RecordingError::Thread`] if the system gives no thread.
    pub fn start(sink: impl Sink, capacity: usize) -> Result<Self, RecordingError> {
        let (queue, receiver) = sync_channel(capacity);
        let (report, closed) = sync_channel(1);
        let counters = Arc::<Counters>::default();
        let shared = Arc::clone(&counters);
        thread::Builder::new()
            .name("recording".to_owned())
            .spawn(move || {
                let closed = write_all(sink, &receiver, &shared);
                // Nobody may be left to hear of it.
                let _ = report.send(closed);
            })
            .map_err(RecordingError::Thread)?;
        Ok(Self { queue, counters, closed: Arc::new(Mutex::new(closed)) })
    }

    /// Hands over what was answered to the body `asked`, which had arrived at `accepted`; returns what goes back to the caller.
    ///
    /// # Errors
    /// The problem of `outcome`, never one of its own.
    pub fn record(
        &self,
        asked: &[u8],
        accepted: Instant,
        outcome: Result<Answer, Problem>,
    ) -> Result<Vec<u8>, Problem> {
        let (bytes, outcome) = match outcome {
            Ok(Answer { bytes, request, prediction, .. }) => (Ok(bytes), Ok((request, prediction))),
            Err(problem) => (Err(problem.clone()), Err(problem)),
        };
        let took = accepted.elapsed();
        let text = String::from_utf8_lossy(&asked[..asked.len().min(LONGEST_TEXT)]).into_owned();
        self.hand_over(Message::Exchange(Box::new(Exchange {
            number: self.counters.answered.fetch_add(1, Ordering::Relaxed) + 1,
            arrived: SystemTime::now() - took,
            took,
            asked: text,
            outcome,
        })));
        bytes
    }

    /// Hands over what an audit found.
    pub fn audited(&self, audited: Audited) {
        self.hand_over(Message::Audited(audited));
    }

    fn hand_over(&self, message: Message) {
        if let Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) = self.queue.try_send(message) {
            let dropped = self.counters.dropped.fetch_add(1, Ordering::Relaxed) + 1;
            // A line each time that the number has doubled: a flood of drops is no flood of lines.
            if dropped.is_power_of_two() {
                tracing::warn!(dropped, "the recording does not keep up: requests are missing in it");
            }
        }
    }

    /// Ends the recording after what is in the queue, or after `limit`.
    pub fn finish(&self, limit: Duration) -> Totals {
        let deadline = Instant::now() + limit;
        while let Err(TrySendError::Full(_)) = self.queue.try_send(Message::End) {
            if Instant::now() >= deadline {
                break;
            }
            thread::sleep(RETRY);
        }
        let closed = self.closed.lock().unwrap_or_else(PoisonError::into_inner);
        let closed = closed.recv_timeout(deadline.saturating_duration_since(Instant::now())).unwrap_or(false);
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let Counters { written, dropped, failed, .. } = &*self.counters;
        Totals { written: count(written), dropped: count(dropped), failed: count(failed), closed }
    }
}

/// Writes until the end is announced; returns whether the sink closed without an error.
fn write_all(mut sink: impl Sink, queue: &Receiver<Message>, counters: &Counters) -> bool {
    loop {
        let written = match queue.recv() {
            Ok(Message::Exchange(exchange)) => sink.write(&exchange, counters.dropped.load(Ordering::Relaxed)),
            Ok(Message::Audited(audited)) => sink.audited(&audited),
            Ok(Message::End) | Err(_) => break,
        };
        match written {
            Ok(()) => {
                counters.written.fetch_add(1, Ordering::Relaxed);
            }
            Err(error) => {
                let failed = counters.failed.fetch_add(1, Ordering::Relaxed) + 1;
                if failed.is_power_of_two() {
                    tracing::warn!(%error, failed, "an exchange is missing in the recording");
                }
            }
        }
    }
    match sink.close() {
        Ok(()) => true,
        Err(error) => {
            tracing::error!(%error, "the recording did not close");
            false
        }
    }
}
