//! `ablation`: the variants of the paper's network, trained alike and tabulated as `models/ABLATION.md`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;

use crate::data::Data;
use crate::describe;
use crate::evaluate::ablation::{Trained, table};
use crate::faithful::learn::FaithfulLearner;
use crate::faithful::variant::Variant;
use crate::sample::Split;
use crate::train::checkpoint::write_whole;
use crate::train::run::{Settings, train};

use super::train::FAITHFUL;

/// Where the table goes.
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/ABLATION.md");

/// Arguments of `ablation`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Folder with the shards of a data set; several may be given.
    #[arg(long, required = true)]
    data: Vec<PathBuf>,
    /// Folder for a checkpoint of each variant; what is found there goes on.
    #[arg(long)]
    out: PathBuf,
    /// Epochs of each variant.
    #[arg(long, default_value_t = 3)]
    epochs: usize,
    /// Everything random follows from it.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// File for the table.
    #[arg(long, default_value = TABLE)]
    table: PathBuf,
}

/// Trains and tabulates.
///
/// # Errors
/// What reading, training or writing said.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { epochs, seed, .. } = *arguments;
    let data = Data::read(&arguments.data)?;
    let settings = Settings {
        seed,
        epochs,
        batch: FAITHFUL.batch,
        chunk: FAITHFUL.chunk,
        rate: FAITHFUL.rate,
        decay: FAITHFUL.decay,
        patience: epochs,
    };
    let mut variants = Vec::new();
    for variant in Variant::ALL {
        eprintln!("{}", variant.name());
        let learner = FaithfulLearner::new(&data.samples, variant);
        let state = train(&learner, &settings, &arguments.out.join(variant.name()))?;
        let seconds = state.curve.last().map_or(0.0, |epoch| epoch.seconds);
        variants.push(Trained::new(variant, state.best, seconds));
    }
    let samples: Vec<_> = data.of(Split::Test).map(|sample| (sample, describe::input(sample))).collect();
    let text = format!(
        "# The paper's network without its parts\n\nWritten by `cargo run --release -p retina-models -- ablation --data DIR --out DIR --epochs {epochs}`; not by hand.\n\n\
         Each variant was trained alike: {} samples, {epochs} epochs, batches of {}, Adam at {:e} falling to zero along a cosine, seed {seed}; the best epoch on validation was kept. That is a smaller budget than that \
         of the weights that ship, so compare the rows with each other. `both` is told positions and force, `position` no force, `physics` no positions (what is not told is zero). Below is the test split, {} samples. \
         Minutes are those of the training on a busy machine. SHA-256 of the shards: `{}`.\n\n{}",
        data.of(Split::Train).count(),
        settings.batch,
        settings.rate,
        samples.len(),
        data.sha256,
        table(&mut variants, &samples)
    );
    print!("{text}");
    write_whole(&arguments.table, text.as_bytes())?;
    Ok(())
}
