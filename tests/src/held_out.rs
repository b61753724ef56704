//! The held-out sample: requests of the working range with the reference's answers, as stored in `tests/data/held_out.json`.
//!
//! Contract: a request follows from its stored numbers alone, so a change of the random sampling does not touch the sample. Stored
//! displacements are rounded to [`ROUNDING_UM`]. Units as on the wire: mm, mN, µm.
//!
//! Not here: drawing the requests and writing the file (`bin/held_out`), judging the answers (the `accuracy` tier).

use nalgebra::{Point3, Quaternion, Unit, Vector3};
use retina_core::needle::{Needle, NeedleShape, Tip};
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request};
use retina_core::scene::Scene;
use serde::{Deserialize, Serialize};

/// Where the sample lies.
pub const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/held_out.json");

/// Resolution of the stored displacements (µm): far below the reference's own error.
pub const ROUNDING_UM: f64 = 1e-3;

/// The whole sample.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HeldOut {
    /// Limits of the levels' errors.
    pub limits: Vec<Limit>,
    /// The requests with their answers.
    pub samples: Vec<Sample>,
}

/// The errors that a level may have over the whole sample.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Limit {
    /// Name of the level.
    pub level: String,
    /// Mean node error when the sample was made (µm).
    pub mean_um: f64,
    /// Largest node error when the sample was made (µm).
    pub worst_um: f64,
    /// Largest allowed mean node error (µm).
    pub mean_limit_um: f64,
    /// Largest allowed node error (µm).
    pub worst_limit_um: f64,
}

/// One request under force control with the reference's answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sample {
    /// Built-in scene.
    pub scene: String,
    /// `hemispherical`, `flat` or `bevelled`, edge and angle at their defaults.
    pub tip: String,
    /// Needle radius (mm).
    pub radius_mm: f64,
    /// Foremost point before the motion (mm).
    pub tip_mm: [f64; 3],
    /// Orientation, x, y, z, w.
    pub orientation_xyzw: [f64; 4],
    /// Force (mN).
    pub force_mn: [f64; 3],
    /// Displacement of each node by level `reference` (µm).
    pub reference_um: Vec<[f64; 3]>,
}

impl Sample {
    /// The sample of `request` (force control) on a built-in scene, without an answer yet.
    pub fn new(scene: &str, request: &Request) -> Option<Self> {
        let Control::Force(force) = request.control else { return None };
        let tip = match request.needle.shape.tip {
            Tip::Hemispherical => "hemispherical",
            Tip::Flat { .. } => "flat",
            Tip::Bevelled { .. } => "bevelled",
        };
        Some(Sample {
            scene: scene.to_owned(),
            tip: tip.to_owned(),
            radius_mm: request.needle.shape.radius_mm,
            tip_mm: request.needle.tip_mm.coords.into(),
            orientation_xyzw: request.needle.orientation.coords.into(),
            force_mn: force.into(),
            reference_um: Vec::new(),
        })
    }

    /// The request at `level`.
    pub fn request(&self, level: Level) -> Request {
        let shape = match self.tip.as_str() {
            "flat" => NeedleShape::flat(self.radius_mm),
            "bevelled" => NeedleShape::bevelled(self.radius_mm),
            _ => NeedleShape::hemispherical(self.radius_mm),
        };
        let needle = Needle {
            shape,
            tip_mm: Point3::from(self.tip_mm),
            orientation: Unit::new_normalize(Quaternion::from(nalgebra::Vector4::from(self.orientation_xyzw))),
            stiffness_mn_per_mm: None,
        };
        let control = Control::Force(Vector3::from(self.force_mn));
        Request { needle, control, level, effects: EffectChoice::Auto }
    }

    /// Distances of the answer's nodes to the stored reference (µm), given the nodes at rest.
    pub fn errors_um(&self, rest: &[Point3<f64>], answer: &Prediction) -> Vec<f64> {
        let moved = displacements_um(rest, answer);
        moved.iter().zip(&self.reference_um).map(|(a, b)| (a - Vector3::from(*b)).norm()).collect()
    }
}

/// Displacement of every node (µm).
pub fn displacements_um(rest: &[Point3<f64>], answer: &Prediction) -> Vec<Vector3<f64>> {
    answer.vertices.iter().zip(rest).map(|(vertex, rest)| (vertex - rest) * 1e3).collect()
}

/// A built-in scene, prepared, with its nodes at rest in scene coordinates.
///
/// # Errors
/// If the scene does not exist or is refused.
pub fn prepare(name: &str) -> Result<(PreparedScene, Vec<Point3<f64>>), PredictError> {
    let missing = || PredictError::Linear(format!("no scene `{name}`"));
    let scene = Scene::built_in(name).ok_or_else(missing)?;
    let patch = scene.patch(&Point3::origin())?;
    let rest = patch.vertices.iter().map(|vertex| patch.scene_from_patch * vertex).collect();
    Ok((PreparedScene::new(scene)?, rest))
}
