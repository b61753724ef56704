//! Keeps held-out samples and what every level errs by on them, for the tier `accuracy`:
//! `cargo run --release -p retina-tests --bin held_out_samples [-- DATA]`.
//!
//! With the folder of the data set of seed 1, the samples are chosen anew, evenly from its test split; without, only the errors are measured again, after a change of the physics, a
//! mesh or the weights, in a commit that says why.

use std::error::Error;
use std::path::PathBuf;

use retina_models::data::Data;
use retina_models::sample::{Sample, Split};
use retina_models::shard;
use retina_tests::held_out_samples::{ERRORS, SAMPLES, measure};

/// Samples that are kept.
const KEPT: usize = 240;

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(folder) = std::env::args().nth(1) {
        let data = Data::read(&[PathBuf::from(folder)])?;
        let test: Vec<&Sample> = data.of(Split::Test).collect();
        let chosen: Vec<Sample> =
            (0..KEPT.min(test.len())).map(|at| *test[at * test.len() / KEPT.min(test.len())]).collect();
        shard::write(SAMPLES.as_ref(), &chosen)?;
        println!("kept {} of {} samples", chosen.len(), test.len());
    }
    let errors = measure(&shard::read(SAMPLES.as_ref())?)?;
    for (group, errors) in &errors {
        println!("{group}: {errors:?}");
    }
    std::fs::write(ERRORS, serde_json::to_string_pretty(&errors)? + "\n")?;
    Ok(())
}
