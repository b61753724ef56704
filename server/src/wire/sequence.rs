//! The question and the answer of `POST /v1/simulate`.
//!
//! Contract: the answer is one JSON object a line, each with exactly one field: `begin`, then `step` again and again, then `end`, or `error` where a
//! step has no answer.

use std::time::Duration;

use nalgebra::{Point3, Vector3};
use retina_core::predict::EffectReport;
use retina_core::sequence::StepOutcome;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::fixed::{Quaternion, Triangle, Vector};
use super::object;
use super::request::{AccuracySpec, EffectsSpec, NeedleSpec, SceneChoice};
use super::response::{ContactAnswer, EffectAnswer, NeedleAnswer, SolverAnswer, TimeAnswer, points, vectors};
use super::scene::FillingSpec;
use crate::problem::ProblemDocument;

/// A needle, a timed list of what is done with it, and what it is pressed into.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "scene": "macula",
    "needle": {"tip_mm": [0.12, -0.05, 0.1], "gauge": "25G"},
    "steps": [
        {"time_s": 0.2, "force_mn": [0.0, 0.0, -0.4]},
        {"time_s": 1.2},
        {"time_s": 1.4, "force_mn": [0.0, 0.0, 0.0]}
    ]
}))]
pub struct SimulateRequest {
    /// The needle before the first step.
    #[serde(deserialize_with = "object::required")]
    pub needle: NeedleSpec,
    /// What is done, in order of time. The tissue is at rest at time 0.
    #[serde(deserialize_with = "object::list")]
    pub steps: Vec<StepSpec>,
    /// A built-in scene by name, or a scene written out; `macula` when left out.
    pub scene: Option<SceneChoice>,
    /// Level `coarse` (when left out) or `reference`.
    #[serde(default, deserialize_with = "object::optional")]
    pub accuracy: Option<AccuracySpec>,
    /// Which effects to simulate, the same in all steps: `auto` (those the sequence calls for, the default), `all`, or a list of names.
    pub effects: Option<EffectsSpec>,
}

/// One step. What is left out of the needle's pose is where the step before left it.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StepSpec {
    /// When the step's load is reached, s: 1e-6 to 1000 after the step before, or after 0.
    pub time_s: f64,
    /// Foremost point of the needle before it moves, scene frame, mm. Where friction is simulated, a needle that presses is dragged there straight along the tissue; a step
    /// of zero force before lifts it.
    pub tip_mm: Option<Vector>,
    /// Rotation from the needle's frame to the scene's, as x, y, z, w. Not together with `direction`.
    pub orientation_xyzw: Option<Quaternion>,
    /// The way the needle points, scene frame.
    pub direction: Option<Vector>,
    /// Force along which the needle advances until the tissue's reaction along it equals it, scene frame, mN; zero withdraws the needle. Left out: the
    /// needle stays where it is, and the reaction is the answer.
    pub force_mn: Option<Vector>,
    /// Fluid that is on the detached disc of `scene.bleb` at the step's time, injected or drawn off since the step before; as much as then when left out. The disc stays as wide as
    /// it is.
    #[serde(default, deserialize_with = "object::optional")]
    pub bleb: Option<FillingSpec>,
}

/// One line of the answer.
#[derive(Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SimulateLine<'a> {
    /// The first line: every step has been checked.
    Begin(BeginLine<'a>),
    /// A step.
    Step(Box<StepLine<'a>>),
    /// The last line.
    End(EndLine),
    /// The last line where a step has no answer.
    Error(ErrorLine<'a>),
}

/// What holds for all steps.
#[derive(Serialize, ToSchema)]
pub struct BeginLine<'a> {
    /// Steps that will be computed.
    pub steps: usize,
    /// The level that answers.
    pub level: &'static str,
    /// Every effect, simulated or not, and why.
    pub effects: Vec<EffectAnswer<'a>>,
    /// Triangles between the nodes of every surface, counter-clockwise seen from the vitreous.
    #[schema(value_type = Vec<Triangle>)]
    pub triangles: &'a [[usize; 3]],
}

/// The end of one step.
#[derive(Serialize, ToSchema)]
pub struct StepLine<'a> {
    /// Index of the step, from 0.
    pub index: usize,
    /// Its time, s.
    pub time_s: f64,
    /// The deformed surface.
    pub surface: StepSurface<'a>,
    /// The needle at the end of the step; its travel is that of this step.
    pub needle: NeedleAnswer,
    /// The contact.
    pub contact: ContactAnswer,
    /// Whether a mesh was laid for this step, which then did not start from the step before.
    pub mesh_laid: bool,
    /// What the solution cost, in units that do not depend on the machine.
    pub solver: SolverAnswer,
    /// What the step cost on this machine.
    pub time_us: TimeAnswer<'a>,
    /// What the caller should know besides.
    pub warnings: &'a [String],
}

/// The deformed surface, scene frame, in the order of a prediction's.
#[derive(Serialize, ToSchema)]
pub struct StepSurface<'a> {
    /// Deformed nodes, mm.
    #[serde(serialize_with = "points")]
    #[schema(value_type = Vec<Vector>)]
    pub vertices_mm: &'a [Point3<f64>],
    /// Unit normals of the deformed surface at the nodes, out of the tissue.
    #[serde(serialize_with = "vectors")]
    #[schema(value_type = Vec<Vector>)]
    pub normals: &'a [Vector3<f64>],
    /// Length of each node's displacement from rest, µm.
    #[schema(value_type = Vec<f64>)]
    pub displacement_um: &'a [f64],
}

/// Every step was computed.
#[derive(Serialize, ToSchema)]
pub struct EndLine {
    /// Steps computed.
    pub steps: usize,
}

/// A step without an answer; the steps after it have nothing to start from.
#[derive(Serialize, ToSchema)]
pub struct ErrorLine<'a> {
    /// Index of the step, from 0.
    pub step: usize,
    /// Its time, s.
    pub time_s: f64,
    /// Why.
    pub problem: ProblemDocument<'a>,
}

impl<'a> BeginLine<'a> {
    /// The line before `steps` steps.
    pub fn new(steps: usize, level: &'static str, effects: &'a [EffectReport], triangles: &'a [[usize; 3]]) -> Self {
        Self { steps, level, effects: effects.iter().map(EffectAnswer::from).collect(), triangles }
    }
}

impl<'a> StepLine<'a> {
    /// The line of a step that took the stages that are given.
    pub fn new(outcome: &'a StepOutcome, stages: &'a [(&'static str, Duration)]) -> Self {
        let prediction = &outcome.prediction;
        Self {
            index: outcome.step,
            time_s: outcome.time_s,
            surface: StepSurface {
                vertices_mm: &prediction.vertices,
                normals: &prediction.normals,
                displacement_um: &prediction.displacement_um,
            },
            needle: NeedleAnswer::from(&prediction.needle),
            contact: ContactAnswer::from(&prediction.contact),
            mesh_laid: outcome.mesh_laid,
            solver: SolverAnswer::from(&prediction.solver),
            time_us: TimeAnswer::new(stages),
            warnings: &prediction.warnings,
        }
    }
}
