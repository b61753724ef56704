//! `parity`: what the trainer computes layer by layer for the sample beside each weight file, written beside it.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use retina_core::network::contact::Start;
use retina_core::network::faithful::NAME;

use crate::parity;
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
    // The paper's network has no sample of its own.
    let layers = parity::faithful(&std::fs::read(path(NAME, ""))?, &sample(Start::Linear.network())?)?;
    write_whole(&path(NAME, "layers."), &layers::write(&layers)?)?;
    println!("{NAME}: {} layers", layers.len());
    Ok(())
}
