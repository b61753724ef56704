//! The threads that compute, apart from those that talk.
//!
//! Contract: at most `queue` jobs wait, and one more is refused at once, as is one whose wait is expected to be longer than it can bear; each
//! thread owns a [`Workspace`]; a panic ends its job and not its thread; a job whose caller has gone, or that has waited for longer than
//! it can bear all the same, is not begun, and one that is running can see that its caller has gone.
//!
//! Not here: what the jobs compute, and what they are expected to take (`times`).

mod load;
mod queue;

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use retina_core::predict::Workspace;
use thiserror::Error;
use tokio::sync::oneshot;
use tokio::time::sleep;
use tracing::Span;

pub use load::Load;
use queue::Queue;

type Job = Box<dyn FnOnce(&mut Workspace) -> Done + Send>;

/// What a job leaves to its thread.
struct Done {
    /// Whether it did what it was expected to do, so that the time that it took tells how good the expectation was.
    as_expected: bool,
    /// Tells its caller, who then finds the thread idle.
    tell: Option<Box<dyn FnOnce()>>,
}

/// Of a job whose time tells nothing and who told its caller by itself.
const NOTHING: Done = Done { as_expected: false, tell: None };

/// Share of the longest wait up to which a job is let in: the rest is for jobs before it that take longer than expected.
const ADMITTED_SHARE: f64 = 0.75;

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

/// The threads, as seen from those that talk. They end when this is dropped and the queue is empty.
pub struct Pool {
    jobs: Arc<Queue<(Ticket, Job)>>,
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
        let jobs = Arc::new(Queue::new(queue));
        let mut first: Option<Job> = Some(Box::new(|workspace: &mut Workspace| {
            first(workspace);
            NOTHING
        }));
        for index in 0..threads {
            let (jobs, load, first) = (Arc::clone(&jobs), Arc::clone(&load), first.take());
            thread::Builder::new().name(format!("numerics-{index}")).spawn(move || work(first, &jobs, &load, index))?;
        }
        Ok(Self { jobs, load })
    }

    /// What waits and what is at work.
    pub fn load(&self) -> &Arc<Load> {
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
                return NOTHING;
            }
            let waited = asked.elapsed();
            let value = match ticket.longest_wait {
                Some(longest) if waited > longest => Err(PoolError::TooLate(waited)),
                _ => Ok(job(workspace, &|| reply.is_closed())),
            };
            Done {
                as_expected: value.is_ok() && !reply.is_closed(),
                // The caller may have gone meanwhile; then nobody wants the value.
                tell: Some(Box::new(move || drop(reply.send(value)))),
            }
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
            NOTHING
        })
    }

    fn queue(
        &self,
        ticket: Ticket,
        job: impl FnOnce(&mut Workspace) -> Done + Send + 'static,
    ) -> Result<(), PoolError> {
        let expected = self.load.expected_wait();
        if ticket.longest_wait.is_some_and(|longest| expected > longest.mul_f64(ADMITTED_SHARE)) {
            return Err(PoolError::TooLate(expected));
        }
        let span = Span::current();
        let job: Job = Box::new(move |workspace: &mut Workspace| span.in_scope(|| job(workspace)));
        // Counted before it is taken, so that the count is never below zero.
        self.load.queued(ticket, 1);
        if !self.jobs.put((ticket, job)) {
            self.load.queued(ticket, -1);
            return Err(PoolError::Full(expected));
        }
        Ok(())
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.jobs.close();
    }
}

fn work(first: Option<Job>, jobs: &Queue<(Ticket, Job)>, load: &Load, index: usize) {
    let mut workspace = Workspace::default();
    let mut next = first;
    loop {
        let taken = next.take().map(|job| (Ticket::default(), job)).or_else(|| {
            jobs.take(|&(ticket, _)| {
                load.queued(ticket, -1);
                load.begun(index, ticket);
            })
        });
        let Some((ticket, job)) = taken else { return };
        let began = Instant::now();
        let done = catch_unwind(AssertUnwindSafe(|| job(&mut workspace))).unwrap_or_else(|_| {
            // The panic hook has told of the panic; what the job left in the workspace is not trusted.
            load.panics.inc();
            workspace = Workspace::default();
            NOTHING
        });
        if done.as_expected {
            load.took(ticket.cost, began.elapsed());
        }
        load.idle(index);
        if let Some(tell) = done.tell {
            tell();
        }
    }
}
