//! One simulation, from bytes to lines: read, understand, find the scene, step by step, each line as soon as it is there.
//!
//! Contract: a sequence that cannot begin is refused and has no line; one that has begun ends with a line that says so, or with one that names the step
//! without an answer. The same function answers over HTTP and on the command line.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use futures_util::stream;
use retina_core::predict::PreparedScene;
use retina_core::progress::Progress as _;
use retina_core::sequence::{Sequence, Simulation};
use tokio::sync::{OwnedSemaphorePermit, mpsc};

use crate::problem::{Problem, from_sequence};
use crate::read::read;
use crate::scenes::Scenes;
use crate::stopwatch::Stopwatch;
use crate::understand;
use crate::wire::SimulateRequest;
use crate::wire::sequence::{BeginLine, EndLine, ErrorLine, SimulateLine, StepLine};
use crate::write::{Layout, write};

/// Lines of a simulation besides those of its steps.
pub const FIRST_AND_LAST: usize = 2;

/// What one simulation may cost.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Steps.
    pub steps: usize,
    /// Time from acceptance to the last line.
    pub time: Duration,
}

/// What a simulation tells.
pub enum Line {
    /// It does not begin; nothing follows.
    Refused(Problem),
    /// A line after which more follow.
    Going(Vec<u8>),
    /// The last line.
    Last {
        /// The line.
        bytes: Vec<u8>,
        /// Whether every step was computed.
        complete: bool,
    },
}

/// Simulates the sequence in `body` and hands every line to `tell`, which says whether someone still reads.
pub fn simulate(
    body: &[u8],
    scenes: &Scenes,
    most_steps: usize,
    stopwatch: &mut Stopwatch,
    tell: &mut dyn FnMut(Line) -> bool,
) {
    simulate_in(body, |message| scenes.get(message.scene.as_ref()), most_steps, stopwatch, tell);
}

/// As [`simulate`], in the scene that `scene` finds.
pub fn simulate_in(
    body: &[u8],
    scene: impl FnOnce(&SimulateRequest) -> Result<Arc<PreparedScene>, Problem>,
    most_steps: usize,
    stopwatch: &mut Stopwatch,
    tell: &mut dyn FnMut(Line) -> bool,
) {
    let understood = read::<SimulateRequest>(body).and_then(|message| {
        let sequence = understand::sequence(&message, most_steps)?;
        stopwatch.stage("prepare");
        Ok((sequence, scene(&message)?))
    });
    let told = match understood {
        Ok((sequence, scene)) => match Simulation::new(&scene, &sequence, stopwatch) {
            Ok(simulation) => return follow(simulation, &sequence, stopwatch, tell),
            Err(error) => Line::Refused(from_sequence(error)),
        },
        Err(problem) => Line::Refused(problem),
    };
    tell(told);
}

/// Tells of every step, then how it ended.
fn follow(
    mut simulation: Simulation,
    sequence: &Sequence,
    stopwatch: &mut Stopwatch,
    tell: &mut dyn FnMut(Line) -> bool,
) {
    let mut step = 0;
    let mut tell_all = || -> Result<bool, Problem> {
        let (steps, level) = (sequence.steps.len(), sequence.level.name());
        let begin = BeginLine::new(steps, level, simulation.effects(), simulation.triangles());
        if !tell(Line::Going(line(&SimulateLine::Begin(begin))?)) {
            return Ok(false);
        }
        while let Some(outcome) = simulation.step(stopwatch).map_err(from_sequence)? {
            let stages = stopwatch.take("write");
            if !tell(Line::Going(line(&SimulateLine::Step(Box::new(StepLine::new(&outcome, &stages))))?)) {
                return Ok(false);
            }
            step += 1;
        }
        Ok(true)
    };
    let told = tell_all();
    let last = match &told {
        Ok(false) => return,
        Ok(true) => SimulateLine::End(EndLine { steps: step }),
        Err(problem) => {
            let time_s = sequence.steps.get(step).map_or(0.0, |step| step.time_s);
            SimulateLine::Error(ErrorLine { step, time_s, problem: problem.document() })
        }
    };
    // Numbers of a problem are finite or text, so this line can always be written.
    let bytes = line(&last).unwrap_or_default();
    tell(Line::Last { bytes, complete: told.is_ok() });
}

/// The JSON of one line and its end.
fn line(line: &SimulateLine) -> Result<Vec<u8>, Problem> {
    let mut bytes = write(line, Layout::Compact).map_err(Problem::internal)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The lines of a simulation that is under way.
pub struct Lines {
    lines: mpsc::Receiver<Line>,
    /// The simulation's place among those that may be at work, held until its last line is read.
    _permit: OwnedSemaphorePermit,
}

impl Lines {
    /// The lines as they come, and the simulation's place.
    pub fn new(lines: mpsc::Receiver<Line>, permit: OwnedSemaphorePermit) -> Self {
        Self { lines, _permit: permit }
    }

    /// The body of the response, once the simulation has begun.
    ///
    /// # Errors
    /// What it was refused with.
    pub async fn body(mut self) -> Result<Body, Problem> {
        let first = match self.lines.recv().await {
            None => return Err(Problem::internal("a simulation ended without a line")),
            Some(Line::Refused(problem)) => return Err(problem),
            Some(line) => line,
        };
        Ok(Body::from_stream(stream::unfold((Some(first), Some(self)), |(ready, lines)| async move {
            let mut lines = lines?;
            let line = match ready {
                Some(line) => Some(line),
                None => lines.lines.recv().await,
            };
            Some(match line {
                Some(Line::Going(bytes)) => (Ok(Bytes::from(bytes)), (None, Some(lines))),
                Some(Line::Last { bytes, .. }) => (Ok(Bytes::from(bytes)), (None, None)),
                // Nothing may follow lines without a last one but the break of the connection.
                None | Some(Line::Refused(_)) => (Err(io::Error::other("the simulation broke off")), (None, None)),
            })
        })))
    }
}
