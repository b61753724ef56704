//! Every setting of the service.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Duration;

use axum::http::HeaderValue;
use clap::{Args, ValueEnum};

use crate::access::{Access, SHORTEST_TOKEN};
use crate::library::{Quota, Store, StoreError};
use crate::recording::Destination;

/// How to serve.
#[derive(Clone, Debug, Args)]
pub struct Config {
    /// Address and port to listen on; port 0 takes a free one.
    #[arg(long, env = "RETINA_LISTEN", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
    /// Address and port on which OpenIGTLink clients (3D Slicer, PLUS) are served too; 18944 is their usual port.
    #[arg(long, env = "RETINA_IGTL", value_name = "ADDRESS")]
    pub igtl: Option<SocketAddr>,
    /// File of settings (TOML), each under its long name without the dashes in front: `threads = 4`.
    #[arg(long, env = "RETINA_CONFIG", value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Numerical threads; as many as the machine has cores when left out.
    #[arg(long, env = "RETINA_THREADS", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Requests that may wait for a numerical thread; one more is answered with 503.
    #[arg(long, env = "RETINA_QUEUE", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    pub queue: u16,
    /// Milliseconds that a prediction may wait for a numerical thread; one that would wait longer is answered with 503 at once. Unbounded but
    /// for the queue when left out.
    #[arg(long, env = "RETINA_MAX_WAIT_MS", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_wait_ms: Option<u32>,
    /// Memory for the prepared scenes of requests, MiB. The built-in ones come on top.
    #[arg(long, env = "RETINA_SCENE_CACHE_MIB", default_value_t = 64)]
    pub scene_cache_mib: u16,
    /// Where the scenes of POST /v1/scenes are kept: a folder, or a URL such as `s3://bucket/scenes` (cargo feature `s3`; the variables AWS_ENDPOINT_URL,
    /// AWS_ACCESS_KEY_ID and so on say the rest). In memory, until the service ends, when left out.
    #[arg(long, env = "RETINA_SCENE_STORE", value_name = "PLACE")]
    pub scene_store: Option<String>,
    /// Scenes that may be stored.
    #[arg(long, env = "RETINA_STORED_SCENES", default_value_t = 256)]
    pub stored_scenes: u16,
    /// What one stored scene may take, MiB.
    #[arg(long, env = "RETINA_STORED_SCENE_MIB", default_value_t = 16)]
    pub stored_scene_mib: u16,
    /// What all stored scenes may take, MiB.
    #[arg(long, env = "RETINA_SCENE_STORE_MIB", default_value_t = 256)]
    pub scene_store_mib: u32,
    /// Milliseconds after which the work on a request is stopped.
    #[arg(long, env = "RETINA_TIME_LIMIT_MS", default_value_t = 30_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub time_limit_ms: u32,
    /// Steps that a simulation may have.
    #[arg(long, env = "RETINA_SIMULATION_STEPS", default_value_t = 2000, value_parser = clap::value_parser!(u16).range(1..))]
    pub simulation_steps: u16,
    /// Poses that a batch may have.
    #[arg(long, env = "RETINA_BATCH_POSES", default_value_t = 1024, value_parser = clap::value_parser!(u16).range(1..))]
    pub batch_poses: u16,
    /// Milliseconds after which a simulation or a batch is stopped.
    #[arg(long, env = "RETINA_SIMULATION_TIME_LIMIT_MS", default_value_t = 300_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub simulation_time_limit_ms: u32,
    /// Connections that may be open at once; more wait until one ends.
    #[arg(long, env = "RETINA_CONNECTIONS", default_value_t = 1024, value_parser = clap::value_parser!(u16).range(1..))]
    pub connections: u16,
    /// Milliseconds in which a connection must bring the whole head of its next request; it is closed otherwise.
    #[arg(long, env = "RETINA_CONNECTION_IDLE_MS", default_value_t = 60_000, value_parser = clap::value_parser!(u32).range(100..))]
    pub connection_idle_ms: u32,
    /// Milliseconds in which the body of a request must arrive.
    #[arg(long, env = "RETINA_BODY_LIMIT_MS", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(100..))]
    pub body_limit_ms: u32,
    /// Streams that may be open at once.
    #[arg(long, env = "RETINA_STREAMS", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    pub streams: u16,
    /// Sessions with memory that streams may have at once.
    #[arg(long, env = "RETINA_STREAM_MEMORIES", default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..))]
    pub stream_memories: u16,
    /// Milliseconds after which a stream whose client is silent, pings unanswered, is closed.
    #[arg(long, env = "RETINA_STREAM_IDLE_MS", default_value_t = 60_000, value_parser = clap::value_parser!(u32).range(30..))]
    pub stream_idle_ms: u32,
    /// Token that requests under /v1 and /metrics must bring as `Authorization: Bearer TOKEN`; several with commas between them. Others see
    /// what stands on a command line, so a file or the environment is the better place.
    #[arg(long = "token", env = "RETINA_TOKENS", hide_env_values = true, value_name = "TOKEN", value_delimiter = ',', value_parser = token)]
    pub tokens: Vec<String>,
    /// Origin of web pages that may ask beside the service's own, as `https://simulator.example`; several with commas between them.
    #[arg(long = "cors-origin", env = "RETINA_CORS_ORIGINS", value_name = "ORIGIN", value_delimiter = ',', value_parser = origin)]
    pub cors_origins: Vec<HeaderValue>,
    /// Form of the log on standard error. RUST_LOG says what is logged; `retina_server=debug` has a line for each request.
    #[arg(long, env = "RETINA_LOG", default_value = "pretty")]
    pub log: LogForm,
    /// Address of an OpenTelemetry collector that takes the spans of requests (OTLP over HTTP), as `http://127.0.0.1:4318`.
    #[arg(long, env = "RETINA_OTLP_ENDPOINT", value_name = "URL")]
    pub otlp_endpoint: Option<String>,
    /// Share of the predictions, 0 to 1, that are computed again at level `reference` while the service has nothing else to do; what they were off
    /// by is told beside what they promised, by the metrics.
    #[arg(long, env = "RETINA_AUDIT_RATE", default_value_t = 0.0, value_parser = share)]
    pub audit_rate: f64,
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

fn token(text: &str) -> Result<String, String> {
    let printable = text.chars().all(|c| c.is_ascii_graphic());
    match printable && text.len() >= SHORTEST_TOKEN {
        true => Ok(text.to_owned()),
        false => Err(format!("a token has {SHORTEST_TOKEN} printable characters or more and no space")),
    }
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "a share is a number from 0 to 1".to_owned())
}

fn origin(text: &str) -> Result<HeaderValue, String> {
    let host = text.strip_prefix("https://").or_else(|| text.strip_prefix("http://"));
    let is_origin = host.is_some_and(|host| !host.is_empty() && !host.contains(['/', '*', ' ', '?', '#']));
    let value = HeaderValue::from_str(text).ok().filter(|_| is_origin);
    value.ok_or_else(|| "an origin is http:// or https:// and a host, perhaps a port, and nothing after".to_owned())
}

impl Config {
    /// Where to record what is asked and answered.
    pub fn recording(&self) -> Option<Destination> {
        super::destination(self.record.as_ref(), self.record_connect.as_ref())
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

    /// Where scenes are stored.
    ///
    /// # Errors
    /// [`StoreError`] with what is wrong with the place.
    pub fn scene_store(&self) -> Result<Store, StoreError> {
        let text = |(name, value): (OsString, OsString)| Some((name.into_string().ok()?, value.into_string().ok()?));
        match &self.scene_store {
            None => Ok(Store::in_memory()),
            Some(place) => Store::open(place, std::env::vars_os().filter_map(text)),
        }
    }

    /// How many scenes may be stored, and how large.
    pub fn scene_quota(&self) -> Quota {
        Quota {
            scenes: self.stored_scenes.into(),
            each: u64::from(self.stored_scene_mib) << 20,
            total: u64::from(self.scene_store_mib) << 20,
        }
    }

    /// How long the work on a request may take.
    pub fn time_limit(&self) -> Duration {
        Duration::from_millis(self.time_limit_ms.into())
    }

    /// How long a connection may bring no request.
    pub fn connection_idle(&self) -> Duration {
        Duration::from_millis(self.connection_idle_ms.into())
    }

    /// How long a body may take to arrive.
    pub fn body_limit(&self) -> Duration {
        Duration::from_millis(self.body_limit_ms.into())
    }

    /// How long a stream's client may be silent.
    pub fn stream_idle(&self) -> Duration {
        Duration::from_millis(self.stream_idle_ms.into())
    }

    /// How long a prediction may wait for a thread.
    pub fn max_wait(&self) -> Option<Duration> {
        self.max_wait_ms.map(|ms| Duration::from_millis(ms.into()))
    }

    /// Who may ask.
    pub fn access(&self) -> Access {
        Access { tokens: self.tokens.clone().into(), origins: self.cors_origins.clone().into() }
    }

    /// How long a simulation or a batch may take.
    pub fn simulation_time_limit(&self) -> Duration {
        Duration::from_millis(self.simulation_time_limit_ms.into())
    }
}
