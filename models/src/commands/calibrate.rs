//! `calibrate`: writes what the levels `linear` and `coarse` err by into the core.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;

use crate::calibrate::source;
use crate::data::Data;
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
    Ok(())
}
