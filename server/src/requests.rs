//! What a request sets in motion: its body is read, a job waits for a numerical thread, its answer comes back.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::{HeaderMap, header};
use axum::response::Response;
use retina_core::predict::Workspace;
use tokio::sync::mpsc;

use crate::admission;
use crate::answer::answer;
use crate::batch;
use crate::body::is_json;
use crate::pool::Ticket;
use crate::problem::{Kind, Problem};
use crate::simulate::{FIRST_AND_LAST, Lines, simulate};
use crate::state::App;
use crate::stopwatch::Stopwatch;
use crate::stream::{self, LONGEST_MESSAGE, WebSockets};
use crate::upload::{Upload, is_form};
use crate::wire::StoredScene;

/// What a simulation is expected to take, whatever it is: long enough to be seen by those who wait behind it.
const SIMULATION_COST: Duration = Duration::from_secs(1);

impl App {
    /// Answers the request whose body is on its way; how long that took from its arrival on.
    ///
    /// # Errors
    /// The problem that the caller is told of.
    pub async fn answer(&self, headers: &HeaderMap, body: Body) -> Result<(Vec<u8>, Duration), Problem> {
        let body = self.bodies.json(headers, body).await?;
        let accepted = Instant::now();
        let ticket = admission::ticket(body.as_ref(), &self.times, self.longest_wait);
        let (scenes, times, limit) = (Arc::clone(&self.scenes), Arc::clone(&self.times), self.time_limit);
        let (recorder, metrics) = (self.recorder.clone(), Arc::clone(&self.metrics));
        let job = move |workspace: &mut Workspace, abandoned: &dyn Fn() -> bool| {
            let mut stopwatch = Stopwatch::start(accepted, limit, abandoned);
            let answer = answer(body.as_ref(), &scenes, &times, workspace, &mut stopwatch);
            if let Ok(answer) = &answer {
                metrics.predicted(&answer.scene, &answer.request, &answer.prediction, stopwatch.stages());
            }
            let accounted = answer.as_ref().ok().and_then(|answer| answer.accounted);
            let bytes = match recorder {
                Some(recorder) => recorder.record(body.as_ref(), accepted, answer),
                None => answer.map(|answer| answer.bytes),
            };
            bytes.map(|bytes| (bytes, accounted))
        };
        let (bytes, accounted) = self.pool.run(ticket, job).await.unwrap_or_else(|error| match &self.recorder {
            Some(recorder) => recorder.record(b"", accepted, Err(error.into())).map(|bytes| (bytes, None)),
            None => Err(error.into()),
        })?;
        let took = accepted.elapsed();
        if let Some(accounted) = accounted {
            self.times.record_around(took.saturating_sub(accounted));
        }
        Ok((bytes, took))
    }

    /// Answers the poses whose list is on its way, in pieces as they are done. The work ends when the answer is dropped.
    ///
    /// # Errors
    /// The problem of what the poses share.
    pub async fn batch(&self, headers: &HeaderMap, body: Body) -> Result<Body, Problem> {
        let body = self.bodies.json(headers, body).await?;
        let (arrived, limits, scenes) = (Instant::now(), self.batch_limits, Arc::clone(&self.scenes));
        let plan = move |_: &mut Workspace, _: &dyn Fn() -> bool| batch::plan(body.as_ref(), limits.poses, &scenes);
        let batch = self.pool.run(self.usual_ticket(), plan).await??;
        let counters = (Arc::clone(&self.times), Arc::clone(&self.metrics));
        batch::answers(batch, Arc::clone(&self.pool), counters, limits, arrived).map(Body::from_stream)
    }

    /// Stores the scene whose body is on its way; whether it is new.
    ///
    /// # Errors
    /// The problem that the caller is told of.
    pub async fn store_scene(&self, headers: &HeaderMap, body: Body) -> Result<(StoredScene, bool), Problem> {
        let fits = |media_type: &str| is_json(media_type) || is_form(media_type);
        let body = self.bodies.of_type(headers, body, fits, "application/json or multipart/form-data").await?;
        let upload = Upload::take_apart(body.bytes(), headers.get(header::CONTENT_TYPE)).await?;
        let content = self.pool.run(self.usual_ticket(), move |_, _| upload.content()).await??;
        self.library.keep(content).await
    }

    /// Simulates the sequence whose body is on its way: the lines of the answer, each as soon as it is there. The work ends when the
    /// answer is dropped.
    ///
    /// # Errors
    /// The problem of a sequence that does not begin.
    pub async fn simulate(&self, headers: &HeaderMap, body: Body) -> Result<Body, Problem> {
        let body = self.bodies.json(headers, body).await?;
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
        self.pool.begin(Ticket { cost: SIMULATION_COST, longest_wait: None }, job)?;
        Lines::new(lines, permit).body().await
    }

    /// The answer to a request for a stream, which then lives until its client goes or the service stops.
    ///
    /// # Errors
    /// [`Kind::ForeignOrigin`], or [`Kind::Busy`] for a stream too many.
    pub fn stream(self: &Arc<Self>, headers: &HeaderMap, upgrade: WebSocketUpgrade) -> Result<Response, Problem> {
        self.access().check_origin(headers)?;
        let place = Arc::clone(&self.streams.places).try_acquire_owned().map_err(|_| {
            Problem::new(Kind::Busy, "As many streams as the service serves are open; try again in a second.")
        })?;
        let (app, open) = (Arc::clone(self), self.streams.open.token());
        let upgrade = upgrade.max_message_size(LONGEST_MESSAGE).max_frame_size(LONGEST_MESSAGE);
        Ok(upgrade.on_upgrade(async move |socket| {
            let metrics = Arc::clone(&app.metrics);
            metrics.streams.inc();
            stream::serve(socket, WebSockets, app).await;
            metrics.streams.dec();
            drop((place, open));
        }))
    }
}
