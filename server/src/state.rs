//! What every request shares: the prepared scenes, the threads that compute, what is counted, and whether the service is ready.
//!
//! Not here: what a request sets in motion (`requests`).

use std::io;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use retina_core::predict::{Level, Workspace};
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::access::Access;
use crate::audit::Audit;
use crate::batch;
use crate::body::Bodies;
use crate::catalog;
use crate::config::Config;
use crate::library::reader::Reader;
use crate::library::{Background, Library, Store};
use crate::metrics::Metrics;
use crate::pool::{Pool, Ticket};
use crate::problem::{Kind, Problem};
use crate::recording::Recorder;
use crate::scenes::Scenes;
use crate::simulate;
use crate::stream::Memories;
use crate::times::Times;
use crate::warm_up::prepare_built_in;
use crate::wire::About;

/// Shared by all requests.
pub type AppState = Arc<App>;

/// The service without its routes.
pub struct App {
    pub(crate) scenes: Arc<Scenes>,
    pub(crate) pool: Arc<Pool>,
    pub(crate) library: Arc<Library>,
    /// Ends with the service.
    _background: Background,
    warm_up: Arc<OnceLock<Result<(), Problem>>>,
    pub(crate) times: Arc<Times>,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) time_limit: Duration,
    /// How long a prediction may wait for a thread.
    pub(crate) longest_wait: Option<Duration>,
    pub(crate) recorder: Option<Recorder>,
    pub(crate) simulations: Arc<Semaphore>,
    pub(crate) simulation_limits: simulate::Limits,
    pub(crate) batch_limits: batch::Limits,
    pub(crate) streams: Streams,
    pub(crate) bodies: Bodies,
    connection_limits: ConnectionLimits,
    access: Access,
    about: About,
}

/// What bounds the connections.
#[derive(Clone)]
pub(crate) struct ConnectionLimits {
    /// One for each that may be open.
    pub(crate) places: Arc<Semaphore>,
    /// How long one may bring no request.
    pub(crate) idle: Duration,
}

/// What the streams share.
pub(crate) struct Streams {
    pub(crate) places: Arc<Semaphore>,
    pub(crate) memories: Memories,
    /// How long a client may be silent.
    pub(crate) idle: Duration,
    pub(crate) open: TaskTracker,
    /// Cancelled when the service stops.
    pub(crate) stopping: CancellationToken,
}

impl App {
    /// Starts the numerical threads and the warm-up on the first of them. Nothing is recorded.
    ///
    /// # Errors
    /// If the system gives no threads, or the place of the stored scenes cannot be used.
    pub fn start(config: &Config) -> io::Result<AppState> {
        Self::start_recorded(config, None)
    }

    /// As [`App::start`], and hands what is asked and answered to the recorder; its owner finishes it when the service has ended.
    ///
    /// # Errors
    /// As [`App::start`].
    pub fn start_recorded(config: &Config, recorder: Option<Recorder>) -> io::Result<AppState> {
        let store = config.scene_store().map_err(io::Error::other)?;
        Self::start_over(config, recorder, store)
    }

    /// As [`App::start_recorded`], with stored scenes at a place that no setting names.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn start_over(config: &Config, recorder: Option<Recorder>, store: Store) -> io::Result<AppState> {
        let background = Background::start()?;
        let handle = background.handle().ok_or_else(|| io::Error::other("the background ended"))?;
        let reader = Reader::new(store.clone(), handle.clone());
        let scenes = Arc::new(Scenes::new(config.scene_cache_bytes(), reader));
        let warm_up = Arc::new(OnceLock::new());
        let times = Arc::new(Times::default());
        let first = {
            let (scenes, times, outcome) = (Arc::clone(&scenes), Arc::clone(&times), Arc::clone(&warm_up));
            move |workspace: &mut Workspace| {
                let result = prepare_built_in(&scenes, &times, workspace);
                if let Err(problem) = &result {
                    tracing::error!(detail = %problem.detail, "the built-in scenes could not be prepared");
                }
                // The first thread alone sets it, once.
                let _ = outcome.set(result);
            }
        };
        let (threads, queue) = (config.threads(), usize::from(config.queue));
        let pool = Arc::new(Pool::start(threads, queue, first)?);
        let shared = (Arc::clone(&scenes), Arc::clone(&pool), Arc::clone(&times));
        let metrics = Arc::new(Metrics::new(pool.load(), threads, queue));
        if config.audit_rate > 0.0 {
            let (load, counters) = (Arc::clone(pool.load()), metrics.audit_metrics.clone());
            let audit = Audit::start(config.audit_rate, load, counters, recorder.clone())?;
            // Nobody else has seen these metrics yet.
            let _ = metrics.audit.set(audit);
        }
        Ok(Arc::new(Self {
            metrics,
            library: Library::start(store, config.scene_quota(), handle, shared),
            _background: background,
            pool,
            bodies: Bodies::new(config.body_limit()),
            connection_limits: ConnectionLimits {
                places: Arc::new(Semaphore::new(config.connections.into())),
                idle: config.connection_idle(),
            },
            scenes,
            warm_up,
            times,
            time_limit: config.time_limit(),
            longest_wait: config.max_wait(),
            recorder,
            // One thread stays for predictions, where there are several.
            simulations: Arc::new(Semaphore::new(threads.saturating_sub(1).max(1))),
            simulation_limits: simulate::Limits {
                steps: config.simulation_steps.into(),
                time: config.simulation_time_limit(),
            },
            batch_limits: batch::Limits {
                poses: config.batch_poses.into(),
                each: config.time_limit(),
                whole: config.simulation_time_limit(),
                pieces: threads,
            },
            streams: Streams {
                places: Arc::new(Semaphore::new(config.streams.into())),
                memories: Memories::new(config.stream_memories.into(), config.simulation_steps.into()),
                idle: config.stream_idle(),
                open: TaskTracker::new(),
                stopping: CancellationToken::new(),
            },
            access: config.access(),
            about: catalog::about(config),
        }))
    }

    /// The ticket of what reads a message and prepares its scene.
    pub(crate) fn usual_ticket(&self) -> Ticket {
        Ticket { cost: self.times.mean(Level::Linear), longest_wait: self.longest_wait }
    }

    /// What bounds the connections.
    pub(crate) fn connection_limits(&self) -> ConnectionLimits {
        self.connection_limits.clone()
    }

    /// What is counted.
    pub fn metrics(&self) -> &Arc<Metrics> {
        &self.metrics
    }

    /// Who may ask.
    pub fn access(&self) -> &Access {
        &self.access
    }

    /// What this service is and what it allows.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Tells every stream to end, and waits until they have. From now on the service is not ready.
    pub async fn end_streams(&self) {
        self.streams.stopping.cancel();
        self.streams.open.close();
        self.streams.open.wait().await;
    }

    /// Whether every built-in scene has answered at the levels that a simulator uses, and the service does not stop.
    ///
    /// # Errors
    /// [`Kind::NotReady`], or what the warm-up failed with.
    pub fn ready(&self) -> Result<(), Problem> {
        if self.streams.stopping.is_cancelled() {
            return Err(Problem::new(Kind::NotReady, "The service is stopping."));
        }
        match self.warm_up.get() {
            Some(Ok(())) => Ok(()),
            Some(Err(problem)) => Err(Problem::new(
                Kind::NotReady,
                format!("The built-in scenes could not be prepared: {}", problem.detail),
            )),
            None => Err(Problem::new(Kind::NotReady, "The built-in scenes are being prepared.")),
        }
    }
}
