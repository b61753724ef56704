//! Many poses in one request: read and understood once, computed in pieces on the numerical threads, written as they are done.
//!
//! Contract: a piece is as many poses as take a few milliseconds, so others are served between two pieces; no more pieces are held than there are
//! threads, so a client that reads slowly slows its own batch; when the client goes, the piece at work stops at its next iteration and
//! none follows. Pieces wait for their place in the queue, and do not count among the requests that are refused.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use futures_util::stream::{self, Stream, StreamExt as _};
use retina_core::predict::budget::DEFAULT_LEVEL;
use retina_core::predict::{PreparedScene, Request, Workspace};
use retina_core::progress::Progress as _;
use serde_json::json;

use crate::answer::{Computed, Question, compute};
use crate::metrics::Metrics;
use crate::pool::{Pool, PoolError, Ticket};
use crate::problem::{Kind, Problem};
use crate::read::read;
use crate::scenes::{Scenes, shared_triangles};
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::understand::{self, Shared};
use crate::wire::batch::{BatchAnswer, BatchRequest};
use crate::write::{Layout, write};

/// What a piece is expected to take at most, where it has more than one pose.
const PIECE: Duration = Duration::from_millis(10);

/// Poses of a piece at most.
const MOST_IN_A_PIECE: usize = 64;

/// A batch that is understood.
pub struct Batch {
    scene: Arc<PreparedScene>,
    shared: Shared,
    /// The poses; one that makes no sense has its problem in its place.
    requests: Vec<Result<Request, Problem>>,
}

/// What bounds a batch.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Poses.
    pub poses: usize,
    /// The work on one pose.
    pub each: Duration,
    /// From arrival to the last answer.
    pub whole: Duration,
    /// Pieces at work at once.
    pub pieces: usize,
}

/// Reads and understands a batch, and prepares its scene.
///
/// # Errors
/// The problem of what all poses share.
pub fn plan(body: &[u8], most: usize, scenes: &Scenes) -> Result<Batch, Problem> {
    let message: BatchRequest = read(body)?;
    let count = message.poses.len();
    if count == 0 || count > most {
        let (detail, allowed) =
            (format!("there are {count} poses; one batch may have 1 to {most}"), format!("1 to {most}"));
        return Err(Problem::field(Kind::OutOfRange, "poses", Some(json!(count)), allowed, detail));
    }
    let shared = understand::shared(message.accuracy.as_ref(), message.effects.as_ref())?;
    let scene = scenes.get(message.scene.as_ref())?;
    let requests = message.poses.iter().map(|pose| understand::batched(&shared, pose));
    let requests = requests.enumerate().map(|(index, request)| request.map_err(|problem| at(index, problem)));
    let requests = requests.collect();
    Ok(Batch { scene, shared, requests })
}

fn at(index: usize, problem: Problem) -> Problem {
    problem.within(&format!("poses[{index}]"))
}

/// Poses of a piece, where each takes so long.
pub fn piece_size(each: Duration) -> usize {
    let in_time = (PIECE.as_secs_f64() / each.as_secs_f64().max(1e-9)) as usize;
    in_time.clamp(1, MOST_IN_A_PIECE)
}

/// The answers as pieces of one JSON object.
pub fn answers(
    batch: Batch,
    pool: Arc<Pool>,
    (times, metrics): (Arc<Times>, Arc<Metrics>),
    limits: Limits,
    arrived: Instant,
) -> Result<impl Stream<Item = Result<Bytes, PoolError>>, Problem> {
    let each = times.mean(batch.shared.budget.level.unwrap_or(DEFAULT_LEVEL));
    let size = piece_size(each);
    let triangles = shared_triangles(&batch.scene)?;
    let mut head = br#"{"triangles":"#.to_vec();
    head.extend(write(&triangles, Layout::Compact).map_err(Problem::internal)?);
    head.extend_from_slice(br#","answers":["#);
    let count = batch.requests.len();
    let (batch, began) = (Arc::new(batch), move || (0..count).step_by(size));
    let pieces = stream::iter(began()).map(move |first| {
        let range = first..count.min(first + size);
        let ticket = Ticket { cost: each * range.len() as u32, longest_wait: None };
        let (batch, times, metrics, pool) =
            (Arc::clone(&batch), Arc::clone(&times), Arc::clone(&metrics), Arc::clone(&pool));
        async move {
            let job = || {
                let (batch, times, metrics, range) =
                    (Arc::clone(&batch), Arc::clone(&times), Arc::clone(&metrics), range.clone());
                move |workspace: &mut Workspace, abandoned: &dyn Fn() -> bool| {
                    let mut text = Vec::new();
                    for index in range {
                        if abandoned() {
                            break;
                        }
                        if index > 0 {
                            text.push(b',');
                        }
                        let left = limits.whole.saturating_sub(arrived.elapsed()).min(limits.each);
                        let mut stopwatch = Stopwatch::start(Instant::now(), left, abandoned);
                        text.extend(batch.answer(index, &times, &metrics, workspace, &mut stopwatch));
                    }
                    Bytes::from(text)
                }
            };
            pool.run_patiently(ticket, job).await
        }
    });
    let tail = stream::once(async move {
        let total_us = arrived.elapsed().as_nanos() as f64 / 1e3;
        Ok(Bytes::from(format!(r#"],"total_us":{total_us:?}}}"#)))
    });
    Ok(stream::once(async { Ok(Bytes::from(head)) }).chain(pieces.buffered(limits.pieces)).chain(tail))
}

impl Batch {
    /// The JSON of one answer.
    fn answer(
        &self,
        index: usize,
        times: &Times,
        metrics: &Metrics,
        workspace: &mut Workspace,
        stopwatch: &mut Stopwatch,
    ) -> Vec<u8> {
        stopwatch.stage("prepare");
        let answered = self.requests[index].clone().and_then(|request| {
            let question = Question { request, budget: self.shared.budget, times };
            let Computed { request, prediction, .. } =
                compute(&self.scene, question, workspace, stopwatch).map_err(|problem| at(index, problem))?;
            metrics.predicted(&self.scene, &request, &prediction, stopwatch.finish());
            write(&BatchAnswer::Prediction(Box::new((&prediction).into())), Layout::Compact).map_err(Problem::internal)
        });
        // A problem may repeat a `null` that the client wrote, which an answer never has.
        answered
            .unwrap_or_else(|problem| serde_json::to_vec(&BatchAnswer::Problem(problem.document())).unwrap_or_default())
    }
}
