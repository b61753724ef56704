//! What is recorded: the one file that names entities, units and timelines, and the only one that logs.
//!
//! | entity | what | unit |
//! |---|---|---|
//! | `predicted/…`, `ground_truth/…` (review), `answer/…` (service) | one answer each: | scene frame, mm |
//! | `…/surface` | deformed patch with vertex normals, coloured by displacement | colours µm |
//! | `…/edges`, `…/rest` | edges of its triangles, deformed and at rest | mm |
//! | `…/needle` | the needle where it ended up, true radius and tip: a mesh, written when the needle changes, and its pose | mm |
//! | `…/force_1_mm_per_mN`, `…/reaction_1_mm_per_mN` | force of the needle, which ends at the end of the shaft; reaction of the tissue, from the tip | 1 mm per mN |
//! | `…/scale` | the colours' bar | µm |
//! | `error/surface` | ground truth, coloured by the distance of each predicted node | colours µm |
//! | `error/arrows_x50` | from each true node towards the predicted one, 50 times as long | 50 mm per mm |
//! | `statistics/mean`, `p99`, `max` | node errors of the sample | µm |
//! | `displacement/largest` | of the ground truth, or of the answer | µm |
//! | `time/predicted_ms`, `time/ground_truth_s`, `time/answer_ms` | wall time of the answer | as named |
//! | `iterations/…` | Newton iterations | 1 |
//! | `request` | what was asked and how it went | text |
//! | `failures` | refusals and failures | text |
//! | `dropped/requests` | service: requests that the recording lost so far | 1 |
//! | `audit/measured`, `audit/promised` | service: error of an audited answer's worst node, and its promised 95 % bound; by `wall_time` alone | µm |
//!
//! Timelines: `sample` (review, index from 0); `wall_time` (service, when the request had arrived) and `request` (service, its
//! number from 1; a gap is a request that the recording lost). What a sample or request does not have is cleared.

use std::time::{SystemTime, UNIX_EPOCH};

use rerun::components::MarkerShape;
use rerun::{
    Clear, Color, RecordingStream, RecordingStreamResult, Scalars, SeriesLines, SeriesPoints, TextDocument, TextLog,
    TextLogLevel, ViewCoordinates,
};
use retina_core::needle::NeedleShape;
use retina_core::predict::{Control, Prediction, Request};

use super::colours::{Map, Scale};
use super::layout::Layout;
use super::needle_mesh::SHAFT_MM;
use super::request_text;
use super::shapes::{EDGE, FORCE, REACTION, REST_EDGE, arrow, edges, error_arrows, needle, pose, surface};
use super::{Destination, Exchange, RecordingError, Sink, stream};
use crate::audit::Audited;
use crate::review::{Compared, Sample};

/// Timeline of a review.
pub const SAMPLE: &str = "sample";
/// Timeline of a service, in the order of the answers.
pub const REQUEST_NUMBER: &str = "request";
/// Timeline of a service, by the clock.
pub const WALL_TIME: &str = "wall_time";
/// Root of the predicted answer.
pub const PREDICTED: &str = "predicted";
/// Root of the ground truth.
pub const GROUND_TRUTH: &str = "ground_truth";
/// Root of the differences.
pub const ERROR: &str = "error";
/// Root of a service's answer.
pub const ANSWER: &str = "answer";
/// Root of the error statistics (µm).
pub const STATISTICS: &str = "statistics";
/// Root of the largest displacement (µm).
pub const DISPLACEMENT: &str = "displacement";
/// Root of the times.
pub const TIME: &str = "time";
/// Root of the Newton iterations.
pub const ITERATIONS: &str = "iterations";
/// What was asked.
pub const REQUEST: &str = "request";
/// What went wrong.
pub const FAILURES: &str = "failures";
/// What the recording lost.
pub const DROPPED: &str = "dropped";

/// How much longer than the error its arrows are; stands in the entity's name.
pub const ERROR_MAGNIFICATION: f64 = 50.0;
/// Length of a force's arrow (mm per mN); stands in the entity's name.
pub const ARROW_MM_PER_MN: f64 = 1.0;

const REVIEW: &str = "retina_review";
const SERVICE: &str = "retina_service";

/// Series of a review: path, name with its unit, colour.
const REVIEW_SERIES: [(&str, &str, u32); 8] = [
    ("statistics/mean", "mean", 0x4fc3_f7ff),
    ("statistics/p99", "p99", 0xffb3_00ff),
    ("statistics/max", "max", 0xef53_50ff),
    ("displacement/largest", "largest", 0x7ad1_51ff),
    ("time/predicted_ms", "predicted (ms)", 0x4fc3_f7ff),
    ("time/ground_truth_s", "ground truth (s)", 0xeeee_eeff),
    ("iterations/predicted", "predicted", 0x4fc3_f7ff),
    ("iterations/ground_truth", "ground truth", 0xeeee_eeff),
];

/// Series of a service, likewise.
const SERVICE_SERIES: [(&str, &str, u32); 6] = [
    ("displacement/largest", "largest", 0x7ad1_51ff),
    ("time/answer_ms", "answer", 0x4fc3_f7ff),
    ("iterations/answer", "answer", 0x4fc3_f7ff),
    ("dropped/requests", "missing", 0xef53_50ff),
    ("audit/measured", "measured (µm)", 0xef53_50ff),
    ("audit/promised", "promised for 95 of 100 (µm)", 0xffb3_00ff),
];

/// What stays the same throughout a recording.
fn log_static(stream: &RecordingStream, series: &[(&str, &str, u32)]) -> RecordingStreamResult<()> {
    stream.log_static("/", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    for &(path, name, rgba) in series {
        let colour = Color::from_u32(rgba);
        stream.log_static(path, &SeriesLines::new().with_names([name]).with_colors([colour]).with_widths([1.0]))?;
        let points = SeriesPoints::new().with_names([name]).with_colors([colour]);
        stream.log_static(path, &points.with_markers([MarkerShape::Circle]).with_marker_sizes([3.0]))?;
    }
    Ok(())
}

fn scalar(stream: &RecordingStream, path: &str, value: f64) -> RecordingStreamResult<()> {
    stream.log(path, &Scalars::single(value))
}

/// The answers below one root.
struct Answers {
    root: &'static str,
    /// The needle that the viewer has; its triangles are written only when it changes.
    drawn: Option<NeedleShape>,
}

impl Answers {
    fn new(root: &'static str) -> Self {
        Self { root, drawn: None }
    }

    fn write(
        &mut self,
        stream: &RecordingStream,
        request: &Request,
        prediction: &Prediction,
        scale: &Scale,
    ) -> RecordingStreamResult<()> {
        let (root, tip) = (self.root, &prediction.needle.tip_mm);
        stream.log(format!("{root}/surface"), &surface(prediction, &prediction.displacement_um, scale))?;
        stream.log(format!("{root}/edges"), &edges(&prediction.vertices, &prediction.triangles, EDGE))?;
        stream.log(format!("{root}/needle"), &pose(&request.needle, tip))?;
        if self.drawn != Some(request.needle.shape) {
            stream.log(format!("{root}/needle"), &needle(&request.needle.shape))?;
            self.drawn = Some(request.needle.shape);
        }
        let force = format!("{root}/force_{ARROW_MM_PER_MN}_mm_per_mN");
        match &request.control {
            Control::Force(force_mn) => {
                let end = tip - request.needle.direction().into_inner() * SHAFT_MM;
                let push = arrow(&(end - force_mn * ARROW_MM_PER_MN), force_mn, "force", FORCE);
                stream.log(force, &push.with_show_labels(true))?;
            }
            Control::Pose => stream.log(force, &Clear::flat())?,
        }
        let reaction = arrow(tip, &prediction.needle.reaction_mn, "reaction", REACTION);
        // Its words would hide the contact; the viewer shows them under the mouse.
        stream.log(format!("{root}/reaction_{ARROW_MM_PER_MN}_mm_per_mN"), &reaction.with_show_labels(false))?;
        bar(stream, root, scale, "displacement")
    }

    fn clear(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.drawn = None;
        stream.log(self.root, &Clear::recursive())
    }
}

fn bar(stream: &RecordingStream, root: &str, scale: &Scale, quantity: &str) -> RecordingStreamResult<()> {
    stream.log(format!("{root}/scale"), &scale.bar())?;
    stream.log(format!("{root}/scale/labels"), &scale.labels(quantity))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// The ground truth with what the prediction misses.
fn error(
    stream: &RecordingStream,
    predicted: &Prediction,
    truth: &Prediction,
    errors_um: &[f64],
) -> RecordingStreamResult<()> {
    let scale = Scale::holding(Map::Error, errors_um);
    stream.log("error/surface", &surface(truth, errors_um, &scale))?;
    stream.log("error/edges", &edges(&truth.vertices, &truth.triangles, EDGE))?;
    let arrows = error_arrows(predicted, truth, errors_um, &scale);
    stream.log(format!("error/arrows_x{ERROR_MAGNIFICATION}"), &arrows)?;
    bar(stream, ERROR, &scale, "node error")
}

/// Writes a review.
pub struct ReviewLog {
    stream: RecordingStream,
    predicted: Answers,
    truth: Answers,
}

impl ReviewLog {
    /// Opens the destination.
    ///
    /// # Errors
    /// [`RecordingError::Open`].
    pub fn open(destination: &Destination) -> Result<Self, RecordingError> {
        let stream = stream::open(destination, REVIEW, Layout::Review)?;
        log_static(&stream, &REVIEW_SERIES).map_err(|error| RecordingError::Write(error.into()))?;
        Ok(Self { stream, predicted: Answers::new(PREDICTED), truth: Answers::new(GROUND_TRUTH) })
    }

    /// Writes one sample.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn write(&mut self, sample: &Sample) -> Result<(), RecordingError> {
        self.sample(sample).map_err(|error| RecordingError::Write(error.into()))
    }

    /// Waits until everything has arrived.
    ///
    /// # Errors
    /// [`RecordingError::Close`].
    pub fn close(self) -> Result<(), RecordingError> {
        stream::close(&self.stream)
    }

    fn sample(&mut self, sample: &Sample) -> RecordingStreamResult<()> {
        let stream = &self.stream;
        stream.set_time_sequence(SAMPLE, sample.index);
        stream.log(REQUEST, &TextDocument::from_markdown(request_text::sample(sample)))?;
        let Compared { predicted, truth, errors_um, statistics } = match &sample.outcome {
            Ok(compared) => compared,
            Err(failure) => {
                self.predicted.clear(stream)?;
                self.truth.clear(stream)?;
                stream.log(ERROR, &Clear::recursive())?;
                let text = format!("{}: {}", failure.level.name(), failure.problem.detail);
                return stream.log(FAILURES, &TextLog::new(text).with_level(TextLogLevel::ERROR));
            }
        };
        let shown = [&predicted.prediction, &truth.prediction];
        let scale = Scale::holding(Map::Displacement, shown.iter().flat_map(|shown| &shown.displacement_um));
        for (answers, prediction) in [&mut self.predicted, &mut self.truth].into_iter().zip(shown) {
            answers.write(stream, &sample.request, prediction, &scale)?;
            stream.log(format!("{}/rest", answers.root), &edges(&sample.rest, &prediction.triangles, REST_EDGE))?;
        }
        error(stream, &predicted.prediction, &truth.prediction, errors_um)?;
        scalar(stream, "statistics/mean", statistics.mean_um)?;
        scalar(stream, "statistics/p99", statistics.p99_um)?;
        scalar(stream, "statistics/max", statistics.max_um)?;
        scalar(stream, "displacement/largest", largest(&truth.prediction.displacement_um))?;
        scalar(stream, "time/predicted_ms", predicted.took.as_secs_f64() * 1e3)?;
        scalar(stream, "time/ground_truth_s", truth.took.as_secs_f64())?;
        scalar(stream, "iterations/predicted", predicted.prediction.solver.iterations as f64)?;
        scalar(stream, "iterations/ground_truth", truth.prediction.solver.iterations as f64)
    }
}

/// Writes what a service is asked and answers.
pub struct ServiceLog {
    stream: RecordingStream,
    answers: Answers,
}

impl ServiceLog {
    /// Opens the destination.
    ///
    /// # Errors
    /// [`RecordingError::Open`].
    pub fn open(destination: &Destination) -> Result<Self, RecordingError> {
        let stream = stream::open(destination, SERVICE, Layout::Service)?;
        log_static(&stream, &SERVICE_SERIES).map_err(|error| RecordingError::Write(error.into()))?;
        Ok(Self { stream, answers: Answers::new(ANSWER) })
    }

    fn exchange(&mut self, exchange: &Exchange, dropped: u64) -> RecordingStreamResult<()> {
        let stream = &self.stream;
        let since_epoch = exchange.arrived.duration_since(UNIX_EPOCH).unwrap_or_default();
        stream.set_time_sequence(REQUEST_NUMBER, exchange.number as i64);
        stream.set_timestamp_nanos_since_epoch(WALL_TIME, since_epoch.as_nanos() as i64);
        stream.log(REQUEST, &TextDocument::from_markdown(request_text::exchange(exchange)))?;
        scalar(stream, "time/answer_ms", exchange.took.as_secs_f64() * 1e3)?;
        scalar(stream, "dropped/requests", dropped as f64)?;
        match &exchange.outcome {
            Ok((request, prediction)) => {
                let scale = Scale::holding(Map::Displacement, &prediction.displacement_um);
                self.answers.write(stream, request, prediction, &scale)?;
                scalar(stream, "displacement/largest", largest(&prediction.displacement_um))?;
                scalar(stream, "iterations/answer", prediction.solver.iterations as f64)
            }
            Err(problem) => {
                self.answers.clear(stream)?;
                let text = format!("{}: {}", problem.kind.name(), problem.detail);
                stream.log(FAILURES, &TextLog::new(text).with_level(TextLogLevel::WARN))
            }
        }
    }
}

impl ServiceLog {
    /// An audit comes some time after its answer and belongs to no request of the timeline.
    fn audit(&mut self, audited: &Audited) -> RecordingStreamResult<()> {
        let stream = &self.stream;
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        stream.reset_time();
        stream.set_timestamp_nanos_since_epoch(WALL_TIME, since_epoch.as_nanos() as i64);
        scalar(stream, "audit/measured", audited.measured_um)?;
        scalar(stream, "audit/promised", audited.promised.p95_um)
    }
}

impl Sink for ServiceLog {
    fn audited(&mut self, audited: &Audited) -> Result<(), RecordingError> {
        self.audit(audited).map_err(|error| RecordingError::Write(error.into()))
    }

    fn write(&mut self, exchange: &Exchange, dropped: u64) -> Result<(), RecordingError> {
        self.exchange(exchange, dropped).map_err(|error| RecordingError::Write(error.into()))
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        stream::close(&self.stream)
    }
}
