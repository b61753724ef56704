//! `reference-error`: what refining the mesh of level `reference` still changes; written into the core.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use indicatif::ProgressBar;

use crate::journal::Journal;
use crate::reference_error::{Change, Draws, measure, source};
use crate::train::checkpoint::write_whole;

/// Where the quantiles go.
const OUTPUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../core/src/predict/refinement.rs");

/// Arguments of `reference-error`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Requests compared under each kind of tip: a few seconds each.
    #[arg(long, default_value_t = 40)]
    requests: usize,
    /// Draws at most.
    #[arg(long, default_value_t = 560)]
    draws: usize,
    /// Seed of the requests.
    #[arg(long, default_value_t = 5)]
    seed: u64,
    /// File for the quantiles.
    #[arg(long, default_value = OUTPUT)]
    out: PathBuf,
}

/// Measures, keeping what is known in `target/reference_error-SEED.jsonl` so that the same command goes on where it stopped, and writes the quantiles.
///
/// # Errors
/// If a scene cannot be prepared; what reading or writing said.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { requests, draws, seed, out } = arguments;
    let path = format!("{}/../target/reference_error-{seed}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let mut journal: Journal<Option<Change>> = Journal::open(path.as_ref())?;
    let mut draws = Draws::new(*requests, *draws, *seed)?;
    let bar = ProgressBar::new(draws.wanted() as u64);
    let mut without = 0;
    while let Some(drawn) = draws.next_wanted() {
        let change = journal.take_or_find(drawn.index as u64, || measure(&mut draws, &drawn))?;
        without += usize::from(change.is_none());
        if let Some(change) = change {
            draws.keep(change);
            bar.inc(1);
        }
    }
    bar.finish();
    let text = source(draws.kept(), without, *seed);
    print!("{text}");
    write_whole(out, text.as_bytes())?;
    Ok(())
}
