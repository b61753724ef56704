//! `evaluate`: every table about a data set and the networks, printed and kept as `models/REPORT.md`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;

use crate::data::Data;
use crate::evaluate::predictors::networks;
use crate::evaluate::report::report;
use crate::train::checkpoint::write_whole;

/// Where the weights that ship lie.
pub(super) const WEIGHTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/weights");
/// Where the report goes.
const REPORT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/REPORT.md");

/// Arguments of `evaluate`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Folder with the shards of a data set; several may be given.
    #[arg(long, required = true)]
    data: Vec<PathBuf>,
    /// Folder with the weights.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// File for the report.
    #[arg(long, default_value = REPORT)]
    out: PathBuf,
}

/// Evaluates.
///
/// # Errors
/// What reading or writing said.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let data = Data::read(&arguments.data)?;
    let (networks, paper, refused) = networks(&arguments.weights);
    for why in refused {
        eprintln!("left out: {why}");
    }
    let text = format!(
        "# What the learned patch errs by\n\nWritten by `cargo run --release -p retina-models -- evaluate --data DIR`; not by hand. Errors are distances between nodes and those of the truth. Times were taken on a busy machine.\n\n{}",
        report(&data, networks, paper)
    );
    print!("{text}");
    write_whole(&arguments.out, text.as_bytes())?;
    Ok(())
}
