//! Laws of sequences: a static step is an equilibrium of its own, memory fades, and an effect that is off leaves no trace.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{ContactState, EffectChoice, Level, PreparedScene};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::sequence::{LASTING, Sequence, SequenceError, Simulation, Step, StepOutcome};
use retina_core::tissue::rate::PronyTerm;

use crate::support::{ask, built_in, force, largest_um, outcomes, requests, straight};

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

fn run(scene: &Arc<PreparedScene>, sequence: &Sequence) -> Vec<StepOutcome> {
    outcomes(scene, sequence, None)
}

fn prepared(scene: Scene) -> Arc<PreparedScene> {
    Arc::new(PreparedScene::new(scene).unwrap())
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
    let scene = prepared(without_relaxation("macula"));
    for request in requests(&scene, 31, 8) {
        let mut alone = ask(&scene, &crate::support::at(&request, Level::Coarse)).unwrap();
        let step = Step { time_s: 10.0, force_mn: Some(force(&request)), ..Step::default() };
        let sequence =
            Sequence { needle: request.needle, steps: vec![step], level: Level::Coarse, effects: EffectChoice::Auto };
        let outcome = run(&scene, &sequence).remove(0);
        let mut stepped = outcome.prediction;
        (stepped.effects, alone.effects) = (Vec::new(), Vec::new());
        assert!(outcome.mesh_laid);
        assert_eq!(stepped, alone, "{request:?}");
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
    let ramp = [0.2, 0.4, 0.6, 0.598, 0.602, 0.6];
    let steps = ramp.iter().enumerate().map(|(k, &force_mn)| pushed(0.1 * (k + 1) as f64, force_mn)).collect();
    let climbed = run(&scene, &sequence(with(&[]), steps));
    let laid: Vec<bool> = climbed.iter().map(|outcome| outcome.mesh_laid).collect();
    assert_eq!(laid, [true, true, true, false, false, false]);
    for (outcome, force_mn) in climbed.iter().zip(ramp) {
        let own = ask(&scene, &straight(Level::Coarse, force_mn)).unwrap();
        let apart = apart_um(&outcome.prediction.vertices, &own.vertices);
        assert!(apart < 0.5, "step {}: {apart} µm", outcome.step);
    }
    // On one mesh the same load is the same equilibrium, whatever was before, and the start from the step before is a good one.
    let again = apart_um(&climbed[5].prediction.vertices, &climbed[2].prediction.vertices);
    assert!(again < 1e-3, "{again} µm");
    let iterations = |step: usize| climbed[step].prediction.solver.iterations;
    assert!(iterations(4) < iterations(2), "{} {}", iterations(4), iterations(2));
    // Another load is another answer.
    assert!(apart_um(&climbed[4].prediction.vertices, &climbed[2].prediction.vertices) > 0.05);
}

#[test]
fn a_needle_that_is_let_be_changes_nothing() {
    let scene = built_in("fovea");
    for request in requests(&scene, 7, 6) {
        let press = Step { time_s: 1.0, force_mn: Some(force(&request)), ..Step::default() };
        let hold = Step { time_s: 2.0, ..Step::default() };
        let less = Step { time_s: 3.0, force_mn: Some(force(&request) * 0.5), ..Step::default() };
        let steps = vec![press, hold, less];
        let sequence = Sequence { needle: request.needle, steps, level: Level::Coarse, effects: with(&[]) };
        let outcomes = run(&scene, &sequence);
        let apart = |k: usize| apart_um(&outcomes[k].prediction.vertices, &outcomes[k - 1].prediction.vertices);
        assert!(!outcomes[1].mesh_laid && apart(1) < 1e-3, "{} µm", apart(1));
        assert!(apart(2) > 0.1, "{} µm", apart(2));
    }
}

#[test]
fn a_contact_that_wanders_gets_a_new_mesh_or_a_warning() {
    let scene = built_in("flat");
    let path: Vec<Step> = (0..6).map(|k| held(1.0 + f64::from(k), -0.5 + 0.2 * f64::from(k), 0.06)).collect();
    let plain = run(&scene, &sequence(with(&[]), path.clone()));
    let of_mesh =
        |outcome: &StepOutcome| outcome.prediction.warnings.iter().filter(|w| w.contains("of the mesh")).count();
    assert!(plain.iter().all(|outcome| outcome.mesh_laid && of_mesh(outcome) == 0));
    let remembering = run(&scene, &sequence(with(&["viscoelasticity"]), path));
    assert_eq!(remembering.iter().filter(|outcome| outcome.mesh_laid).count(), 1);
    assert!(remembering.iter().all(|outcome| of_mesh(outcome) > 0));
    // A path that stays where it is needs neither.
    let still = vec![held(1.0, 0.0, 0.06), held(2.0, 0.0, 0.06)];
    for effects in [with(&[]), with(&["viscoelasticity"])] {
        let still = run(&scene, &sequence(effects, still.clone()));
        assert!(!still[1].mesh_laid && still.iter().all(|outcome| of_mesh(outcome) == 0));
    }
}

#[test]
fn a_lasting_mesh_answers_as_meshes_made_for_each_contact_do() {
    let scene = built_in("macula");
    for (step, force_mn) in [0.05, 0.2, 0.8].into_iter().enumerate() {
        // Steps so long that neither mass nor drag is felt: memory without an effect.
        let steps = [0.05, 0.2, 0.8].iter().enumerate().map(|(k, &f)| pushed(900.0 * (k + 1) as f64, f)).collect();
        let lasting = run(&scene, &sequence(with(&["inertia"]), steps)).remove(step);
        let own = ask(&scene, &straight(Level::Reference, force_mn)).unwrap();
        let coarse = ask(&scene, &straight(Level::Coarse, force_mn)).unwrap();
        let error = apart_um(&lasting.prediction.vertices, &own.vertices);
        let allowed = apart_um(&coarse.vertices, &own.vertices).max(0.5);
        assert!(error < allowed, "{force_mn} mN: {error} µm, `coarse` {allowed} µm");
    }
}

#[test]
fn held_tissue_relaxes_from_stiff_to_the_elastic_answer() {
    let scene = built_in("flat");
    let times = [1e-6, 1e-3, 0.1, 1.0, 10.0, 100.0, 1000.0, 2000.0];
    let steps: Vec<Step> = times.iter().map(|&time_s| held(time_s, 0.0, 0.06)).collect();
    let elastic = reaction(&outcomes(&scene, &sequence(with(&[]), vec![steps[0]]), Some(&LASTING))[0]);
    let relaxing = run(&scene, &sequence(with(&["viscoelasticity"]), steps));
    let forces: Vec<f64> = relaxing.iter().map(reaction).collect();
    assert!(forces.windows(2).all(|pair| pair[1] < pair[0]), "{forces:?}");
    assert!(forces[0] > 2.0 * elastic, "{} against {elastic}", forces[0]);
    let left = forces[forces.len() - 1] / elastic - 1.0;
    assert!((0.0..1e-3).contains(&left), "{left}");
    // Nothing relaxes in a retina without networks, which is the same bits as one whose networks are off.
    let dead = prepared(without_relaxation("flat"));
    let steps = vec![held(1e-6, 0.0, 0.06), held(1000.0, 0.0, 0.06)];
    let still = run(&dead, &sequence(with(&["viscoelasticity"]), steps.clone()));
    let off = run(&scene, &sequence(with(&[]), steps));
    for (still, off) in still.iter().zip(&off) {
        assert_eq!(still.prediction.vertices, off.prediction.vertices);
        assert_eq!(reaction(still), reaction(off));
    }
    assert!((reaction(&still[1]) / reaction(&still[0]) - 1.0).abs() < 1e-6);
}

#[test]
fn a_reaction_beyond_puncture_is_said() {
    let scene = built_in("flat");
    let said = |time_s: f64| {
        let outcome = run(&scene, &sequence(with(&["viscoelasticity"]), vec![held(time_s, 0.0, 0.25)])).remove(0);
        let pressure_kpa = reaction(&outcome) / (std::f64::consts::PI * 0.257 * 0.257);
        (outcome.prediction.contact.state == ContactState::Punctured, pressure_kpa > 15.0)
    };
    // The same depth: a stab meets glassy tissue, a slow needle yielding one.
    assert_eq!((said(1e-4), said(1000.0)), ((true, true), (false, false)));
}

#[test]
fn pressed_tissue_creeps_and_recovers() {
    let scene = built_in("macula");
    let loads = [(0.01, 0.4), (1.0, 0.4), (100.0, 0.4), (1000.0, 0.4), (1000.1, 0.0)];
    let rests = [1001.0, 1010.0, 1050.0, 1100.0, 1200.0, 1400.0, 1700.0, 2200.0].map(|time_s| (time_s, 0.0));
    let steps = loads.into_iter().chain(rests).map(|(time_s, force_mn)| pushed(time_s, force_mn)).collect();
    let outcomes = run(&scene, &sequence(with(&["viscoelasticity"]), steps));
    let depth: Vec<f64> = outcomes.iter().map(|outcome| largest_um(&outcome.prediction)).collect();
    assert!(depth[0] < depth[1] && depth[1] < depth[2] && depth[2] < depth[3], "{depth:?}");
    assert!(depth[4] > 0.05 * depth[3] && depth[12] < 1e-3 * depth[3], "{depth:?}");
    assert_eq!(reaction(&outcomes[12]), 0.0);
}

#[test]
fn released_tissue_comes_to_rest_and_never_leaves_it_without_a_load() {
    let scene = built_in("flat");
    let mut steps = vec![held(0.1, 0.0, 0.03), pushed(0.1 + 1e-5, 0.0)];
    steps.extend((1..=6).map(|k| pushed(0.1 + 1e-5 + 2e-4 * f64::from(k), 0.0)));
    steps.push(pushed(100.0, 0.0));
    let outcomes = run(&scene, &sequence(with(&["inertia"]), steps));
    let motion: Vec<f64> = outcomes.iter().map(|outcome| largest_um(&outcome.prediction)).collect();
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
    let scene = prepared(scene);
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

#[test]
fn random_sequences_of_any_step_are_all_answered() {
    let scene = built_in("macula");
    let mut random = fastrand::Rng::with_seed(41);
    let mut iterations = Vec::new();
    for request in requests(&scene, 57, 20) {
        let (mut time_s, mut steps) = (0.0, Vec::new());
        for _ in 0..5 {
            time_s += 10.0_f64.powf(9.0 * random.f64() - 6.0);
            let force_mn = match random.usize(0..6) {
                0 => Some(Vector3::zeros()),
                1 => None,
                _ => Some(force(&request) * random.f64()),
            };
            steps.push(Step { time_s, force_mn, ..Step::default() });
        }
        let sequence = Sequence { needle: request.needle, steps, level: Level::Coarse, effects: EffectChoice::All };
        for outcome in run(&scene, &sequence) {
            let numbers = outcome.prediction.vertices.iter().flat_map(|vertex| vertex.coords.iter().copied());
            assert!(numbers.chain(outcome.prediction.needle.reaction_mn.iter().copied()).all(f64::is_finite));
            iterations.push(outcome.prediction.solver.iterations);
        }
    }
    iterations.sort_unstable();
    // As few as a single prediction needs: the start from the step before serves steps of any size.
    assert!(iterations[iterations.len() / 2] <= 8, "{iterations:?}");
}
