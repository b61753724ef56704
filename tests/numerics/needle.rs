//! The needle: signed distance and its derivatives, foremost points, underside, poses, gauges.

use nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};
use retina_core::needle::{Body, Gauge, Needle, NeedleShape, Tip, orientation_pointing};

use crate::meshes::noise;

fn shapes(radius: f64) -> Vec<NeedleShape> {
    let bevel = |angle_deg, edge| NeedleShape {
        radius_mm: radius,
        tip: Tip::Bevelled { angle_deg, edge_radius_mm: edge * radius },
    };
    vec![
        NeedleShape::hemispherical(radius),
        NeedleShape::flat(radius),
        NeedleShape { radius_mm: radius, tip: Tip::Flat { edge_radius_mm: 0.6 * radius } },
        NeedleShape::bevelled(radius),
        bevel(15.0, 0.05),
        bevel(75.0, 0.5),
        bevel(45.0, 1.0),
    ]
}

/// Whether the second derivative stays nearly what it is at `p` up to `h` away: differences across a jump of it prove nothing.
fn smooth_around(body: &Body, p: &Point3<f64>, h: f64) -> bool {
    let here = body.signed_distance(p).hessian;
    let step = |axis| Vector3::ith_axis(axis).into_inner() * h;
    let around = (0..3).flat_map(|axis| [p - step(axis), p + step(axis)]);
    around.into_iter().all(|q| (body.signed_distance(&q).hessian - here).amax() <= 1e-2 * here.amax())
}

#[test]
fn derivatives_match_differences_at_every_scale() {
    for radius in [0.01, 0.05, 0.257, 0.5] {
        for shape in shapes(radius) {
            let body = shape.body();
            let mut random = noise(7);
            let (mut checked, mut curved) = (0, 0);
            for _ in 0..400 {
                let p = Point3::new(
                    1.6 * radius * random() + if shape.tip == Tip::Hemispherical { 0.0 } else { -0.3 * radius },
                    1.6 * radius * random(),
                    radius * (1.2 + 2.0 * random()),
                );
                let h = 1e-5 * radius;
                if !smooth_around(&body, &p, 4.0 * h) {
                    continue;
                }
                let at = body.signed_distance(&p);
                assert!((at.value - body.distance(&p)).abs() < 1e-15);
                let mut gradient = Vector3::zeros();
                let mut hessian = Matrix3::zeros();
                for axis in 0..3 {
                    let (mut low, mut high) = (p, p);
                    low[axis] -= h;
                    high[axis] += h;
                    let (low, high) = (body.signed_distance(&low), body.signed_distance(&high));
                    gradient[axis] = (high.value - low.value) / (2.0 * h);
                    hessian.set_column(axis, &((high.gradient - low.gradient) / (2.0 * h)));
                }
                assert!(at.gradient.norm() > 0.1, "a gradient of zero proves nothing: {shape:?} {p}");
                assert!((at.gradient - gradient).amax() < 1e-7, "{shape:?} {p} {} {gradient}", at.gradient);
                let size = at.hessian.amax().max(1.0 / radius);
                assert!((at.hessian - hessian).amax() < 1e-5 * size, "{shape:?} {p} {} {hessian}", at.hessian);
                checked += 1;
                curved += usize::from(at.hessian.amax() > 1e-3 / radius);
            }
            assert!(checked > 200 && curved > 50, "{shape:?}: {checked} points, {curved} of them curved");
        }
    }
}

#[test]
fn derivatives_are_finite_on_the_axis_and_at_the_tip() {
    for shape in shapes(0.25) {
        for z in [-0.5, -0.1, 0.0, 0.025, 0.125, 0.25, 0.5, 2.0] {
            for p in [Point3::new(0.0, 0.0, z), Point3::new(-0.225, 0.0, z)] {
                let at = shape.signed_distance(&p);
                assert!(at.value.is_finite() && at.gradient.norm() < 1.5, "{shape:?} {p}");
                assert!(at.hessian.iter().all(|entry| entry.is_finite()), "{shape:?} {p}");
            }
        }
    }
    // Under the apex the level sets are spheres: curvature 1/distance from the centre in both lateral directions.
    let at = NeedleShape::hemispherical(0.25).signed_distance(&Point3::new(0.0, 0.0, -0.15));
    assert!((at.hessian - Matrix3::from_diagonal(&Vector3::new(2.5, 2.5, 0.0))).amax() < 1e-9);
    assert!((at.gradient + Vector3::z()).amax() < 1e-12);
}

/// Points all over the surface of a tip without a bevel, `n` along the profile and `n` around.
fn revolved_surface(shape: &NeedleShape, n: usize) -> Vec<Point3<f64>> {
    let (radius, edge) = (shape.radius_mm, shape.edge_radius_mm());
    let core = radius - edge;
    let mut profile = Vec::new();
    for i in 0..=n {
        let t = i as f64 / n as f64;
        let (sin, cos) = (t * std::f64::consts::FRAC_PI_2).sin_cos();
        profile.push((core * t, 0.0));
        profile.push((core + edge * sin, edge - edge * cos));
        profile.push((radius, edge + 4.0 * radius * t));
    }
    let around = (0..n).map(|i| (i as f64 * std::f64::consts::TAU / n as f64).sin_cos());
    around.flat_map(|(sin, cos)| profile.iter().map(move |&(r, z)| Point3::new(r * cos, r * sin, z))).collect()
}

#[test]
fn distance_is_that_to_the_nearest_point_of_the_surface() {
    let radius = 0.25;
    for shape in shapes(radius).into_iter().filter(|shape| !matches!(shape.tip, Tip::Bevelled { .. })) {
        let surface = revolved_surface(&shape, 300);
        let mut random = noise(3);
        let (mut inside, mut outside) = (0, 0);
        for _ in 0..40 {
            let p = Point3::new(2.0 * radius * random(), 2.0 * radius * random(), radius * (0.5 + 1.5 * random()));
            let nearest = surface.iter().map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min);
            let value = shape.distance(&p);
            // The samples are at most 0.0053 mm apart, so the nearest is off by no more than that, and by less further away.
            assert!((value.abs() - nearest).abs() < 1e-3, "{shape:?} {p} {value} {nearest}");
            let is_inside = p.x.hypot(p.y) < radius && p.z > 0.0 && value < 0.0;
            inside += usize::from(is_inside);
            outside += usize::from(value > 0.0);
        }
        assert!(inside >= 3 && outside >= 10, "{shape:?} {inside} {outside}");
    }
}

#[test]
fn the_foremost_point_of_the_solid_is_the_origin() {
    for shape in shapes(0.257) {
        let body = shape.body();
        assert!(body.distance(&Point3::origin()).abs() < 1e-12, "{shape:?}");
        let foremost = body.foremost_along(&-Vector3::z_axis()).unwrap();
        assert!(foremost.coords.norm() < 1e-12, "{shape:?} {foremost}");
        // Nothing of the solid lies below z = 0, and something lies just above it.
        let grid = (-100..=100).flat_map(|i| (-100..=100).map(move |j| (0.008 * i as f64, 0.008 * j as f64)));
        let deepest = grid.map(|(x, y)| body.distance(&Point3::new(x, y, -1e-9))).fold(f64::INFINITY, f64::min);
        assert!(deepest > 0.0, "{shape:?} {deepest}");
        assert!(body.distance(&Point3::new(-1e-7, 0.0, 1e-5)) < 0.0, "{shape:?}");
    }
}

#[test]
fn foremost_points_touch_the_surface_and_nothing_lies_beyond() {
    let mut random = noise(11);
    for shape in shapes(0.257) {
        let body = shape.body();
        for _ in 0..50 {
            let inward = Unit::new_normalize(Vector3::new(random(), random(), -0.05 - random().abs()));
            let foremost = body.foremost_along(&inward).unwrap();
            let at = body.signed_distance(&foremost);
            assert!(at.value.abs() < 1e-12, "{shape:?} {inward:?} {}", at.value);
            // The body is convex: where its outward normal is the direction, nothing lies further along it.
            assert!((at.gradient.normalize() - inward.into_inner()).norm() < 1e-6, "{shape:?} {inward:?}");
        }
        assert_eq!(body.foremost_along(&Vector3::z_axis()), None);
        assert_eq!(body.foremost_along(&Vector3::x_axis()), None);
    }
}

/// Height of the needle on a ray by marching and bisection, as slow and plain as can be.
fn plain_height(body: &Body, origin: &Point3<f64>, up: &Vector3<f64>) -> Option<f64> {
    let distance = |height: f64| body.distance(&(origin + up * height));
    let step = 1e-4;
    let above = (0..10_000).map(|i| i as f64 * step).find(|&height| distance(height) <= 0.0)?;
    let (mut low, mut high) = ((above - step).max(0.0), above);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if distance(middle) <= 0.0 { high = middle } else { low = middle }
    }
    Some(high)
}

#[test]
fn underside_agrees_with_plain_marching() {
    let radii: Vec<f64> = (0..8).map(|i| 0.031 * i as f64).collect();
    let mut finite = 0;
    for shape in shapes(0.257) {
        let body = shape.body();
        for inward in [[0.0, 0.0, -1.0], [0.3, 0.0, -1.0], [0.02, -0.25, -1.0]] {
            let inward = Unit::new_normalize(Vector3::from(inward));
            let lowest = body.foremost_along(&inward).unwrap();
            let profile = body.underside_profile(&inward, &lowest, &radii).unwrap();
            let up = -inward.into_inner();
            let leaning = Vector3::z() - up * up.z;
            let across = if leaning.norm() < 1e-12 { Vector3::x() } else { leaning.normalize() };
            for (&radius, &height) in radii.iter().zip(&profile) {
                let hits: Vec<f64> = (0..16)
                    .filter_map(|i| {
                        let (sin, cos) = (i as f64 * std::f64::consts::TAU / 16.0).sin_cos();
                        let origin = lowest + (across * cos + up.cross(&across) * sin) * radius;
                        plain_height(&body, &origin, &up)
                    })
                    .collect();
                if hits.len() < 8 {
                    assert!(height.is_infinite(), "{shape:?} {inward:?} {radius} {height}");
                } else {
                    let expected = hits.iter().sum::<f64>() / hits.len() as f64;
                    assert!((height - expected).abs() < 1e-6, "{shape:?} {inward:?} {radius} {height} {expected}");
                    finite += 1;
                }
            }
        }
    }
    assert!(finite > 80, "{finite}");
}

#[test]
fn underside_of_a_ball_and_of_a_flat_tip_have_closed_forms() {
    let ball = NeedleShape::hemispherical(0.25).body();
    let radii: Vec<f64> = (0..30).map(|i| 0.01 * i as f64).collect();
    for inward in [[0.0, 0.0, -1.0], [0.1, 0.2, -1.0]] {
        let inward = Unit::new_normalize(Vector3::from(inward));
        let lowest = ball.foremost_along(&inward).unwrap();
        let profile = ball.underside_profile(&inward, &lowest, &radii).unwrap();
        for (radius, height) in radii.iter().zip(&profile).filter(|(radius, _)| **radius < 0.24) {
            let expected = 0.25 - (0.0625 - radius * radius).sqrt();
            assert!((height - expected).abs() < 1e-6, "{inward:?} {radius} {height} {expected}");
        }
        assert!(profile[29].is_infinite());
    }
    let flat = NeedleShape::flat(0.25).body();
    let down = -Vector3::z_axis();
    let profile = flat.underside_profile(&down, &Point3::origin(), &[0.0, 0.2, 0.24, 0.26]).unwrap();
    assert_eq!((profile[0], profile[1], profile[3]), (0.0, 0.0, f64::INFINITY));
    assert!((profile[2] - (0.025 - (0.025f64.powi(2) - 0.015f64.powi(2)).sqrt())).abs() < 1e-9);
    assert_eq!(flat.underside_profile(&Vector3::z_axis(), &Point3::origin(), &radii), None);
}

#[test]
fn a_tilted_edge_is_as_wide_by_area_as_its_two_curvatures_say() {
    let shape = NeedleShape::flat(0.25);
    let (body, edge) = (shape.body(), shape.edge_radius_mm());
    let radii: Vec<f64> = (0..120).map(|i| 1e-4 * i as f64).collect();
    for tilt_deg in [20.0_f64, 40.0, 60.0] {
        let (sin, cos) = tilt_deg.to_radians().sin_cos();
        let inward = Unit::new_normalize(Vector3::new(sin, 0.0, -cos));
        let profile = body.underside_by_area(&inward, &radii).unwrap();
        // Radii of curvature of a torus where its normal leans by the tilt.
        let around = (0.25 - edge + edge * sin) / sin;
        let expected = |radius: f64| radius * radius / (2.0 * (edge * around).sqrt());
        // Sixteen azimuths integrate an ellipse of this aspect to a few per cent; the mean height would be off by a factor of two.
        // Eight distinct directions integrate the ellipse's r² by the trapezoidal rule, whose error falls like q⁸.
        let q = ((around / edge).sqrt() - 1.0) / ((around / edge).sqrt() + 1.0);
        let azimuths = 2.0 * q.powi(8) / (1.0 - q.powi(8));
        assert!((profile[20] / expected(radii[20]) - 1.0).abs() < azimuths + 0.01, "{tilt_deg}: {}", profile[20]);
        let lowest = body.foremost_along(&inward).unwrap();
        let mean = body.underside_profile(&inward, &lowest, &radii).unwrap();
        assert!(mean[20] > 1.5 * expected(radii[20]), "{tilt_deg}: {}", mean[20]);
        assert!(profile.windows(2).all(|pair| pair[0] <= pair[1]));
    }
    // A round tip has the same height either way.
    let ball = NeedleShape::hemispherical(0.25).body();
    let inward = Unit::new_normalize(Vector3::new(0.3, 0.0, -1.0));
    let lowest = ball.foremost_along(&inward).unwrap();
    let (area, mean) =
        (ball.underside_by_area(&inward, &radii).unwrap(), ball.underside_profile(&inward, &lowest, &radii).unwrap());
    for (area, mean) in area.iter().zip(&mean) {
        assert!((area - mean).abs() < 1e-9, "{area} {mean}");
    }
}

#[test]
fn a_needle_points_along_the_direction_asked_for() {
    let mut random = noise(5);
    let mut directions =
        vec![Vector3::z(), -Vector3::z(), Vector3::new(1e-9, 0.0, 1.0), Vector3::new(0.0, -1e-200, 1.0)];
    directions.extend((0..50).map(|_| Vector3::new(random(), random(), random())));
    for direction in directions.into_iter().map(Unit::new_normalize) {
        let needle = Needle::pointing(NeedleShape::flat(0.25), Point3::new(1.0, 2.0, 3.0), &direction);
        assert!((needle.direction().into_inner() - direction.into_inner()).norm() < 1e-12, "{direction:?}");
        needle.validate().unwrap();
        // The shortest rotation: no longer than the angle between the two directions.
        let angle = (-Vector3::z()).angle(&direction);
        assert!((needle.orientation.angle() - angle).abs() < 1e-7, "{direction:?}");
    }
    assert!(orientation_pointing(&-Vector3::z_axis()).angle() < 1e-15);
    let turned = orientation_pointing(&Vector3::z_axis());
    assert!((turned * Vector3::x() - Vector3::x()).norm() < 1e-15, "the half turn is about local x");
}

#[test]
fn a_needle_outside_its_ranges_is_refused_with_the_field() {
    let refused = |shape: NeedleShape| shape.validate().unwrap_err().field;
    assert_eq!(refused(NeedleShape::flat(0.6)), "needle.radius_mm");
    assert_eq!(refused(NeedleShape::hemispherical(f64::NAN)), "needle.radius_mm");
    let tip = Tip::Flat { edge_radius_mm: 0.21 };
    assert_eq!(refused(NeedleShape { radius_mm: 0.2, tip }), "needle.tip.edge_radius_mm");
    let tip = Tip::Bevelled { angle_deg: 80.0, edge_radius_mm: 0.02 };
    assert_eq!(refused(NeedleShape { radius_mm: 0.2, tip }), "needle.tip.angle_deg");
    for shape in shapes(0.257) {
        shape.validate().unwrap();
    }
    let mut needle = Needle::pointing(NeedleShape::flat(0.25), Point3::origin(), &Vector3::x_axis());
    needle.tip_mm.y = f64::NAN;
    assert_eq!(needle.validate().unwrap_err().field, "needle.tip_mm[1]");
    needle.tip_mm.y = 0.0;
    needle.orientation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0));
    assert_eq!(needle.validate().unwrap_err().field, "needle.orientation_xyzw");
}

#[test]
fn gauges_have_names() {
    assert_eq!(Gauge::from_name("25G").unwrap().radius_mm(), 0.257);
    let error = Gauge::from_name("26G").unwrap_err();
    assert!(error.to_string().contains("41G, 38G, 30G, 27G, 25G, 23G"), "{error}");
}
