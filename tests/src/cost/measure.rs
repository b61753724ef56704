//! Errors and times of contestants on one panel.

use std::time::Instant;

use indicatif::ProgressBar;
use retina_core::comparison::{node_errors_um, quantile};
use retina_core::predict::{Level, Prediction, PreparedScene, Request, Workspace};
use serde::{Deserialize, Serialize};

use super::contestant::Contestant;
use super::panel::Question;

/// What a contestant's errors and times come to on one panel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// The contestant.
    pub name: String,
    /// Which knob it turns.
    pub knob: String,
    /// Requests answered.
    pub answered: usize,
    /// Requests without an answer, of those that the reference answered.
    pub failed: usize,
    /// Mean error of all nodes (µm).
    pub mean_um: f64,
    /// Error of a request's worst node: median over requests (µm).
    pub median_um: f64,
    /// The same: 99 % of the requests are no further off (µm).
    pub p99_um: f64,
    /// The same: largest (µm).
    pub max_um: f64,
    /// Root mean square of the errors over that of the motion (%).
    pub rms_percent: f64,
    /// Time of an answer: median over requests (ms).
    pub median_ms: f64,
    /// The same: 99 % of the requests take no longer (ms).
    pub p99_ms: f64,
    /// Newton iterations, median.
    pub iterations: f64,
}

/// A panel measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The panel.
    pub panel: String,
    /// What it holds.
    pub caption: String,
    /// Requests that the reference answered.
    pub requests: usize,
    /// Requests that it did not.
    pub without_truth: usize,
    /// Largest displacement of a request: median (µm).
    pub motion_median_um: f64,
    /// The same: largest (µm).
    pub motion_max_um: f64,
    /// What refinement may still change of the reference: median over requests of the bound that it is held to (µm).
    pub floor_um: f64,
    /// Mean error of all nodes if nothing moved (µm).
    pub nothing_moves_um: f64,
    /// The reference itself: its time, and the floor as its error.
    pub reference: Standing,
    /// Everybody else.
    pub standings: Vec<Standing>,
}

/// An answer slower than this is timed once, a faster one repeatedly (ms).
const SLOW_MS: f64 = 100.0;
/// Absolute and relative change that refinement of the reference may still bring (µm, share of the largest displacement).
const REFERENCE_CHANGE: (f64, f64) = (0.5, 0.01);

/// Errors and times of one contestant as they come.
#[derive(Default)]
pub(super) struct Tally {
    errors_um: Vec<f64>,
    worst_um: Vec<f64>,
    ms: Vec<f64>,
    iterations: Vec<f64>,
    failed: usize,
}

impl Tally {
    pub(super) fn standing(&self, contestant: &Contestant, motion_um2: f64) -> Standing {
        let squares: f64 = self.errors_um.iter().map(|e| e * e).sum();
        Standing {
            name: contestant.name.clone(),
            knob: contestant.knob.to_owned(),
            answered: self.worst_um.len(),
            failed: self.failed,
            mean_um: self.errors_um.iter().sum::<f64>() / self.errors_um.len() as f64,
            median_um: quantile(&self.worst_um, 0.5),
            p99_um: quantile(&self.worst_um, 0.99),
            max_um: quantile(&self.worst_um, 1.0),
            rms_percent: 100.0 * (squares / motion_um2).sqrt(),
            median_ms: quantile(&self.ms, 0.5),
            p99_ms: quantile(&self.ms, 0.99),
            iterations: quantile(&self.iterations, 0.5),
        }
    }
}

/// Measures everybody on `questions`; each fast answer is timed `repeats` times after one that warms up, and counts with its median.
pub fn measure(
    (panel, caption): (&str, &str),
    questions: &[Question],
    contestants: &[Contestant],
    repeats: usize,
    bar: &ProgressBar,
) -> Measured {
    let reference = Contestant::level(Level::Reference);
    let mut workspace = Workspace::default();
    let mut tallies: Vec<Tally> = contestants.iter().map(|_| Tally::default()).collect();
    let mut truths = Tally::default();
    let (mut motion_um2, mut motions, mut floors, mut nodes, mut moved_um) = (0.0, Vec::new(), Vec::new(), 0, 0.0);
    for question in questions {
        bar.inc(1);
        let begun = Instant::now();
        let Ok(truth) = reference.answer(&question.scene, &question.request, &mut workspace) else {
            truths.failed += 1;
            continue;
        };
        truths.ms.push(begun.elapsed().as_secs_f64() * 1e3);
        truths.iterations.push(truth.solver.iterations as f64);
        let largest_um = truth.displacement_um.iter().copied().fold(0.0, f64::max);
        let floor_um = REFERENCE_CHANGE.0.max(REFERENCE_CHANGE.1 * largest_um);
        motion_um2 += truth.displacement_um.iter().map(|um| um * um).sum::<f64>();
        moved_um += truth.displacement_um.iter().sum::<f64>();
        nodes += truth.displacement_um.len();
        motions.push(largest_um);
        floors.push(floor_um);
        for (contestant, tally) in contestants.iter().zip(&mut tallies) {
            let errors = |answer: &Prediction| node_errors_um(&answer.vertices, &truth.vertices);
            tally.add(contestant, (&question.scene, &question.request), errors, repeats, &mut workspace);
        }
    }
    truths.worst_um.clone_from(&floors);
    truths.errors_um.clone_from(&floors);
    Measured {
        panel: panel.to_owned(),
        caption: caption.to_owned(),
        requests: motions.len(),
        without_truth: truths.failed,
        motion_median_um: quantile(&motions, 0.5),
        motion_max_um: quantile(&motions, 1.0),
        floor_um: quantile(&floors, 0.5),
        nothing_moves_um: moved_um / nodes as f64,
        reference: truths.standing(&reference, motion_um2),
        standings: contestants.iter().zip(&tallies).map(|(c, tally)| tally.standing(c, motion_um2)).collect(),
    }
}

impl Tally {
    /// Answers a request once to warm up and `repeats` times more against the clock; `errors_um` are the node errors of its answer.
    pub(super) fn add(
        &mut self,
        contestant: &Contestant,
        (scene, request): (&PreparedScene, &Request),
        errors_um: impl Fn(&Prediction) -> Vec<f64>,
        repeats: usize,
        workspace: &mut Workspace,
    ) {
        let own = contestant.scene(scene);
        let scene = own.as_ref().unwrap_or(scene);
        let mut timed = || {
            let begun = Instant::now();
            let answer = contestant.answer(scene, request, workspace);
            (begun.elapsed().as_secs_f64() * 1e3, answer)
        };
        let (first_ms, answer) = timed();
        let Ok(answer) = answer else {
            self.failed += 1;
            return;
        };
        let ms = match first_ms < SLOW_MS {
            true => quantile(&(0..repeats).map(|_| timed().0).collect::<Vec<_>>(), 0.5),
            false => first_ms,
        };
        let errors = errors_um(&answer);
        self.worst_um.push(errors.iter().copied().fold(0.0, f64::max));
        self.errors_um.extend(errors);
        self.ms.push(ms);
        self.iterations.push(answer.solver.iterations as f64);
    }
}
