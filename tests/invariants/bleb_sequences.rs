//! Fluid under the retina in a sequence: without memory each step is its prediction, what is injected is there, the tissue relaxes over it, and what cannot be is refused by step.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::equilibrium::bleb::VOLUME_TOLERANCE;
use retina_core::predict::types::BlebReport;
use retina_core::predict::{ContactState, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::scene::bleb::{Filling, SubretinalFluid};
use retina_core::sequence::{LASTING, Sequence, SequenceError, Simulation, Step, StepOutcome};

use crate::support::{ask, built_in, largest_um, outcomes, straight};

/// Radius of the detached disc (mm).
const RADIUS_MM: f64 = 0.6;
/// Effects without memory.
const STATIC: [&str; 4] = ["finite_strain", "contact", "bleb", "puncture"];

fn filled(volume_mm3: f64) -> Arc<PreparedScene> {
    let fluid = SubretinalFluid {
        filling: Filling::Volume(volume_mm3),
        center_mm: Point3::new(0.1, 0.05, 0.0),
        radius_mm: RADIUS_MM,
    };
    Arc::new(PreparedScene::new(Scene { bleb: Some(fluid), ..Scene::built_in("macula").unwrap() }).unwrap())
}

fn named(names: &[&str]) -> EffectChoice {
    EffectChoice::Named(names.iter().map(|name| (*name).to_owned()).collect())
}

fn sequence(effects: EffectChoice, steps: Vec<Step>) -> Sequence {
    Sequence { needle: straight(Level::Coarse, 0.2).needle, steps, level: Level::Coarse, effects }
}

fn pushed(time_s: f64, force_mn: f64) -> Step {
    Step { time_s, force_mn: Some(Vector3::new(0.0, 0.0, -force_mn)), ..Step::default() }
}

/// The needle is away, and so much fluid is there.
fn injected(time_s: f64, volume_mm3: f64) -> Step {
    Step { fluid: Some(Filling::Volume(volume_mm3)), ..pushed(time_s, 0.0) }
}

/// The prediction of a push of its own, without what remembers.
fn alone(scene: &PreparedScene, force_mn: f64) -> Prediction {
    ask(scene, &Request { effects: named(&STATIC), ..straight(Level::Coarse, force_mn) }).unwrap()
}

fn refused(scene: &Arc<PreparedScene>, sequence: &Sequence) -> (usize, PredictError) {
    match Simulation::new(scene, sequence, &mut Silent).err().unwrap() {
        SequenceError::At { step, cause, .. } => (step, cause),
        other => panic!("{other:?}"),
    }
}

fn bleb(outcome: &StepOutcome) -> BlebReport {
    outcome.prediction.contact.bleb.unwrap()
}

#[test]
fn without_memory_a_step_over_fluid_is_its_prediction() {
    let scene = filled(0.02);
    let steps = vec![pushed(1.0, 0.0), pushed(2.0, 0.2), pushed(3.0, 0.6), pushed(4.0, 0.0)];
    for (outcome, force_mn) in outcomes(&scene, &sequence(named(&STATIC), steps), None).iter().zip([0.0, 0.2, 0.6, 0.0])
    {
        let alone = alone(&scene, force_mn);
        assert!(bleb(outcome).pressure_kpa > 0.0 && largest_um(&alone) > 10.0, "{force_mn} mN");
        let apart = outcome.prediction.vertices.iter().zip(&alone.vertices).map(|(a, b)| (a - b).norm());
        let apart_um = 1e3 * apart.fold(0.0, f64::max);
        println!("{force_mn} mN: {apart_um:.2e} µm apart, {} iterations", outcome.prediction.solver.iterations);
        assert!(apart_um < 0.05, "{force_mn} mN: {apart_um} µm");
        assert!((bleb(outcome).pressure_kpa / alone.contact.bleb.unwrap().pressure_kpa - 1.0).abs() < 1e-3);
    }
}

#[test]
fn what_is_injected_is_there_and_what_is_drawn_off_is_not() {
    let scene = filled(0.005);
    let volumes = [0.01, 0.02, 0.04, 0.01, 0.0];
    let steps = (1..).map(f64::from).zip(volumes).map(|(time_s, volume_mm3)| injected(time_s, volume_mm3));
    let outcomes = outcomes(&scene, &sequence(named(&STATIC), steps.collect()), None);
    for (outcome, volume_mm3) in outcomes.iter().zip(&volumes[..4]) {
        let (there, told) = (largest_um(&outcome.prediction), largest_um(&alone(&filled(*volume_mm3), 0.0)));
        println!("{volume_mm3} mm³: {:.4} kPa, up to {there:.3} µm", bleb(outcome).pressure_kpa);
        assert!((bleb(outcome).volume_mm3 / volume_mm3 - 1.0).abs() <= VOLUME_TOLERANCE);
        assert!((there / told - 1.0).abs() < 1e-3, "as the bleb of a scene that has so much: {there} and {told} µm");
        assert_eq!(outcome.prediction.contact.state, ContactState::Clear);
    }
    let last = &outcomes[4].prediction;
    assert_eq!(last.contact.bleb, None);
    assert!(largest_um(last) < 1.0, "the detached retina lies on what is below: {} µm", largest_um(last));
}

/// What is injected fast meets the stiffer tissue of the Prony series, and relaxes to what it is after a slow injection.
#[test]
fn tissue_relaxes_over_what_is_injected() {
    let scene = filled(0.01);
    let auto = |times: &[f64]| {
        let mut steps: Vec<Step> = times.iter().map(|&time_s| pushed(time_s, 0.0)).collect();
        steps[0].fluid = Some(Filling::Volume(0.02));
        sequence(EffectChoice::Auto, steps)
    };
    let fast = outcomes(&scene, &auto(&[0.1, 1.0, 10.0, 1000.0, 1900.0]), None);
    let kpa: Vec<f64> = fast.iter().map(|outcome| bleb(outcome).pressure_kpa).collect();
    // Without memory, on the mesh of those that have it.
    let lasting = sequence(named(&STATIC), vec![pushed(1.0, 0.0), injected(2.0, 0.02)]);
    let mut lasting = Simulation::at(&scene, &lasting, Some(&LASTING), &mut Silent).unwrap();
    let [before_kpa, lasting_kpa] =
        [0, 1].map(|_: usize| bleb(&lasting.step(&mut Silent).unwrap().unwrap()).pressure_kpa);
    println!("{before_kpa:.4} kPa, after a fast injection {kpa:.4?}, lasting {lasting_kpa:.4} kPa");
    assert!(kpa.windows(2).all(|pair| pair[1] < pair[0]), "{kpa:?}");
    assert!(kpa[0] - before_kpa > 1.5 * (kpa[4] - before_kpa));
    assert!((kpa[4] / lasting_kpa - 1.0).abs() < 1e-3, "{kpa:?}");
    for outcome in &fast {
        assert!((bleb(outcome).volume_mm3 / 0.02 - 1.0).abs() <= VOLUME_TOLERANCE);
    }
    // Under the fluid of a scene the tissue has been for ever.
    let names = ["finite_strain", "contact", "bleb", "viscoelasticity"];
    let still = outcomes(&scene, &sequence(named(&names), vec![pushed(0.1, 0.0), pushed(1.0, 0.0)]), None);
    let [first, second] = [0, 1].map(|at: usize| bleb(&still[at]).pressure_kpa);
    assert!((first / second - 1.0).abs() < 1e-6, "nothing creeps: {first} and {second} kPa");
}

#[test]
fn a_needle_rubs_over_fluid() {
    let mut scene = filled(0.02).scene().clone();
    scene.friction_coefficient = 0.3;
    let scene = Arc::new(PreparedScene::new(scene).unwrap());
    let tip = |x_mm: f64| Some(Point3::new(0.1 + x_mm, 0.05, 0.02));
    let steps =
        (0..4).map(|at| Step { time_s: f64::from(at + 1), tip_mm: tip(0.02 * f64::from(at)), ..Step::default() });
    let names = ["finite_strain", "contact", "bleb", "friction", "puncture"];
    let outcomes = outcomes(&scene, &sequence(named(&names), steps.collect()), None);
    for outcome in &outcomes {
        let reaction = outcome.prediction.needle.reaction_mn;
        println!("{:?} mN, {:?}", reaction, outcome.prediction.contact.slipping_share);
        assert!((bleb(outcome).volume_mm3 / 0.02 - 1.0).abs() <= VOLUME_TOLERANCE);
    }
    let dragged = outcomes[3].prediction.needle.reaction_mn;
    assert!(
        dragged.x < 0.0 && -dragged.x < 0.3 * dragged.z,
        "friction opposes the motion, below its limit and what is sloped: {dragged:?}"
    );
}

#[test]
fn what_a_sequence_cannot_do_with_fluid_is_refused_by_step() {
    let wet = filled(0.02);
    let beside = Step { tip_mm: Some(Point3::new(0.8, 0.05, 0.0)), ..pushed(2.0, 0.2) };
    let (step, cause) = refused(&wet, &sequence(named(&STATIC), vec![pushed(1.0, 0.2), beside]));
    assert!(step == 1 && matches!(cause, PredictError::BesideBleb { .. }), "{step}: {cause:?}");
    let (step, cause) = refused(&wet, &sequence(named(&STATIC), vec![pushed(1.0, 0.2), injected(2.0, 0.6)]));
    assert!(step == 1 && matches!(cause, PredictError::OutOfRange(_)), "{step}: {cause:?}");
    let dry = Arc::new(built_in("flat"));
    let (step, cause) = refused(&dry, &sequence(EffectChoice::Auto, vec![injected(2.0, 0.02)]));
    assert_eq!((step, cause), (0, PredictError::NoBleb));
    // Steps that were not planned are refused as they come, and the motion goes on from the last good one.
    let mut simulation = Simulation::new(&wet, &sequence(named(&STATIC), vec![pushed(1.0, 0.2)]), &mut Silent).unwrap();
    let before = simulation.advance_to(&pushed(1.0, 0.2), &mut Silent).unwrap();
    assert!(simulation.advance_to(&injected(2.0, -0.1), &mut Silent).is_err());
    assert!(simulation.advance_to(&beside, &mut Silent).is_err());
    let after = simulation.advance_to(&pushed(2.0, 0.2), &mut Silent).unwrap();
    assert!((bleb(&after).pressure_kpa / bleb(&before).pressure_kpa - 1.0).abs() < 1e-3);
}
