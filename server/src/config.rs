//! What the program can be told, on the command line, by environment variables or by a file. The only place that reads any of them.
//!
//! What is on the command line goes before what is in the environment, that before what is in the file, that before the default. Read
//! `service` (every setting of the service), `file` (how a file is laid under the command line), `table` (the settings for people).

mod file;
mod service;
pub mod table;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use retina_core::predict::Level;

use crate::recording::Destination;
use crate::understand::DEFAULT_SCENE;

pub use service::{Config, LogForm};

/// Needle pose and force in, deformed retina surface and normals out.
#[derive(Debug, Parser)]
#[command(name = "retina-server", version, args_conflicts_with_subcommands = true)]
pub struct CommandLine {
    /// What to do; serve when left out.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// How to serve.
    #[command(flatten)]
    pub config: Config,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Answer requests over HTTP (the default).
    Serve(Box<Config>),
    /// Answer one request from a file and end: the response goes to standard output, a problem to standard error.
    Predict(PredictArgs),
    /// Compare a level with the ground truth on random requests, for the rerun viewer (cargo feature `rerun`).
    Review(ReviewArgs),
    /// Simulate a sequence from a file and end: one JSON object a line goes to standard output as it is computed.
    Simulate(SimulateArgs),
    /// Print every setting of the service with its environment variable and its default, as a table in Markdown.
    Settings,
}

/// One request without HTTP.
#[derive(Debug, Args)]
pub struct PredictArgs {
    /// File with the request that `POST /v1/predict` takes; `-` is standard input.
    pub request: PathBuf,
    /// A mesh in mm (.ply or .stl, text or binary, or .obj) in place of the scene's surface.
    #[arg(long)]
    pub mesh: Option<PathBuf>,
    /// One line for each field.
    #[arg(long)]
    pub pretty: bool,
}

/// A comparison with the ground truth.
#[derive(Clone, Debug, Args)]
pub struct ReviewArgs {
    /// Built-in scene.
    #[arg(long, default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// Requests to compare. The ground truth takes seconds for each.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub count: u32,
    /// Every request follows from it.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// The level that is compared with `reference`.
    #[arg(long, default_value = "coarse", value_parser = level)]
    pub level: Level,
    /// Tips of the needles.
    #[arg(long, default_value = "any")]
    pub tip: TipChoice,
    /// Where the recording goes.
    #[command(flatten)]
    pub destination: ReviewDestination,
}

/// Exactly one place for a review.
#[derive(Clone, Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ReviewDestination {
    /// File that `rerun FILE.rrd` opens; what is in it is lost.
    #[arg(long, value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
    /// A running viewer, as rerun+http://127.0.0.1:9876/proxy.
    #[arg(long, value_name = "URL")]
    pub connect: Option<String>,
}

/// Tips of the needles of a review.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TipChoice {
    /// Half of them hemispherical, the others flat or bevelled.
    Any,
    /// Half a ball.
    Hemispherical,
    /// A plane across the shaft.
    Flat,
    /// A plane oblique to the shaft.
    Bevelled,
}

fn level(name: &str) -> Result<Level, String> {
    let compared = || Level::ALL.into_iter().filter(|level| *level != Level::Reference);
    compared().find(|level| level.name() == name).ok_or_else(|| {
        let known: Vec<&str> = compared().map(Level::name).collect();
        format!("levels that can be compared are {}", known.join(", "))
    })
}

fn destination(file: Option<&PathBuf>, viewer: Option<&String>) -> Option<Destination> {
    let file = file.cloned().map(Destination::File);
    file.or_else(|| viewer.cloned().map(Destination::Viewer))
}

impl ReviewDestination {
    /// The place; `None` where neither is given, which the command line refuses.
    pub fn chosen(&self) -> Option<Destination> {
        destination(self.save.as_ref(), self.connect.as_ref())
    }
}

/// One sequence without HTTP.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// File with the request that `POST /v1/simulate` takes; `-` is standard input.
    pub request: PathBuf,
    /// A mesh in mm (.ply or .stl, text or binary, or .obj) in place of the scene's surface.
    #[arg(long)]
    pub mesh: Option<PathBuf>,
}
