//! The laws at the learned levels, which compute in single precision; and what they refuse.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::networks::Networks;
use retina_core::predict::{Control, EffectChoice, Level, PredictError, PreparedScene, Request};
use retina_core::scene::Scene;
use retina_core::tissue::Layer;
use retina_tests::tolerance::{BALANCE, RIGID_MOTION};

use crate::support::{answered, ask, at, built_in, cap, force, largest_um, mesh_scene, motion, moved, straight};

const LEARNED: [Level; 2] = [Level::Network, Level::Corrected];
/// Single precision has a rounding of 6e-8 of a coordinate of 1 mm, where double precision has a residual: 0.01 µm in all.
const SINGLE: f64 = 100.0 * RIGID_MOTION;

#[test]
fn a_rigid_motion_of_scene_and_needle_moves_the_answer() {
    for (name, seed) in Scene::built_in_names().iter().zip(160..) {
        let scene = built_in(name);
        for level in LEARNED {
            for (index, (request, answer)) in answered(&scene, seed, 4, level).iter().enumerate() {
                let by = motion(100 * seed + index as u64);
                let placed = Scene { scene_from_patch: by, ..Scene::built_in(name).unwrap() };
                let elsewhere = ask(&PreparedScene::new(placed).unwrap(), &moved(request, &by)).unwrap();
                for (here, there) in answer.vertices.iter().zip(&elsewhere.vertices) {
                    assert!((by * here - there).norm() < SINGLE, "{name} {level:?}: {here} {there}");
                }
                let reaction = by * answer.needle.reaction_mn - elsewhere.needle.reaction_mn;
                assert!(reaction.norm() < 1e-4 * answer.needle.reaction_mn.norm(), "{name} {level:?}: {reaction}");
                assert!(ask(&scene, &moved(request, &by)).map_or(true, |a| a.vertices != answer.vertices));
            }
        }
    }
}

/// The grid on a plane is its own image under a quarter turn and under a mirror; the request and its answer turn along.
#[test]
fn on_a_plane_the_answer_turns_and_mirrors_with_the_request() {
    let scene = built_in("flat");
    let node = |p: &Point3<f64>, rest: &[Point3<f64>]| rest.iter().position(|q| (p - q).norm() < 1e-9).unwrap();
    let rest = scene.scene().patch(&Point3::origin()).unwrap().vertices;
    for (request, answer) in answered(&scene, 171, 6, Level::Network) {
        let turn = Isometry3::from_parts(
            Default::default(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2),
        );
        let turned = ask(&scene, &moved(&request, &turn)).unwrap();
        let mirrored = ask(&scene, &mirror(&request)).unwrap();
        let flip = |p: &Point3<f64>| Point3::new(-p.x, p.y, p.z);
        for (index, vertex) in answer.vertices.iter().enumerate() {
            let image = node(&(turn * rest[index]), &rest);
            assert!((turn * vertex - turned.vertices[image]).norm() < SINGLE, "turned: {vertex}");
            let image = node(&flip(&rest[index]), &rest);
            assert!((flip(vertex) - mirrored.vertices[image]).norm() < SINGLE, "mirrored: {vertex}");
        }
        assert!(largest_um(&answer) > 0.1);
        assert_ne!(turned.vertices, answer.vertices);
    }
}

/// The request as its image in the plane x = 0: a needle is its own image under y → −y of its own coordinates.
fn mirror(request: &Request) -> Request {
    let mut request = request.clone();
    request.needle.tip_mm.x *= -1.0;
    let q = request.needle.orientation;
    let image = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
    let x = image(q * Vector3::x());
    let z = image(q * Vector3::z());
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]));
    request.needle.orientation = UnitQuaternion::from_rotation_matrix(&rotation);
    request.control = Control::Force(image(force(&request)));
    request
}

#[test]
fn the_reaction_along_the_force_is_the_force_and_nothing_is_pierced() {
    for (name, seed) in Scene::built_in_names().iter().zip(180..) {
        let scene = built_in(name);
        for level in LEARNED {
            for (request, answer) in answered(&scene, seed, 8, level) {
                let force = force(&request);
                let along = answer.needle.reaction_mn.dot(&force) / force.norm_squared();
                assert!((along + 1.0).abs() < BALANCE, "{name} {level:?}: {along}");
                let body = request.needle.shape.body();
                let mut pose = request.needle.scene_from_needle();
                pose.translation = answer.needle.tip_mm.into();
                for vertex in &answer.vertices {
                    let distance = body.distance(&pose.inverse_transform_point(vertex));
                    assert!(distance > -SINGLE, "{name} {level:?}: {distance:e} mm inside");
                }
                assert_eq!(answer.level, level);
                let again = ask(&scene, &request).unwrap();
                assert_eq!(answer.vertices, again.vertices, "the same bits");
            }
        }
    }
}

#[test]
fn a_held_needle_stands_where_its_force_takes_it() {
    let scene = built_in("macula");
    for (request, answer) in answered(&scene, 190, 5, Level::Network) {
        let mut held = Request { control: Control::Pose, ..request.clone() };
        held.needle.tip_mm = answer.needle.tip_mm;
        // Driven along its own direction, as a held needle is taken to have come.
        let along = Request {
            control: Control::Force(request.needle.direction().into_inner() * force(&request).norm()),
            ..request
        };
        let Ok(pushed) = ask(&scene, &along) else { continue };
        held.needle.tip_mm = pushed.needle.tip_mm;
        let found = ask(&scene, &held).unwrap();
        let direction = along.needle.direction();
        let [pushed_mn, found_mn] = [&pushed, &found].map(|answer| -answer.needle.reaction_mn.dot(&direction));
        assert!((found_mn - pushed_mn).abs() < 1e-3 * pushed_mn, "{found_mn} mN held, {pushed_mn} mN pushed");
        assert_eq!(found.needle.travel_mm, 0.0);
    }
}

#[test]
fn a_patch_cut_from_a_mesh_is_answered_and_not_called_calibrated() {
    let (vertices, triangles) = cap();
    let scene = mesh_scene(vertices.clone(), triangles.clone());
    let request = straight(Level::Network, 0.5);
    let answer = ask(&scene, &request).unwrap();
    assert!(largest_um(&answer) > 5.0 && !answer.expected_error.calibrated);
    // Numbered the other way round.
    let last = vertices.len() - 1;
    let reversed: Vec<_> = vertices.iter().rev().copied().collect();
    let renumbered = triangles.iter().map(|corners| corners.map(|c| last - c)).collect();
    let other = ask(&mesh_scene(reversed, renumbered), &request).unwrap();
    for (vertex, source) in answer.vertices.iter().zip(answer.source_indices.as_ref().unwrap()) {
        let at = other.source_indices.as_ref().unwrap().iter().position(|s| *s == last - source).unwrap();
        assert!((vertex - other.vertices[at]).norm() < SINGLE);
    }
}

#[test]
fn what_was_not_learned_is_refused_by_name() {
    let rough = Scene { friction_coefficient: 0.5, ..Scene::built_in("flat").unwrap() };
    let raised = Scene { pressure_kpa: 4.0, ..Scene::built_in("macula").unwrap() };
    let mut layered = Scene::built_in("flat").unwrap();
    let half = Layer { thickness_mm: 0.5 * layered.tissue.retina[0].thickness_mm, ..layered.tissue.retina[0] };
    layered.tissue.retina = vec![half, half];
    for level in LEARNED {
        let refusal =
            |scene: &Scene, request: &Request| ask(&PreparedScene::new(scene.clone()).unwrap(), &at(request, level));
        let mut leaning = straight(level, 0.8);
        leaning.control = Control::Force(Vector3::new(0.4, 0.0, -0.7));
        let friction = refusal(&rough, &leaning);
        assert!(matches!(&friction, Err(PredictError::Effect { name, .. }) if name == "friction"), "{friction:?}");
        let pressure = refusal(&raised, &straight(level, 0.8));
        assert!(matches!(&pressure, Err(PredictError::Effect { name, .. }) if name == "pressure"), "{pressure:?}");
        let layers = refusal(&layered, &straight(level, 0.8));
        assert!(matches!(layers, Err(PredictError::NotLearned { field: "scene.tissue.retina", .. })), "{layers:?}");
        let small = ["elasticity", "contact"].map(str::to_owned).to_vec();
        let small = Request { effects: EffectChoice::Named(small), ..straight(level, 0.8) };
        let small = refusal(&Scene::built_in("flat").unwrap(), &small);
        assert!(matches!(&small, Err(PredictError::Effect { name, .. }) if name == "finite_strain"), "{small:?}");
        assert!(refusal(&Scene::built_in("flat").unwrap(), &straight(level, 0.8)).is_ok());
    }
}

#[test]
fn without_usable_weights_the_other_levels_answer() {
    let networks = Arc::new(Networks::read(b"not weights", b""));
    let scene = built_in("macula").with_networks(networks);
    for level in [Level::Linear, Level::Coarse] {
        assert!(ask(&scene, &straight(level, 0.5)).is_ok());
    }
    for level in LEARNED {
        let refusal = ask(&scene, &straight(level, 0.5));
        assert!(matches!(refusal, Err(PredictError::Weights { .. })), "{refusal:?}");
        let situation = scene.situation(&straight(level, 0.5)).unwrap();
        assert!(!situation.has(level));
    }
    let situation = built_in("macula").situation(&straight(Level::Network, 0.5)).unwrap();
    assert!(LEARNED.iter().all(|level| situation.has(*level) && situation.expected_error(*level).p95_um.is_finite()));
}

/// A needle that leans to 60° and is driven within 15° of its axis was sampled; one that leans or is driven further off was not.
#[test]
fn a_needle_beyond_the_training_is_answered_and_flagged() {
    let scene = built_in("flat");
    let request = |tilt_deg: f64, lean_deg: f64| {
        let along = |deg: f64| {
            let (sin, cos) = deg.to_radians().sin_cos();
            nalgebra::Unit::new_normalize(Vector3::new(sin, 0.0, -cos))
        };
        let tip = Point3::new(0.0, 0.0, 0.1);
        let needle = Needle::pointing(NeedleShape::hemispherical(0.2), tip, &along(tilt_deg));
        let control = Control::Force(along(tilt_deg + lean_deg).into_inner() * 0.2);
        Request { needle, control, level: Level::Network, effects: EffectChoice::Auto }
    };
    for level in [Level::Linear, Level::Network] {
        let calibrated = |tilt_deg, lean_deg| {
            ask(&scene, &at(&request(tilt_deg, lean_deg), level)).unwrap().expected_error.calibrated
        };
        assert!(calibrated(0.0, 0.0) && calibrated(0.0, 14.0) && calibrated(58.0, 0.0), "{level:?}");
        assert!(!calibrated(0.0, 17.0) && !calibrated(62.0, 0.0), "{level:?}");
    }
}

#[test]
fn a_tissue_beyond_the_training_is_answered_and_flagged() {
    let known = ask(&built_in("macula"), &straight(Level::Network, 0.5)).unwrap();
    assert!(known.expected_error.calibrated);
    // A thick retina on hardly any choroid.
    let mut odd = Scene::built_in("macula").unwrap();
    (odd.tissue.retina[0].thickness_mm, odd.tissue.choroid.thickness_mm) = (0.32, 0.05);
    let answer = ask(&PreparedScene::new(odd).unwrap(), &straight(Level::Network, 0.5)).unwrap();
    assert!(!answer.expected_error.calibrated && answer.expected_error.p95_um.is_finite());
}
