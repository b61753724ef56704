//! Laws of sequences: a static step is an equilibrium of its own, memory fades, and an effect that is off leaves no trace.

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PreparedScene};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::sequence::{Sequence, SequenceError, Simulation, Step, StepOutcome};
use retina_core::tissue::rate::PronyTerm;

use crate::support::{ask, built_in, force, largest_um, requests, straight};

/// Effects without memory.
const STATIC: [&str; 3] = ["elasticity", "finite_strain", "contact"];

fn named(names: &[&str]) -> EffectChoice {
    EffectChoice::Named(names.iter().map(|name| (*name).to_owned()).collect())
}

fn with(extra: &[&str]) -> EffectChoice {
    named(&[&STATIC[..], extra].concat())
}

fn needle() -> Needle {
    Needle::pointing(NeedleShape::hemispherical(0.257), Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis())
}

fn sequence(effects: EffectChoice, steps: Vec<Step>) -> Sequence {
    Sequence { needle: needle(), steps, level: Level::Coarse, effects }
}

fn pushed(time_s: f64, force_mn: f64) -> Step {
    Step { time_s, force_mn: Some(Vector3::new(0.0, 0.0, -force_mn)), ..Step::default() }
}

fn held(time_s: f64, x_mm: f64, depth_mm: f64) -> Step {
    Step { time_s, tip_mm: Some(Point3::new(x_mm, 0.0, -depth_mm)), ..Step::default() }
}

fn run(scene: &PreparedScene, sequence: &Sequence) -> Vec<StepOutcome> {
    let mut simulation = Simulation::new(scene, sequence, &mut Silent).unwrap();
    let mut outcomes = Vec::new();
    while let Some(outcome) = simulation.step(&mut Silent).unwrap_or_else(|error| panic!("{error}: {sequence:?}")) {
        outcomes.push(outcome);
    }
    outcomes
}

fn reaction(outcome: &StepOutcome) -> f64 {
    outcome.prediction.needle.reaction_mn.z
}

/// Largest distance between nodes of two answers (µm).
fn apart_um(a: &[Point3<f64>], b: &[Point3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm() * 1e3).fold(0.0, f64::max)
}

#[test]
fn a_sequence_of_one_static_step_is_the_prediction_bit_by_bit() {
    let scene = built_in("macula");
    for request in requests(&scene, 31, 8) {
        let Ok(mut alone) = ask(&scene, &crate::support::at(&request, Level::Coarse)) else { continue };
        let step = Step { time_s: 10.0, force_mn: Some(force(&request)), ..Step::default() };
        for effects in [EffectChoice::Auto, with(&[])] {
            let sequence =
                Sequence { needle: request.needle, steps: vec![step], level: Level::Coarse, effects: effects.clone() };
            let elastic = PreparedScene::new(without_relaxation("macula")).unwrap();
            let outcome = run(&elastic, &sequence).remove(0);
            assert!(outcome.mesh_laid);
            let mut stepped = outcome.prediction;
            if effects == EffectChoice::Auto {
                (stepped.effects, alone.effects) = (Vec::new(), Vec::new());
                assert_eq!(stepped, alone, "{request:?}");
            } else {
                let other = Control::Force(force(&request));
                assert_eq!(request.control, other);
            }
        }
    }
}

/// The built-in scene with an elastic retina.
fn without_relaxation(name: &str) -> Scene {
    let mut scene = Scene::built_in(name).unwrap();
    scene.tissue.rate.retina_relaxation.clear();
    scene
}

#[test]
fn a_static_step_does_not_depend_on_the_steps_before_it() {
    let scene = built_in("macula");
    let ramp: Vec<Step> = (1..=8).map(|k| pushed(0.1 * f64::from(k), 0.1 * f64::from(k))).collect();
    let climbed = run(&scene, &sequence(with(&[]), ramp));
    let jumped = run(&scene, &sequence(with(&[]), vec![pushed(0.1, 0.8)]));
    let (last, alone) = (&climbed[7].prediction, &jumped[0].prediction);
    let apart = apart_um(&last.vertices, &alone.vertices);
    for outcome in &climbed {
        println!("{} {} {:?}", outcome.step, outcome.mesh_laid, outcome.prediction.solver);
    }
    assert!(!climbed[7].mesh_laid && apart < 1e-3, "{apart} µm");
    // Every step on a mesh made for another contact stays near the answer on its own.
    for outcome in &climbed {
        let force_mn = 0.1 * (outcome.step + 1) as f64;
        let own = ask(&scene, &straight(Level::Coarse, force_mn)).unwrap();
        let apart = apart_um(&outcome.prediction.vertices, &own.vertices);
        println!("step {}: {apart:.3} µm of {:.1}", outcome.step, largest_um(&own));
        assert!(apart < 0.02 * largest_um(&own).max(50.0), "step {}: {apart} µm", outcome.step);
    }
    // Another load is another answer.
    assert!(apart_um(&climbed[6].prediction.vertices, &last.vertices) > 1.0);
}

#[test]
fn a_contact_that_wanders_gets_a_new_mesh_or_a_warning() {
    let scene = built_in("flat");
    let path: Vec<Step> = (0..6).map(|k| held(1.0 + f64::from(k), -0.5 + 0.2 * f64::from(k), 0.06)).collect();
    let plain = run(&scene, &sequence(with(&[]), path.clone()));
    assert!(plain.iter().filter(|outcome| outcome.mesh_laid).count() > 2);
    let depth = |outcome: &StepOutcome| largest_um(&outcome.prediction);
    for outcome in &plain {
        let mut request = straight(Level::Coarse, 1.0);
        request.control = Control::Pose;
        request.needle.tip_mm = path[outcome.step].tip_mm.unwrap();
        let own = ask(&scene, &request).unwrap();
        let apart = apart_um(&outcome.prediction.vertices, &own.vertices);
        println!("step {}: {apart:.3} µm, {:?}", outcome.step, outcome.prediction.solver);
        assert!(apart < 0.02 * depth(outcome).max(50.0), "{apart}");
    }
    let remembering = run(&scene, &sequence(with(&["viscoelasticity"]), path));
    assert_eq!(remembering.iter().filter(|outcome| outcome.mesh_laid).count(), 1);
    let warned = |outcome: &&StepOutcome| outcome.prediction.warnings.iter().any(|w| w.contains("middle of the mesh"));
    assert!(remembering.iter().filter(warned).count() >= 2);
    // A path that stays where it is needs neither.
    let still = vec![held(1.0, 0.0, 0.06), held(2.0, 0.0, 0.06)];
    let still = run(&scene, &sequence(with(&["viscoelasticity"]), still));
    assert!(!still[1].mesh_laid && still.iter().all(|outcome| outcome.prediction.warnings.is_empty()));
}

#[test]
fn held_tissue_relaxes_from_stiff_to_the_elastic_answer() {
    let scene = built_in("flat");
    let times = [1e-6, 1e-3, 0.1, 1.0, 10.0, 100.0, 1000.0, 2000.0];
    let steps: Vec<Step> = times.iter().map(|&time_s| held(time_s, 0.0, 0.06)).collect();
    let elastic = reaction(&run(&scene, &sequence(with(&[]), vec![steps[0]]))[0]);
    let relaxing = run(&scene, &sequence(with(&["viscoelasticity"]), steps));
    let forces: Vec<f64> = relaxing.iter().map(reaction).collect();
    println!("{elastic} {forces:?}");
    for outcome in &relaxing {
        println!("{:?}", outcome.prediction.solver);
    }
    assert!(forces.windows(2).all(|pair| pair[1] < pair[0]), "{forces:?}");
    assert!(forces[0] > 2.0 * elastic, "{} against {elastic}", forces[0]);
    let left = forces[forces.len() - 1] / elastic - 1.0;
    assert!((0.0..1e-3).contains(&left), "{left}");
    // Nothing relaxes in a retina without networks.
    let dead = PreparedScene::new(without_relaxation("flat")).unwrap();
    let steps = vec![held(1e-6, 0.0, 0.06), held(1000.0, 0.0, 0.06)];
    let still = run(&dead, &sequence(with(&["viscoelasticity"]), steps));
    assert_eq!(reaction(&still[0]), elastic);
    assert!((reaction(&still[1]) / elastic - 1.0).abs() < 1e-6);
}

#[test]
fn pressed_tissue_creeps_and_recovers() {
    let scene = built_in("macula");
    let steps = vec![
        pushed(0.01, 0.4),
        pushed(1.0, 0.4),
        pushed(100.0, 0.4),
        pushed(1000.0, 0.4),
        pushed(1000.1, 0.0),
        pushed(1990.0, 0.0),
    ];
    let outcomes = run(&scene, &sequence(with(&["viscoelasticity"]), steps));
    let depth: Vec<f64> = outcomes.iter().map(|outcome| largest_um(&outcome.prediction)).collect();
    println!("{depth:?}");
    for outcome in &outcomes {
        println!("{:?} {:?}", outcome.prediction.solver, outcome.prediction.needle);
    }
    assert!(depth[0] < depth[1] && depth[1] < depth[2] && depth[2] < depth[3], "{depth:?}");
    assert!(depth[4] > 0.05 * depth[3] && depth[5] < 1e-3 * depth[3], "{depth:?}");
    assert_eq!(reaction(&outcomes[5]), 0.0);
}

#[test]
fn released_tissue_comes_to_rest_and_never_leaves_it_without_a_load() {
    let scene = built_in("flat");
    let mut steps = vec![held(0.1, 0.0, 0.03), pushed(0.1 + 1e-5, 0.0)];
    steps.extend((1..=6).map(|k| pushed(0.1 + 1e-5 + 2e-4 * f64::from(k), 0.0)));
    steps.push(pushed(100.0, 0.0));
    let outcomes = run(&scene, &sequence(with(&["inertia"]), steps));
    let motion: Vec<f64> = outcomes.iter().map(|outcome| largest_um(&outcome.prediction)).collect();
    println!("{motion:?}");
    for outcome in &outcomes {
        println!("{:?}", outcome.prediction.solver);
    }
    assert!(motion[1] > 0.5 * motion[0], "it does not vanish at once");
    assert!(motion[motion.len() - 1] < 1e-4);
    let quiet: Vec<Step> = (1..=3).map(|k| pushed(1e-4 * f64::from(k), 0.0)).collect();
    let quiet = run(&scene, &sequence(with(&["inertia", "viscoelasticity"]), quiet));
    assert!(quiet.iter().all(|outcome| largest_um(&outcome.prediction) == 0.0));
}

#[test]
fn auto_takes_what_remembers_by_the_ratio_of_times() {
    let fast = [(1e-4, true, true), (0.2, true, false), (900.0, false, false)];
    let mut scene = Scene::built_in("macula").unwrap();
    scene.tissue.rate.retina_relaxation = vec![PronyTerm { relaxation_time_s: 1.0, share: 0.5 }];
    let scene = PreparedScene::new(scene).unwrap();
    for (time_s, viscoelastic, inert) in fast {
        let sequence = sequence(EffectChoice::Auto, vec![pushed(time_s, 0.4)]);
        let simulation = Simulation::new(&scene, &sequence, &mut Silent).unwrap();
        let report = |name: &str| simulation.effects().iter().find(|report| report.name == name).unwrap().clone();
        for (name, expected) in [("viscoelasticity", viscoelastic), ("inertia", inert)] {
            let report = report(name);
            assert_eq!(report.simulated, expected, "{time_s} s: {report:?}");
            let (value, threshold) = (report.value.unwrap(), report.threshold.unwrap());
            assert_eq!(value > threshold, expected, "{report:?}");
            assert!(report.reason.contains("the load changes within"), "{report:?}");
        }
    }
    let single = ask(&scene, &straight(Level::Coarse, 0.4)).unwrap();
    for name in ["viscoelasticity", "inertia"] {
        let report = single.effects.iter().find(|report| report.name == name).unwrap();
        assert_eq!((report.simulated, report.reason.as_str()), (false, "static scene: not called for"));
    }
}

#[test]
fn what_cannot_be_is_refused_before_it_begins() {
    let scene = built_in("macula");
    let refusal = |sequence: &Sequence| Simulation::new(&scene, sequence, &mut Silent).err().expect("a refusal");
    assert_eq!(refusal(&sequence(EffectChoice::Auto, Vec::new())), SequenceError::NoSteps);
    for times in [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [1.0, f64::NAN], [1.0, 2e3]] {
        let steps = times.iter().map(|&time_s| pushed(time_s, 0.1)).collect();
        let wrong = usize::from(times[0] > 0.0);
        assert!(
            matches!(refusal(&sequence(EffectChoice::Auto, steps)), SequenceError::Time { step, .. } if step == wrong)
        );
    }
    let too_deep = sequence(EffectChoice::Auto, vec![held(0.1, 0.0, 0.05), held(0.2, 0.0, 0.45)]);
    assert!(matches!(refusal(&too_deep), SequenceError::At { step: 1, .. }));
    let linear = Sequence { level: Level::Linear, ..sequence(EffectChoice::Auto, vec![pushed(1.0, 0.1)]) };
    assert!(matches!(refusal(&linear), SequenceError::Level { level: "linear" }));
}
