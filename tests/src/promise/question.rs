//! A random request of the working range with a random promise.

use retina_core::needle::Tip;
use retina_core::needle::shaft::STIFFNESS;
use retina_core::predict::{Control, Request};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Smallest and largest error that is asked for (µm).
const ERRORS_UM: [f64; 2] = [1.0, 50.0];
/// Shortest and longest time that is asked for (ms).
const TIMES_MS: [f64; 2] = [0.3, 60.0];

/// What is asked for beside the needle and the force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// Largest error of the worst node (µm).
    pub max_error_um: Option<f64>,
    /// Longest time (ms).
    pub max_time_ms: Option<f64>,
}

/// Draws promises: an error, a time, or both.
pub fn asked(random: &mut fastrand::Rng) -> Asked {
    let mut between = |[low, high]: [f64; 2]| low * (high / low).powf(random.f64());
    let (error, time) = (between(ERRORS_UM), between(TIMES_MS));
    match random.u8(0..3) {
        0 => Asked { max_error_um: Some(error), max_time_ms: None },
        1 => Asked { max_error_um: None, max_time_ms: Some(time) },
        _ => Asked { max_error_um: Some(error), max_time_ms: Some(time) },
    }
}

/// The request as it is posted.
pub fn body(scene: &str, request: &Request, asked: Asked) -> Value {
    let needle = &request.needle;
    let radius_mm = needle.shape.radius_mm;
    let tip = match needle.shape.tip {
        Tip::Hemispherical => json!("hemispherical"),
        Tip::Flat { edge_radius_mm } => json!({"flat": {"edge_radius_mm": edge_radius_mm}}),
        Tip::Bevelled { angle_deg, edge_radius_mm } => {
            json!({"bevelled": {"angle_deg": angle_deg, "edge_radius_mm": edge_radius_mm}})
        }
    };
    let mut body = json!({
        "scene": scene,
        "needle": {
            "tip_mm": needle.tip_mm.coords.as_slice(),
            "orientation_xyzw": needle.orientation.coords.as_slice(),
            "radius_mm": radius_mm,
            // On the wire a rigid shaft is one of the largest stiffness; the truth knows no other.
            "stiffness_mn_per_mm": STIFFNESS.max,
            "tip": tip,
        },
        "accuracy": asked,
    });
    if let Control::Force(force) = request.control {
        body["force_mn"] = json!(force.as_slice());
    }
    body
}
