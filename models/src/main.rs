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
    /// Prints and keeps every table about a data set and the networks.
    Evaluate(commands::evaluate::Arguments),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Train(arguments) => commands::train::run(&arguments),
        Command::Evaluate(arguments) => commands::evaluate::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
