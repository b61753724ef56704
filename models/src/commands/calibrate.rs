//! `calibrate`: writes what the levels `linear` and `coarse` err by into the core, and the bounds of trained contact networks into their weights.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;

use retina_core::network::contact::Start;
use retina_core::network::weights::{Weights, hash};

use super::evaluate::WEIGHTS;
use crate::calibrate::source;
use crate::contact::trained::Trained;
use crate::data::Data;
use crate::parity;
use crate::sample::Split;
use crate::shard;
use crate::train::card::Card;
use crate::train::checkpoint::write_whole;

/// Where the quantiles go.
const OUTPUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../core/src/predict/calibration.rs");

/// Arguments of `calibrate`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Folder with the shards of a data set; several may be given.
    #[arg(long, required = true)]
    data: Vec<PathBuf>,
    /// File for the quantiles.
    #[arg(long, default_value = OUTPUT)]
    out: PathBuf,
    /// Folder with the weights.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
}

/// Calibrates.
///
/// # Errors
/// What reading or writing said.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let data = Data::read(&arguments.data)?;
    let text = source(&data.samples, &data.sha256);
    print!("{text}");
    write_whole(&arguments.out, text.as_bytes())?;
    bound(&arguments.weights, &data, Start::Linear)?;
    bound(&arguments.weights, &data, Start::Coarse)
}

/// Sets the bounds of a network right on the validation split of `data`, in its weights and in their card.
fn bound(weights: &Path, data: &Data, start: Start) -> Result<(), Box<dyn Error>> {
    let name = start.network();
    let path = |ending: &str| weights.join(format!("{name}.{ending}"));
    let file = std::fs::read(path("safetensors"))?;
    let trained = Trained::read(start, &Weights::read(name, &file)?)?;
    let samples: Vec<_> = data.of(Split::Validation).filter_map(|sample| trained.prepare(sample)).collect();
    let file = trained.with_bounds(start, &file, &samples, &data.sha256)?;
    let mut card: Card = serde_json::from_slice(&std::fs::read(path("card.json"))?)?;
    card.weights_sha256 = hash(&file);
    if let (Some(parity), Some(sample)) = (&mut card.parity, shard::read(&path("parity.safetensors"))?.first()) {
        let layers = parity::contact(start, &file, sample)?;
        let quantiles = layers.iter().find(|layer| layer.name == "quantile.0").ok_or("no quantiles")?;
        parity.quantiles = quantiles.rows.clone();
    }
    write_whole(&path("safetensors"), &file)?;
    write_whole(&path("card.json"), serde_json::to_string_pretty(&card)?.as_bytes())?;
    eprintln!("{name}: bounds from {} samples", samples.len());
    Ok(())
}
