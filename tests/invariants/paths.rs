//! Laws of sequences in which the way matters: friction that sticks, slips and turns back, a bond that never heals, an eye under pressure.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::equilibrium::error::EquilibriumError;
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::sequence::{LASTING, Sequence, SequenceError, Simulation, Step, StepOutcome};
use retina_core::tissue::RetinalBond;
use retina_tests::tolerance::DISCRETISATION;

use crate::support::{ask, at, force, largest_um, outcomes, requests, straight};

fn changed(name: &str, change: impl FnOnce(&mut Scene)) -> Arc<PreparedScene> {
    let mut scene = Scene::built_in(name).unwrap();
    change(&mut scene);
    Arc::new(PreparedScene::new(scene).unwrap())
}

fn rough(coefficient: f64) -> Arc<PreparedScene> {
    changed("flat", |scene| scene.friction_coefficient = coefficient)
}

fn named(extra: &[&str]) -> EffectChoice {
    let names = ["elasticity", "finite_strain", "contact"].iter().chain(extra);
    EffectChoice::Named(names.map(|name| (*name).to_owned()).collect())
}

fn needle() -> Needle {
    Needle::pointing(NeedleShape::hemispherical(0.257), Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis())
}

fn sequence(effects: EffectChoice, steps: Vec<Step>) -> Sequence {
    Sequence { needle: needle(), steps, level: Level::Coarse, effects }
}

fn held(time_s: f64, x_mm: f64, depth_mm: f64) -> Step {
    Step { time_s, tip_mm: Some(Point3::new(x_mm, 0.0, -depth_mm)), ..Step::default() }
}

/// The reaction's part along x over that along z: what drags over what presses.
fn lean(outcome: &StepOutcome) -> f64 {
    outcome.prediction.needle.reaction_mn.x / outcome.prediction.needle.reaction_mn.z
}

fn drag_mn(outcome: &StepOutcome) -> f64 {
    outcome.prediction.needle.reaction_mn.x
}

fn slipping(outcome: &StepOutcome) -> f64 {
    outcome.prediction.contact.slipping_share.unwrap()
}

/// Steps a tenth of a second apart that hold the needle this deep at these places.
fn path(places_mm: &[f64], depth_mm: f64) -> Vec<Step> {
    places_mm.iter().enumerate().map(|(k, &x)| held(0.1 * (k + 1) as f64, x, depth_mm)).collect()
}

/// Largest distance between nodes of two answers (µm).
fn apart_um(a: &StepOutcome, b: &StepOutcome) -> f64 {
    let pairs = a.prediction.vertices.iter().zip(&b.prediction.vertices);
    pairs.map(|(a, b)| (a - b).norm() * 1e3).fold(0.0, f64::max)
}

const DEPTH_MM: f64 = 0.06;

#[test]
fn a_dragged_needle_sticks_slips_and_sticks_again_when_it_turns_back() {
    let coefficient = 0.3;
    // Out in steps of 10 µm, held, and back.
    let out = (0..=12).map(|k| 0.01 * f64::from(k));
    let back = (0..12).rev().map(|k| 0.01 * f64::from(k));
    let places: Vec<f64> = out.chain([0.12]).chain(back).collect();
    let steps = path(&places, DEPTH_MM);
    let rough_run = outcomes(&rough(coefficient), &sequence(named(&["friction"]), steps.clone()), None);
    let smooth = outcomes(&rough(0.0), &sequence(named(&["friction"]), steps.clone()), Some(&LASTING));
    let lean_of_friction: Vec<f64> = rough_run.iter().zip(&smooth).map(|(a, b)| lean(a) - lean(b)).collect();
    println!("{lean_of_friction:.4?}");
    // It sticks: the tissue goes along, and what drags it grows; then it slips at µ N.
    assert!(slipping(&rough_run[1]) < 0.6 && lean_of_friction[1] > -0.7 * coefficient, "{lean_of_friction:?}");
    assert!((2..=3).all(|k| drag_mn(&rough_run[k]) < drag_mn(&rough_run[k - 1])), "{lean_of_friction:?}");
    for k in (3..=12).chain(18..=25) {
        // The contact's normals spread by 40 degrees and its mesh is coarse beyond its middle, so µ N is met to a share.
        let sign = if k <= 12 { -1.0 } else { 1.0 };
        assert!(slipping(&rough_run[k]) > 0.99, "step {k}");
        assert!(
            (sign * lean_of_friction[k] / coefficient - 1.0).abs() < 0.6 * DISCRETISATION,
            "step {k}: {lean_of_friction:?}"
        );
    }
    // Held, it changes nothing; turned back it sticks, with the force that was there to be overcome first.
    assert!(slipping(&rough_run[13]) == 0.0 && apart_um(&rough_run[13], &rough_run[12]) < 0.02);
    assert!(lean_of_friction[14] < 0.0 && lean_of_friction[14] > 0.6 * lean_of_friction[13], "{lean_of_friction:?}");
    assert!(slipping(&rough_run[14]) < 0.6);
    // The way costs work, and none without friction, where the same place has the same force.
    let work = |run: &[StepOutcome]| -> f64 {
        (1..run.len()).map(|k| -0.5 * (drag_mn(&run[k]) + drag_mn(&run[k - 1])) * (places[k] - places[k - 1])).sum()
    };
    let limit_mn = coefficient * rough_run[12].prediction.needle.reaction_mn.z;
    assert!(work(&rough_run) > 1.5 * limit_mn * 0.12, "{} µJ", work(&rough_run));
    assert!(work(&smooth).abs() < 1e-3 * limit_mn * 0.12, "{} µJ", work(&smooth));
    assert!(smooth.iter().all(|outcome| lean(outcome).abs() < 0.1 * coefficient));
}

#[test]
fn a_drag_costs_the_same_in_few_steps_and_in_many_with_memory_and_without() {
    let scene = rough(0.3);
    for (extra, shares) in [(&["friction"][..], 0.01), (&["friction", "viscoelasticity", "inertia"], 0.05)] {
        let run_in = |steps: usize| -> StepOutcome {
            let mut list = vec![held(1.0, 0.0, DEPTH_MM)];
            list.extend((1..=steps).map(|k| {
                let share = k as f64 / steps as f64;
                held(1.0 + 0.5 * share, 0.05 * share, DEPTH_MM)
            }));
            outcomes(&scene, &sequence(named(extra), list), None).pop().unwrap()
        };
        let (few, many) = (run_in(2), run_in(10));
        println!("{extra:?}: drag {:.5} mN in 2 steps, {:.5} in 10", drag_mn(&few), drag_mn(&many));
        assert!((drag_mn(&few) / drag_mn(&many) - 1.0).abs() < shares, "{} {}", drag_mn(&few), drag_mn(&many));
        assert!(apart_um(&few, &many) < 1.0, "{} µm", apart_um(&few, &many));
    }
    // The way does matter: one that overshot and came back ends otherwise.
    let places =
        |places: &[f64]| outcomes(&scene, &sequence(named(&["friction"]), path(places, DEPTH_MM)), None).pop().unwrap();
    let (straight, overshot) = (places(&[0.0, 0.05]), places(&[0.0, 0.08, 0.05]));
    assert!(drag_mn(&straight) < 0.0 && drag_mn(&overshot) > 0.0);
    assert!(apart_um(&straight, &overshot) > 5.0);
}

#[test]
fn a_turning_needle_drags_the_tissue_round_with_it() {
    let turned = |coefficient: f64, angle: f64| {
        let about = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let start = needle().orientation;
        let turn = Step { time_s: 2.0, orientation: Some(about * start), ..Step::default() };
        let steps = vec![held(1.0, 0.0, DEPTH_MM), turn];
        let names = if coefficient > 0.0 { &["friction"][..] } else { &[] };
        outcomes(&rough(coefficient), &sequence(named(names), steps), None).pop().unwrap()
    };
    // The mean turn of the four nodes at the edge of the contact (radians).
    let spin = |outcome: &StepOutcome, against: &StepOutcome| -> f64 {
        let pairs = outcome.prediction.vertices.iter().zip(&against.prediction.vertices);
        let near = pairs.filter(|(_, w)| w.coords.xy().norm() < 0.3);
        near.map(|(v, w)| w.coords.xy().perp(&v.coords.xy()) / w.coords.xy().norm_squared()).sum::<f64>() / 4.0
    };
    let still = turned(0.5, 0.0);
    let [left, right] = [0.2, -0.2].map(|angle| spin(&turned(0.5, angle), &still));
    println!("turned by {left:.5} and {right:.5} rad");
    assert!(left > 1e-3 && left < 0.2 && (left + right).abs() < 0.02 * left, "{left} {right}");
    assert_eq!(apart_um(&turned(0.0, 0.2), &turned(0.0, 0.0)), 0.0, "a smooth ball turns in its place");
}

#[test]
fn the_first_step_with_every_effect_is_the_single_prediction() {
    let scene = changed("macula", |scene| {
        scene.tissue.rate.retina_relaxation.clear();
        scene.friction_coefficient = 0.3;
        scene.pressure_kpa = scene.rest_pressure_kpa + 1.0;
        scene.tissue.bond.strength_kpa = 3.0;
    });
    let mut compared = 0;
    for request in requests(&scene, 31, 8) {
        let Ok(alone) = ask(&scene, &at(&request, Level::Coarse)) else { continue };
        let step = Step { time_s: 10.0, force_mn: Some(force(&request)), ..Step::default() };
        let sequence =
            Sequence { needle: request.needle, steps: vec![step], level: Level::Coarse, effects: EffectChoice::Auto };
        let stepped = outcomes(&scene, &sequence, None).remove(0).prediction;
        let numbers = |p: &Prediction| format!("{:?} {:?} {:?} {:?}", p.vertices, p.needle, p.contact, p.solver);
        assert_eq!(numbers(&stepped), numbers(&alone), "{request:?}");
        let on = |p: &Prediction, name: &str| p.effects.iter().any(|e| e.name == name && e.simulated);
        for name in ["friction", "pressure", "adhesion"] {
            assert_eq!(on(&stepped, name), on(&alone, name), "{name}");
        }
        compared += usize::from(on(&alone, "friction") && on(&alone, "pressure"));
    }
    assert!(compared >= 4, "{compared} requests with friction and pressure");
}

#[test]
fn tissue_has_been_at_rest_under_its_pressure_for_ever() {
    let scene = changed("macula", |scene| scene.pressure_kpa = scene.rest_pressure_kpa + 2.0);
    let remembering = named(&["pressure", "viscoelasticity", "inertia"]);
    let quiet: Vec<Step> = [1e-6, 1e-3, 1.0, 100.0]
        .iter()
        .map(|&time_s| Step { time_s, force_mn: Some(Vector3::zeros()), ..Step::default() })
        .collect();
    let quiet = outcomes(&scene, &sequence(remembering.clone(), quiet), None);
    let sunk: Vec<f64> = quiet.iter().map(|outcome| largest_um(&outcome.prediction)).collect();
    let alone =
        ask(&scene, &Request { control: Control::Force(Vector3::zeros()), ..straight(Level::Coarse, 0.0) }).unwrap();
    println!("sunk {sunk:.4?} µm, alone {:.4}", largest_um(&alone));
    // Nothing swings and nothing creeps: the pressure is no load that begins at 0 s.
    assert!(sunk.iter().all(|um| (um - sunk[0]).abs() < 1e-4), "{sunk:?}");
    // A ball's wall is squeezed by its columns up to terms of the order of its thickness over its radius.
    assert!(
        (sunk[0] / largest_um(&alone) - 1.0).abs() < 0.04 && sunk[0] > 10.0,
        "{sunk:?}, alone {}",
        largest_um(&alone)
    );
    // What the needle does is felt by the rates, and once it has lasted is the elastic answer.
    let presses = [1e-3, 1000.0, 2000.0].map(|time_s| Step {
        tip_mm: Some(Point3::new(0.0, 0.0, -0.14)),
        time_s,
        ..Step::default()
    });
    let pressed = outcomes(&scene, &sequence(remembering, presses.to_vec()), None);
    let elastic = outcomes(&scene, &sequence(named(&["pressure"]), presses[..1].to_vec()), Some(&LASTING));
    let reaction = |outcome: &StepOutcome| outcome.prediction.needle.reaction_mn.z;
    assert!(reaction(&pressed[0]) > 1.5 * reaction(&elastic[0]), "{}", reaction(&pressed[0]));
    assert!((reaction(&pressed[2]) / reaction(&elastic[0]) - 1.0).abs() < 1e-3);
}

/// A bond that a push shears off.
fn weak(rate_exponent: f64) -> Arc<PreparedScene> {
    changed("flat", |scene| {
        scene.tissue.bond =
            RetinalBond { strength_kpa: 1.0, fracture_energy_mn_per_mm: 0.06, rate_exponent, ..RetinalBond::default() };
    })
}

fn damage(outcome: &StepOutcome) -> f64 {
    outcome.prediction.contact.bond_damage.unwrap()
}

#[test]
fn what_has_let_go_never_heals() {
    let release = |time_s: f64| Step { time_s, force_mn: Some(Vector3::zeros()), ..Step::default() };
    let steps = vec![
        held(1.0, 0.0, 0.06),
        held(2.0, 0.0, 0.16),
        release(3.0),
        held(4.0, 0.0, 0.06),
        held(5.0, 0.0, 0.16),
        held(6.0, 0.0, 0.2),
    ];
    let adhering = |scene: &Arc<PreparedScene>| outcomes(scene, &sequence(named(&["adhesion"]), steps.clone()), None);
    let outcomes = adhering(&weak(0.0));
    let damages: Vec<f64> = outcomes.iter().map(damage).collect();
    let reactions: Vec<f64> = outcomes.iter().map(|outcome| outcome.prediction.needle.reaction_mn.z).collect();
    println!("damage {damages:.4?}, reaction {reactions:.5?}");
    assert!(damages.windows(2).all(|pair| pair[1] >= pair[0]), "{damages:?}");
    assert!(damages[1] > damages[0] + 0.01 && damages[2] == damages[1] && damages[3] == damages[1], "{damages:?}");
    // Let go, everything is at rest again but the bond; pushed again as far, it is where it was, and beyond, it goes on.
    assert!(largest_um(&outcomes[2].prediction) < 1e-3);
    assert!(
        (reactions[4] / reactions[1] - 1.0).abs() < 1e-3 && damages[4] - damages[1] < 1e-3 && damages[5] > damages[4]
    );
    // The paired negative: half as far it is softer than it was, and a bond that holds is not.
    let softer = 1.0 - reactions[3] / reactions[0];
    let strong = changed("flat", |_| {});
    let strong = adhering(&strong);
    let same = 1.0 - strong[3].prediction.needle.reaction_mn.z / strong[0].prediction.needle.reaction_mn.z;
    println!("softer by {softer:.2e}, a strong bond by {same:.2e}");
    assert!(softer > 1e-4 && same.abs() < 1e-6 && damage(&strong[5]) == 0.0);
}

/// From whatever depth a needle lets go, the tissue is back within an iteration or two: it is not searched for from where the needle held it.
#[test]
fn tissue_that_is_let_go_springs_back_at_once() {
    let scene = weak(0.0);
    for depth_mm in [0.1, 0.1136, 0.1238, 0.1425, 0.16, 0.1697, 0.1748, 0.19, 0.2] {
        let released = Step { time_s: 3.0, force_mn: Some(Vector3::zeros()), ..Step::default() };
        let steps = vec![held(1.0, 0.0, 0.06), held(2.0, 0.0, depth_mm), released];
        let outcomes = outcomes(&scene, &sequence(named(&["adhesion"]), steps), None);
        let [pushed, let_go] = [&outcomes[1], &outcomes[2]].map(|outcome| &outcome.prediction);
        assert!(largest_um(pushed) > 10.0, "{depth_mm}: {}", largest_um(pushed));
        assert!(largest_um(let_go) < 1e-3, "{depth_mm}: {}", largest_um(let_go));
        assert!(let_go.solver.iterations <= 2, "{depth_mm}: {}", let_go.solver.iterations);
    }
}

#[test]
fn a_bond_holds_more_against_haste_and_no_more_against_patience() {
    let pushed = |scene: &Arc<PreparedScene>, time_s: f64| {
        damage(&outcomes(scene, &sequence(named(&["adhesion"]), vec![held(time_s, 0.0, 0.16)]), None)[0])
    };
    let (rated, plain) = (weak(0.5), weak(0.0));
    let lasting = pushed(&plain, 1.0);
    let by_time = [1e-3, 0.1, 10.0, 1000.0].map(|time_s| pushed(&rated, time_s));
    println!("damage {lasting:.4} without haste; within 1 ms, 0.1 s, 10 s, 1000 s {by_time:.4?}");
    assert!(by_time.windows(2).all(|pair| pair[1] > pair[0]), "{by_time:?}");
    assert!(by_time[0] < 0.9 * lasting && (by_time[3] / lasting - 1.0).abs() < 1e-3, "{by_time:?} {lasting}");
    assert_eq!(pushed(&plain, 1e-3), lasting, "a bond without a power knows no time");
}

#[test]
fn auto_decides_by_what_all_steps_ask() {
    let decided = |scene: &Arc<PreparedScene>, steps: Vec<Step>, name: &str| {
        let sequence = sequence(EffectChoice::Auto, steps);
        let simulation = Simulation::new(scene, &sequence, &mut Silent).unwrap();
        let report = simulation.effects().iter().find(|report| report.name == name).unwrap().clone();
        if let (Some(value), Some(threshold)) = (report.value, report.threshold) {
            assert!(!report.simulated || value > threshold, "{report:?}");
        }
        report
    };
    let slow = |places: &[f64]| -> Vec<Step> {
        places.iter().enumerate().map(|(k, &x)| held(900.0 * (k + 1) as f64, x, 0.03)).collect()
    };
    // Friction by how far the needle goes along the surface, though each of its steps points straight down.
    let rough = rough(0.02);
    let (still, dragged) =
        (decided(&rough, slow(&[0.0]), "friction"), decided(&rough, slow(&[0.0, 0.01, 0.4]), "friction"));
    assert!(!still.simulated && !dragged.simulated && dragged.value > still.value, "{still:?} {dragged:?}");
    let rougher = self::rough(0.3);
    let (still, dragged) =
        (decided(&rougher, slow(&[0.0]), "friction"), decided(&rougher, slow(&[0.0, 0.01, 0.4]), "friction"));
    assert!(!still.simulated && dragged.simulated && dragged.reason.contains("drag"), "{still:?} {dragged:?}");
    // The bond by the force of a needle that is moved fast, which meets stiffer tissue.
    let bonded = changed("flat", |scene| scene.tissue.bond.strength_kpa = 4.0);
    let press = |time_s: f64| vec![held(time_s, 0.0, 0.06)];
    let (slow_press, stab) = (decided(&bonded, press(900.0), "adhesion"), decided(&bonded, press(1e-4), "adhesion"));
    assert!(!slow_press.simulated && stab.simulated, "{slow_press:?} {stab:?}");
    // Pressure by what it moves.
    let pressed = |kpa: f64| changed("flat", |scene| scene.pressure_kpa = scene.rest_pressure_kpa + kpa);
    assert!(!decided(&pressed(0.01), press(1.0), "pressure").simulated);
    assert!(decided(&pressed(1.0), press(1.0), "pressure").simulated);
    // A fall of the pressure that tears everything off is refused at once.
    let torn = changed("flat", |scene| {
        scene.pressure_kpa = 0.0;
        scene.tissue.bond.strength_kpa = 1.5;
    });
    let sequence = sequence(named(&["pressure", "adhesion"]), press(1.0));
    let error = Simulation::new(&torn, &sequence, &mut Silent).err().unwrap().to_string();
    assert!(error.contains("comes off everywhere"), "{error}");
}

#[test]
fn a_step_without_an_equilibrium_is_named_with_its_cause_and_a_hard_one_is_computed_in_parts() {
    let scene = rough(2.0);
    let run = |shape: NeedleShape, steps: Vec<Step>| {
        let needle = Needle::pointing(shape, Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis());
        let sequence = Sequence { needle, steps, level: Level::Coarse, effects: named(&["friction"]) };
        let mut simulation = Simulation::new(&scene, &sequence, &mut Silent).unwrap();
        let mut warnings = Vec::new();
        loop {
            match simulation.step(&mut Silent) {
                Ok(Some(outcome)) => warnings.extend(outcome.prediction.warnings),
                Ok(None) => break Ok(warnings),
                Err(error) => break Err(error),
            }
        }
    };
    // A ball that is pushed mostly along the tissue.
    let (sin, cos) = 70_f64.to_radians().sin_cos();
    let along = Step { time_s: 0.2, force_mn: Some(Vector3::new(sin, 0.0, -cos) * 0.3), ..Step::default() };
    let error = run(NeedleShape::hemispherical(0.257), vec![held(0.1, 0.0, -0.05), along])
        .expect_err("no equilibrium was found when this was written; take a harder one if it is now");
    println!("{error}");
    let SequenceError::At { step, cause, .. } = &error else { panic!("{error}") };
    assert!(
        *step == 1 && matches!(cause, PredictError::Solver { cause: EquilibriumError::NotSettled { .. }, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("steps[1]") && error.to_string().contains("`friction`"), "{error}");
    // Which depth is too hard for one step depends on the way to the equilibrium; one of these is.
    let parted = [0.08, 0.09, 0.1, 0.11, 0.12].into_iter().filter_map(|depth_mm| {
        let mut steps = path(&[0.0, 0.0, 0.3, -0.3, 0.3], depth_mm);
        steps[0] = held(0.1, 0.0, -0.05);
        let warnings = run(NeedleShape::bevelled(0.257), steps).ok()?;
        warnings.iter().any(|warning| warning.contains("parts of its time")).then_some(depth_mm)
    });
    println!("computed in parts: {:?} mm", parted.clone().collect::<Vec<_>>());
    assert_ne!(parted.count(), 0);
}
