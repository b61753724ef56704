//! From the wire's request to the core's: names looked up, defaults filled in, contradictions refused.
//!
//! Contract: what comes out is inside the ranges of the core; what does not get through is a problem that names the field.
//!
//! Not here: JSON (`read`), anything that needs the tissue's answer.

mod needle;
mod scene;
mod sequence;
mod stream;

use nalgebra::Vector3;
use retina_core::effects::EFFECT_NAMES;
use retina_core::predict::budget::{Budget, DEFAULT_LEVEL};
use retina_core::predict::{Control, EffectChoice, Level, Request};
use retina_core::range::ParameterRange;
use serde_json::json;

pub use scene::{built_in, chosen, scene, scene_on_file};
pub use sequence::sequence;
pub use stream::{Opening, REHEARSAL, opening, pose, step};

use crate::problem::{Kind, Problem, from_out_of_range};
use crate::wire::batch::BatchPose;
use crate::wire::fixed::Vector;
use crate::wire::request::{AccuracySpec, ControlName, EffectsSpec, PredictRequest};

/// The scene of a request that names none.
pub const DEFAULT_SCENE: &str = "macula";

/// What may be asked of the error.
pub const MAX_ERROR: ParameterRange = ParameterRange {
    name: "largest error of the worst node",
    unit: "um",
    default: 5.0,
    min: 0.01,
    max: 1000.0,
    source: "bound of this program: below 0.01 um is rounding, above 1 mm there is no retina",
};

/// What may be asked of the time.
pub const MAX_TIME: ParameterRange = ParameterRange {
    name: "longest time",
    unit: "ms",
    default: 15.0,
    min: 0.01,
    max: 600_000.0,
    source: "bound of this program: from a fraction of what the fastest level takes to ten minutes",
};

/// The gauge of a request that gives neither gauge nor radius.
pub const DEFAULT_GAUGE: &str = "25G";

/// How long a force may be. Whether the tissue holds it is for the core to say.
pub const FORCE: ParameterRange = ParameterRange {
    name: "length of the force",
    unit: "mN",
    default: 0.0,
    min: 0.0,
    max: 100.0,
    source: "bound of this program: forces at the retina are below 7.5 mN (surgeons stay unaware of those), and 100 mN is no surgery",
};

/// How far the length of a quaternion may be from 1; it is then made 1.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// The core's request, its level that of one that asks for none, and what the answer must keep; the scene is looked up apart, see [`crate::scenes`].
///
/// # Errors
/// A problem that names the field.
pub fn request(request: &PredictRequest) -> Result<(Request, Budget), Problem> {
    let budget = budget(request.accuracy.as_ref())?;
    let request = Request {
        needle: needle::needle(&request.needle)?,
        control: control(request.control, request.force_mn)?,
        level: DEFAULT_LEVEL,
        effects: effects(request.effects.as_ref(), &budget)?,
    };
    Ok((request, budget))
}

/// What many poses share.
#[derive(Clone, Debug)]
pub struct Shared {
    /// What every answer must keep.
    pub budget: Budget,
    /// Which effects are simulated.
    pub effects: EffectChoice,
}

/// What many poses share; the scene is looked up apart.
///
/// # Errors
/// A problem that names the field.
pub fn shared(accuracy: Option<&AccuracySpec>, given: Option<&EffectsSpec>) -> Result<Shared, Problem> {
    let budget = budget(accuracy)?;
    let effects = effects(given, &budget)?;
    Ok(Shared { budget, effects })
}

/// The core's request of one pose of a batch, its level that of one that asks for none.
///
/// # Errors
/// A problem that names the field.
pub fn batched(shared: &Shared, pose: &BatchPose) -> Result<Request, Problem> {
    Ok(Request {
        needle: needle::needle(&pose.needle)?,
        control: control(pose.control, pose.force_mn)?,
        level: DEFAULT_LEVEL,
        effects: shared.effects.clone(),
    })
}

fn control(control: ControlName, force_mn: Option<Vector>) -> Result<Control, Problem> {
    match (control, force_mn) {
        (ControlName::Force, Some(force_mn)) => force("force_mn", force_mn).map(Control::Force),
        (ControlName::Force, None) => Err(Problem::field(
            Kind::InvalidRequest,
            "force_mn",
            None,
            "required",
            "force_mn is missing; without a force, \"control\" must be \"pose\"",
        )),
        (ControlName::Pose, None) => Ok(Control::Pose),
        (ControlName::Pose, Some(Vector(force_mn))) => Err(Problem::field(
            Kind::InvalidRequest,
            "force_mn",
            Some(json!(force_mn)),
            "left out when \"control\" is \"pose\"",
            "under pose control the needle stays where it is and the force is the answer, so force_mn must be left out",
        )),
    }
}

/// The force at `field`, not longer than [`FORCE`] allows.
fn force(field: &str, Vector(force_mn): Vector) -> Result<Vector3<f64>, Problem> {
    let force = Vector3::from(force_mn);
    FORCE.check(field, force.norm()).map_err(|error| {
        let mut problem = from_out_of_range(field.to_owned(), &error);
        // The caller wrote a vector, so that is what is shown; its length may not even be finite.
        problem.errors[0].value = Some(json!(force_mn));
        problem.errors[0].allowed = format!("length {}", problem.errors[0].allowed);
        problem
    })?;
    Ok(force)
}

/// What the answer must keep.
///
/// # Errors
/// A problem that names the field.
pub fn budget(accuracy: Option<&AccuracySpec>) -> Result<Budget, Problem> {
    let Some(accuracy) = accuracy else {
        return Ok(Budget::default());
    };
    let promise = |field: &str, range: &ParameterRange, value: Option<f64>| match value {
        Some(value) => {
            range.check(field, value).map_err(|error| from_out_of_range(field.to_owned(), &error)).map(|()| Some(value))
        }
        None => Ok(None),
    };
    Ok(Budget {
        max_error_um: promise("accuracy.max_error_um", &MAX_ERROR, accuracy.max_error_um)?,
        max_time_ms: promise("accuracy.max_time_ms", &MAX_TIME, accuracy.max_time_ms)?,
        level: accuracy.level.as_deref().map(level).transpose()?,
        strict: accuracy.strict,
    })
}

fn level(name: &str) -> Result<Level, Problem> {
    let names: Vec<&str> = Level::ALL.map(Level::name).to_vec();
    Level::ALL
        .into_iter()
        .find(|level| level.name() == name)
        .ok_or_else(|| unknown_name("accuracy.level", name, &names))
}

/// The effects asked for; what a scene calls for depends on the error that the answer may have.
fn effects(effects: Option<&EffectsSpec>, budget: &Budget) -> Result<EffectChoice, Problem> {
    let auto = || budget.max_error_um.map_or(EffectChoice::Auto, EffectChoice::auto_for);
    let known = |field: &str, name: &String| match EFFECT_NAMES.contains(&name.as_str()) {
        true => Ok(()),
        false => Err(unknown_name(field, name, &EFFECT_NAMES)),
    };
    match effects {
        None => Ok(auto()),
        Some(EffectsSpec::Word(word)) if word == "auto" => Ok(auto()),
        Some(EffectsSpec::Word(word)) if word == "all" => Ok(EffectChoice::All),
        Some(EffectsSpec::Word(word)) => Err(unknown_name("effects", word, &["auto", "all", "an array of names"])),
        Some(EffectsSpec::Names(names)) => {
            for (index, name) in names.iter().enumerate() {
                known(&format!("effects[{index}]"), name)?;
            }
            Ok(EffectChoice::Named(names.clone()))
        }
    }
}

/// The problem of a name that stands for nothing.
pub(crate) fn unknown_name(field: &str, name: &str, known: &[&str]) -> Problem {
    let shown: String = name.chars().take(60).collect();
    let allowed = known.join(", ");
    let detail = format!("{field}: there is no {shown:?}; known are {allowed}");
    Problem::field(Kind::UnknownName, field, Some(json!(shown)), allowed, detail)
}

/// The problem of two fields that exclude each other.
fn both(field: &str, other: &str) -> Problem {
    Problem::field(
        Kind::InvalidRequest,
        field,
        None,
        format!("left out when {other} is given"),
        format!("{field} and {other} exclude each other"),
    )
}

/// A quaternion x, y, z, w of a length near 1, made exactly that long.
fn rotation(field: &str, xyzw: [f64; 4]) -> Result<nalgebra::UnitQuaternion<f64>, Problem> {
    let quaternion = nalgebra::Quaternion::from(xyzw);
    let norm = quaternion.norm();
    if (norm - 1.0).abs() <= QUATERNION_TOLERANCE {
        return Ok(nalgebra::UnitQuaternion::new_normalize(quaternion));
    }
    let detail = format!("{field} has the length {norm}, which is not that of a rotation");
    let allowed = format!("four numbers of length 1 within {QUATERNION_TOLERANCE}");
    Err(Problem::field(Kind::OutOfRange, field, Some(json!(xyzw)), allowed, detail))
}
