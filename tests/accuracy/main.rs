//! Micrometre regressions: cheap levels against the stored answers of level `reference` on held-out requests.
//!
//! Contract: `tests/data/held_out.json` holds the answers and the limits; `cargo run --release -p retina-tests --bin held_out` makes it
//! anew. Not here: laws (`invariants`), truth about the reference itself (`verification`).

mod samples;
mod unseen;

use std::collections::HashMap;

use nalgebra::Point3;
use retina_core::predict::{Level, PreparedScene, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_tests::cost::report::Results;
use retina_tests::cost::small;
use retina_tests::held_out::{HeldOut, PATH, prepare};

/// Largest node difference of a recomputed reference (µm): the solver's tolerance and another machine's rounding, a tenth of the
/// reference's own error.
const RECOMPUTED_UM: f64 = 0.05;

fn held_out() -> HeldOut {
    serde_json::from_str(&std::fs::read_to_string(PATH).unwrap()).unwrap()
}

fn scenes() -> HashMap<String, (PreparedScene, Vec<Point3<f64>>)> {
    Scene::built_in_names().iter().map(|&name| (name.to_owned(), prepare(name).unwrap())).collect()
}

#[test]
fn levels_stay_within_their_stored_errors() {
    let (sample, scenes, mut workspace) = (held_out(), scenes(), Workspace::default());
    assert!(sample.samples.len() >= 15, "{}", sample.samples.len());
    for level in [Level::Linear, Level::Coarse] {
        let mut errors = Vec::new();
        for stored in &sample.samples {
            let (scene, rest) = &scenes[&stored.scene];
            let answer = scene.predict(&stored.request(level), &mut workspace, &mut Silent).unwrap();
            errors.extend(stored.errors_um(rest, &answer));
        }
        let mean_um = errors.iter().sum::<f64>() / errors.len() as f64;
        let worst_um = errors.iter().copied().fold(0.0, f64::max);
        let limit = sample.limits.iter().find(|limit| limit.level == level.name()).unwrap();
        assert!(mean_um <= limit.mean_limit_um, "{}: mean {mean_um} µm, limit {}", level.name(), limit.mean_limit_um);
        assert!(
            worst_um <= limit.worst_limit_um,
            "{}: worst {worst_um} µm, limit {}",
            level.name(),
            limit.worst_limit_um
        );
        // A level that got much better deserves new limits.
        assert!(mean_um >= 0.5 * limit.mean_um, "{}: mean {mean_um} µm, stored {}", level.name(), limit.mean_um);
    }
}

#[test]
fn each_level_is_better_than_the_one_before() {
    let sample = held_out();
    let mean = |name: &str| sample.limits.iter().find(|limit| limit.level == name).unwrap().mean_um;
    let lengths = sample.samples.iter().flat_map(|s| s.reference_um.iter().map(|u| Point3::from(*u).coords.norm()));
    let nothing_moves = lengths.clone().sum::<f64>() / lengths.count() as f64;
    assert!(mean("coarse") < mean("linear"), "{} {}", mean("coarse"), mean("linear"));
    assert!(mean("linear") < nothing_moves, "{} {nothing_moves}", mean("linear"));
}

#[test]
fn the_reference_is_still_the_stored_one() {
    let (sample, scenes, mut workspace) = (held_out(), scenes(), Workspace::default());
    // One of a plane and one of the pit: mesh, surface and thinning all enter.
    for stored in [&sample.samples[0], &sample.samples[sample.samples.len() - 1]] {
        let (scene, rest) = &scenes[&stored.scene];
        let answer = scene.predict(&stored.request(Level::Reference), &mut workspace, &mut Silent).unwrap();
        let worst_um = stored.errors_um(rest, &answer).into_iter().fold(0.0, f64::max);
        assert!(worst_um <= RECOMPUTED_UM, "{} {}: {worst_um} µm", stored.scene, stored.tip);
        let largest_um = answer.displacement_um.iter().copied().fold(0.0, f64::max);
        assert!(largest_um > 20.0 * RECOMPUTED_UM, "a node that does not move proves nothing: {largest_um} µm");
    }
}

/// The stored requests are no part of any training: another program drew them, from another distribution and with sharper edges.
#[test]
fn a_learned_level_is_nearer_to_the_reference_than_what_it_corrects() {
    let (sample, scenes, mut workspace) = (held_out(), scenes(), Workspace::default());
    let mut mean_um = |level: Level| {
        let mut errors = Vec::new();
        for stored in &sample.samples {
            let (scene, rest) = &scenes[&stored.scene];
            let answer = scene.predict(&stored.request(level), &mut workspace, &mut Silent).unwrap();
            errors.extend(stored.errors_um(rest, &answer));
        }
        errors.iter().sum::<f64>() / errors.len() as f64
    };
    for (learned, start) in [(Level::Network, Level::Linear), (Level::Corrected, Level::Coarse)] {
        let (learned_um, start_um) = (mean_um(learned), mean_um(start));
        println!("{}: mean {learned_um:.3} µm, {}: {start_um:.3} µm", learned.name(), start.name());
        assert!(learned_um < start_um, "{}: mean {learned_um} µm, {}: {start_um} µm", learned.name(), start.name());
    }
}

/// The committed run of the `accuracy` program.
const COSTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/accuracy/results.json");
/// A ratio of two levels' times may differ from the committed one by this factor: another machine, and other work beside it.
const RATIO_FACTOR: f64 = 5.0;

#[test]
fn levels_and_knobs_cost_what_the_committed_run_says() {
    let committed: Results = serde_json::from_str(&std::fs::read_to_string(COSTS).unwrap()).unwrap();
    let now = small::standings(1).unwrap();
    assert_eq!(
        now.iter().map(|s| &s.name).collect::<Vec<_>>(),
        committed.small.iter().map(|s| &s.name).collect::<Vec<_>>()
    );
    for (now, then) in now.iter().zip(&committed.small) {
        assert_eq!(now.failed, then.failed, "{}", now.name);
        for (now_um, then_um) in
            [(now.mean_um, then.mean_um), (now.median_um, then.median_um), (now.max_um, then.max_um)]
        {
            assert!((now_um - then_um).abs() <= RECOMPUTED_UM, "{}: {now_um} µm, committed {then_um} µm", now.name);
        }
    }
    let ms = |standings: &[retina_tests::cost::measure::Standing], name: &str| {
        standings.iter().find(|s| s.name == name).unwrap().median_ms
    };
    for name in ["linear", "network", "corrected"] {
        let [now, then] = [&now, &committed.small].map(|s| ms(s, name) / ms(s, "coarse"));
        assert!(now <= RATIO_FACTOR * then, "{name} takes {now} of `coarse`, committed {then}");
    }
}
