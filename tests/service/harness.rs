//! A service in process or on a socket, and what it answers.

use std::net::SocketAddr;
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use axum::body::{Body, to_bytes};
use axum::http::{HeaderMap, Request, StatusCode, header};
use clap::Parser as _;
use retina_server::config::CommandLine;
use retina_server::{App, AppState, app, run};
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt as _;

/// An answer with its body as JSON; text that is not JSON becomes a JSON string.
#[derive(Debug)]
pub struct Reply {
    pub status: StatusCode,
    pub headers: HeaderMap,
    pub body: Value,
}

impl Reply {
    pub fn media_type(&self) -> &str {
        self.headers[header::CONTENT_TYPE].to_str().expect("text")
    }
}

/// A service with the given arguments of its command line.
pub fn state(arguments: &[&str]) -> AppState {
    let words = ["retina-server"].iter().chain(arguments);
    let config = CommandLine::try_parse_from(words).expect("arguments").config;
    App::start(&config).expect("threads")
}

/// The service that most tests share.
pub fn shared() -> AppState {
    static STATE: OnceLock<AppState> = OnceLock::new();
    STATE.get_or_init(|| state(&[])).clone()
}

pub fn runtime() -> &'static Runtime {
    static RUNTIME: OnceLock<Runtime> = OnceLock::new();
    RUNTIME.get_or_init(|| Runtime::new().expect("runtime"))
}

/// Sends a request to the shared service without a socket, from anywhere.
pub fn send(request: Request<Body>) -> Reply {
    let send = async {
        let response = app(shared()).oneshot(request).await.expect("infallible");
        let (parts, body) = response.into_parts();
        let bytes = to_bytes(body, usize::MAX).await.expect("body");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        Reply {
            status: parts.status,
            headers: parts.headers,
            body: serde_json::from_str(&text).unwrap_or(Value::String(text)),
        }
    };
    tokio::task::block_in_place(|| runtime().block_on(send))
}

pub fn get(path: &str) -> Reply {
    send(Request::get(path).body(Body::empty()).expect("request"))
}

/// `POST /v1/predict` with a body that is announced as JSON.
pub fn post(body: impl Into<Body>) -> Reply {
    let request = Request::post("/v1/predict").header(header::CONTENT_TYPE, "application/json");
    send(request.body(body.into()).expect("request"))
}

pub fn predict(request: &Value) -> Reply {
    post(request.to_string())
}

/// The smallest request that presses, at a level.
pub fn request(level: &str) -> Value {
    json!({
        "needle": {"tip_mm": [0.1, -0.05, 0.0]},
        "force_mn": [0.0, 0.0, -0.4],
        "accuracy": {"level": level},
    })
}

/// Replaces or adds the value at a JSON pointer, whose parent must exist.
pub fn with(mut request: Value, pointer: &str, value: Value) -> Value {
    let (parent, key) = pointer.rsplit_once('/').expect("pointer");
    match request.pointer_mut(parent).expect("parent") {
        Value::Array(items) => items[key.parse::<usize>().expect("index")] = value,
        Value::Object(fields) => {
            fields.insert(key.to_owned(), value);
        }
        other => panic!("{other} has no {key}"),
    }
    request
}

/// A service on a socket; stops when dropped.
pub struct Running {
    pub address: SocketAddr,
    pub shutdown: CancellationToken,
    pub ended: Option<thread::JoinHandle<()>>,
}

impl Running {
    /// Starts a service with these arguments and waits until it is ready.
    pub fn start(arguments: &[&str]) -> Self {
        Self::of(state(arguments))
    }

    /// Serves this on a socket and waits until it is ready.
    pub fn of(state: AppState) -> Self {
        let listener = runtime().block_on(TcpListener::bind("127.0.0.1:0")).expect("port");
        let address = listener.local_addr().expect("address");
        let shutdown = CancellationToken::new();
        let stop = shutdown.clone();
        let ended = thread::spawn(move || {
            runtime().block_on(run(listener, state, stop)).expect("service");
        });
        let running = Self { address, shutdown, ended: Some(ended) };
        let patience = Instant::now() + Duration::from_secs(60);
        while ureq::get(running.url("/readyz")).call().is_err() {
            assert!(Instant::now() < patience, "the service does not get ready");
            thread::sleep(Duration::from_millis(20));
        }
        running
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Posts a prediction over the socket: status, header Retry-After, body.
    pub fn predict(&self, agent: &ureq::Agent, request: &Value) -> (u16, Option<String>, String) {
        let mut response = agent
            .post(self.url("/v1/predict"))
            .header("content-type", "application/json")
            .send(request.to_string())
            .expect("answer");
        let retry = response.headers().get("retry-after");
        let retry = retry.map(|value| value.to_str().expect("text").to_owned());
        let body = response.body_mut().read_to_string().expect("body");
        (response.status().as_u16(), retry, body)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shutdown.cancel();
    }
}

/// A client that tells of every status instead of failing for some.
pub fn agent() -> ureq::Agent {
    ureq::Agent::config_builder().http_status_as_error(false).build().into()
}
