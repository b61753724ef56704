//! The threads that compute, apart from those that talk.
//!
//! Contract: at most `queue` jobs wait, and one more is refused at once; each thread owns a [`Workspace`]; a panic ends its job and
//! not its thread; a job whose caller has gone is not begun, and one that is running can see that it has.
//!
//! Not here: what the jobs compute.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use retina_core::predict::Workspace;
use thiserror::Error;
use tokio::sync::oneshot;
use tracing::Span;

type Job = Box<dyn FnOnce(&mut Workspace) + Send>;

/// The threads, as seen from those that talk. They end when this is dropped and the queue is empty.
pub struct Pool {
    queue: SyncSender<Job>,
}

/// Why a job gave no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PoolError {
    /// The queue is full.
    #[error("the queue of the numerical threads is full")]
    Full,
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
        let (sender, receiver) = sync_channel::<Job>(queue);
        let receiver = Arc::new(Mutex::new(receiver));
        let mut first: Option<Job> = Some(Box::new(first));
        for index in 0..threads.max(1) {
            let (receiver, first) = (Arc::clone(&receiver), first.take());
            thread::Builder::new().name(format!("numerics-{index}")).spawn(move || work(first, &receiver))?;
        }
        Ok(Self { queue: sender })
    }

    /// Runs `job` on one of the threads. The job is given a question that tells whether its caller has gone.
    ///
    /// # Errors
    /// [`PoolError`].
    pub async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce(&mut Workspace, &dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<T, PoolError> {
        let (reply, result) = oneshot::channel();
        self.begin(move |workspace| {
            if reply.is_closed() {
                return;
            }
            let value = job(workspace, &|| reply.is_closed());
            // The caller may have gone meanwhile; then nobody wants the value.
            let _ = reply.send(value);
        })?;
        result.await.map_err(|_| PoolError::Panicked)
    }

    /// Begins `job` as soon as a thread is free, without waiting for it. What it has to tell it tells by itself.
    ///
    /// # Errors
    /// [`PoolError`].
    pub fn begin(&self, job: impl FnOnce(&mut Workspace) + Send + 'static) -> Result<(), PoolError> {
        let span = Span::current();
        let job = Box::new(move |workspace: &mut Workspace| span.in_scope(|| job(workspace)));
        self.queue.try_send(job).map_err(|error| match error {
            TrySendError::Full(_) => PoolError::Full,
            TrySendError::Disconnected(_) => PoolError::Panicked,
        })
    }
}

fn work(first: Option<Job>, queue: &Mutex<Receiver<Job>>) {
    let mut workspace = Workspace::default();
    let mut next = first;
    loop {
        let taken = next.take().or_else(|| {
            let queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
            queue.recv().ok()
        });
        let Some(job) = taken else { return };
        // The panic hook has told of the panic; what the job left in the workspace is not trusted.
        if catch_unwind(AssertUnwindSafe(|| job(&mut workspace))).is_err() {
            workspace = Workspace::default();
        }
    }
}
