//! What a stream asks of the numerical threads: to open a session, to answer a pose.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, Utf8Bytes};
use retina_core::predict::budget::Budget;
use retina_core::predict::{PreparedScene, Workspace};
use retina_core::progress::Progress as _;

use super::binary::{self, Head};
use crate::answer::{Question, compute};
use crate::metrics::Metrics;
use crate::problem::{Kind, Problem, of_pose};
use crate::read::read;
use crate::scenes::{Scenes, shared_triangles};
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::understand::{self, Opening};
use crate::wire::stream::{
    AnswerMessage, Format, OpenSpec, OpenedMessage, StreamCommand, StreamMessage, StreamPose, StreamTimes,
};
use crate::write::{Layout, write};

/// A session: what holds for every pose.
pub struct Session {
    scene: Arc<PreparedScene>,
    opening: Opening,
    format: Format,
}

/// A pose with what belongs to its place in the stream.
#[derive(Clone, Debug)]
pub struct Posed {
    /// The pose.
    pub pose: StreamPose,
    /// When it arrived.
    pub arrived: Instant,
    /// From the beginning of the connection until then.
    pub received: Duration,
}

/// The message that opens a session, read or not.
pub enum Open {
    /// Read.
    Read(Box<OpenSpec>),
    /// Too long to be read by the thread that talks.
    Text(Utf8Bytes),
}

/// Opens a session: finds or prepares its scene.
///
/// # Errors
/// The problem that the client is told of.
pub fn open(open: Open, scenes: &Scenes) -> Result<(Session, Message), Problem> {
    let spec = match open {
        Open::Read(spec) => spec,
        Open::Text(text) => match read::<StreamCommand>(text.as_bytes())? {
            StreamCommand { open: Some(spec), pose: None } => Box::new(spec),
            _ => return Err(Problem::new(Kind::BodyTooLarge, "Only a message that opens a session may be so long.")),
        },
    };
    let within = |problem: Problem| problem.within("open");
    let opening = understand::opening(&spec).map_err(within)?;
    // The scene's own problems begin with `scene`.
    let scene = scenes.get(spec.scene.as_ref()).map_err(within)?;
    let triangles = shared_triangles(&scene)?;
    let opened = OpenedMessage { protocol: binary::VERSION, format: spec.format, triangles: &triangles };
    let message = text(&StreamMessage::Opened(opened))?;
    Ok((Session { scene, opening, format: spec.format }, message))
}

impl Session {
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
        posed: &Posed,
        dropped: u32,
        (times, metrics): (&Times, &Metrics),
        workspace: &mut Workspace,
        stopwatch: &mut Stopwatch,
    ) -> Result<Message, Problem> {
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
        match self.format {
            Format::Json => text(&StreamMessage::Answer(Box::new(AnswerMessage {
                sequence,
                client_time_us,
                dropped,
                time_us: times,
                prediction: (&prediction).into(),
            }))),
            Format::Binary => {
                let head = Head { sequence, client_time_us, dropped, times };
                binary::answer(&head, &prediction).map(|bytes| Message::Binary(bytes.into()))
            }
        }
    }
}

/// The text message that says this.
///
/// # Errors
/// [`Kind::Internal`] for a number that is not finite.
pub fn text(message: &StreamMessage) -> Result<Message, Problem> {
    let bytes = write(message, Layout::Compact).map_err(Problem::internal)?;
    let text = String::from_utf8(bytes).map_err(Problem::internal)?;
    Ok(Message::Text(text.into()))
}

/// The text message of a problem, which may repeat a `null` that the client wrote.
pub fn problem_text(message: &StreamMessage) -> Message {
    Message::Text(serde_json::to_string(message).unwrap_or_default().into())
}
