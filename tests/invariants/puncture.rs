//! Puncture: judged by what an answer measures, at every level and in every step, told by name, and never a reason for the surface to be another.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::effects::puncture::{Burden, Limits};
use retina_core::needle::{Gauge, NeedleShape};
use retina_core::predict::{
    ContactState, Control, EffectChoice, EffectReport, Level, PredictError, Prediction, PreparedScene, Request,
};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::scene::puncture::{PRESSURE_PER_MODULUS, Puncture, PunctureForce};
use retina_core::sequence::{Sequence, Simulation, Step};
use retina_tests::tolerance::{BALANCE, ROUNDOFF};

use crate::support::{FAST, ask, straight};

/// A strain that no answer of these tests reaches.
const ANY_STRAIN: f64 = 5.0;
/// A force that none reaches (mN).
const ANY_FORCE: PunctureForce = PunctureForce::Force(100.0);

fn bearing(force: PunctureForce, max_strain: f64) -> PreparedScene {
    let scene = Scene { puncture: Puncture { force, max_strain }, ..Scene::built_in("flat").unwrap() };
    PreparedScene::new(scene).unwrap()
}

fn row(answer: &Prediction) -> EffectReport {
    answer.effects.iter().find(|effect| effect.name == "puncture").unwrap().clone()
}

fn held(level: Level, depth_mm: f64) -> Request {
    let mut request = Request { control: Control::Pose, ..straight(level, 1.0) };
    request.needle.tip_mm = Point3::new(0.0, 0.0, -depth_mm);
    request
}

#[test]
fn a_force_beyond_the_limit_punctures_and_one_below_does_not() {
    for level in FAST {
        let scene = bearing(PunctureForce::Force(0.5), ANY_STRAIN);
        for (force_mn, expected) in [(0.499, ContactState::Touching), (0.501, ContactState::Punctured)] {
            let answer = ask(&scene, &straight(level, force_mn)).unwrap();
            assert_eq!(answer.contact.state, expected, "{level:?} {force_mn}");
            let row = row(&answer);
            assert!(row.simulated && row.reason.contains("nearest to its limit is the force"), "{row:?}");
            assert!((row.value.unwrap() - force_mn).abs() < BALANCE * force_mn, "{row:?}");
            assert_eq!(row.threshold, Some(0.5));
            assert!((answer.contact.puncture_share - row.value.unwrap() / 0.5).abs() < ROUNDOFF);
            let told = answer.warnings.iter().any(|warning| warning.contains("the tissue is punctured: the force is"));
            assert_eq!(told, expected == ContactState::Punctured, "{:?}", answer.warnings);
        }
    }
}

#[test]
fn a_strain_beyond_the_limit_punctures_and_one_below_does_not() {
    for level in FAST {
        let measured = ask(&bearing(ANY_FORCE, ANY_STRAIN), &straight(level, 1.0)).unwrap().contact.max_strain;
        for (share, expected) in [(1.001, ContactState::Touching), (0.999, ContactState::Punctured)] {
            let answer = ask(&bearing(ANY_FORCE, share * measured), &straight(level, 1.0)).unwrap();
            assert_eq!(answer.contact.state, expected, "{level:?} {share}");
            assert_eq!((row(&answer).value, row(&answer).threshold), (Some(measured), Some(share * measured)));
        }
    }
}

#[test]
fn what_punctures_moves_nothing_else() {
    let whole = bearing(ANY_FORCE, ANY_STRAIN);
    let pierced = bearing(PunctureForce::Force(0.01), 0.01);
    for level in FAST {
        for request in [straight(level, 0.7), held(level, 0.05)] {
            let [whole, pierced] = [&whole, &pierced].map(|scene| ask(scene, &request).unwrap());
            assert_eq!((whole.contact.state, pierced.contact.state), (ContactState::Touching, ContactState::Punctured));
            assert_eq!(whole.vertices, pierced.vertices);
            assert_eq!((whole.needle, whole.solver), (pierced.needle, pierced.solver));
            // Leaving it out of a list does not switch it off, for it is always checked.
            let names = ["elasticity", "contact"].map(str::to_owned).to_vec();
            let listed = Request { effects: EffectChoice::Named(names), ..request };
            let scene = bearing(PunctureForce::Force(0.01), 0.01);
            assert_eq!(ask(&scene, &listed).unwrap().contact.state, ContactState::Punctured);
        }
    }
}

#[test]
fn a_held_needle_punctures_once_on_its_way_down() {
    let scene = bearing(PunctureForce::PressurePerModulus(0.5), ANY_STRAIN);
    for level in FAST {
        let depths = [-0.05, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.34];
        let answers = depths.map(|depth_mm| ask(&scene, &held(level, depth_mm)).unwrap());
        let states = answers.each_ref().map(|answer| answer.contact.state);
        let shares = answers.each_ref().map(|answer| answer.contact.puncture_share);
        println!("{level:?}: {shares:.3?}");
        assert_eq!((states[0], shares[0]), (ContactState::Clear, 0.0));
        assert_eq!((states[1], states[7]), (ContactState::Touching, ContactState::Punctured), "{level:?}: {shares:?}");
        assert!(shares.windows(2).all(|pair| pair[0] < pair[1]), "{level:?}: {shares:?}");
        for (state, share) in states.iter().zip(shares).skip(1) {
            assert_eq!(*state == ContactState::Punctured, share > 1.0);
        }
    }
}

#[test]
fn a_force_beyond_the_model_is_refused_whatever_the_tissue_bears() {
    let scene = bearing(ANY_FORCE, ANY_STRAIN);
    let model_mn = PRESSURE_PER_MODULUS.max * 20.0 * std::f64::consts::PI * 0.257 * 0.257;
    for level in FAST {
        let error = ask(&scene, &straight(level, 1.001 * model_mn)).unwrap_err();
        assert!(matches!(error, PredictError::BeyondPuncture { .. }), "{error:?}");
    }
    // Just below, this tissue is pressed too deep, which is another refusal; on a stiffer choroid it is not.
    let error = ask(&scene, &straight(Level::Linear, 0.999 * model_mn)).unwrap_err();
    assert!(matches!(error, PredictError::TooDeep { .. }), "{error:?}");
    let mut stiff = scene.scene().clone();
    stiff.tissue.choroid.youngs_modulus_kpa = 100.0;
    let stiff = PreparedScene::new(stiff).unwrap();
    let answer = ask(&stiff, &straight(Level::Linear, 0.999 * model_mn)).unwrap();
    assert_eq!(answer.contact.state, ContactState::Touching);
    assert!(ask(&stiff, &straight(Level::Linear, 1.001 * model_mn)).is_err());
}

#[test]
fn the_limit_of_pressure_grows_with_the_cross_section() {
    // A blunt tip of 0.05 mm radius presses 20 kPa tissue with one modulus at 0.157 mN (reference values of the field).
    let force_mn = |radius_mm| Puncture::default().force_mn(radius_mm, 20.0);
    assert!((force_mn(0.05) / PRESSURE_PER_MODULUS.default - 0.157).abs() < 1e-3 * 0.157);
    assert!((force_mn(0.1) / force_mn(0.05) - 4.0).abs() < ROUNDOFF);
    // One pressure, told of two needles: the same share is used.
    let scene = bearing(PunctureForce::PressurePerModulus(0.1), ANY_STRAIN);
    let share = |gauge: &str| {
        let radius_mm = Gauge::from_name(gauge).unwrap().radius_mm();
        let mut request = straight(Level::Linear, 1.0 * std::f64::consts::PI * radius_mm * radius_mm);
        request.needle.shape = NeedleShape::hemispherical(radius_mm);
        ask(&scene, &request).unwrap().contact.puncture_share
    };
    assert!((share("25G") - 0.5).abs() < BALANCE && (share("41G") - 0.5).abs() < BALANCE);
}

#[test]
fn the_share_is_that_of_the_measure_nearest_to_its_limit() {
    let limits = Limits { force_mn: 2.0, strain: 0.5 };
    let nearest = |force_mn, strain| {
        let nearest = limits.nearest(&Burden { force_mn, strain });
        (nearest.measure, nearest.share(), nearest.is_beyond())
    };
    assert_eq!(nearest(1.0, 0.1), ("force", 0.5, false));
    assert_eq!(nearest(1.0, 0.4), ("strain", 0.8, false));
    assert_eq!(nearest(2.0, 0.5), ("force", 1.0, false));
    assert_eq!(nearest(3.0, 0.6), ("force", 1.5, true));
    assert_eq!(nearest(2.1, 0.75), ("strain", 1.5, true));
}

#[test]
fn nothing_punctures_where_nothing_presses() {
    // The eye's pressure alone squeezes the choroid far beyond the limit of strain.
    let mut scene = Scene::built_in("flat").unwrap();
    (scene.rest_pressure_kpa, scene.pressure_kpa) = (0.0, 8.0);
    scene.puncture.max_strain = 0.1;
    let scene = PreparedScene::new(scene).unwrap();
    for level in FAST {
        let still = ask(&scene, &Request { effects: EffectChoice::All, ..straight(level, 0.0) }).unwrap();
        assert!(still.contact.max_strain > 0.1, "{}", still.contact.max_strain);
        assert_eq!((still.contact.state, still.contact.puncture_share), (ContactState::Clear, 0.0));
    }
}

#[test]
fn tissue_once_punctured_stays_so() {
    let force = |time_s: f64, force_mn: f64| Step {
        time_s,
        force_mn: Some(Vector3::new(0.0, 0.0, -force_mn)),
        ..Step::default()
    };
    let steps = [0.2, 0.6, 0.3, 0.0].iter().enumerate().map(|(k, &mn)| force(0.5 * (k + 1) as f64, mn)).collect();
    let names = ["elasticity", "finite_strain", "contact"].map(str::to_owned).to_vec();
    let needle = straight(Level::Coarse, 1.0).needle;
    let sequence = Sequence { needle, steps, level: Level::Coarse, effects: EffectChoice::Named(names) };
    let run = |scene: PreparedScene| {
        let scene = &Arc::new(scene);
        let mut simulation = Simulation::new(scene, &sequence, &mut Silent).unwrap();
        let mut steps = Vec::new();
        while let Some(outcome) = simulation.step(&mut Silent).unwrap() {
            steps.push(outcome.prediction);
        }
        steps
    };
    let pierced = run(bearing(PunctureForce::Force(0.5), ANY_STRAIN));
    let states: Vec<ContactState> = pierced.iter().map(|step| step.contact.state).collect();
    use ContactState::{Clear, Punctured, Touching};
    assert_eq!(states, [Touching, Punctured, Punctured, Punctured]);
    let since = |step: &Prediction| step.warnings.iter().any(|w| w.contains("punctured since 1 s"));
    assert_eq!(pierced.iter().map(since).collect::<Vec<_>>(), [false, false, true, true]);
    assert!(pierced[1].warnings.iter().any(|w| w.contains("the force is 0.6000, beyond 0.5000")));
    // What is measured is that of each step.
    assert!((pierced[2].contact.puncture_share - 0.6).abs() < BALANCE && pierced[3].contact.puncture_share == 0.0);
    // Tissue that bears it is touched and let go, and moves as the other did.
    let whole = run(bearing(PunctureForce::Force(0.61), ANY_STRAIN));
    assert_eq!(whole.iter().map(|step| step.contact.state).collect::<Vec<_>>(), [Touching, Touching, Touching, Clear]);
    assert!(whole.iter().flat_map(|step| &step.warnings).all(|warning| !warning.contains("punctured")));
    assert!(whole.iter().zip(&pierced).all(|(whole, pierced)| whole.vertices == pierced.vertices));
}
