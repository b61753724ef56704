//! `runtime`: what predictions cost, split into data and network; and the paper's network beside ONNX Runtime.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use retina_core::network::faithful::{FaithfulNetwork, NAME};
use retina_core::network::input::Input;

use crate::data::Data;
use crate::describe;
use crate::evaluate::onnx;
use crate::evaluate::predictors::networks;
use crate::evaluate::runtime::{Paper, split};
use crate::sample::Split;

use super::evaluate::WEIGHTS;

/// Arguments of `runtime`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Folder with the shards of a data set.
    #[arg(long, required = true)]
    data: Vec<PathBuf>,
    /// Folder with the weights.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// A Python with what `tests/comparison/onnxruntime/requirements.txt` lists; without, ONNX Runtime is left out.
    #[arg(long)]
    onnx_python: Option<PathBuf>,
    /// Samples of the test split that are evaluated, of the default scene.
    #[arg(long, default_value_t = 64)]
    samples: usize,
    /// How often each is.
    #[arg(long, default_value_t = 20)]
    turns: usize,
}

/// The default scene among the built-in ones.
const MACULA: u8 = 1;

/// Measures and prints.
///
/// # Errors
/// What reading said, or the other side of the comparison.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let data = Data::read(&arguments.data)?;
    let chosen = data.of(Split::Test).filter(|sample| sample.scene == MACULA && sample.coarse.is_some());
    let samples: Vec<(Input, f32)> =
        chosen.take(arguments.samples).map(|sample| (describe::input(sample), sample.touch_travel_mm)).collect();
    let weights = arguments.weights.join(format!("{NAME}.safetensors"));
    let mut paper = Paper::new(FaithfulNetwork::new(&std::fs::read(&weights)?)?);
    let (mut contacts, _, refused) = networks(&arguments.weights);
    for why in refused {
        eprintln!("left out: {why}");
    }
    println!("{} samples of the default scene, {} turns, one thread\n", samples.len(), arguments.turns);
    println!("{}", split(&mut paper, &mut contacts, &samples, arguments.turns));
    if let Some(python) = &arguments.onnx_python {
        println!("{}", onnx::compare(python, &weights, &mut paper, &samples, arguments.turns)?);
    }
    Ok(())
}
