//! A blind search for bytes that bring a reader down: `cargo run --release -p retina-tests --bin fuzz_blind [-- SECONDS SEED]` (60 seconds for each target,
//! seed 1), or `-- seeds FOLDER` to write the seeds for `cargo fuzz` (`tests/fuzz`), which searches by coverage and needs a nightly compiler.
//!
//! The n-th input of a seed is always the same. Ends with the first panic, whose input is written to `fuzz_blind-TARGET`.

use std::panic::catch_unwind;
use std::path::Path;
use std::time::{Duration, Instant};

use fastrand::Rng;
use retina_tests::fuzzed::{TARGETS, mutate::mutated, seeds};

/// Longest search of a target (s).
const LONGEST_S: f64 = 86_400.0;

fn main() {
    let argument = |index: usize| std::env::args().nth(index);
    if argument(1).as_deref() == Some("seeds") {
        let folder = argument(2).expect("FOLDER");
        for (target, _) in TARGETS {
            let folder = Path::new(&folder).join(target);
            std::fs::create_dir_all(&folder).expect("folder");
            for (index, seed) in seeds::of(target).iter().enumerate() {
                std::fs::write(folder.join(format!("seed-{index}")), seed).expect("seed");
            }
        }
        return;
    }
    let seconds = argument(1).map_or(60.0, |text| text.parse::<f64>().expect("SECONDS")).clamp(0.1, LONGEST_S);
    let seed = argument(2).map_or(1, |text| text.parse::<u64>().expect("SEED"));
    println!("| target | inputs | seconds | panics |\n|---|---|---|---|");
    for (name, target) in TARGETS {
        let (mut rng, seeds, began) = (Rng::with_seed(seed), seeds::of(name), Instant::now());
        let mut inputs = 0u64;
        while began.elapsed() < Duration::from_secs_f64(seconds) {
            let input = mutated(&mut rng, &seeds);
            if catch_unwind(|| target(&input)).is_err() {
                std::fs::write(format!("fuzz_blind-{name}"), &input).expect("input");
                println!("| {name} | {inputs} | {:.0} | 1: see fuzz_blind-{name} |", began.elapsed().as_secs_f64());
                std::process::exit(1);
            }
            inputs += 1;
        }
        println!("| {name} | {inputs} | {:.0} | 0 |", began.elapsed().as_secs_f64());
    }
}
