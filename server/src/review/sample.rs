//! One request of a review with its two answers.

use std::time::Duration;

use nalgebra::Point3;
use retina_core::comparison::{ErrorStatistics, node_errors_um};
use retina_core::predict::{Level, Prediction, Request};

use crate::problem::Problem;

/// One request of a review.
#[derive(Clone, Debug)]
pub struct Sample {
    /// From 0.
    pub index: i64,
    /// The built-in scene.
    pub scene: String,
    /// The question, at the level that is compared.
    pub request: Request,
    /// The nodes at rest, scene coordinates (mm).
    pub rest: Vec<Point3<f64>>,
    /// Both answers, or why one is missing.
    pub outcome: Result<Compared, Failure>,
}

/// A level that gave no answer.
#[derive(Clone, Debug)]
pub struct Failure {
    /// Which one.
    pub level: Level,
    /// Why.
    pub problem: Problem,
}

/// An answer with the wall time that it took.
#[derive(Clone, Debug)]
pub struct Timed {
    /// The answer.
    pub prediction: Prediction,
    /// How long it took.
    pub took: Duration,
}

/// Both answers.
#[derive(Clone, Debug)]
pub struct Compared {
    /// That of the level.
    pub predicted: Timed,
    /// That of level `reference`.
    pub truth: Timed,
    /// Distance of each predicted node from the true one (µm).
    pub errors_um: Vec<f64>,
    /// Statistics of these distances.
    pub statistics: ErrorStatistics,
}

impl Compared {
    /// The two answers side by side.
    pub fn new(predicted: Timed, truth: Timed) -> Self {
        let errors_um = node_errors_um(&predicted.prediction.vertices, &truth.prediction.vertices);
        let statistics = ErrorStatistics::new(&errors_um);
        Self { predicted, truth, errors_um, statistics }
    }
}
