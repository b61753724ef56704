//! `parity`: what the trainer computes layer by layer for the sample beside each weight file, written beside it.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use retina_core::network::contact::Start;
use retina_core::network::faithful::NAME;

use crate::data::Data;
use crate::dataset::report::largest_um;
use crate::parity;
use crate::sample::{Sample, Split};
use crate::shard;
use crate::train::checkpoint::write_whole;
use crate::train::layers;

use super::evaluate::WEIGHTS;

/// Arguments of `parity`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Folder with the weights.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Folder of a data set whose furthest moved validation sample becomes that of the paper's network; without, the one beside its weights stays.
    #[arg(long)]
    data: Option<PathBuf>,
}

/// Writes `NAME.layers.safetensors` for each network.
///
/// # Errors
/// What reading or writing said.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let path = |name: &str, kind: &str| arguments.weights.join(format!("{name}.{kind}safetensors"));
    let sample = |name: &str| -> Result<_, Box<dyn Error>> {
        shard::read(&path(name, "parity."))?.first().copied().ok_or_else(|| "there is no sample in the shard".into())
    };
    for start in [Start::Linear, Start::Coarse] {
        let name = start.network();
        let layers = parity::contact(start, &std::fs::read(path(name, ""))?, &sample(name)?)?;
        write_whole(&path(name, "layers."), &layers::write(&layers)?)?;
        println!("{name}: {} layers", layers.len());
    }
    if let Some(folder) = &arguments.data {
        let data = Data::read(std::slice::from_ref(folder))?;
        let moved_um = |sample: &Sample| largest_um(&sample.truth.displacement_mm);
        let furthest = data.of(Split::Validation).max_by(|a, b| moved_um(a).total_cmp(&moved_um(b)));
        let furthest = furthest.ok_or("there is no validation sample")?;
        shard::write(&path(NAME, "parity."), &[*furthest])?;
    }
    let layers = parity::faithful(&std::fs::read(path(NAME, ""))?, &sample(NAME)?)?;
    write_whole(&path(NAME, "layers."), &layers::write(&layers)?)?;
    println!("{NAME}: {} layers", layers.len());
    Ok(())
}
