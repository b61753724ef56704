//! The threads that compute, apart from those that talk.
//!
//! Contract: at most `queue` jobs wait, and one more is refused at once, as is one whose wait is expected to be longer than it can bear; each
//! thread owns a [`Workspace`]; a panic ends its job and not its thread; a job whose caller has gone, or that has waited for longer than
//! it can bear all the same, is not begun, and one that is running can see that its caller has gone.
//!
//! Not here: what the jobs compute, and what they are expected to take (`times`).

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::gauge::Gauge;
use retina_core::predict::Workspace;
use thiserror::Error;
use tokio::sync::oneshot;
use tokio::time::sleep;
use tracing::Span;

/// A job says whether it did what it was expected to do, so that the time that it took tells how good the expectation was.
type Job = Box<dyn FnOnce(&mut Workspace) -> bool + Send>;

/// Share of the longest wait up to which a job is let in: the rest is for jobs before it that take longer than expected.
const ADMITTED_SHARE: f64 = 0.75;

/// How much the last job counts in the ratio of times to expectations, and the bounds of that ratio.
const NEWEST_SHARE: f64 = 0.05;
const RATIO: (f64, f64) = (0.2, 10.0);

/// How long a job that waits for a place in the queue waits before it asks again.
const PATIENCE: Duration = Duration::from_millis(2);

/// What is known of a job before it runs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ticket {
    /// What it is expected to take.
    pub cost: Duration,
    /// The longest wait after which its result is still of use; `None` for any.
    pub longest_wait: Option<Duration>,
}

/// What waits and what is at work, kept by the threads.
pub struct Load {
    /// Jobs that wait.
    pub waiting: Gauge,
    /// Jobs that panicked.
    pub panics: Counter,
    began: Instant,
    waiting_cost_us: AtomicI64,
    /// What jobs took over what they were expected to take, a running mean; the bits of an f64.
    ratio: AtomicU64,
    /// When each thread is expected to be free, µs after the beginning; zero for one that is idle.
    busy_until_us: Vec<AtomicU64>,
}

/// The threads, as seen from those that talk. They end when this is dropped and the queue is empty.
pub struct Pool {
    jobs: SyncSender<(Ticket, Job)>,
    load: Arc<Load>,
}

/// Why a job gave no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PoolError {
    /// The queue is full; the wait is expected to last so long.
    #[error("the queue of the numerical threads is full")]
    Full(Duration),
    /// The wait is expected to last so long, or has, which is longer than the job can bear.
    #[error("the wait for a numerical thread is {0:?}, longer than the job can bear")]
    TooLate(Duration),
    /// The job panicked, or its thread is gone.
    #[error("the computation panicked")]
    Panicked,
}

impl Load {
    fn new(threads: usize) -> Self {
        Self {
            waiting: Gauge::default(),
            panics: Counter::default(),
            began: Instant::now(),
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

    fn ratio(&self) -> f64 {
        f64::from_bits(self.ratio.load(Ordering::Relaxed))
    }

    /// A job that was expected to take `cost` took `time`. Two threads that tell at once may lose one of both, which is as good.
    fn took(&self, cost: Duration, time: Duration) {
        if cost > Duration::ZERO {
            let ratio = (time.as_secs_f64() / cost.as_secs_f64()).clamp(RATIO.0, RATIO.1);
            let mean = self.ratio() + NEWEST_SHARE * (ratio - self.ratio());
            self.ratio.store(mean.to_bits(), Ordering::Relaxed);
        }
    }

    fn queued(&self, ticket: Ticket, sign: i64) {
        self.waiting.inc_by(sign);
        self.waiting_cost_us.fetch_add(sign * ticket.cost.as_micros() as i64, Ordering::Relaxed);
    }
}

impl Pool {
    /// Starts `threads` threads (at least one); the first one runs `first` before it takes jobs.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn start(
        threads: usize,
        queue: usize,
        first: impl FnOnce(&mut Workspace) + Send + 'static,
    ) -> io::Result<Self> {
        let threads = threads.max(1);
        let load = Arc::new(Load::new(threads));
        let (sender, receiver) = sync_channel::<(Ticket, Job)>(queue);
        let receiver = Arc::new(Mutex::new(receiver));
        let mut first: Option<Job> = Some(Box::new(|workspace: &mut Workspace| {
            first(workspace);
            false
        }));
        for index in 0..threads {
            let (receiver, load, first) = (Arc::clone(&receiver), Arc::clone(&load), first.take());
            thread::Builder::new()
                .name(format!("numerics-{index}"))
                .spawn(move || work(first, &receiver, &load, index))?;
        }
        Ok(Self { jobs: sender, load })
    }

    /// What waits and what is at work.
    pub fn load(&self) -> &Load {
        &self.load
    }

    /// Runs `job` on one of the threads. The job is given a question that tells whether its caller has gone.
    ///
    /// # Errors
    /// [`PoolError`].
    pub async fn run<T: Send + 'static>(
        &self,
        ticket: Ticket,
        job: impl FnOnce(&mut Workspace, &dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<T, PoolError> {
        let (reply, result) = oneshot::channel();
        let asked = Instant::now();
        self.queue(ticket, move |workspace| {
            if reply.is_closed() {
                return false;
            }
            let waited = asked.elapsed();
            let value = match ticket.longest_wait {
                Some(longest) if waited > longest => Err(PoolError::TooLate(waited)),
                _ => Ok(job(workspace, &|| reply.is_closed())),
            };
            let done = value.is_ok();
            // The caller may have gone meanwhile; then nobody wants the value.
            reply.send(value).is_ok() && done
        })?;
        result.await.map_err(|_| PoolError::Panicked)?
    }

    /// As [`Pool::run`], for a job that waits for its place in the queue too; `job` makes it anew for each time of asking.
    ///
    /// # Errors
    /// [`PoolError::Panicked`].
    pub async fn run_patiently<T, J>(&self, ticket: Ticket, job: impl Fn() -> J) -> Result<T, PoolError>
    where
        T: Send + 'static,
        J: FnOnce(&mut Workspace, &dyn Fn() -> bool) -> T + Send + 'static,
    {
        loop {
            match self.run(ticket, job()).await {
                Err(PoolError::Full(_)) => sleep(PATIENCE).await,
                result => return result,
            }
        }
    }

    /// Begins `job` as soon as a thread is free, without waiting for it. What it has to tell it tells by itself.
    ///
    /// # Errors
    /// [`PoolError`].
    pub fn begin(&self, ticket: Ticket, job: impl FnOnce(&mut Workspace) + Send + 'static) -> Result<(), PoolError> {
        self.queue(ticket, |workspace| {
            job(workspace);
            false
        })
    }

    fn queue(
        &self,
        ticket: Ticket,
        job: impl FnOnce(&mut Workspace) -> bool + Send + 'static,
    ) -> Result<(), PoolError> {
        let expected = self.load.expected_wait();
        if ticket.longest_wait.is_some_and(|longest| expected > longest.mul_f64(ADMITTED_SHARE)) {
            return Err(PoolError::TooLate(expected));
        }
        let span = Span::current();
        let job = Box::new(move |workspace: &mut Workspace| span.in_scope(|| job(workspace)));
        // Counted before it is taken, so that the count is never below zero.
        self.load.queued(ticket, 1);
        self.jobs.try_send((ticket, job)).map_err(|error| {
            self.load.queued(ticket, -1);
            match error {
                TrySendError::Full(_) => PoolError::Full(expected),
                TrySendError::Disconnected(_) => PoolError::Panicked,
            }
        })
    }
}

fn work(first: Option<Job>, queue: &Mutex<Receiver<(Ticket, Job)>>, load: &Load, index: usize) {
    let mut workspace = Workspace::default();
    let mut next = first;
    loop {
        let taken = next.take().map(|job| (Ticket::default(), job)).or_else(|| {
            let queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
            let (ticket, job) = queue.recv().ok()?;
            load.queued(ticket, -1);
            let until_us = load.now_us() + (ticket.cost.as_micros() as f64 * load.ratio()) as u64;
            load.busy_until_us[index].store(until_us, Ordering::Relaxed);
            Some((ticket, job))
        });
        let Some((ticket, job)) = taken else { return };
        let began = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| job(&mut workspace))) {
            Ok(true) => load.took(ticket.cost, began.elapsed()),
            Ok(false) => {}
            // The panic hook has told of the panic; what the job left in the workspace is not trusted.
            Err(_) => {
                load.panics.inc();
                workspace = Workspace::default();
            }
        }
        load.busy_until_us[index].store(0, Ordering::Relaxed);
    }
}
