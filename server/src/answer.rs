//! One request, from bytes to bytes: read, understand, find the scene, choose the level, predict, write.
//!
//! The same function answers over HTTP and on the command line.

use std::sync::Arc;
use std::time::{Duration, Instant};

use retina_core::predict::budget::{Budget, DEFAULT_LEVEL};
use retina_core::predict::{Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Progress as _;

use crate::problem::{Problem, from_predict};
use crate::read::read;
use crate::scenes::Scenes;
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::understand;
use crate::wire::{PredictRequest, PredictResponse};
use crate::write::{Layout, write};

/// An answer with what led to it.
pub struct Answer {
    /// The response.
    pub bytes: Vec<u8>,
    /// The scene that it is about.
    pub scene: Arc<PreparedScene>,
    /// The question as it was understood.
    pub request: Request,
    /// What the core said.
    pub prediction: Prediction,
    /// See [`Computed::accounted`].
    pub accounted: Option<Duration>,
}

/// A prediction with the level that was chosen.
pub struct Computed {
    /// The request.
    pub request: Request,
    /// What the core said.
    pub prediction: Prediction,
    /// Where a time or an error was asked for: what passed before the level was chosen, and what the prediction took. What the answer takes besides is
    /// [`Times::around_ms`].
    pub accounted: Option<Duration>,
}

/// The answer to the request in `body`.
///
/// # Errors
/// The problem that the caller is told of.
pub fn answer(
    body: &[u8],
    scenes: &Scenes,
    times: &Times,
    workspace: &mut Workspace,
    stopwatch: &mut Stopwatch,
) -> Result<Answer, Problem> {
    let message: PredictRequest = read(body)?;
    let (request, budget) = understand::request(&message)?;
    stopwatch.stage("prepare");
    let scene = scenes.get(message.scene.as_ref())?;
    predict(&scene, Question { request, budget, times }, workspace, stopwatch, Layout::Compact)
}

/// A request that is understood, and what its answer must keep.
pub struct Question<'a> {
    /// The request; its level is the budget's choice.
    pub request: Request,
    /// What the answer must keep.
    pub budget: Budget,
    /// How long the levels take.
    pub times: &'a Times,
}

/// The answer to a request that is understood, in a scene that is prepared.
///
/// # Errors
/// The problem that the caller is told of.
pub fn predict(
    scene: &Arc<PreparedScene>,
    question: Question,
    workspace: &mut Workspace,
    stopwatch: &mut Stopwatch,
    layout: Layout,
) -> Result<Answer, Problem> {
    let Computed { request, prediction, accounted } = compute(scene, question, workspace, stopwatch)?;
    let response = PredictResponse::new(&prediction, stopwatch.finish());
    let bytes = write(&response, layout).map_err(Problem::internal)?;
    Ok(Answer { bytes, scene: Arc::clone(scene), request, prediction, accounted })
}

/// As [`predict`], without writing it down: the request with the level chosen, and what the core says.
///
/// # Errors
/// The problem that the caller is told of.
pub fn compute(
    scene: &PreparedScene,
    question: Question,
    workspace: &mut Workspace,
    stopwatch: &mut Stopwatch,
) -> Result<Computed, Problem> {
    let Question { mut request, mut budget, times } = question;
    let mut broken = Vec::new();
    let mut waited = None;
    request.level = match budget.level {
        Some(level) if !budget.promises() => level,
        None if !budget.promises() => DEFAULT_LEVEL,
        _ => {
            stopwatch.stage("choose");
            let spent = *waited.insert(stopwatch.elapsed());
            let besides_ms = spent.as_secs_f64() * 1e3 + times.around_ms();
            budget.max_time_ms = budget.max_time_ms.map(|most| (most - besides_ms).max(0.0));
            let choice = scene.choose(&request, &budget, &times.expected_ms()).map_err(from_predict)?;
            broken = choice.broken;
            choice.level
        }
    };
    let start = Instant::now();
    let mut prediction = scene.predict(&request, workspace, stopwatch).map_err(from_predict)?;
    let predicted = start.elapsed();
    times.record(request.level, predicted);
    prediction.warnings.append(&mut broken);
    Ok(Computed { request, prediction, accounted: waited.map(|waited| waited + predicted) })
}
