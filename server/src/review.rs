//! `retina-server review`: a level beside the ground truth on random requests, recorded for the rerun viewer.
//!
//! Contract: the requests follow from scene, tip and seed alone. A request outside of what the tissue model holds is drawn again and
//! counted; one that a level cannot answer stays as a sample without surfaces and is counted with the level and the cause. Ctrl-C
//! ends the review after closing the recording, so what was compared until then can be opened. Every time is that of one thread.
//!
//! Not here: what is recorded where (`recording::entities`).

mod draw;
mod sample;
mod tally;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::Point3;
use retina_core::predict::{Level, PreparedScene, Request, Workspace};
use thiserror::Error;

use crate::config::ReviewArgs;
use crate::problem::{Problem, from_predict};
use crate::recording::RecordingError;
use crate::recording::entities::ReviewLog;
use crate::stopwatch::Stopwatch;
use crate::understand;
use draw::Draws;
pub use sample::{Compared, Failure, Sample, Timed};
pub use tally::Tally;

/// Why a review ended without a result.
#[derive(Debug, Error)]
pub enum ReviewError {
    /// The scene cannot be used.
    #[error("{}", .0.detail)]
    Scene(Problem),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Neither a file nor a viewer is given.
    #[error("nowhere to record to: give --save or --connect")]
    NoDestination,
    /// Random requests for this scene are refused, all of them.
    #[error("of {0} random requests in a row the scene takes none")]
    NothingFits(usize),
}

/// The command; tells of its progress on standard error and of the result on standard output.
pub fn main(args: &ReviewArgs) -> ExitCode {
    let stop = Arc::new(AtomicBool::new(false));
    stop_on_ctrl_c(Arc::clone(&stop));
    let bar = progress_bar(args.count);
    let result = run(args, &|| stop.load(Ordering::Relaxed), &bar);
    bar.finish_and_clear();
    match result {
        Ok(tally) => {
            println!("{tally}");
            if let Some(path) = &args.destination.save {
                println!(
                    "Open it with `rerun {}` (the viewer of version 0.36, `pip install rerun-sdk`).",
                    path.display()
                );
            }
            if tally.compared() > 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(error) => {
            eprintln!("retina-server review: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Compares and records until all samples are there or `stopped` says so.
///
/// # Errors
/// [`ReviewError`].
pub fn run(args: &ReviewArgs, stopped: &dyn Fn() -> bool, bar: &ProgressBar) -> Result<Tally, ReviewError> {
    let scene = understand::built_in(&args.scene).map_err(ReviewError::Scene)?;
    let scene = PreparedScene::new(scene).map_err(|error| ReviewError::Scene(from_predict(error)))?;
    let rest = rest(&scene)?;
    let mut log = ReviewLog::open(&args.destination.chosen().ok_or(ReviewError::NoDestination)?)?;
    let mut draws = Draws::new(&scene.scene().tissue, args.seed, args.tip);
    let mut tally = Tally::new(args);
    let mut workspace = Workspace::default();
    for index in 0..args.count {
        let request = draws.next(&scene, args.level, &mut workspace)?;
        let outcome = compare(&scene, &request, &mut workspace, stopped);
        if stopped() {
            tally.interrupted();
            break;
        }
        let sample = Sample { index: index.into(), scene: args.scene.clone(), request, rest: rest.clone(), outcome };
        if let Err(Failure { level, problem }) = &sample.outcome {
            bar.suspend(
                || tracing::warn!(sample = index, level = level.name(), detail = %problem.detail, "no comparison"),
            );
        }
        tally.add(&sample);
        log.write(&sample)?;
        bar.set_message(tally.so_far());
        bar.inc(1);
    }
    tally.refused(draws.refused());
    log.close()?;
    Ok(tally)
}

/// The nodes at rest, scene coordinates (mm).
fn rest(scene: &PreparedScene) -> Result<Vec<Point3<f64>>, ReviewError> {
    let patch =
        scene.scene().patch(&Point3::origin()).map_err(|error| ReviewError::Scene(from_predict(error.into())))?;
    Ok(patch.vertices.iter().map(|vertex| patch.scene_from_patch * vertex).collect())
}

/// The request at its level and at `reference`.
fn compare(
    scene: &PreparedScene,
    request: &Request,
    workspace: &mut Workspace,
    stopped: &dyn Fn() -> bool,
) -> Result<Compared, Failure> {
    // Once for the caches, once for the clock: the level's time is that of a service that is warm.
    timed(scene, request, workspace, stopped)?;
    let predicted = timed(scene, request, workspace, stopped)?;
    let truth = timed(scene, &Request { level: Level::Reference, ..request.clone() }, workspace, stopped)?;
    Ok(Compared::new(predicted, truth))
}

fn timed(
    scene: &PreparedScene,
    request: &Request,
    workspace: &mut Workspace,
    stopped: &dyn Fn() -> bool,
) -> Result<Timed, Failure> {
    let started = Instant::now();
    let mut stopwatch = Stopwatch::start(started, Duration::MAX / 4, stopped);
    match scene.predict(request, workspace, &mut stopwatch) {
        Ok(prediction) => Ok(Timed { prediction, took: started.elapsed() }),
        Err(error) => Err(Failure { level: request.level, problem: from_predict(error) }),
    }
}

/// Sets `stop` at the first ctrl-c; without a way to hear of it the review runs to its end.
fn stop_on_ctrl_c(stop: Arc<AtomicBool>) {
    std::thread::spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else { return };
        if runtime.block_on(tokio::signal::ctrl_c()).is_ok() {
            stop.store(true, Ordering::Relaxed);
        }
    });
}

fn progress_bar(count: u32) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len}, {eta} left · {msg}");
    let bar = ProgressBar::new(count.into());
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
