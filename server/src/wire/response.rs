//! The answer of `POST /v1/predict`, written straight from the core's prediction without a copy.

use std::time::Duration;

use nalgebra::{Point3, Vector3};
use retina_core::predict::{ContactReport, ContactState, EffectReport, NeedleOutcome, Prediction, SolverReport};
use retina_core::scene::conditions::MMHG_KPA;
use serde::ser::{SerializeMap, SerializeSeq};
use serde::{Serialize, Serializer};
use utoipa::ToSchema;

use super::fixed::{Triangle, Vector};

/// What the surface looks like now, where the needle is and what the answer cost.
#[derive(Serialize, ToSchema)]
pub struct PredictResponse<'a> {
    /// The deformed surface.
    pub surface: SurfaceAnswer<'a>,
    /// The needle at equilibrium.
    pub needle: NeedleAnswer,
    /// The contact at equilibrium.
    pub contact: ContactAnswer,
    /// How accurate the answer is.
    pub accuracy: AccuracyAnswer,
    /// Every effect, simulated or not, and why.
    pub effects: Vec<EffectAnswer<'a>>,
    /// What the solution cost, in units that do not depend on the machine.
    pub solver: SolverAnswer,
    /// What the answer cost on this machine.
    pub time_us: TimeAnswer<'a>,
    /// What the caller should know besides.
    pub warnings: &'a [String],
}

/// The deformed surface, scene frame. A grid patch has 64 vertices row by row (x fastest) and 98 triangles.
#[derive(Serialize, ToSchema)]
pub struct SurfaceAnswer<'a> {
    /// Deformed nodes, mm.
    #[serde(serialize_with = "points")]
    #[schema(value_type = Vec<Vector>)]
    pub vertices_mm: &'a [Point3<f64>],
    /// Unit normals of the deformed surface at the nodes, out of the tissue.
    #[serde(serialize_with = "vectors")]
    #[schema(value_type = Vec<Vector>)]
    pub normals: &'a [Vector3<f64>],
    /// Triangles between nodes, counter-clockwise seen from the vitreous.
    #[schema(value_type = Vec<Triangle>)]
    pub triangles: &'a [[usize; 3]],
    /// Length of each node's displacement, µm.
    #[schema(value_type = Vec<f64>)]
    pub displacement_um: &'a [f64],
    /// For a patch cut from a mesh: the mesh's index of each node.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<usize>>)]
    pub source_indices: Option<&'a [usize]>,
}

/// The needle at equilibrium.
#[derive(Serialize, ToSchema)]
pub struct NeedleAnswer {
    /// Foremost point, scene frame, mm; the deflection is in it.
    pub tip_mm: Vector,
    /// Advance along the force from where the needle was given, mm; zero under pose control.
    pub travel_mm: f64,
    /// How far the tip stands aside of where a rigid needle's would, scene frame, mm; told where `tool_flex` is simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deflection_mm: Option<Vector>,
    /// Force of the tissue on the needle, scene frame, mN.
    pub reaction_mn: Vector,
}

/// The contact at equilibrium.
#[derive(Serialize, ToSchema)]
pub struct ContactAnswer {
    /// Whether needle and retina touch.
    pub state: ContactWord,
    /// Contact area, measured on the surface at rest, mm².
    pub area_mm2: f64,
    /// Largest principal stretch minus one, in magnitude, anywhere in the tissue.
    pub max_strain: f64,
    /// Largest contact pressure, kPa.
    pub max_pressure_kpa: f64,
    /// Deepest penetration of the needle that the contact law left, µm.
    pub max_penetration_um: f64,
    /// Share of the normal force that acts where the tissue slides along the needle, 0 to 1; told where `friction` is simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slipping_share: Option<f64>,
    /// Largest share of the strength that the retina's bond has lost anywhere, 0 intact to 1 parted; told where `adhesion` is simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bond_damage: Option<f64>,
    /// Fluid under the retina; told where `bleb` is simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bleb: Option<BlebAnswer>,
    /// Force under the needle and strain over the limits of `scene.puncture`, the larger of the two: above 1 the tissue counts as punctured.
    pub puncture_share: f64,
}

/// Fluid under the retina at equilibrium.
#[derive(Serialize, ToSchema)]
pub struct BlebAnswer {
    /// Its pressure above that in the eye, kPa.
    pub pressure_kpa: f64,
    /// The same in mmHg.
    pub pressure_mmhg: f64,
    /// Its volume, mm³ (the same number in µl).
    pub volume_mm3: f64,
}

/// Whether needle and retina touch.
#[derive(Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactWord {
    /// They do not.
    Clear,
    /// They do.
    Touching,
    /// They do, and most of the normal force acts where the tissue slides along the needle.
    Slipping,
    /// A limit of `scene.puncture` is exceeded, now or in a step before: what is told is the tissue as if it were still whole.
    Punctured,
}

/// How accurate the answer is.
#[derive(Serialize, ToSchema)]
pub struct AccuracyAnswer {
    /// The level that answered.
    pub level: &'static str,
    /// How far the worst node of the patch is likely to be from the truth.
    pub expected_error_um: ExpectedErrorAnswer,
    /// Whether that was measured on requests like this one (tissue, needle, pose).
    pub calibrated: bool,
}

/// The error of the worst node of the patch, over requests like this one, µm; left out where too few were measured to say.
#[derive(Serialize, ToSchema)]
pub struct ExpectedErrorAnswer {
    /// Half of them err less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median: Option<f64>,
    /// 95 of 100 err less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p95: Option<f64>,
}

/// One effect: simulated or not, and why.
#[derive(Serialize, ToSchema)]
pub struct EffectAnswer<'a> {
    /// Name of the effect.
    pub name: &'static str,
    /// Whether it was simulated.
    pub simulated: bool,
    /// Why, in words.
    pub reason: &'a str,
    /// The number decided on, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// What it was compared with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
}

/// What the solution cost, in units that do not depend on the machine.
#[derive(Serialize, ToSchema)]
pub struct SolverAnswer {
    /// Newton iterations over all meshes and load steps.
    pub iterations: usize,
    /// Load steps.
    pub load_steps: usize,
    /// Unknowns of the last mesh.
    pub unknowns: usize,
    /// Residual force at the end, mN.
    pub residual_mn: f64,
}

/// What the answer cost on this machine, from the arrival of the body to the start of the answer's text.
#[derive(Serialize, ToSchema)]
pub struct TimeAnswer<'a> {
    /// All stages together, µs.
    pub total: f64,
    /// By stage, µs: `queue` (the wait for a thread), `read` (the body), `prepare` (finding the scene, or making it) and then those of the
    /// level.
    #[serde(serialize_with = "stages")]
    #[schema(value_type = std::collections::BTreeMap<String, f64>)]
    pub stages: &'a [(&'static str, Duration)],
}

impl<'a> PredictResponse<'a> {
    /// The answer that tells of `prediction`, which took the stages that are given.
    pub fn new(prediction: &'a Prediction, stages: &'a [(&'static str, Duration)]) -> Self {
        let Prediction { needle, contact, .. } = prediction;
        Self {
            surface: SurfaceAnswer {
                vertices_mm: &prediction.vertices,
                normals: &prediction.normals,
                triangles: &prediction.triangles,
                displacement_um: &prediction.displacement_um,
                source_indices: prediction.source_indices.as_deref(),
            },
            needle: NeedleAnswer::from(needle),
            contact: ContactAnswer::from(contact),
            accuracy: AccuracyAnswer::from(prediction),
            effects: prediction.effects.iter().map(EffectAnswer::from).collect(),
            solver: SolverAnswer::from(&prediction.solver),
            time_us: TimeAnswer::new(stages),
            warnings: &prediction.warnings,
        }
    }
}

impl From<&Prediction> for AccuracyAnswer {
    fn from(prediction: &Prediction) -> Self {
        let expected = &prediction.expected_error;
        let known = |um: f64| Some(um).filter(|um| um.is_finite() && expected.p95_um.is_finite());
        Self {
            level: prediction.level.name(),
            expected_error_um: ExpectedErrorAnswer { median: known(expected.median_um), p95: known(expected.p95_um) },
            calibrated: expected.calibrated,
        }
    }
}

impl From<&NeedleOutcome> for NeedleAnswer {
    fn from(needle: &NeedleOutcome) -> Self {
        Self {
            tip_mm: Vector(needle.tip_mm.coords.into()),
            travel_mm: needle.travel_mm,
            deflection_mm: needle.deflection_mm.map(|deflection| Vector(deflection.into())),
            reaction_mn: Vector(needle.reaction_mn.into()),
        }
    }
}

impl From<&ContactReport> for ContactAnswer {
    fn from(contact: &ContactReport) -> Self {
        Self {
            state: match contact.state {
                ContactState::Clear => ContactWord::Clear,
                ContactState::Touching => ContactWord::Touching,
                ContactState::Slipping => ContactWord::Slipping,
                ContactState::Punctured => ContactWord::Punctured,
            },
            area_mm2: contact.area_mm2,
            max_strain: contact.max_strain,
            max_pressure_kpa: contact.max_pressure_kpa,
            max_penetration_um: contact.max_penetration_mm * 1e3,
            slipping_share: contact.slipping_share,
            bond_damage: contact.bond_damage,
            bleb: contact.bleb.map(|bleb| BlebAnswer {
                pressure_kpa: bleb.pressure_kpa,
                pressure_mmhg: bleb.pressure_kpa / MMHG_KPA,
                volume_mm3: bleb.volume_mm3,
            }),
            puncture_share: contact.puncture_share,
        }
    }
}

impl<'a> TimeAnswer<'a> {
    /// These stages and their sum.
    pub fn new(stages: &'a [(&'static str, Duration)]) -> Self {
        Self { total: micros(stages.iter().map(|(_, time)| *time).sum()), stages }
    }
}

impl<'a> From<&'a EffectReport> for EffectAnswer<'a> {
    fn from(report: &'a EffectReport) -> Self {
        Self {
            name: report.name,
            simulated: report.simulated,
            reason: &report.reason,
            value: report.value,
            threshold: report.threshold,
        }
    }
}

impl From<&SolverReport> for SolverAnswer {
    fn from(report: &SolverReport) -> Self {
        Self {
            iterations: report.iterations,
            load_steps: report.load_steps,
            unknowns: report.unknowns,
            residual_mn: report.residual_mn,
        }
    }
}

pub(super) fn points<S: Serializer>(points: &&[Point3<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    let mut list = serializer.serialize_seq(Some(points.len()))?;
    for point in *points {
        list.serialize_element(&[point.x, point.y, point.z])?;
    }
    list.end()
}

pub(super) fn vectors<S: Serializer>(vectors: &&[Vector3<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    let mut list = serializer.serialize_seq(Some(vectors.len()))?;
    for vector in *vectors {
        list.serialize_element(&[vector.x, vector.y, vector.z])?;
    }
    list.end()
}

fn stages<S: Serializer>(stages: &&[(&'static str, Duration)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(stages.len()))?;
    for (name, time) in *stages {
        map.serialize_entry(name, &micros(*time))?;
    }
    map.end()
}

/// Whole nanoseconds over a thousand, so that the text has three digits after the point at most.
fn micros(time: Duration) -> f64 {
    time.as_nanos() as f64 / 1e3
}
