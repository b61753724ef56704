//! Every level on held-out samples of the data sets: errors as they were committed, by scene, tip and needle.

use retina_core::predict::Level;
use retina_models::sample::Split;
use retina_models::shard;
use retina_tests::held_out_samples::{ERRORS, Errors, LEVELS, SAMPLES, measure};

/// Change of an error that another machine's rounding makes (µm): a hundredth of what a user can see, and more than Newton's tolerance moves a node.
const ROUNDING_UM: f64 = 0.02;
/// The same in shares of the error.
const ROUNDING: f64 = 0.01;

#[test]
fn every_level_errs_as_it_did_when_the_errors_were_committed() {
    let samples = shard::read(SAMPLES.as_ref()).unwrap();
    assert!(samples.len() >= 200 && samples.iter().all(|sample| sample.split == Split::Test), "{}", samples.len());
    let committed: Errors = serde_json::from_str(&std::fs::read_to_string(ERRORS).unwrap()).unwrap();
    let now = measure(&samples).unwrap();
    assert_eq!(now.keys().collect::<Vec<_>>(), committed.keys().collect::<Vec<_>>());
    for (group, now) in &now {
        let before = committed[group];
        let same = |now: f64, before: f64| (now - before).abs() <= ROUNDING_UM + ROUNDING * before;
        assert!(
            now.failed == before.failed && same(now.mean_um, before.mean_um) && same(now.p99_um, before.p99_um),
            "{group}: {now:?}, committed {before:?}"
        );
    }
}

#[test]
fn what_learned_levels_correct_they_improve_in_every_group() {
    let committed: Errors = serde_json::from_str(&std::fs::read_to_string(ERRORS).unwrap()).unwrap();
    assert!(committed.len() >= 4 * 9, "{}", committed.len());
    for (better, than) in [(Level::Network, Level::Linear), (Level::Corrected, Level::Coarse)] {
        assert!(LEVELS.contains(&better) && LEVELS.contains(&than));
        for (name, errors) in &committed {
            let Some(group) = name.strip_prefix(&format!("{} · ", than.name())) else { continue };
            let learned = committed[&format!("{} · {group}", better.name())];
            assert!(learned.mean_um < 0.8 * errors.mean_um, "{} on {group}: {learned:?}, {errors:?}", better.name());
        }
    }
}
