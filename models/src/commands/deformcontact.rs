//! `export-deformcontact` and `import-deformcontact`: data in the layout of the paper's public code.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;

use super::dataset::samples;
use crate::dataset::DatasetError;
use crate::dataset::deformcontact::{export, import};
use crate::sample::Split;

/// Arguments of `export-deformcontact`.
#[derive(Args, Clone, Debug)]
pub struct ExportArguments {
    /// The data set's folder.
    folder: PathBuf,
    /// The folder to write to.
    out: PathBuf,
    /// Splits to write, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "train,validation")]
    splits: Vec<String>,
}

/// Arguments of `import-deformcontact`.
#[derive(Args, Clone, Debug)]
pub struct ImportArguments {
    /// A folder with an `InitialMesh.ply`.
    folder: PathBuf,
}

/// Writes a data set in that layout.
///
/// # Errors
/// [`DatasetError`].
pub fn run_export(arguments: &ExportArguments) -> Result<(), Box<dyn Error>> {
    let ExportArguments { folder, out, splits } = arguments;
    let known = Split::ALL.map(Split::name);
    if let Some(unknown) = splits.iter().find(|name| !known.contains(&name.as_str())) {
        let allowed = known.join(", ");
        return Err(DatasetError::Value { field: "splits", value: unknown.clone(), allowed }.into());
    }
    let mut samples = samples(folder)?;
    samples.retain(|sample| splits.iter().any(|name| name == sample.split.name()));
    println!("{} samples written to {}", export(&samples, out)?, out.display());
    Ok(())
}

/// Reads that layout and says what is there.
///
/// # Errors
/// [`DatasetError`].
pub fn run_import(arguments: &ImportArguments) -> Result<(), Box<dyn Error>> {
    let samples = import(&arguments.folder)?;
    let largest_mn = samples.iter().map(|sample| sample.force_mn).fold(0.0_f32, f32::max);
    println!("{} samples, largest force {largest_mn} mN", samples.len());
    Ok(())
}
