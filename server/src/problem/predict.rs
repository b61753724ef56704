//! The core's errors, told to the caller in the words of the wire.
//!
//! Contract: fields are those of the request, so what the core calls `tissue.…` is `scene.tissue.…` here.

use retina_core::effects::EFFECT_NAMES;
use retina_core::mesh::wall::WallError;
use retina_core::patch::{CONTACT_DISTANCE_LIMIT_MM, PatchError};
use retina_core::predict::PredictError;
use retina_core::range::OutOfRange;
use serde_json::{Value, json};

use super::{Kind, Problem};

/// The problem of a number outside its range; `field` is its path in the request.
pub fn from_out_of_range(field: String, error: &OutOfRange) -> Problem {
    let OutOfRange { value, min, max, unit, .. } = error;
    let unit = match *unit {
        "1" => String::new(),
        unit => format!(" {unit}"),
    };
    let allowed = format!("{min} to {max}{unit}");
    let detail = format!("{field} = {value}{unit} is outside the allowed range {allowed}");
    // What is not finite has no JSON number, so it is told as text.
    let value = if value.is_finite() { json!(value) } else { json!(value.to_string()) };
    Problem::field(Kind::OutOfRange, field, Some(value), allowed, detail)
}

/// The path in the request of a field that the core names.
fn wire_field(field: &str) -> String {
    if let Some(index) = field.strip_prefix("scene_from_patch.translation_mm") {
        return format!("scene.pose.position_mm{index}");
    }
    match field.split(['.', '[']).next() {
        Some(
            "surface" | "tissue" | "friction_coefficient" | "pressure_kpa" | "rest_pressure_kpa" | "puncture" | "bleb",
        ) => {
            format!("scene.{field}")
        }
        Some("scene_from_patch") => "scene.pose.orientation_xyzw".to_owned(),
        _ => field.to_owned(),
    }
}

/// The problem that the caller is told of.
pub fn from_predict(error: PredictError) -> Problem {
    let detail = error.to_string();
    match error {
        PredictError::OutOfRange(error) => from_out_of_range(wire_field(&error.field), &error),
        PredictError::PointsAway { field, angle_deg, max_deg } => Problem::field(
            Kind::PointsAway,
            field,
            Some(json!(angle_deg)),
            format!("at most {max_deg} degrees from the inward normal"),
            detail,
        ),
        PredictError::OutsidePatch { x_mm, y_mm, limit_mm } => Problem::field(
            Kind::OutsidePatch,
            "needle.tip_mm",
            Some(json!([x_mm, y_mm])),
            format!("contact within {limit_mm} mm of the patch's centre in x and y"),
            detail,
        ),
        PredictError::BlebOutsidePatch { x_mm, y_mm, limit_mm } => Problem::field(
            Kind::OutsidePatch,
            "scene.bleb.center_mm",
            Some(json!([x_mm, y_mm])),
            format!("a middle within {limit_mm} mm of the patch's centre in x and y"),
            detail,
        ),
        PredictError::NoBleb => {
            Problem::field(Kind::NotPossible, "bleb", None, "left out, or a scene with `bleb`", detail)
        }
        PredictError::BesideBleb { away_mm, most_mm, core_mm, .. } => Problem::field(
            Kind::NotPossible,
            "needle.tip_mm",
            Some(json!(away_mm)),
            format!("a contact within {:.3} mm of the middle of the bleb", (most_mm - core_mm).max(0.0)),
            detail,
        ),
        PredictError::BeyondPuncture { force_mn, pressure_kpa, limit_kpa, .. } => Problem::field(
            Kind::BeyondPuncture,
            "force_mn",
            Some(json!(force_mn)),
            format!("at most {:.3} mN with this needle", force_mn * limit_kpa / pressure_kpa),
            detail,
        ),
        PredictError::TooDeep { depth_mm, limit_mm } => Problem::field(
            Kind::TooDeep,
            "needle.tip_mm",
            Some(json!(depth_mm)),
            format!("at most {limit_mm} mm below the surface at rest"),
            detail,
        ),
        PredictError::Budget { problem } => {
            Problem::field(Kind::NotPossible, "accuracy", None, "promises that a level keeps, or not strict", problem)
        }
        PredictError::Effect { name, .. } => Problem::field(
            Kind::UnknownName,
            "effects",
            Some(Value::String(name)),
            format!("auto, all, or some of {}", EFFECT_NAMES.join(", ")),
            detail,
        ),
        PredictError::Weights { level, .. } => {
            Problem::field(Kind::NotPossible, "accuracy.level", Some(json!(level)), "another level", detail)
        }
        PredictError::NotLearned { field, .. } => Problem::field(
            Kind::NotPossible,
            field,
            None,
            "what the level's network was trained on, or another level",
            detail,
        ),
        PredictError::Patch(error) => from_patch(&error, detail),
        PredictError::Mesh(WallError::Geometry(_)) => Problem::field(
            Kind::InvalidMesh,
            "scene",
            None,
            "a surface with room for the tissue's layers under it",
            detail,
        ),
        PredictError::Mesh(error @ WallError::Linear(_)) => Problem::internal(error),
        PredictError::Solver { cause, .. } if cause.is_interrupted() => {
            Problem::new(Kind::TookTooLong, "The work was stopped at the time limit of the server.")
        }
        PredictError::Solver { .. } | PredictError::Bleb { .. } | PredictError::Linear(_) => {
            Problem::new(Kind::NoEquilibrium, detail)
        }
    }
}

fn from_patch(error: &PatchError, detail: String) -> Problem {
    match error {
        PatchError::ContactNotFinite { .. } => {
            Problem::field(Kind::OutOfRange, "needle.tip_mm", None, "finite coordinates", detail)
        }
        PatchError::ContactTooFar { .. } => Problem::field(
            Kind::OutsidePatch,
            "needle.tip_mm",
            None,
            format!("contact within {CONTACT_DISTANCE_LIMIT_MM} mm of the mesh"),
            detail,
        ),
        PatchError::TooFewVertices { .. } | PatchError::NoCommonNormal | PatchError::Folded { .. } => Problem::field(
            Kind::InvalidMesh,
            "scene.surface",
            None,
            "a mesh with 64 connected vertices around the contact that face one side",
            detail,
        ),
    }
}
