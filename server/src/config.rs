//! What the program can be told, on the command line or by environment variables. The only place that reads either.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use retina_core::predict::Level;

use crate::recording::Destination;
use crate::understand::DEFAULT_SCENE;

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
    Serve(Config),
    /// Answer one request from a file and end: the response goes to standard output, a problem to standard error.
    Predict(PredictArgs),
    /// Compare a level with the ground truth on random requests, for the rerun viewer (cargo feature `rerun`).
    Review(ReviewArgs),
    /// Simulate a sequence from a file and end: one JSON object a line goes to standard output as it is computed.
    Simulate(SimulateArgs),
}

/// How to serve.
#[derive(Clone, Debug, Args)]
pub struct Config {
    /// Address and port to listen on; port 0 takes a free one.
    #[arg(long, env = "RETINA_LISTEN", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
    /// Numerical threads; as many as the machine has cores when left out.
    #[arg(long, env = "RETINA_THREADS", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Requests that may wait for a numerical thread; one more is answered with 503.
    #[arg(long, env = "RETINA_QUEUE", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    pub queue: u16,
    /// Memory for the prepared scenes of requests, MiB. The built-in ones come on top.
    #[arg(long, env = "RETINA_SCENE_CACHE_MIB", default_value_t = 64)]
    pub scene_cache_mib: u16,
    /// Milliseconds after which the work on a request is stopped.
    #[arg(long, env = "RETINA_TIME_LIMIT_MS", default_value_t = 30_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub time_limit_ms: u32,
    /// Steps that a simulation may have.
    #[arg(long, env = "RETINA_SIMULATION_STEPS", default_value_t = 2000, value_parser = clap::value_parser!(u16).range(1..))]
    pub simulation_steps: u16,
    /// Milliseconds after which a simulation is stopped.
    #[arg(long, env = "RETINA_SIMULATION_TIME_LIMIT_MS", default_value_t = 300_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub simulation_time_limit_ms: u32,
    /// Streams that may be open at once.
    #[arg(long, env = "RETINA_STREAMS", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    pub streams: u16,
    /// Milliseconds after which a stream whose client is silent, pings unanswered, is closed.
    #[arg(long, env = "RETINA_STREAM_IDLE_MS", default_value_t = 60_000, value_parser = clap::value_parser!(u32).range(30..))]
    pub stream_idle_ms: u32,
    /// Form of the log on standard error. RUST_LOG says what is logged; `retina_server=debug` has a line for each request.
    #[arg(long, env = "RETINA_LOG", default_value = "pretty")]
    pub log: LogForm,
    /// Record what is asked and answered in this file, for the rerun viewer (cargo feature `rerun`).
    #[arg(long, env = "RETINA_RECORD", value_name = "FILE.rrd", conflicts_with = "record_connect")]
    pub record: Option<PathBuf>,
    /// Record to a running viewer, as rerun+http://127.0.0.1:9876/proxy (cargo feature `rerun`).
    #[arg(long, env = "RETINA_RECORD_CONNECT", value_name = "URL")]
    pub record_connect: Option<String>,
}

/// Form of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogForm {
    /// For people.
    Pretty,
    /// One JSON object a line.
    Json,
}

/// One request without HTTP.
#[derive(Debug, Args)]
pub struct PredictArgs {
    /// File with the request that `POST /v1/predict` takes; `-` is standard input.
    pub request: PathBuf,
    /// A mesh in mm (.ply, text or binary, or .obj) in place of the scene's surface.
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
    /// A mesh in mm (.ply, text or binary, or .obj) in place of the scene's surface.
    #[arg(long)]
    pub mesh: Option<PathBuf>,
}

impl Config {
    /// Where to record what is asked and answered.
    pub fn recording(&self) -> Option<Destination> {
        destination(self.record.as_ref(), self.record_connect.as_ref())
    }

    /// Numerical threads.
    pub fn threads(&self) -> usize {
        let cores = || available_parallelism().map_or(1, usize::from);
        self.threads.map_or_else(cores, usize::from)
    }

    /// Memory for the prepared scenes of requests, bytes.
    pub fn scene_cache_bytes(&self) -> usize {
        usize::from(self.scene_cache_mib) << 20
    }

    /// How long the work on a request may take.
    pub fn time_limit(&self) -> Duration {
        Duration::from_millis(self.time_limit_ms.into())
    }

    /// How long a stream's client may be silent.
    pub fn stream_idle(&self) -> Duration {
        Duration::from_millis(self.stream_idle_ms.into())
    }

    /// How long a simulation may take.
    pub fn simulation_time_limit(&self) -> Duration {
        Duration::from_millis(self.simulation_time_limit_ms.into())
    }
}
