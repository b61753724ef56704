//! Random scenes, held against every law: a few hundred here, any number with the program `random_scenes`. What has once gone wrong is kept by name in
//! `tests/data/regressions.jsonl`, one line each.
//!
//! Sixty tissues with a handful of requests each; the clock bounds the rest, because a busy machine must not fail a test. A case that fails is shrunk towards
//! the default scene under the default needle and printed as a line for the file.

use std::cell::Cell;
use std::time::{Duration, Instant};

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use retina_core::predict::{PreparedScene, Workspace};
use retina_tests::random_scene::{REQUEST_UNITS, RequestNumbers, SCENE_UNITS, SceneNumbers};
use retina_tests::search::{Outcome, ask, prepare};
use serde::{Deserialize, Serialize};

/// Tissues, and requests to each.
const TISSUES: u32 = 60;
/// See [`TISSUES`].
const REQUESTS: usize = 6;
/// Trials that must have been made, however slow the machine.
const LEAST_TRIALS: usize = 10;
/// Share of the trials that may end without an answer, by name, where there should be one. The aim is none; the README says how many there are.
const MOST_FAILED: f64 = 0.2;
/// No new tissue is begun after this.
const LONGEST: Duration = Duration::from_secs(45);
/// What has once gone wrong.
const REGRESSIONS: &str = include_str!("../data/regressions.jsonl");

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Regression {
    name: String,
    scene: SceneNumbers,
    request: RequestNumbers,
    /// What it came to once.
    was: String,
    /// What it must come to: `answered`, or the cause of a refusal or failure.
    expect: String,
}

fn came_to(scene: &SceneNumbers, request: &RequestNumbers) -> Outcome {
    prepare(scene)
        .map_or_else(|outcome| outcome, |scene: PreparedScene| ask(&scene, request, &mut Workspace::default()))
}

#[test]
fn random_scenes_obey_every_law() {
    let begun = Instant::now();
    let (tried, answered, failed) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let config = Config { cases: TISSUES, failure_persistence: None, max_shrink_iters: 200, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let units = |count| vec(0.0..1.0, count);
    let cases = (units(SCENE_UNITS), vec(units(REQUEST_UNITS), 1..=REQUESTS));
    let result = runner.run(&cases, |(scene, requests)| {
        if begun.elapsed() > LONGEST {
            return Ok(());
        }
        let numbers = SceneNumbers::draw(&scene);
        let prepared = prepare(&numbers);
        for units in requests {
            let request = RequestNumbers::draw(&units, &numbers);
            let outcome = match &prepared {
                Ok(scene) => ask(scene, &request, &mut Workspace::default()),
                Err(outcome) => outcome.clone(),
            };
            tried.set(tried.get() + 1);
            match outcome {
                Outcome::Answered { .. } => answered.set(answered.get() + 1),
                Outcome::Refused(_) => {}
                Outcome::Failed(_) => failed.set(failed.get() + 1),
                Outcome::Broken(law) => return Err(TestCaseError::fail(law)),
            }
        }
        Ok(())
    });
    if let Err(TestError::Fail(reason, (scene, requests))) = &result {
        let numbers = SceneNumbers::draw(scene);
        for units in requests {
            let request = RequestNumbers::draw(units, &numbers);
            println!("{}\n{}", serde_json::to_string(&numbers).unwrap(), serde_json::to_string(&request).unwrap());
        }
        panic!("{reason}");
    }
    result.unwrap();
    println!("{} trials, {} answered, {} without an answer", tried.get(), answered.get(), failed.get());
    assert!(tried.get() >= LEAST_TRIALS && 4 * answered.get() > tried.get(), "{} of {}", answered.get(), tried.get());
    let share = failed.get() as f64 / tried.get() as f64;
    assert!(share <= MOST_FAILED, "{} of {} have no answer", failed.get(), tried.get());
}

#[test]
fn what_once_went_wrong_stays_right() {
    let mut wrong = Vec::new();
    for line in REGRESSIONS.lines().filter(|line| !line.is_empty()) {
        let case: Regression = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        let outcome = came_to(&case.scene, &case.request);
        let right = match &outcome {
            Outcome::Answered { .. } => case.expect == "answered",
            Outcome::Refused(cause) | Outcome::Failed(cause) => *cause == case.expect,
            Outcome::Broken(_) => false,
        };
        println!("| regressions | {} (was: {}) | {outcome:?} |", case.name, case.was);
        if !right {
            wrong.push(format!("{}: {outcome:?}, expected {}", case.name, case.expect));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_plainest_units_are_the_default_scene_under_the_default_needle() {
    let scene = SceneNumbers::draw(&[]);
    let request = RequestNumbers::draw(&[], &scene);
    assert_eq!(scene.scene().tissue, retina_core::tissue::Tissue::default());
    assert!(matches!(came_to(&scene, &request), Outcome::Answered { iterations: 1.., .. }));
    // The laws must be able to fail: a needle that is elsewhere than the answer says.
    let prepared = prepare(&scene).unwrap();
    let asked = request.request(retina_core::predict::Level::Coarse);
    let mut answer = prepared.predict(&asked, &mut Workspace::default(), &mut retina_core::progress::Silent).unwrap();
    assert_eq!(retina_tests::laws::broken(prepared.scene(), &asked, &answer), Vec::<String>::new());
    answer.needle.tip_mm.z -= 0.2;
    answer.needle.reaction_mn *= 1.001;
    answer.contact.least_volume_ratio = Some(-0.1);
    let broken = retina_tests::laws::broken(prepared.scene(), &asked, &answer);
    for law in ["inside the needle", "misses", "inverted"] {
        assert!(broken.iter().any(|b| b.contains(law)), "{law} is not seen: {broken:?}");
    }
    answer.vertices[7].x = f64::NAN;
    assert_eq!(retina_tests::laws::broken(prepared.scene(), &asked, &answer), ["not finite"]);
}
