//! `friction`: derivatives, the cone of Coulomb, and where anchors lie.

use nalgebra::{Point3, Unit, Vector3};
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::contact::ContactFaces;
use retina_core::effects::friction::{CoupledFriction, Friction, RubbingPoint, anchor};
use retina_core::mesh::element::FACE_NODES;
use retina_tests::tolerance::ROUNDOFF;

use super::contact::{for_each_contact, shapes};
use super::{Case, RADIUS, REPEATS, SIZES, STEP, added, check_effect, face};
use crate::meshes::noise;

/// Slip from which on friction is at its limit, in needle radii.
const FULL_SLIP: f64 = 0.02;

/// Points of one face that rub, their anchors off by about `slip` radii.
fn points(
    faces: &ContactFaces,
    stencils: &Stencils,
    rest: &[f64],
    slip: f64,
    size: f64,
    seed: u64,
) -> Vec<RubbingPoint> {
    let mut random = noise(70 + seed);
    let normal = Vector3::new(0.3 * random(), 0.3 * random(), 1.0).normalize();
    (0..faces.points)
        .map(|point| {
            let node = |&v: &u32| Vector3::from_row_slice(&rest[3 * v as usize..][..3]);
            let at: Vector3<f64> =
                faces.values(point).iter().zip(stencils.group(0)).map(|(value, v)| node(v) * *value).sum();
            let off = Vector3::new(1.0 + 0.3 * random(), 0.5 * random(), random()) * (slip * RADIUS * size);
            RubbingPoint { point, limit_mn: (1.0 + random().abs()) * size * size, normal, anchor: at - off }
        })
        .collect()
}

fn for_each(size: f64, mut visit: impl FnMut(&Friction, Case)) {
    let (stencils, rest) = face(size);
    let faces = ContactFaces::new(&stencils, &rest, 3);
    for (label, slip) in [("sticking", 0.3 * FULL_SLIP), ("about to slip", FULL_SLIP), ("slipping", 10.0 * FULL_SLIP)] {
        for seed in 0..REPEATS as u64 {
            let points = vec![points(&faces, &stencils, &rest, slip, size, seed)];
            let friction = Friction { faces: &faces, points, full_slip_mm: FULL_SLIP * RADIUS * size };
            let mut current = vec![0.0; 3 * (FACE_NODES + 1)];
            stencils.gather(0, &rest, &mut current);
            let label = format!("{label}, seed {seed}, size {size:e}");
            visit(&friction, Case { label, group: 0, current, step_mm: 0.1 * STEP * RADIUS * size });
        }
    }
}

pub fn check() {
    for size in SIZES {
        for_each(size, |friction, case| check_effect("friction", friction, &[case]));
    }
}

#[test]
fn the_traction_stays_in_the_cone_and_reaches_it_where_the_tissue_slips() {
    for_each(1.0, |friction, case| {
        let local = Local { current: &case.current, group: 0, predicted: &[] };
        let used: Vec<f64> = friction.used(&local).map(|(_, used)| used).collect();
        assert!(used.iter().all(|&used| (0.0..=1.0).contains(&used)), "{}: {used:?}", case.label);
        let at_limit = used.iter().filter(|&&used| used == 1.0).count();
        match case.label.split(',').next() {
            Some("sticking") => assert_eq!(at_limit, 0, "{used:?}"),
            Some("slipping") => assert_eq!(at_limit, used.len(), "{used:?}"),
            _ => {}
        }
        let n = FACE_NODES + 1;
        let forces = added(3 * n, |out| friction.add_gradient(&local, out));
        let on = |a: usize| Vector3::from_fn(|k, _| forces[k * n + a]);
        let (tip, normal) = (on(FACE_NODES), friction.points[0][0].normal);
        let tissue: Vector3<f64> = (0..FACE_NODES).map(on).sum();
        let limit: f64 = friction.points[0].iter().map(|point| point.limit_mn).sum();
        assert!((tissue + tip).norm() < ROUNDOFF * limit, "equal and opposite");
        assert!(tip.dot(&normal).abs() < ROUNDOFF * limit && tip.norm() <= limit, "tangential: {tip}");
        // The gradient resists: it points the way of the slip, which leads from the anchors towards +x.
        assert!(tissue.x > 0.0, "{tissue}");
    });
}

#[test]
fn an_anchor_is_the_first_of_the_needle_on_its_way() {
    let mut random = noise(5);
    for shape in shapes(1.0) {
        let body = shape.body();
        for _ in 0..50 {
            let direction = Unit::new_normalize(Vector3::new(random(), random(), -2.0));
            let across = Vector3::new(random(), random(), 0.0) * (0.6 * RADIUS);
            let point = Point3::from(across + direction.into_inner() * (0.5 * RADIUS * random()));
            let at = anchor(&body, &point, &direction);
            assert!(body.distance(&at).abs() < 1e-9, "{:?}: not on the surface", shape.tip);
            let ahead = |by: f64| body.distance(&(at + direction.into_inner() * by));
            if ahead(1e-3) > 1e-6 && (at - point).cross(&direction).norm() < 1e-9 {
                assert!([0.01, 0.1, 1.0].iter().all(|&by| ahead(by) > 0.0), "{:?}: not the first", shape.tip);
            }
        }
        // Straight ahead of the foremost point.
        let foremost = body.foremost_along(&-Vector3::z_axis()).unwrap();
        for off in [-0.1, 0.0, 0.2] {
            let at = anchor(&body, &(foremost - Vector3::z() * off), &-Vector3::z_axis());
            assert!((at - foremost).norm() < 1e-6, "{:?}: {at} {foremost}", shape.tip);
        }
    }
}

/// Coefficient of the coupled friction below.
const COEFFICIENT: f64 = 0.4;
/// By how much the needle is pushed on, in needle radii.
const PUSHED: f64 = 5e-3;

#[test]
fn coupled_friction_is_held_friction_with_the_pressures_of_each_position() {
    let n = FACE_NODES + 1;
    let stencils = Stencils { group_size: n, vertices: (0..n as u32).collect() };
    for_each_contact(1.0, |contact, case| {
        let Case { label, current, .. } = case;
        // Anchors beside the needle: everything slips the same way.
        let beside = |_: usize, _: usize| Vector3::new(-2.0 * RADIUS, 0.5 * RADIUS, 0.0);
        let full_slip_mm = FULL_SLIP * RADIUS;
        let coupled = CoupledFriction { contact, anchor: &beside, coefficient: COEFFICIENT, full_slip_mm };
        let positions: Vec<f64> = (0..3 * n).map(|at| current[at % 3 * n + at / 3]).collect();
        let held = coupled.held_at(&stencils, &positions).expect("friction has no potential of its own");
        let tip_force = |effect: &dyn Effect, current: &[f64]| {
            let local = Local { current, group: 0, predicted: &[] };
            let forces = added(3 * n, |out| effect.add_gradient(&local, out));
            (Vector3::from_fn(|k, _| forces[k * n + FACE_NODES]), forces)
        };
        let stiffness = |effect: &dyn Effect| {
            let local = Local { current: &current, group: 0, predicted: &[] };
            added(9 * n * n, |out| effect.add_hessian(&local, out))
        };
        let (rubbed, forces) = tip_force(&coupled, &current);
        assert_eq!(forces, tip_force(held.as_ref(), &current).1, "{label}: forces");
        assert_eq!(stiffness(&coupled), stiffness(held.as_ref()), "{label}: stiffness");
        let local = Local { current: &current, group: 0, predicted: &[] };
        let normal_mn: f64 = contact.pressing(&local).map(|(_, force_mn, _)| force_mn).sum();
        assert!(rubbed.norm() <= COEFFICIENT * normal_mn * (1.0 + ROUNDOFF), "{label}: beyond Coulomb's cone");
        if normal_mn == 0.0 {
            assert_eq!(forces, vec![0.0; 3 * n], "{label}: rubbed without touching");
            return;
        }
        assert!(rubbed.norm() > 0.5 * COEFFICIENT * normal_mn, "{label}: what slips is at the limit, {rubbed}");
        // Pushed on, the needle presses harder: what is held does not know.
        let mut pushed = current.clone();
        let outward = contact.pressing(&local).map(|(_, force_mn, normal)| normal * force_mn).sum::<Vector3<f64>>();
        for (k, along) in outward.normalize().iter().enumerate() {
            pushed[k * n + FACE_NODES] += PUSHED * RADIUS * along;
        }
        let [now, before] = [&coupled as &dyn Effect, held.as_ref()].map(|effect| tip_force(effect, &pushed).0.norm());
        assert!(now > 1.01 * before, "{label}: {now} pushed on, {before} held");
    });
}
