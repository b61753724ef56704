//! Questions that have no answer are refused with the right reason, at every level and before any work.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use retina_core::needle::NeedleShape;
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Request};

use crate::support::{ask, built_in, straight};

/// The refusal of a changed request, the same at every level; the unchanged one is answered.
fn refused(change: impl Fn(&mut Request)) -> PredictError {
    let scene = built_in("flat");
    ask(&scene, &straight(Level::Linear, 1.0)).unwrap();
    let errors = Level::ALL.map(|level| {
        let mut request = straight(level, 1.0);
        change(&mut request);
        ask(&scene, &request).unwrap_err()
    });
    assert!(errors.iter().all(|error| error.to_string() == errors[0].to_string()), "{errors:?}");
    let [first, ..] = errors;
    first
}

/// A direction that leans from straight down by so many degrees.
fn leaning(degrees: f64) -> Vector3<f64> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vector3::new(sin, 0.0, -cos)
}

fn out_of_range(error: PredictError) -> String {
    match error {
        PredictError::OutOfRange(out) => out.field,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_number_outside_its_range_is_named() {
    assert_eq!(out_of_range(refused(|r| r.needle.tip_mm.x = f64::NAN)), "needle.tip_mm[0]");
    assert_eq!(out_of_range(refused(|r| r.needle.tip_mm.y = f64::INFINITY)), "needle.tip_mm[1]");
    assert_eq!(out_of_range(refused(|r| r.needle.tip_mm.z = 1e9)), "needle.tip_mm[2]");
    assert_eq!(out_of_range(refused(|r| r.needle.shape.radius_mm = -0.1)), "needle.radius_mm");
    assert_eq!(out_of_range(refused(|r| r.needle.shape = NeedleShape::flat(f64::NAN))), "needle.radius_mm");
    let zero = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0));
    assert_eq!(out_of_range(refused(|r| r.needle.orientation = zero)), "needle.orientation_xyzw");
}

#[test]
fn a_force_that_is_not_a_number_is_refused() {
    for force in [Vector3::new(f64::NAN, 0.0, -1.0), Vector3::new(0.0, 0.0, f64::NEG_INFINITY)] {
        let error = refused(|r| r.control = Control::Force(force));
        assert!(!matches!(error, PredictError::Solver { .. }), "{error:?}");
    }
}

#[test]
fn a_needle_or_force_that_points_away_or_along_is_refused() {
    for degrees in [180.0, 90.0, 76.0] {
        let turn = UnitQuaternion::from_axis_angle(&-Vector3::y_axis(), f64::to_radians(degrees));
        let error = refused(|r| r.needle.orientation = turn);
        let is_needle = |e: &PredictError| matches!(e, PredictError::PointsAway { field: "needle.direction", angle_deg, .. } if (angle_deg - degrees).abs() < 1e-6);
        assert!(is_needle(&error), "{degrees}: {error:?}");
        let error = refused(|r| r.control = Control::Force(leaning(degrees)));
        let is_force = |e: &PredictError| matches!(e, PredictError::PointsAway { field: "force_mn", angle_deg, .. } if (angle_deg - degrees).abs() < 1e-6);
        assert!(is_force(&error), "{degrees}: {error:?}");
    }
    let scene = built_in("flat");
    let mut steep = straight(Level::Linear, 0.3);
    steep.control = Control::Force(0.3 * leaning(74.0));
    ask(&scene, &steep).unwrap();
}

#[test]
fn a_contact_outside_the_patch_is_refused() {
    let error = refused(|r| r.needle.tip_mm = Point3::new(1.2, 0.3, 0.1));
    let at = |e: &PredictError| match *e {
        PredictError::OutsidePatch { x_mm, y_mm, limit_mm } => Some((x_mm, y_mm, limit_mm)),
        _ => None,
    };
    let (x, y, limit) = at(&error).unwrap_or_else(|| panic!("{error:?}"));
    assert!((x - 1.2).abs() < 1e-9 && (y - 0.3).abs() < 1e-9 && (limit - 1.05).abs() < 1e-9);
}

#[test]
fn too_much_force_and_too_much_depth_are_refused() {
    let error = refused(|r| r.control = Control::Force(Vector3::new(0.0, 0.0, -7.5)));
    assert!(matches!(error, PredictError::BeyondPuncture { force_mn: 7.5, .. }), "{error:?}");
    let deep = |r: &mut Request| {
        r.control = Control::Pose;
        r.needle.tip_mm.z = -0.5;
    };
    let error = refused(deep);
    let is_deep = |e: &PredictError| matches!(e, PredictError::TooDeep { depth_mm, limit_mm } if (depth_mm - 0.5).abs() < 1e-6 && depth_mm > limit_mm);
    assert!(is_deep(&error), "{error:?}");
}

#[test]
fn an_effect_that_does_not_exist_or_is_missing_is_refused() {
    let named = |names: &[&str]| EffectChoice::Named(names.iter().map(|name| (*name).to_owned()).collect());
    let error = refused(|r| r.effects = named(&["elasticity", "contact", "magnetism"]));
    assert!(matches!(&error, PredictError::Effect { name, .. } if name == "magnetism"), "{error:?}");
    let error = refused(|r| r.effects = named(&["contact"]));
    assert!(matches!(&error, PredictError::Effect { name, .. } if name == "elasticity"), "{error:?}");
}
