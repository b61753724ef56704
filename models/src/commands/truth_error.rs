//! `truth-error`: how far the truth of the samples is from that on a finer mesh.

use std::error::Error;

use clap::Args;
use indicatif::ProgressBar;
use retina_core::scene::Scene;

use crate::dataset::truth::{FINER_NAME, NAME, compare, table};

/// Arguments of `truth-error`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Number of paths.
    #[arg(long, default_value_t = 20)]
    paths: u32,
    /// Seed of the paths; another one than that of the data.
    #[arg(long, default_value_t = 77)]
    seed: u64,
}

/// Measures and prints the table.
///
/// # Errors
/// If a path's scene cannot be prepared.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { paths, seed } = *arguments;
    let scenes: Vec<u8> = (0..Scene::built_in_names().len() as u8).collect();
    let bar = ProgressBar::new(u64::from(paths));
    let mut comparisons = Vec::new();
    for path in 0..paths {
        comparisons.extend(compare(seed, path, &scenes)?);
        bar.inc(1);
    }
    bar.finish();
    println!("truth `{NAME}` against `{FINER_NAME}`, {paths} paths, seed {seed}\n");
    print!("{}", table(&comparisons));
    Ok(())
}
