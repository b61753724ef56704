//! The question and the answer of `POST /v1/predict/batch`: many poses in one scene.
//!
//! Contract: there is an answer for every pose and in their order, each a prediction or a problem; what all poses share is wrong for all and is
//! the problem of the whole request.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::fixed::{Triangle, Vector};
use super::object;
use super::pose::PoseAnswer;
use super::request::{AccuracySpec, ControlName, EffectsSpec, NeedleSpec, SceneChoice};
use crate::problem::ProblemDocument;

/// Many poses and what they are pressed into.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "scene": "macula",
    "poses": [
        {"needle": {"tip_mm": [0.12, -0.05, 0.0], "gauge": "25G"}, "force_mn": [0.0, 0.0, -0.4]},
        {"needle": {"tip_mm": [0.12, -0.05, -0.05]}, "control": "pose"}
    ],
    "accuracy": {"level": "linear"}
}))]
pub struct BatchRequest {
    /// The poses; the service says at `GET /v1/about` how many there may be.
    #[serde(deserialize_with = "object::list")]
    pub poses: Vec<BatchPose>,
    /// A built-in scene by name, or a scene written out; `macula` when left out.
    pub scene: Option<SceneChoice>,
    /// How accurate, and at what cost, the same for all; level `coarse` when left out. A time is that of each pose by itself.
    #[serde(default, deserialize_with = "object::optional")]
    pub accuracy: Option<AccuracySpec>,
    /// Which effects to simulate, the same for all, as in a prediction.
    pub effects: Option<EffectsSpec>,
}

/// A needle and its force, as in a prediction.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BatchPose {
    /// The needle before it moves.
    #[serde(deserialize_with = "object::required")]
    pub needle: NeedleSpec,
    /// Force of the needle on the tissue, scene frame, mN. Required under `"control": "force"`, refused under `"pose"`.
    pub force_mn: Option<Vector>,
    /// What is given about the needle's motion; `force` when left out.
    #[serde(default)]
    pub control: ControlName,
}

/// The answers.
#[derive(Serialize, ToSchema)]
pub struct BatchResponse<'a> {
    /// Triangles between the nodes of every surface, counter-clockwise seen from the vitreous; empty for a mesh, whose answers bring their own.
    #[schema(value_type = Vec<Triangle>)]
    pub triangles: &'a [[usize; 3]],
    /// One for each pose, in their order.
    pub answers: Vec<BatchAnswer<'a>>,
    /// From the arrival of the request until the last answer, µs.
    pub total_us: f64,
}

/// The answer to one pose.
#[derive(Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BatchAnswer<'a> {
    /// What the surface looks like.
    Prediction(Box<PoseAnswer<'a>>),
    /// Why there is none; fields are told from `poses[i]` on.
    Problem(ProblemDocument<'a>),
}
