//! What a stream asks of the numerical threads: to open a session, to answer a pose.

use std::sync::Arc;
use std::time::{Duration, Instant};

use retina_core::predict::budget::Budget;
use retina_core::predict::{PreparedScene, Workspace};
use retina_core::progress::Progress as _;

use super::binary::Head;
use super::protocol::{Form, Opening};
use crate::answer::{Question, compute};
use crate::metrics::Metrics;
use crate::problem::{Problem, of_pose};
use crate::scenes::{Scenes, shared_triangles};
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::understand;
use crate::wire::stream::{StreamPose, StreamTimes};

/// A session: what holds for every pose.
pub struct Session<F> {
    scene: Arc<PreparedScene>,
    opening: understand::Opening,
    form: F,
}

/// A pose with what belongs to its place in the stream.
#[derive(Clone, Debug)]
pub struct Posed<T> {
    /// The pose.
    pub pose: StreamPose,
    /// What the answer repeats besides.
    pub tag: T,
    /// When it arrived.
    pub arrived: Instant,
    /// From the beginning of the connection until then.
    pub received: Duration,
}

/// Opens a session: finds or prepares its scene.
///
/// # Errors
/// The problem that the client is told of.
pub fn open<F: Form>(opening: Opening<F>, scenes: &Scenes) -> Result<(Session<F>, F::Message), Problem> {
    let (spec, form) = opening()?;
    let within = |problem: Problem| problem.within("open");
    let opening = understand::opening(&spec).map_err(within)?;
    // The scene's own problems begin with `scene`.
    let scene = scenes.get(spec.scene.as_ref()).map_err(within)?;
    let message = form.opened(&spec, &shared_triangles(&scene)?)?;
    Ok((Session { scene, opening, form }, message))
}

impl<F: Form> Session<F> {
    /// What every answer must keep.
    pub fn budget(&self) -> &Budget {
        &self.opening.shared.budget
    }

    /// The message that answers a pose.
    ///
    /// # Errors
    /// The problem that the client is told of.
    pub fn answer(
        &self,
        posed: &Posed<F::Tag>,
        dropped: u32,
        (times, metrics): (&Times, &Metrics),
        workspace: &mut Workspace,
        stopwatch: &mut Stopwatch,
    ) -> Result<F::Message, Problem> {
        let waited = stopwatch.elapsed();
        let request = understand::pose(&self.opening, &posed.pose).map_err(of_pose)?;
        stopwatch.stage("prepare");
        let question = Question { request, budget: self.opening.shared.budget, times };
        let (request, prediction) = compute(&self.scene, question, workspace, stopwatch).map_err(of_pose)?;
        metrics.predicted(&self.scene, &request, &prediction, stopwatch.finish());
        let micros = |time: Duration| time.as_nanos() as f64 / 1e3;
        let times = StreamTimes {
            received: micros(posed.received),
            waited: micros(waited),
            computed: micros(posed.arrived.elapsed().saturating_sub(waited)),
        };
        let StreamPose { sequence, client_time_us, .. } = posed.pose;
        self.form.answer(&Head { sequence, client_time_us, dropped, times }, &posed.tag, &prediction)
    }
}
