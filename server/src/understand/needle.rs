//! The needle of a request.

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use retina_core::needle::shaft::stiffness_mn_per_mm;
use retina_core::needle::shape::{BEVEL_ANGLE, EDGE_FRACTION_OF_RADIUS};
use retina_core::needle::{Gauge, Needle, NeedleShape, Tip, orientation_pointing};
use serde_json::json;

use super::{DEFAULT_GAUGE, both, rotation, unknown_name};
use crate::problem::{Kind, Problem, from_out_of_range};
use crate::wire::fixed::{Quaternion, Vector};
use crate::wire::request::{BevelledTip, FlatTip, NeedleSpec, TipName, TipShape, TipSpec};
use crate::wire::stream::ShapeSpec;

/// A direction must be at least this long; shorter ones are rounding.
const SHORTEST_DIRECTION: f64 = 1e-9;

/// The needle, inside the core's ranges.
pub(super) fn needle(spec: &NeedleSpec) -> Result<Needle, Problem> {
    let radius_mm = radius_mm(spec.gauge.as_deref(), spec.radius_mm)?;
    let shape = NeedleShape { radius_mm, tip: tip(spec.tip.as_ref(), radius_mm)? };
    let (xyzw, direction) = (spec.orientation_xyzw.as_ref(), spec.direction.as_ref());
    placed(shape, "needle", spec.tip_mm, xyzw, direction, spec.stiffness_mn_per_mm)
}

/// A needle's shape without its place, inside the core's ranges.
///
/// # Errors
/// A problem that names the field.
pub fn shape(spec: &ShapeSpec) -> Result<NeedleShape, Problem> {
    let radius_mm = radius_mm(spec.gauge.as_deref(), spec.radius_mm)?;
    let shape = NeedleShape { radius_mm, tip: tip(spec.tip.as_ref(), radius_mm)? };
    placed(shape, "needle", Vector([0.0; 3]), None, None, None).map(|needle| needle.shape)
}

/// The needle of that shape at the place that the object at `path` gives; with the usual stiffness of its radius where none is given.
///
/// # Errors
/// A problem that names the field.
pub fn placed(
    shape: NeedleShape,
    path: &str,
    tip_mm: Vector,
    xyzw: Option<&Quaternion>,
    direction: Option<&Vector>,
    stiffness: Option<f64>,
) -> Result<Needle, Problem> {
    let orientation = orientation(path, xyzw, direction)?.unwrap_or_else(|| orientation_pointing(&-Vector3::z_axis()));
    let stiffness = stiffness.unwrap_or_else(|| stiffness_mn_per_mm(shape.radius_mm));
    let tip_mm = Point3::from(tip_mm.0);
    let needle = Needle { shape, tip_mm, orientation, stiffness_mn_per_mm: Some(stiffness) };
    needle.validate().map_err(|error| from_out_of_range(tip_field(&error.field, &shape), &error))?;
    Ok(needle)
}

/// The orientation that `orientation_xyzw` or `direction` of the object at `path` gives, if either does.
pub(super) fn orientation(
    path: &str,
    xyzw: Option<&Quaternion>,
    direction: Option<&Vector>,
) -> Result<Option<UnitQuaternion<f64>>, Problem> {
    let (xyzw_path, direction_path) = (format!("{path}.orientation_xyzw"), format!("{path}.direction"));
    match (xyzw, direction) {
        (Some(_), Some(_)) => Err(both(&direction_path, &xyzw_path)),
        (Some(xyzw), None) => rotation(&xyzw_path, xyzw.0).map(Some),
        (None, Some(direction)) => Ok(Some(orientation_pointing(&unit(&direction_path, direction)?))),
        (None, None) => Ok(None),
    }
}

fn radius_mm(gauge: Option<&str>, radius_mm: Option<f64>) -> Result<f64, Problem> {
    let name = match (gauge, radius_mm) {
        (Some(_), Some(_)) => return Err(both("needle.radius_mm", "needle.gauge")),
        (None, Some(radius_mm)) => return Ok(radius_mm),
        (Some(name), None) => name,
        (None, None) => DEFAULT_GAUGE,
    };
    Gauge::from_name(name)
        .map(|gauge| gauge.radius_mm())
        .map_err(|unknown| unknown_name("needle.gauge", name, &unknown.allowed))
}

/// Scaled before it is squared, so that neither 1e-9 nor 1e300 is lost.
fn unit(field: &str, direction: &Vector) -> Result<Unit<Vector3<f64>>, Problem> {
    let vector = Vector3::from(direction.0);
    let largest = vector.amax();
    if largest > 0.0 {
        let scaled = vector / largest;
        if scaled.norm() * largest >= SHORTEST_DIRECTION {
            return Ok(Unit::new_normalize(scaled));
        }
    }
    Err(Problem::field(
        Kind::OutOfRange,
        field,
        Some(json!(direction.0)),
        format!("a vector of length {SHORTEST_DIRECTION:e} or more"),
        format!("{field} is too short to point anywhere"),
    ))
}

fn tip(spec: Option<&TipSpec>, radius_mm: f64) -> Result<Tip, Problem> {
    let edge = |given: Option<f64>| given.unwrap_or(EDGE_FRACTION_OF_RADIUS * radius_mm);
    let flat = |spec: &FlatTip| Tip::Flat { edge_radius_mm: edge(spec.edge_radius_mm) };
    let bevelled = |spec: &BevelledTip| Tip::Bevelled {
        angle_deg: spec.angle_deg.unwrap_or(BEVEL_ANGLE.default),
        edge_radius_mm: edge(spec.edge_radius_mm),
    };
    match spec {
        None | Some(TipSpec::Name(TipName::Hemispherical)) => Ok(Tip::Hemispherical),
        Some(TipSpec::Name(TipName::Flat)) => Ok(flat(&FlatTip { edge_radius_mm: None })),
        Some(TipSpec::Name(TipName::Bevelled)) => Ok(bevelled(&BevelledTip { angle_deg: None, edge_radius_mm: None })),
        Some(TipSpec::Shape(TipShape { flat: Some(spec), bevelled: None })) => Ok(flat(spec)),
        Some(TipSpec::Shape(TipShape { flat: None, bevelled: Some(spec) })) => Ok(bevelled(spec)),
        Some(TipSpec::Shape(_)) => Err(Problem::field(
            Kind::InvalidRequest,
            "needle.tip",
            None,
            "exactly one of flat, bevelled",
            "needle.tip must have exactly one of the fields flat and bevelled",
        )),
    }
}

/// The core calls both tips `tip`; on the wire each has a name.
fn tip_field(field: &str, shape: &NeedleShape) -> String {
    match (field.strip_prefix("needle.tip."), shape.tip) {
        (Some(number), Tip::Flat { .. }) => format!("needle.tip.flat.{number}"),
        (Some(number), Tip::Bevelled { .. }) => format!("needle.tip.bevelled.{number}"),
        _ => field.to_owned(),
    }
}
