//! The command line of the learned patch: `retina-models dataset --help`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, Parser, Subcommand};
use indicatif::ProgressBar;
use retina_models::dataset::DatasetError;
use retina_models::dataset::manifest::Manifest;
use retina_models::dataset::report::report;
use retina_models::dataset::run::{Order, Summary, generate};
use retina_models::sample::Sample;
use retina_models::shard;

/// Data, training and evaluation of the learned retina patch.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Makes samples of random indentation paths; the same command again goes on where it stopped.
    Dataset(Dataset),
    /// Prints how far the surface moves in a data set, and how far off the cheap answers are.
    DatasetReport {
        /// The data set's folder.
        folder: PathBuf,
    },
}

#[derive(Args)]
struct Dataset {
    /// flat, macula, fovea or all.
    #[arg(long, default_value = "all")]
    scene: String,
    /// Number of paths, of up to six samples each.
    #[arg(long)]
    paths: u32,
    /// Seed: the same seed gives the same data, whatever the number of threads.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder of the data set.
    #[arg(long, default_value = "dataset")]
    out: PathBuf,
    /// Threads; as many as the machine has cores if left out.
    #[arg(long)]
    threads: Option<usize>,
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Dataset(arguments) => dataset(&arguments),
        Command::DatasetReport { folder } => samples(&folder).map(|samples| print!("{}", report(&samples))),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn dataset(arguments: &Dataset) -> Result<(), DatasetError> {
    let threads = arguments.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let order = Order::new(&arguments.scene, arguments.paths, arguments.seed, threads);
    let start = Instant::now();
    let Summary { counts, computed, new_samples } = generate(&order, &arguments.out, &ProgressBar::new(0))?;
    let minutes = start.elapsed().as_secs_f64() / 60.0;
    println!(
        "{} samples of {} paths ({} complete); this run: {computed} paths, {new_samples} samples in {minutes:.1} minutes, {:.1} samples a minute with {threads} threads",
        counts.all_samples(),
        counts.finished,
        counts.complete,
        new_samples as f64 / minutes
    );
    for (cause, paths) in &counts.ended_by {
        println!("- {paths} paths ended early: {cause}");
    }
    println!("\n{}", report(&samples(&arguments.out)?));
    Ok(())
}

/// All samples of the data set in `folder`.
fn samples(folder: &Path) -> Result<Vec<Sample>, DatasetError> {
    let mut samples = Vec::new();
    for record in Manifest::read(folder)?.shards {
        samples.extend(shard::read(&folder.join(record.file))?);
    }
    Ok(samples)
}
