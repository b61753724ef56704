//! `dataset`: samples of random indentation paths; `dataset-report`: what they are worth.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use indicatif::ProgressBar;

use crate::dataset::DatasetError;
use crate::dataset::draw::{Depths, Tips};
use crate::dataset::manifest::Manifest;
use crate::dataset::part::Part;
use crate::dataset::report::report;
use crate::dataset::run::{Order, Summary, generate, generate_part};
use crate::sample::Sample;
use crate::shard;

/// Arguments of `dataset`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// flat, macula, fovea or all.
    #[arg(long, default_value = "all")]
    scene: String,
    /// Number of paths, of up to six samples each.
    #[arg(long)]
    paths: u32,
    /// How deep they go.
    #[arg(long, value_enum, default_value_t = Depths::Deep)]
    depths: Depths,
    /// Which tips they have.
    #[arg(long, value_enum, default_value_t = Tips::All)]
    tips: Tips,
    /// Seed: the same seed gives the same data, whatever the number of threads.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder of the data set.
    #[arg(long, default_value = "dataset")]
    out: PathBuf,
    /// Threads; as many as the machine has cores if left out.
    #[arg(long)]
    threads: Option<usize>,
    /// Which part to compute, as `2/8` for the third of eight: only what its blocks lack, on a machine of a cluster beside those of the other
    /// parts. When all are done, the same command without it makes the shards.
    #[arg(long)]
    part: Option<Part>,
}

/// Arguments of `dataset-report`.
#[derive(Args, Clone, Debug)]
pub struct ReportArguments {
    /// The data set's folder.
    folder: PathBuf,
}

/// Makes a data set, or goes on with it.
///
/// # Errors
/// [`DatasetError`].
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let threads = arguments.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let Arguments { depths, tips, paths, seed, .. } = *arguments;
    let order = Order { depths, tips, ..Order::new(&arguments.scene, paths, seed, threads) };
    let start = Instant::now();
    if let Some(part) = arguments.part {
        let (computed, new_samples) = generate_part(&order, part, &arguments.out, &ProgressBar::new(0))?;
        let minutes = start.elapsed().as_secs_f64() / 60.0;
        println!("this part: {computed} paths, {new_samples} samples in {minutes:.1} minutes with {threads} threads");
        return Ok(());
    }
    let Summary { counts, computed, new_samples } = generate(&order, &arguments.out, &ProgressBar::new(0))?;
    let minutes = start.elapsed().as_secs_f64() / 60.0;
    println!(
        "this run: {computed} paths, {new_samples} samples in {minutes:.1} minutes, {:.1} samples a minute with {threads} threads; now there are",
        new_samples as f64 / minutes
    );
    println!("{counts}");
    println!("{}", report(&samples(&arguments.out)?));
    Ok(())
}

/// Prints the report on a data set.
///
/// # Errors
/// [`DatasetError`].
pub fn run_report(arguments: &ReportArguments) -> Result<(), Box<dyn Error>> {
    println!("{}", Manifest::read(&arguments.folder)?.counts);
    print!("{}", report(&samples(&arguments.folder)?));
    Ok(())
}

/// All samples of the data set in `folder`.
///
/// # Errors
/// [`DatasetError`].
pub fn samples(folder: &Path) -> Result<Vec<Sample>, DatasetError> {
    let mut samples = Vec::new();
    for record in Manifest::read(folder)?.shards {
        samples.extend(shard::read(&folder.join(record.file))?);
    }
    Ok(samples)
}
