//! The question: `POST /v1/predict`.
//!
//! Contract: only `needle` and, under force control, `force_mn` are required. Names (scene, gauge, level, effects) are read as text
//! here and looked up in `understand`, so that an unknown one is answered with the list of known ones.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::fixed::{Quaternion, Vector};
use super::object;
use super::scene::SceneSpec;

/// A needle, a force and what they are pressed into.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "scene": "macula",
    "needle": {"tip_mm": [0.12, -0.05, 0.0], "direction": [0, 0, -1], "gauge": "25G"},
    "force_mn": [0.0, 0.0, -0.8],
    "accuracy": {"level": "coarse"},
    "effects": "auto"
}))]
pub struct PredictRequest {
    /// The needle before it moves.
    #[serde(deserialize_with = "object::required")]
    pub needle: NeedleSpec,
    /// Force of the needle on the tissue, scene frame, mN; at most 100 mN long. Required under `"control": "force"`, refused under `"pose"`.
    pub force_mn: Option<Vector>,
    /// What is given about the needle's motion; `force` when left out.
    #[serde(default)]
    pub control: ControlName,
    /// A built-in scene by name, or a scene written out; `macula` when left out.
    pub scene: Option<SceneChoice>,
    /// How accurate, and at what cost; level `coarse` when left out.
    #[serde(default, deserialize_with = "object::optional")]
    pub accuracy: Option<AccuracySpec>,
    /// Which effects to simulate: `auto` (those the scene calls for, the default), `all`, or a list of names.
    pub effects: Option<EffectsSpec>,
}

/// What is given about the needle's motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ControlName {
    /// The needle advances along `force_mn` until the tissue's reaction along it equals the force.
    #[default]
    Force,
    /// The needle stays where it is; the reaction is the answer.
    Pose,
}

/// A needle: where it is, where it points, how thick it is and how it ends.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NeedleSpec {
    /// Foremost point of the needle, scene frame, mm.
    pub tip_mm: Vector,
    /// Rotation from the needle's frame (it points along its own −z) to the scene's, as x, y, z, w. Its length may differ from 1 by
    /// 0.001 and is made 1. Not together with `direction`.
    pub orientation_xyzw: Option<Quaternion>,
    /// The way the needle points, scene frame, of any length from 1e-9; `[0, 0, -1]` when neither this nor `orientation_xyzw` is given.
    pub direction: Option<Vector>,
    /// Size by name, see `GET /v1/gauges`; `25G` when neither this nor `radius_mm` is given.
    pub gauge: Option<String>,
    /// Radius of the shaft in place of a gauge, mm.
    pub radius_mm: Option<f64>,
    /// Force across the shaft that moves the tip by 1 mm, where the shaft bends, mN/mm, 1 to 1000000 (rigid); that of the gauge (see `GET /v1/gauges`)
    /// or of the radius when left out.
    pub stiffness_mn_per_mm: Option<f64>,
    /// How the needle ends; `hemispherical` when left out.
    pub tip: Option<TipSpec>,
}

/// How a needle ends.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum TipSpec {
    /// By name, every number its default.
    Name(TipName),
    /// With its numbers: exactly one of the fields.
    Shape(TipShape),
}

/// A tip by name.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TipName {
    /// Half a ball of the needle's radius.
    Hemispherical,
    /// A plane across the shaft with a rounded edge.
    Flat,
    /// A plane oblique to the shaft with a rounded edge, the sharp point towards the needle's +x.
    Bevelled,
}

/// A tip with its numbers: exactly one of the fields.
#[derive(Debug, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TipShape {
    /// A plane across the shaft.
    #[serde(default, deserialize_with = "object::optional")]
    pub flat: Option<FlatTip>,
    /// A plane oblique to the shaft.
    #[serde(default, deserialize_with = "object::optional")]
    pub bevelled: Option<BevelledTip>,
}

/// A plane across the shaft with a rounded edge.
#[derive(Debug, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FlatTip {
    /// Radius of the rounded edge, mm; a tenth of the needle's radius when left out.
    pub edge_radius_mm: Option<f64>,
}

/// A plane oblique to the shaft with a rounded edge.
#[derive(Debug, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BevelledTip {
    /// Angle between plane and shaft, degrees; 30 when left out.
    pub angle_deg: Option<f64>,
    /// Radius of the rounded edge, mm; a tenth of the needle's radius when left out.
    pub edge_radius_mm: Option<f64>,
}

/// How accurate, and at what cost.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracySpec {
    /// The level that answers, see `GET /v1/levels`; `coarse` when neither this nor a promise is given.
    #[schema(example = "coarse")]
    pub level: Option<String>,
    /// Largest error of the worst node of the patch that is accepted, kept in 95 of 100 requests, µm: the cheapest level that keeps it
    /// answers.
    #[schema(example = 5.0)]
    pub max_error_um: Option<f64>,
    /// Longest time from the arrival of the request to its answer that is accepted, ms, by the service's clock (header `Server-Timing` of the answer): with `max_error_um` it
    /// bounds the choice, alone it asks for the most accurate level in time.
    #[schema(example = 20.0)]
    pub max_time_ms: Option<f64>,
    /// Whether a promise that no level is expected to keep is refused; otherwise the best there is answers, with a warning.
    #[serde(default)]
    pub strict: bool,
}

/// A built-in scene by name, or a scene written out.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum SceneChoice {
    /// See `GET /v1/scenes`.
    Name(String),
    /// Every part may be left out.
    Inline(Box<SceneSpec>),
}

/// Which effects to simulate.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum EffectsSpec {
    /// `auto` or `all`.
    Word(String),
    /// These, by name.
    Names(Vec<String>),
}
