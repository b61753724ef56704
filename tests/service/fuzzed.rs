//! A short blind search for bytes that bring a reader down; the long ones are programs (`fuzz_blind`, `tests/fuzz`).

use fastrand::Rng;
use retina_tests::fuzzed::{TARGETS, mutate::mutated, seeds};

/// Inputs of each target.
const INPUTS: usize = 4000;

#[test]
fn no_bytes_bring_a_reader_down() {
    for (name, target) in TARGETS {
        let (mut rng, seeds) = (Rng::with_seed(11), seeds::of(name));
        assert!(seeds.len() >= 3, "{name}");
        seeds.iter().for_each(|seed| target(seed));
        (0..INPUTS).for_each(|_| target(&mutated(&mut rng, &seeds)));
    }
}

#[test]
fn the_seeds_of_scenes_are_scenes() {
    for seed in seeds::of("scene") {
        let spec = retina_server::read::read::<retina_server::wire::SceneSpec>(&seed).expect("read");
        let text = String::from_utf8_lossy(&seed).into_owned();
        assert!(retina_server::understand::scene(&spec).is_ok(), "{text}");
    }
}
