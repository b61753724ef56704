//! The command line of the learned patch: `retina-models dataset --help`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, Parser, Subcommand};
use indicatif::ProgressBar;
use retina_core::scene::Scene;
use retina_models::dataset::manifest::Manifest;
use retina_models::dataset::report::report;
use retina_models::dataset::run::{Order, Summary, generate};
use retina_models::dataset::{DatasetError, deformcontact, truth};
use retina_models::sample::{Sample, Split};
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
    /// Measures how far the truth of the samples is from level `reference`, on random paths.
    TruthError {
        /// Number of paths.
        #[arg(long, default_value_t = 20)]
        paths: u32,
        /// Seed of the paths.
        #[arg(long, default_value_t = 77)]
        seed: u64,
    },
    /// Writes a data set in the layout that the public DeformContact code reads.
    ExportDeformcontact {
        /// The data set's folder.
        folder: PathBuf,
        /// The folder to write to.
        out: PathBuf,
        /// Splits to write.
        #[arg(long, value_delimiter = ',', default_value = "train,validation")]
        splits: Vec<String>,
    },
    /// Reads that layout back and says what is there.
    ImportDeformcontact {
        /// A folder with an `InitialMesh.ply`.
        folder: PathBuf,
    },
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
        Command::TruthError { paths, seed } => truth_error(paths, seed),
        Command::ExportDeformcontact { folder, out, splits } => export(&folder, &out, &splits),
        Command::ImportDeformcontact { folder } => deformcontact::import(&folder).map(|samples| {
            let forces = samples.iter().map(|sample| sample.force_mn);
            let largest = forces.fold(0.0_f32, f32::max);
            println!("{} samples, largest force {largest} mN", samples.len());
        }),
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

fn truth_error(paths: u32, seed: u64) -> Result<(), DatasetError> {
    let scenes: Vec<u8> = (0..Scene::built_in_names().len() as u8).collect();
    let bar = ProgressBar::new(u64::from(paths));
    let mut comparisons = Vec::new();
    for path in 0..paths {
        comparisons.extend(truth::compare(seed, path, &scenes)?);
        bar.inc(1);
    }
    bar.finish();
    println!("truth `{}` against level `reference`, {paths} paths, seed {seed}\n", truth::NAME);
    print!("{}", truth::table(&comparisons));
    Ok(())
}

fn export(folder: &Path, out: &Path, splits: &[String]) -> Result<(), DatasetError> {
    let known = Split::ALL.map(Split::name);
    if let Some(unknown) = splits.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(DatasetError::Value { field: "splits", value: unknown.clone(), allowed: known.join(", ") });
    }
    let mut samples = samples(folder)?;
    samples.retain(|sample| splits.iter().any(|name| name == sample.split.name()));
    println!("{} samples written to {}", deformcontact::export(&samples, out)?, out.display());
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
