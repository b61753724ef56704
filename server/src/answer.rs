//! One request, from bytes to bytes: read, understand, find the scene, predict, write.
//!
//! The same function answers over HTTP and on the command line.

use retina_core::predict::{Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Progress as _;

use crate::problem::{Problem, from_predict};
use crate::read::read;
use crate::scenes::Scenes;
use crate::stopwatch::Stopwatch;
use crate::understand;
use crate::wire::{PredictRequest, PredictResponse};
use crate::write::{Layout, write};

/// An answer with what led to it.
#[derive(Debug)]
pub struct Answer {
    /// The response.
    pub bytes: Vec<u8>,
    /// The question as it was understood.
    pub request: Request,
    /// What the core said.
    pub prediction: Prediction,
}

/// The answer to the request in `body`.
///
/// # Errors
/// The problem that the caller is told of.
pub fn answer(
    body: &[u8],
    scenes: &Scenes,
    workspace: &mut Workspace,
    stopwatch: &mut Stopwatch,
) -> Result<Answer, Problem> {
    let message: PredictRequest = read(body)?;
    let request = understand::request(&message)?;
    stopwatch.stage("prepare");
    let scene = scenes.get(message.scene.as_ref())?;
    predict(&scene, request, workspace, stopwatch, Layout::Compact)
}

/// The answer to a request that is understood, in a scene that is prepared.
///
/// # Errors
/// The problem that the caller is told of.
pub fn predict(
    scene: &PreparedScene,
    request: Request,
    workspace: &mut Workspace,
    stopwatch: &mut Stopwatch,
    layout: Layout,
) -> Result<Answer, Problem> {
    let prediction = scene.predict(&request, workspace, stopwatch).map_err(from_predict)?;
    let response = PredictResponse::new(&prediction, stopwatch.finish());
    let bytes = write(&response, layout).map_err(Problem::internal)?;
    Ok(Answer { bytes, request, prediction })
}
