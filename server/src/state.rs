//! What every request shares: the prepared scenes, the threads that compute, and whether the service is ready.

use std::io;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::HeaderMap;
use axum::response::Response;
use nalgebra::{Point3, Vector3};
use retina_core::needle::shape::RADIUS;
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::budget::Budget;
use retina_core::predict::{Control, EffectChoice, Level, Request, Workspace};
use retina_core::scene::Scene;
use tokio::sync::{Semaphore, mpsc};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::answer::{Question, answer, predict};
use crate::body::{self, LARGE_AT_ONCE};
use crate::config::Config;
use crate::pool::Pool;
use crate::problem::{Kind, Problem};
use crate::recording::Recorder;
use crate::scenes::Scenes;
use crate::simulate::{FIRST_AND_LAST, Limits, Lines, simulate};
use crate::stopwatch::Stopwatch;
use crate::stream::{self, LONGEST_MESSAGE};
use crate::times::Times;
use crate::wire::request::SceneChoice;
use crate::write::Layout;

/// Force of the warm-up on every built-in scene, mN: enough for contact, far from any limit.
const WARM_UP_FORCE_MN: f64 = 0.1;

/// How long each prediction of the warm-up may take.
const WARM_UP_LIMIT: Duration = Duration::from_secs(60);

/// Shared by all requests.
pub type AppState = Arc<App>;

/// The service without its routes.
pub struct App {
    scenes: Arc<Scenes>,
    pool: Pool,
    large_bodies: Arc<Semaphore>,
    warm_up: Arc<OnceLock<Result<(), Problem>>>,
    times: Arc<Times>,
    time_limit: Duration,
    recorder: Option<Recorder>,
    simulations: Arc<Semaphore>,
    simulation_limits: Limits,
    streams: Streams,
}

/// What the streams share.
struct Streams {
    places: Arc<Semaphore>,
    idle: Duration,
    open: TaskTracker,
    stopping: CancellationToken,
}

impl App {
    /// Starts the numerical threads and the warm-up on the first of them. Nothing is recorded.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn start(config: &Config) -> io::Result<AppState> {
        Self::start_recorded(config, None)
    }

    /// As [`App::start`], and hands what is asked and answered to the recorder; its owner finishes it when the service has ended.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn start_recorded(config: &Config, recorder: Option<Recorder>) -> io::Result<AppState> {
        let scenes = Arc::new(Scenes::new(config.scene_cache_bytes()));
        let warm_up = Arc::new(OnceLock::new());
        let time_limit = config.time_limit();
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
        Ok(Arc::new(Self {
            pool: Pool::start(config.threads(), config.queue.into(), first)?,
            large_bodies: Arc::new(Semaphore::new(LARGE_AT_ONCE)),
            scenes,
            warm_up,
            times,
            time_limit,
            recorder,
            // One thread stays for predictions, where there are several.
            simulations: Arc::new(Semaphore::new(config.threads().saturating_sub(1).max(1))),
            simulation_limits: Limits { steps: config.simulation_steps.into(), time: config.simulation_time_limit() },
            streams: Streams {
                places: Arc::new(Semaphore::new(config.streams.into())),
                idle: config.stream_idle(),
                open: TaskTracker::new(),
                stopping: CancellationToken::new(),
            },
        }))
    }

    /// Answers the request whose body is on its way.
    ///
    /// # Errors
    /// The problem that the caller is told of.
    pub async fn answer(&self, headers: &HeaderMap, body: Body) -> Result<Vec<u8>, Problem> {
        let body = body::json(headers, body, &self.large_bodies).await?;
        let accepted = Instant::now();
        let (scenes, times, limit) = (Arc::clone(&self.scenes), Arc::clone(&self.times), self.time_limit);
        let recorder = self.recorder.clone();
        let job = move |workspace: &mut Workspace, abandoned: &dyn Fn() -> bool| {
            let mut stopwatch = Stopwatch::start(accepted, limit, abandoned);
            let answer = answer(body.as_ref(), &scenes, &times, workspace, &mut stopwatch);
            match recorder {
                Some(recorder) => recorder.record(body.as_ref(), accepted, answer),
                None => answer.map(|answer| answer.bytes),
            }
        };
        self.pool.run(job).await.unwrap_or_else(|error| match &self.recorder {
            Some(recorder) => recorder.record(b"", accepted, Err(error.into())),
            None => Err(error.into()),
        })
    }

    /// Simulates the sequence whose body is on its way: the lines of the answer, each as soon as it is there. The work ends when the
    /// answer is dropped.
    ///
    /// # Errors
    /// The problem of a sequence that does not begin.
    pub async fn simulate(&self, headers: &HeaderMap, body: Body) -> Result<Body, Problem> {
        let body = body::json(headers, body, &self.large_bodies).await?;
        let permit = Arc::clone(&self.simulations).try_acquire_owned().map_err(|_| {
            Problem::new(
                Kind::Busy,
                "As many simulations as the service has threads for are at work; try again in a second.",
            )
        })?;
        let accepted = Instant::now();
        let (scenes, limits) = (Arc::clone(&self.scenes), self.simulation_limits);
        // Room for every line: a client that reads slowly does not hold a thread.
        let (sender, lines) = mpsc::channel(limits.steps + FIRST_AND_LAST);
        let job = move |_: &mut Workspace| {
            let gone = || sender.is_closed();
            let mut stopwatch = Stopwatch::start(accepted, limits.time, &gone);
            // A line that finds no room has lost its reader.
            simulate(body.as_ref(), &scenes, limits.steps, &mut stopwatch, &mut |line| sender.try_send(line).is_ok());
        };
        self.pool.begin(job)?;
        Lines::new(lines, permit).body().await
    }

    /// The answer to a request for a stream, which then lives until its client goes or the service stops.
    ///
    /// # Errors
    /// [`Kind::Busy`] for a stream too many.
    pub fn stream(self: &Arc<Self>, upgrade: WebSocketUpgrade) -> Result<Response, Problem> {
        let place = Arc::clone(&self.streams.places).try_acquire_owned().map_err(|_| {
            Problem::new(Kind::Busy, "As many streams as the service serves are open; try again in a second.")
        })?;
        let (app, open) = (Arc::clone(self), self.streams.open.token());
        let upgrade = upgrade.max_message_size(LONGEST_MESSAGE).max_frame_size(LONGEST_MESSAGE);
        Ok(upgrade.on_upgrade(async move |socket| {
            stream::serve(socket, app).await;
            drop((place, open));
        }))
    }

    /// Tells every stream to end, and waits until they have.
    pub async fn end_streams(&self) {
        self.streams.stopping.cancel();
        self.streams.open.close();
        self.streams.open.wait().await;
    }

    /// Cancelled when the service stops.
    pub(crate) fn stopping(&self) -> &CancellationToken {
        &self.streams.stopping
    }

    /// How long a stream's client may be silent.
    pub(crate) fn stream_idle(&self) -> Duration {
        self.streams.idle
    }

    pub(crate) fn scenes(&self) -> Arc<Scenes> {
        Arc::clone(&self.scenes)
    }

    pub(crate) fn times(&self) -> Arc<Times> {
        Arc::clone(&self.times)
    }

    pub(crate) fn pool(&self) -> &Pool {
        &self.pool
    }

    pub(crate) fn time_limit(&self) -> Duration {
        self.time_limit
    }

    /// Whether every built-in scene has answered at the levels that a simulator uses.
    ///
    /// # Errors
    /// [`Kind::NotReady`], or what the warm-up failed with.
    pub fn ready(&self) -> Result<(), Problem> {
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

/// A light touch on every built-in scene, so that what depends on the scene alone is there before the first request.
fn prepare_built_in(scenes: &Scenes, times: &Times, workspace: &mut Workspace) -> Result<(), Problem> {
    let shape = NeedleShape::hemispherical(RADIUS.default);
    let needle = Needle::pointing(shape, Point3::origin(), &-Vector3::z_axis());
    for name in Scene::built_in_names() {
        let scene = scenes.get(Some(&SceneChoice::Name((*name).to_owned())))?;
        for level in [Level::Linear, Level::Coarse] {
            let request = Request {
                needle,
                control: Control::Force(Vector3::new(0.0, 0.0, -WARM_UP_FORCE_MN)),
                level,
                effects: EffectChoice::Auto,
            };
            let budget = Budget { level: Some(level), ..Budget::default() };
            let mut stopwatch = Stopwatch::start(Instant::now(), WARM_UP_LIMIT, &|| false);
            predict(&scene, Question { request, budget, times }, workspace, &mut stopwatch, Layout::Compact)?;
        }
    }
    Ok(())
}
