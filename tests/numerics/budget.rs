//! Which level keeps a promise: the choice against every level's own numbers.

use retina_core::needle::{NeedleShape, Tip};
use retina_core::predict::budget::{Budget, DEFAULT_LEVEL, LevelTimes};
use retina_core::predict::expected_error::{ExpectedError, Situation};
use retina_core::predict::{Level, PredictError, sampled};
use retina_core::scene::Scene;
use retina_core::tissue::Tissue;
use retina_core::tissue::ranges::{CHOROID, RETINA};

const TIMES_MS: LevelTimes = [0.1, 0.5, 12.0, 12.5, 3000.0];

fn pressed() -> Situation {
    let scene = Scene::built_in("macula").unwrap();
    let situation = Situation::new(&scene, &NeedleShape::hemispherical(0.257), 20.0, 0.06, 0.15);
    // Between the levels around them.
    let between = |a: Level, b: Level| {
        let [a, b] = [a, b].map(|level| situation.expected_error(level));
        ExpectedError {
            median_um: (a.median_um * b.median_um).sqrt(),
            p95_um: (a.p95_um * b.p95_um).sqrt(),
            calibrated: true,
        }
    };
    Situation {
        network: Some(between(Level::Linear, Level::Coarse)),
        corrected: Some(between(Level::Coarse, Level::Reference)),
        ..situation
    }
}

fn choose(budget: Budget) -> (Level, usize) {
    let choice = budget.choose(&pressed(), &TIMES_MS).unwrap();
    (choice.level, choice.broken.len())
}

#[test]
fn nothing_promised_is_the_default_level() {
    assert_eq!(choose(Budget::default()), (DEFAULT_LEVEL, 0));
}

#[test]
fn an_error_asks_for_the_cheapest_level_that_keeps_it() {
    let errors = Level::ALL.map(|level| pressed().expected_error(level));
    assert!(errors.iter().all(|error| error.calibrated && error.median_um < error.p95_um), "{errors:?}");
    assert!(errors.is_sorted_by(|a, b| a.p95_um > b.p95_um), "{errors:?}");
    for (level, error) in Level::ALL.iter().zip(&errors) {
        let asking = |um| choose(Budget { max_error_um: Some(um), ..Budget::default() });
        assert_eq!(asking(error.p95_um), (*level, 0));
        assert_ne!(asking(error.p95_um * 0.999), (*level, 0));
    }
}

#[test]
fn a_time_asks_for_the_most_accurate_level_in_it() {
    let asking = |ms| choose(Budget { max_time_ms: Some(ms), ..Budget::default() });
    assert_eq!(asking(5000.0), (Level::Reference, 0));
    assert_eq!(asking(2999.0), (Level::Corrected, 0));
    assert_eq!(asking(12.2), (Level::Coarse, 0));
    assert_eq!(asking(0.6), (Level::Network, 0));
    assert_eq!(asking(0.1), (Level::Linear, 0));
    assert_eq!(asking(0.05), (Level::Linear, 1));
}

#[test]
fn what_cannot_be_kept_is_said_or_refused() {
    let both = Budget { max_error_um: Some(0.51), max_time_ms: Some(1.0), ..Budget::default() };
    assert_eq!(choose(both), (Level::Network, 1));
    let refused = Budget { strict: true, ..both }.choose(&pressed(), &TIMES_MS);
    assert!(matches!(refused, Err(PredictError::Budget { .. })), "{refused:?}");
    let fixed = Budget { level: Some(Level::Coarse), ..both };
    assert_eq!(choose(fixed), (Level::Coarse, 2));
}

#[test]
fn a_level_without_an_answer_is_not_chosen() {
    let without = Situation { network: None, corrected: None, ..pressed() };
    let choose = |budget: Budget| budget.choose(&without, &TIMES_MS).unwrap().level;
    for ms in [0.6, 12.6] {
        let chosen = choose(Budget { max_time_ms: Some(ms), ..Budget::default() });
        assert!(!chosen.is_learned(), "{chosen:?} in {ms} ms");
    }
    for level in [Level::Network, Level::Corrected] {
        let um = pressed().expected_error(level).p95_um;
        assert!(!choose(Budget { max_error_um: Some(um), ..Budget::default() }).is_learned());
        // Asked for by name it is taken at its word, and refuses by itself.
        assert_eq!(choose(Budget { level: Some(level), ..Budget::default() }), level);
    }
}

#[test]
fn no_level_is_surer_than_reference_and_reference_is_less_sure_under_edges() {
    let scene = Scene::built_in("macula").unwrap();
    let shapes = [NeedleShape::hemispherical(0.257), NeedleShape::flat(0.257), NeedleShape::bevelled(0.257)];
    for depth_um in [3.0, 60.0, 250.0] {
        let own = shapes.map(|shape| {
            let situation = Situation::new(&scene, &shape, 20.0, 1e-3 * depth_um, 0.15);
            let own = situation.expected_error(Level::Reference);
            for level in [Level::Linear, Level::Coarse] {
                let error = situation.expected_error(level);
                assert!(
                    error.p95_um > own.p95_um && error.median_um > own.median_um,
                    "{level:?}, {shape:?}: {error:?}"
                );
            }
            own.p95_um
        });
        assert!(own[1] > 2.0 * own[0] && own[2] > 2.0 * own[0], "{own:?} µm at {depth_um} µm");
    }
}

#[test]
fn outside_of_what_was_measured_nothing_is_called_calibrated() {
    let scene = Scene::built_in("macula").unwrap();
    let situation = |shape: &NeedleShape, angle| Situation::new(&scene, shape, angle, 0.06, 0.15);
    assert!(pressed().sampled);
    assert!(!situation(&NeedleShape::hemispherical(0.45), 20.0).sampled);
    assert!(!situation(&NeedleShape::hemispherical(0.257), 74.0).sampled);
    let on = |scene: &Scene| Situation::new(scene, &NeedleShape::hemispherical(0.257), 20.0, 0.06, 0.15);
    // Tissue was sampled over the inner part of every range, in one layer of retina.
    let stiffened = |place: f64| {
        let mut other = scene.clone();
        other.tissue.retina[0].youngs_modulus_kpa = sampled::logarithmic(&RETINA.youngs_modulus, place);
        other.tissue.choroid.poisson_ratio = sampled::straight(&CHOROID.poisson_ratio, -place);
        on(&other)
    };
    for place in [-sampled::INNER, 0.5, sampled::INNER] {
        assert!(stiffened(place).sampled, "{place}");
        assert!(stiffened(place).expected_error(Level::Coarse).calibrated, "{place}");
    }
    for place in [-1.02 * sampled::INNER, 1.02 * sampled::INNER] {
        assert!(!stiffened(place).sampled, "{place}");
        assert!(!stiffened(place).expected_error(Level::Coarse).calibrated, "{place}");
    }
    let with = |tissue: Tissue| on(&Scene { tissue, ..scene.clone() });
    assert!(!with(Tissue::with_inner_limiting_membrane()).sampled);
    assert!(!with(Tissue::rabbit_sublayers()).sampled);
    // Tips by default, or with the edges and angles that were drawn.
    let radius_mm = 0.257;
    let edged = |share: f64| NeedleShape {
        tip: Tip::Flat { edge_radius_mm: share * radius_mm },
        ..NeedleShape::flat(radius_mm)
    };
    assert!(situation(&NeedleShape::flat(radius_mm), 20.0).sampled && situation(&edged(0.2), 20.0).sampled);
    assert!(!situation(&edged(0.5), 20.0).sampled);
    // Errors were measured without friction and at the pressure of the rest surface.
    let (mut rough, mut pressed_eye) = (scene.clone(), scene.clone());
    rough.friction_coefficient = 0.1;
    pressed_eye.pressure_kpa += 1.0;
    for other in [&rough, &pressed_eye] {
        assert!(!on(other).sampled);
    }
    // Nothing that moves nothing is wrong.
    let still = Situation::new(&rough, &NeedleShape::hemispherical(0.257), 20.0, 0.0, 0.0);
    assert_eq!(still.expected_error(Level::Linear).p95_um, 0.0);
}
