//! Laws of steps that come one by one: they are the steps of a list, and one that fails is as if it had not come.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{EffectChoice, Level, PredictError, PreparedScene};
use retina_core::progress::{Progress, Silent};
use retina_core::scene::Scene;
use retina_core::sequence::{Sequence, Simulation, Step, StepError};

use crate::support::outcomes;

fn rough(coefficient: f64) -> Arc<PreparedScene> {
    let scene = Scene { friction_coefficient: coefficient, ..Scene::built_in("flat").unwrap() };
    Arc::new(PreparedScene::new(scene).unwrap())
}

fn held(time_s: f64, x_mm: f64, depth_mm: f64) -> Step {
    Step { time_s, tip_mm: Some(Point3::new(x_mm, 0.0, -depth_mm)), ..Step::default() }
}

fn pushed(time_s: f64, force_mn: f64) -> Step {
    Step { time_s, force_mn: Some(Vector3::new(0.0, 0.0, -force_mn)), ..Step::default() }
}

fn sequence(shape: NeedleShape, extra: &[&str], steps: &[Step]) -> Sequence {
    let names = ["elasticity", "finite_strain", "contact"].iter().chain(extra);
    Sequence {
        needle: Needle::pointing(shape, Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis()),
        steps: steps.to_vec(),
        level: Level::Coarse,
        effects: EffectChoice::Named(names.map(|name| (*name).to_owned()).collect()),
    }
}

/// Presses, drags until it slips, turns back, pushes, lets be, lets go.
fn drag() -> Vec<Step> {
    let places = [0.0, 0.02, 0.04, 0.05, 0.03, 0.0];
    let mut steps: Vec<Step> = (1..).zip(places).map(|(k, x_mm)| held(0.1 * f64::from(k), x_mm, 0.06)).collect();
    steps.extend([pushed(0.8, 0.3), Step { time_s: 1.5, ..Step::default() }, pushed(1.6, 0.0), pushed(1.7, 0.2)]);
    steps
}

#[test]
fn steps_that_come_one_by_one_are_the_listed_ones() {
    let scene = rough(0.3);
    let round = NeedleShape::hemispherical(0.257);
    for effects in [&["friction", "viscoelasticity", "adhesion"][..], &["inertia"], &[]] {
        let sequence = sequence(round, effects, &drag());
        let listed = outcomes(&scene, &sequence, None);
        let mut simulation = Simulation::new(&scene, &sequence, &mut Silent).unwrap();
        for (step, listed) in drag().iter().zip(&listed) {
            assert_eq!(&simulation.advance_to(step, &mut Silent).unwrap(), listed, "{effects:?}");
        }
    }
}

#[test]
fn a_rehearsal_of_what_is_farthest_and_deepest_plans_the_same() {
    let scene = rough(0.3);
    let round = NeedleShape::hemispherical(0.257);
    let effects = ["friction", "viscoelasticity"];
    let steps = &drag()[..6];
    let listed = outcomes(&scene, &sequence(round, &effects, steps), None);
    let rehearsal = sequence(round, &effects, &[held(0.1, 0.0, 0.06), held(0.2, 0.05, 0.06)]);
    let mut simulation = Simulation::new(&scene, &rehearsal, &mut Silent).unwrap();
    for (step, listed) in steps.iter().zip(&listed) {
        assert_eq!(simulation.advance_to(step, &mut Silent).unwrap().prediction.vertices, listed.prediction.vertices);
    }
    // One that is left behind is told of.
    let far = simulation.advance_to(&held(1.0, 0.5, 0.06), &mut Silent).unwrap();
    assert!(
        far.prediction.warnings.iter().any(|w| w.contains("beyond its fine zone")),
        "{:?}",
        far.prediction.warnings
    );
    assert!(listed.iter().all(|step| step.prediction.warnings.is_empty()));
}

/// Someone who has had enough after some looks.
struct Impatient(usize);

impl Progress for Impatient {
    fn interrupted(&mut self) -> bool {
        self.0 = self.0.saturating_sub(1);
        self.0 == 0
    }
}

#[test]
fn a_step_that_cannot_be_changes_nothing() {
    let scene = rough(0.3);
    let sequence = sequence(NeedleShape::hemispherical(0.257), &["friction", "viscoelasticity"], &drag());
    let listed = outcomes(&scene, &sequence, None);
    let mut simulation = Simulation::new(&scene, &sequence, &mut Silent).unwrap();
    for (step, listed) in drag().iter().zip(&listed) {
        let (now_s, next_s) = (simulation.time_s(), step.time_s);
        for time_s in [now_s, now_s - 0.05, now_s + 2e3, f64::NAN] {
            let refused = simulation.advance_to(&Step { time_s, ..*step }, &mut Silent);
            assert!(matches!(refused, Err(StepError::Time { .. })), "{refused:?}");
        }
        let mut fails = |wrong: Step, progress: &mut dyn Progress| match simulation.advance_to(&wrong, progress) {
            Err(StepError::Predict(cause)) => cause,
            other => panic!("{other:?}"),
        };
        assert!(matches!(fails(held(next_s, 5.0, 0.1), &mut Silent), PredictError::OutsidePatch { .. }));
        assert!(matches!(fails(held(next_s, 0.0, 0.45), &mut Silent), PredictError::TooDeep { .. }));
        assert!(matches!(fails(pushed(next_s, 90.0), &mut Silent), PredictError::BeyondPuncture { .. }));
        assert!(matches!(fails(held(next_s, f64::NAN, 0.1), &mut Silent), PredictError::OutOfRange(_)));
        let interrupted = fails(held(next_s, 0.01, 0.09), &mut Impatient(3));
        assert!(matches!(&interrupted, PredictError::Solver { cause, .. } if cause.is_interrupted()), "{interrupted}");
        assert_eq!(simulation.time_s(), now_s);
        assert_eq!(&simulation.advance_to(step, &mut Silent).unwrap(), listed);
    }
}

#[test]
fn a_step_without_an_equilibrium_changes_nothing() {
    let scene = rough(2.0);
    // A ball that is pushed mostly along the tissue.
    let (sin, cos) = 70_f64.to_radians().sin_cos();
    let along = Step { time_s: 0.2, force_mn: Some(Vector3::new(sin, 0.0, -cos) * 0.3), ..Step::default() };
    let rehearsal = [held(0.1, 0.0, -0.05), along];
    let sequence = sequence(NeedleShape::hemispherical(0.257), &["friction"], &rehearsal);
    let good = [held(0.1, 0.0, -0.05), held(0.3, 0.0, 0.02), held(0.4, 0.01, 0.02), pushed(0.5, 0.1)];
    let begun = || Simulation::new(&scene, &sequence, &mut Silent).unwrap();
    let (mut undisturbed, mut simulation) = (begun(), begun());
    for step in &good {
        let expected = undisturbed.advance_to(step, &mut Silent).unwrap();
        assert_eq!(simulation.advance_to(step, &mut Silent).unwrap(), expected);
        if step.time_s < along.time_s {
            match simulation.advance_to(&along, &mut Silent) {
                Err(StepError::Predict(cause @ PredictError::Solver { .. })) => println!("{cause}"),
                Err(other) => panic!("{other}"),
                Ok(_) => panic!("no equilibrium was found when this was written; take a harder step if it is now"),
            }
        }
    }
}
