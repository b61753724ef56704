//! The command line of `retina-models`.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use retina_models::commands;

/// Data, training and evaluation of the learned retina patch.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Trains a network on a data set.
    Train(commands::train::Arguments),
    /// Trains the variants of the paper's network alike and tabulates their errors.
    Ablation(commands::ablation::Arguments),
    /// Prints and keeps every table about a data set and the networks.
    Evaluate(commands::evaluate::Arguments),
    /// Writes what the levels `linear` and `coarse` err by into the core.
    Calibrate(commands::calibrate::Arguments),
    /// Makes samples of random indentation paths; the same command again goes on where it stopped.
    Dataset(commands::dataset::Arguments),
    /// Writes what the trainer computes layer by layer beside the weights.
    Parity(commands::parity::Arguments),
    /// Prints how far the surface moves in a data set, and how far off the cheap answers are.
    DatasetReport(commands::dataset::ReportArguments),
    /// Prints what predictions cost, split into data and network, and the paper's network beside ONNX Runtime.
    Runtime(commands::runtime::Arguments),
    /// Measures how far the truth of the samples is from that on a finer mesh, on random paths.
    TruthError(commands::truth_error::Arguments),
    /// Measures what refining the mesh of level `reference` still changes, on random requests, and writes it into the core.
    ReferenceError(commands::reference_error::Arguments),
    /// Writes a data set in the layout that the public DeformContact code reads.
    ExportDeformcontact(commands::deformcontact::ExportArguments),
    /// Reads that layout back and says what is there.
    ImportDeformcontact(commands::deformcontact::ImportArguments),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Train(arguments) => commands::train::run(&arguments),
        Command::Ablation(arguments) => commands::ablation::run(&arguments),
        Command::Evaluate(arguments) => commands::evaluate::run(&arguments),
        Command::Calibrate(arguments) => commands::calibrate::run(&arguments),
        Command::Dataset(arguments) => commands::dataset::run(&arguments),
        Command::Parity(arguments) => commands::parity::run(&arguments),
        Command::DatasetReport(arguments) => commands::dataset::run_report(&arguments),
        Command::Runtime(arguments) => commands::runtime::run(&arguments),
        Command::TruthError(arguments) => commands::truth_error::run(&arguments),
        Command::ReferenceError(arguments) => commands::reference_error::run(&arguments),
        Command::ExportDeformcontact(arguments) => commands::deformcontact::run_export(&arguments),
        Command::ImportDeformcontact(arguments) => commands::deformcontact::run_import(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
