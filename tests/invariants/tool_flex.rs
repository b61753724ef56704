//! A shaft that bends: the force across it is its stiffness times the deflection, a stiff one is rigid, and a bent needle is a rigid one that stands where it was bent to.

use nalgebra::{Point3, Unit, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, EffectReport, Level, Prediction, PreparedScene, Request};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::sequence::{Sequence, Simulation, Step};
use retina_tests::tolerance::BALANCE;

use crate::support::{FAST, ask, built_in, force, requests};

/// What the tests simulate besides the bending.
const RIGID: [&str; 3] = ["elasticity", "finite_strain", "contact"];

fn named(extra: &[&str]) -> EffectChoice {
    EffectChoice::Named([&RIGID[..], extra].concat().iter().map(|name| (*name).to_owned()).collect())
}

/// A 25G ball that leans by so many degrees and is pushed along its shaft, its foremost point in the scene's origin.
fn leaning(level: Level, force_mn: f64, angle_deg: f64, stiffness_mn_per_mm: f64) -> Request {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let direction = Unit::new_normalize(Vector3::new(sin, 0.0, -cos));
    let mut needle = Needle::pointing(NeedleShape::hemispherical(0.257), Point3::origin(), &direction);
    needle.stiffness_mn_per_mm = Some(stiffness_mn_per_mm);
    let control = Control::Force(direction.into_inner() * force_mn);
    Request { needle, control, level, effects: named(&["tool_flex"]) }
}

/// The part of `vector` across the shaft.
fn across(request: &Request, vector: &Vector3<f64>) -> Vector3<f64> {
    let axis = request.needle.direction().into_inner();
    vector - axis * axis.dot(vector)
}

fn report(answer: &Prediction) -> EffectReport {
    answer.effects.iter().find(|effect| effect.name == "tool_flex").unwrap().clone()
}

fn apart_um(a: &Prediction, b: &Prediction) -> f64 {
    a.vertices.iter().zip(&b.vertices).map(|(a, b)| (a - b).norm() * 1e3).fold(0.0, f64::max)
}

fn bits(answer: &Prediction) -> String {
    let Prediction { vertices, normals, needle, contact, solver, .. } = answer;
    format!("{vertices:?} {normals:?} {needle:?} {contact:?} {solver:?}")
}

#[test]
fn the_force_across_the_shaft_is_its_stiffness_times_the_deflection() {
    for (name, seed) in Scene::built_in_names().iter().zip(70..) {
        let scene = built_in(name);
        for request in requests(&scene, seed, 4) {
            for control in [request.control, Control::Pose] {
                let mut request =
                    Request { control, level: Level::Coarse, effects: named(&["tool_flex"]), ..request.clone() };
                request.needle.stiffness_mn_per_mm = Some(20.0);
                if control == Control::Pose {
                    // From 0.1 mm above the patch a little way into the tissue.
                    request.needle.tip_mm.z -= 0.15;
                }
                let answer = match ask(&scene, &request) {
                    Ok(answer) if answer.needle.deflection_mm.is_some() => answer,
                    Ok(_) => continue,
                    Err(error) => panic!("{name}: {error}: {request:?}"),
                };
                let deflection = answer.needle.deflection_mm.unwrap();
                let reaction = answer.needle.reaction_mn;
                let size = reaction.norm();
                assert!(deflection.dot(&request.needle.direction()).abs() < 1e-12, "across the shaft only");
                let missing = (across(&request, &reaction) - deflection * 20.0).norm();
                assert!(missing < BALANCE * size.max(0.1), "{name}: {missing} of {size} mN: {request:?}");
                let wrong = (across(&request, &reaction) - deflection * 22.0).norm();
                assert!(wrong > 1e2 * BALANCE * size, "another stiffness does not balance");
                let guide = answer.needle.tip_mm - deflection - request.needle.tip_mm;
                match control {
                    Control::Force(force) => {
                        let along = force.normalize();
                        assert!((reaction.dot(&along) + force.norm()).abs() < BALANCE * force.norm());
                        assert!((guide - along * answer.needle.travel_mm).norm() < 1e-12);
                    }
                    Control::Pose => assert!(guide.norm() < 1e-12 && answer.needle.travel_mm == 0.0),
                }
            }
        }
    }
}

#[test]
fn on_a_plane_the_tip_is_bent_as_a_cantilever_is() {
    // A ball on a plane meets it along its normal: N = F/cos, of which N sin bends the shaft, F tan(angle)/k.
    let mut scene = Scene::built_in("flat").unwrap();
    scene.tissue.choroid.youngs_modulus_kpa = 1300.0;
    let scene = PreparedScene::new(scene).unwrap();
    for angle_deg in [10.0, 30.0, 45.0] {
        let request = leaning(Level::Coarse, 0.1, angle_deg, 32.0);
        let answer = ask(&scene, &request).unwrap();
        let deflection = answer.needle.deflection_mm.unwrap();
        let expected = 0.1 * f64::to_radians(angle_deg).tan() / 32.0;
        println!("{angle_deg}°: {:.5} mm, closed form {expected:.5} mm", deflection.norm());
        assert!((deflection.norm() / expected - 1.0).abs() < 0.03, "{deflection} {expected}");
        assert!(deflection.x < 0.0 || deflection.z > 0.0, "away from the tissue: {deflection}");
    }
    let upright = ask(&scene, &leaning(Level::Coarse, 0.1, 0.0, 32.0)).unwrap();
    assert!(upright.needle.deflection_mm.unwrap().norm() < 1e-3 * 0.1 / 32.0);
}

#[test]
fn a_stiff_shaft_is_a_rigid_one() {
    let scene = built_in("macula");
    let rigid = ask(&scene, &Request { effects: named(&[]), ..leaning(Level::Coarse, 0.8, 30.0, 32.0) }).unwrap();
    assert_eq!(rigid.needle.deflection_mm, None);
    let change_um = |stiffness: f64| {
        let answer = ask(&scene, &leaning(Level::Coarse, 0.8, 30.0, stiffness)).unwrap();
        println!(
            "{stiffness:e} mN/mm: {:.4} µm, {} iterations (rigid {})",
            apart_um(&answer, &rigid),
            answer.solver.iterations,
            rigid.solver.iterations
        );
        apart_um(&answer, &rigid)
    };
    let changes = [32.0, 1e3, 1e6].map(change_um);
    assert!(changes[0] > 2.0, "{changes:?}");
    assert!(changes[1] < 0.1 * changes[0] && changes[2] < 1e-2, "{changes:?}");
}

#[test]
fn a_bent_needle_is_a_rigid_one_that_stands_where_it_was_bent_to() {
    let scene = built_in("flat");
    for (force_mn, angle_deg) in [(0.5, 20.0), (0.9, 40.0)] {
        let bent = ask(&scene, &leaning(Level::Coarse, force_mn, angle_deg, 20.0)).unwrap();
        let mut held = leaning(Level::Coarse, force_mn, angle_deg, 20.0);
        held.effects = named(&[]);
        held.control = Control::Pose;
        held.needle.tip_mm = bent.needle.tip_mm;
        let stands = ask(&scene, &held).unwrap();
        let missing = (stands.needle.reaction_mn - bent.needle.reaction_mn).norm() / bent.needle.reaction_mn.norm();
        let apart = apart_um(&bent, &stands);
        println!("{force_mn} mN, {angle_deg}°: reactions differ by {missing:.4}, nodes by {apart:.3} µm");
        // Each has a mesh of its own, around the contact that it expects.
        assert!(missing < 0.02 && apart < 1.0, "{missing} {apart}");
        held.needle.tip_mm -= bent.needle.deflection_mm.unwrap();
        assert!(
            apart_um(&bent, &ask(&scene, &held).unwrap()) > 3.0 * apart,
            "a needle that did not bend stands elsewhere"
        );
    }
}

#[test]
fn a_rigid_needle_and_one_whose_bending_is_off_are_the_same_bits() {
    for (name, seed) in Scene::built_in_names().iter().zip(90..) {
        let scene = built_in(name);
        for request in requests(&scene, seed, 3) {
            for level in FAST {
                let rigid = Request { level, effects: EffectChoice::Auto, ..request.clone() };
                let expected = ask(&scene, &rigid).unwrap();
                let mut soft = rigid.clone();
                soft.needle.stiffness_mn_per_mm = Some(5.0);
                let names: Vec<&str> =
                    expected.effects.iter().filter(|effect| effect.simulated).map(|effect| effect.name).collect();
                soft.effects = EffectChoice::Named(names.iter().map(|name| (*name).to_owned()).collect());
                assert_eq!(bits(&ask(&scene, &soft).unwrap()), bits(&expected), "{name} {level:?}");
                assert!(!report(&expected).simulated && report(&expected).reason == "the needle's shaft is rigid");
                let mut all = rigid.clone();
                (all.effects, all.needle.stiffness_mn_per_mm) = (EffectChoice::All, Some(5.0));
                if level == Level::Coarse {
                    assert_ne!(bits(&ask(&scene, &all).unwrap()), bits(&expected), "{name}: it does something");
                } else {
                    assert!(report(&ask(&scene, &all).unwrap()).reason.contains("by construction"));
                }
            }
        }
    }
}

#[test]
fn auto_bends_the_shaft_from_a_micrometre_on() {
    let scene = built_in("flat");
    for (force_mn, angle_deg, expected) in
        [(0.8, 0.0, false), (0.8, 3.0, false), (0.8, 10.0, true), (0.05, 30.0, false)]
    {
        let request = Request { effects: EffectChoice::Auto, ..leaning(Level::Coarse, force_mn, angle_deg, 67.0) };
        let answer = ask(&scene, &request).unwrap();
        let report = report(&answer);
        println!("{force_mn} mN, {angle_deg}°: {report:?}");
        assert_eq!((report.simulated, answer.needle.deflection_mm.is_some()), (expected, expected));
        let across_um = force_mn * f64::to_radians(angle_deg).tan() / 67.0 * 1e3;
        assert!((report.value.unwrap() - across_um).abs() < 1e-6 + 1e-3 * across_um && report.threshold == Some(1.0));
        // What is left out moves less than the tolerance.
        let all = Request { effects: named(&["tool_flex"]), ..request.clone() };
        let rigid = Request { effects: named(&[]), ..request };
        let off_um = apart_um(&ask(&scene, &all).unwrap(), &ask(&scene, &rigid).unwrap());
        assert!(expected || off_um < 1.0, "{off_um} µm");
        assert_eq!(answer.expected_error.calibrated, !expected, "measured on rigid needles");
    }
    // A motion across the shaft is not bending's to describe, which is said.
    let mut aside = leaning(Level::Coarse, 0.3, 60.0, 67.0);
    aside.control = Control::Force(Vector3::new(-0.1, 0.0, -0.3));
    let answer = ask(&scene, &aside).unwrap();
    assert!(!report(&answer).simulated && report(&answer).reason.contains("60 degrees"), "{:?}", report(&answer));
    assert!(answer.warnings.iter().any(|warning| warning.contains("`tool_flex` is not simulated though")));
}

#[test]
fn friction_and_pressure_bend_it_too() {
    let mut scene = Scene::built_in("macula").unwrap();
    (scene.friction_coefficient, scene.pressure_kpa) = (0.2, scene.rest_pressure_kpa + 1.0);
    let scene = PreparedScene::new(scene).unwrap();
    let request =
        Request { effects: named(&["tool_flex", "friction", "pressure"]), ..leaning(Level::Coarse, 0.6, 25.0, 20.0) };
    let answer = ask(&scene, &request).unwrap();
    let deflection = answer.needle.deflection_mm.unwrap();
    let reaction = answer.needle.reaction_mn;
    assert!((across(&request, &reaction) - deflection * 20.0).norm() < BALANCE * reaction.norm());
    assert!((reaction.dot(&request.needle.direction()) + 0.6).abs() < BALANCE);
    let smooth = Request { effects: named(&["tool_flex", "pressure"]), ..request };
    let slides = ask(&scene, &smooth).unwrap().needle.deflection_mm.unwrap();
    assert!(deflection.norm() < 0.9 * slides.norm(), "friction bears a part: {deflection} {slides}");
}

#[test]
fn a_bent_needle_that_is_let_be_stays_bent_and_springs_back_when_lifted() {
    let scene = built_in("flat");
    let first = leaning(Level::Coarse, 0.6, 30.0, 20.0);
    let press = Step { time_s: 1.0, force_mn: Some(force(&first)), ..Step::default() };
    let hold = Step { time_s: 2.0, ..Step::default() };
    let less = Step { time_s: 3.0, force_mn: Some(force(&first) * 0.5), ..Step::default() };
    let lift = Step { time_s: 4.0, force_mn: Some(Vector3::zeros()), ..Step::default() };
    let again = Step { time_s: 5.0, force_mn: Some(force(&first)), ..Step::default() };
    let sequence = Sequence {
        needle: first.needle,
        steps: vec![press, hold, less, lift, again],
        level: Level::Coarse,
        effects: named(&["tool_flex"]),
    };
    let mut simulation = Simulation::new(&scene, &sequence, &mut Silent).unwrap();
    let mut steps = Vec::new();
    while let Some(outcome) = simulation.step(&mut Silent).unwrap() {
        steps.push(outcome.prediction);
    }
    let bent = |step: usize| steps[step].needle.deflection_mm.unwrap_or_default();
    let alone = ask(&scene, &first).unwrap();
    assert_eq!(steps[0].vertices, alone.vertices);
    assert_eq!(steps[0].needle, alone.needle);
    assert!((bent(1) - bent(0)).norm() < 1e-6 && apart_um(&steps[1], &steps[0]) < 1e-3, "let be");
    assert!((steps[1].needle.reaction_mn - steps[0].needle.reaction_mn).norm() < 1e-5);
    assert!(bent(2).norm() < 0.6 * bent(0).norm() && bent(2).norm() > 0.4 * bent(0).norm());
    assert_eq!((bent(3), steps[3].needle.reaction_mn), (Vector3::zeros(), Vector3::zeros()));
    assert!((bent(4) - bent(0)).norm() < 0.02 * bent(0).norm() && apart_um(&steps[4], &steps[0]) < 0.5);
}
