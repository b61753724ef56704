//! What a stream asks of the numerical threads: to open a session, to answer a pose.

use std::sync::Arc;
use std::time::{Duration, Instant};

use retina_core::predict::{Prediction, PreparedScene, Workspace};
use retina_core::progress::Progress as _;

use super::binary::Head;
use super::memory::{Memories, Memory};
use super::protocol::{Form, Opening};
use crate::admission;
use crate::answer::{Computed, Question, compute};
use crate::metrics::Metrics;
use crate::pool::Ticket;
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
    memory: Option<Box<Memory>>,
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

/// Opens the session that was asked for at `asked`: finds or prepares its scene, and plans what it remembers.
///
/// # Errors
/// The problem that the client is told of.
pub fn open<F: Form>(
    opening: Opening<F>,
    (scenes, memories): (&Scenes, &Memories),
    asked: Instant,
    stopwatch: &mut Stopwatch,
) -> Result<(Session<F>, F::Message), Problem> {
    let (spec, form) = opening()?;
    let within = |problem: Problem| problem.within("open");
    let opening = understand::opening(&spec, memories.most_steps).map_err(within)?;
    // The scene's own problems begin with `scene`.
    let scene = scenes.get(spec.scene.as_ref()).map_err(within)?;
    let plan = |rehearsal| Memory::plan(&scene, rehearsal, memories, asked, stopwatch).map(Box::new);
    let memory = opening.rehearsal.as_ref().map(plan).transpose().map_err(within)?;
    let triangles = shared_triangles(&scene)?;
    let message = match &memory {
        Some(memory) => memory.tell(|planned| form.opened(&triangles, Some(planned)))?,
        None => form.opened(&triangles, None),
    }?;
    Ok((Session { scene, opening, memory, form }, message))
}

impl<F: Form> Session<F> {
    /// The ticket of its next pose, where one may wait for `longest_wait`.
    pub fn ticket(&self, times: &Times, longest_wait: Option<Duration>) -> Ticket {
        let ticket = admission::of_budget(&self.opening.shared.budget, times, longest_wait);
        let expected = self.memory.as_deref().and_then(Memory::expected);
        Ticket { cost: expected.unwrap_or(ticket.cost), ..ticket }
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
        let (prediction, time_s) = match &self.memory {
            Some(memory) => {
                let outcome = memory.step(&posed.pose, posed.arrived, stopwatch)?;
                metrics.computed(memory.level(), stopwatch.finish());
                (outcome.prediction, Some(outcome.time_s))
            }
            None => (self.predict(&posed.pose, (times, metrics), workspace, stopwatch)?, None),
        };
        let micros = |time: Duration| time.as_nanos() as f64 / 1e3;
        let times = StreamTimes {
            received: micros(posed.received),
            waited: micros(waited),
            computed: micros(posed.arrived.elapsed().saturating_sub(waited)),
        };
        let StreamPose { sequence, client_time_us, .. } = posed.pose;
        self.form.answer(&Head { sequence, client_time_us, time_s, dropped, times }, &posed.tag, &prediction)
    }

    /// The answer to a pose as if it were the first.
    fn predict(
        &self,
        pose: &StreamPose,
        (times, metrics): (&Times, &Metrics),
        workspace: &mut Workspace,
        stopwatch: &mut Stopwatch,
    ) -> Result<Prediction, Problem> {
        let request = understand::pose(&self.opening, pose).map_err(of_pose)?;
        stopwatch.stage("prepare");
        let question = Question { request, budget: self.opening.shared.budget, times };
        let Computed { request, prediction, .. } =
            compute(&self.scene, question, workspace, stopwatch).map_err(of_pose)?;
        metrics.predicted(&self.scene, &request, &prediction, stopwatch.finish());
        Ok(prediction)
    }
}
