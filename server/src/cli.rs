//! The program: serve, answer one request from a file, simulate one sequence, or review a level.
//!
//! Contract of `predict`: the response goes to standard output and is that of `POST /v1/predict`; a problem goes to standard error as the
//! same document that HTTP has, and the program ends with 1. The command line is at fault: 2. `simulate` is the same line by line; a
//! sequence that breaks off has its error as last line and ends with 1.

use std::fs;
use std::future::pending;
use std::io::{self, Read, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use retina_core::predict::{PreparedScene, Workspace};
use retina_core::progress::Progress as _;
use retina_core::scene::{Scene, SceneSurface};
use retina_core::surface::mesh_file::{MeshFormat, read_mesh};
use tokio_util::sync::CancellationToken;

use crate::answer::{Question, predict};
#[cfg(feature = "rerun")]
use crate::config::LogForm;
use crate::config::table;
use crate::config::{Command, CommandLine, Config, PredictArgs, ReviewArgs, SimulateArgs};
use crate::log;
use crate::problem::{Kind, Problem, from_predict};
use crate::read::read;
use crate::recording::{self, Recorder, Totals};
use crate::simulate::{Line, simulate_in};
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::understand;
use crate::wire::{PredictRequest, SimulateRequest};
use crate::write::Layout;
use crate::{App, igtl, page, run};

/// Exit code where the command line asks for what cannot be.
const COMMAND_LINE_AT_FAULT: u8 = 2;

/// How long what was answered may still take to be recorded after the service has ended.
const RECORDING_PATIENCE: Duration = Duration::from_secs(10);

/// Where the program reads from and writes to.
pub struct Streams<'a> {
    /// Standard input.
    pub input: &'a mut dyn Read,
    /// Standard output.
    pub output: &'a mut dyn Write,
    /// Standard error.
    pub problems: &'a mut dyn Write,
}

/// Runs the program as its command line says.
pub fn main() -> ExitCode {
    let CommandLine { command, config } = CommandLine::read(std::env::args_os()).unwrap_or_else(|error| error.exit());
    match command {
        Some(Command::Predict(args)) => {
            let streams = Streams { input: &mut io::stdin(), output: &mut io::stdout(), problems: &mut io::stderr() };
            match predict_file(&args, streams) {
                Ok(code) => ExitCode::from(code),
                Err(_) => ExitCode::FAILURE,
            }
        }
        Some(Command::Review(args)) => review(&args),
        Some(Command::Simulate(args)) => {
            let streams = Streams { input: &mut io::stdin(), output: &mut io::stdout(), problems: &mut io::stderr() };
            match simulate_file(&args, streams) {
                Ok(code) => ExitCode::from(code),
                Err(_) => ExitCode::FAILURE,
            }
        }
        Some(Command::Settings) => {
            // A pipe that is closed early wants no more of it.
            let _ = io::stdout().write_all(table::settings().as_bytes());
            ExitCode::SUCCESS
        }
        Some(Command::Serve(config)) => serve(&config),
        None => serve(&config),
    }
}

fn serve(config: &Config) -> ExitCode {
    let export = match log::start(config.log, config.otlp_endpoint.as_deref()) {
        Ok(export) => export,
        Err(error) => {
            tracing::error!(%error, "not started");
            return ExitCode::from(COMMAND_LINE_AT_FAULT);
        }
    };
    let recorder = match config.recording().map(|destination| recording::start(&destination)).transpose() {
        Ok(recorder) => recorder,
        Err(error) => {
            tracing::error!(%error, "not started");
            return ExitCode::from(COMMAND_LINE_AT_FAULT);
        }
    };
    let ended = serve_until_told(config, recorder.clone());
    if let Some(recorder) = recorder {
        let Totals { written, dropped, failed, closed } = recorder.finish(RECORDING_PATIENCE);
        tracing::info!(written, dropped, failed, complete = closed, "the recording ended");
    }
    drop(export);
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!(%error, listen = %config.listen, "the service ended");
            ExitCode::FAILURE
        }
    }
}

/// One thread talks: the numerical threads do the work, and handing it to one of several talking threads costs a wake-up more.
#[tokio::main(flavor = "current_thread")]
async fn serve_until_told(config: &Config, recorder: Option<Recorder>) -> io::Result<()> {
    let listener = tokio::net::TcpListener::bind(config.listen).await?;
    let address = listener.local_addr()?;
    tracing::info!("listening on http://{address}, the API is at http://{address}/docs");
    if let Some(reason) = page::missing() {
        tracing::warn!(reason, "no page at http://{address}/, which says how to get it; the API works without");
    }
    let shutdown = CancellationToken::new();
    let stop = shutdown.clone();
    if config.tokens.is_empty() && !address.ip().is_loopback() {
        tracing::warn!("whoever reaches {address} may ask: there is no token, see --token");
    }
    tokio::spawn(async move {
        told_to_stop().await;
        tracing::info!("stopping after what was accepted");
        stop.cancel();
    });
    let app = App::start_recorded(config, recorder)?;
    if let Some(address) = config.igtl {
        let listener = tokio::net::TcpListener::bind(address).await?;
        tracing::info!("OpenIGTLink on {}", listener.local_addr()?);
        tokio::spawn(igtl::listen(listener, app.clone()));
    }
    run(listener, app, shutdown).await
}

/// Returns when somebody presses ctrl-c or, on Unix, sends SIGTERM. Without a way to hear of either the service runs on, as it must.
async fn told_to_stop() {
    let interrupted = async {
        if tokio::signal::ctrl_c().await.is_err() {
            pending().await
        }
    };
    #[cfg(unix)]
    let terminated = async {
        match tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate()) {
            Ok(mut terminate) => terminate.recv().await,
            Err(_) => pending().await,
        }
    };
    #[cfg(not(unix))]
    let terminated = pending::<()>();
    tokio::select! {
        () = interrupted => {}
        _ = terminated => {}
    }
}

#[cfg(feature = "rerun")]
fn review(args: &ReviewArgs) -> ExitCode {
    // Nothing is exported, so nothing fails.
    let _ = log::start(LogForm::Pretty, None);
    crate::review::main(args)
}

#[cfg(not(feature = "rerun"))]
fn review(_args: &ReviewArgs) -> ExitCode {
    eprintln!("retina-server review: {}", recording::RecordingError::NotBuilt);
    ExitCode::from(COMMAND_LINE_AT_FAULT)
}

/// `retina-server predict`; returns the exit code.
///
/// # Errors
/// If a stream cannot be written.
pub fn predict_file(args: &PredictArgs, streams: Streams) -> io::Result<u8> {
    let body = match read_input(&args.request, streams.input) {
        Ok(body) => body,
        Err(error) => {
            writeln!(streams.problems, "{}: {error}", args.request.display())?;
            return Ok(COMMAND_LINE_AT_FAULT);
        }
    };
    let layout = match args.pretty {
        true => Layout::Indented,
        false => Layout::Compact,
    };
    match answer(&body, args.mesh.as_deref(), layout) {
        Ok(answer) => {
            streams.output.write_all(&answer)?;
            streams.output.write_all(b"\n")?;
            Ok(0)
        }
        Err(problem) => {
            serde_json::to_writer_pretty(&mut *streams.problems, &problem.document())?;
            writeln!(streams.problems)?;
            Ok(1)
        }
    }
}

/// `retina-server simulate`; returns the exit code.
///
/// # Errors
/// If a stream cannot be written.
pub fn simulate_file(args: &SimulateArgs, streams: Streams) -> io::Result<u8> {
    let body = match read_input(&args.request, streams.input) {
        Ok(body) => body,
        Err(error) => {
            writeln!(streams.problems, "{}: {error}", args.request.display())?;
            return Ok(2);
        }
    };
    let Streams { output, problems, .. } = streams;
    let mut stopwatch = Stopwatch::start(Instant::now(), Duration::MAX / 4, &|| false);
    let (mut code, mut written) = (1, Ok(()));
    let mut tell = |line: Line| {
        written = match line {
            Line::Refused(problem) => serde_json::to_writer_pretty(&mut *problems, &problem.document())
                .map_err(io::Error::from)
                .and_then(|()| writeln!(problems)),
            Line::Going(bytes) => output.write_all(&bytes).and_then(|()| output.flush()),
            Line::Last { bytes, complete } => {
                code = u8::from(!complete);
                output.write_all(&bytes)
            }
        };
        written.is_ok()
    };
    let scene = |message: &SimulateRequest| {
        let mut scene = understand::chosen(message.scene.as_ref())?;
        if let Some(path) = &args.mesh {
            replace_surface(&mut scene, path)?;
        }
        PreparedScene::new(scene).map(Arc::new).map_err(from_predict)
    };
    simulate_in(&body, scene, usize::MAX, &mut stopwatch, &mut tell);
    written.map(|()| code)
}

fn read_input(path: &Path, input: &mut dyn Read) -> io::Result<Vec<u8>> {
    if path == Path::new("-") {
        let mut bytes = Vec::new();
        input.read_to_end(&mut bytes)?;
        return Ok(bytes);
    }
    fs::read(path)
}

fn answer(body: &[u8], mesh: Option<&Path>, layout: Layout) -> Result<Vec<u8>, Problem> {
    let mut stopwatch = Stopwatch::start(Instant::now(), Duration::MAX / 4, &|| false);
    let message: PredictRequest = read(body)?;
    let (request, budget) = understand::request(&message)?;
    let mut scene = understand::chosen(message.scene.as_ref())?;
    if let Some(path) = mesh {
        replace_surface(&mut scene, path)?;
    }
    stopwatch.stage("prepare");
    let scene = Arc::new(PreparedScene::new(scene).map_err(from_predict)?);
    let question = Question { request, budget, times: &Times::default() };
    predict(&scene, question, &mut Workspace::default(), &mut stopwatch, layout).map(|answer| answer.bytes)
}

fn replace_surface(scene: &mut Scene, path: &Path) -> Result<(), Problem> {
    let refuse = |allowed: &str, reason: String| {
        let detail = format!("{}: {reason}", path.display());
        Problem::field(Kind::InvalidMesh, "--mesh", None, allowed, detail)
    };
    let format = path.file_name().and_then(|name| name.to_str()).and_then(MeshFormat::of_name);
    let format = format.ok_or_else(|| refuse("a file named .ply, .obj or .stl", "unknown format".to_owned()))?;
    let bytes = fs::read(path).map_err(|error| refuse("a file that can be read", error.to_string()))?;
    let mesh = read_mesh(&bytes, format)
        .map_err(|error| refuse("a triangle mesh in mm with a common outward side", error.to_string()))?;
    scene.surface = SceneSurface::Mesh(Arc::new(mesh));
    Ok(())
}
