//! What an operator sees: metrics, `about`, settings from a file, readiness, request ids.

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use retina_server::config::{Command, CommandLine, table};
use retina_tests::stream_client::StreamClient;
use serde_json::json;

use crate::harness::{Running, agent, request, runtime, state, with};
use crate::schema::assert_matches;

pub fn metrics(service: &Running) -> String {
    let mut response = agent().get(service.url("/metrics")).call().expect("answer");
    assert!(response.headers()["content-type"].to_str().expect("text").starts_with("application/openmetrics-text"));
    response.body_mut().read_to_string().expect("text")
}

/// The value of one series.
pub fn value(text: &str, series: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix(series).and_then(|rest| rest.strip_prefix(' ')));
    line.unwrap_or_else(|| panic!("no {series} in\n{text}")).parse().expect("number")
}

#[test]
fn metrics_count_what_was_answered_refused_and_timed() {
    let service = Running::start(&["--threads", "1", "--queue", "7"]);
    let agent = agent();
    for _ in 0..3 {
        assert_eq!(service.predict(&agent, &request("linear")).0, 200);
    }
    assert_eq!(service.predict(&agent, &request("coarse")).0, 200);
    assert_eq!(service.predict(&agent, &request("exact")).0, 422);
    assert_eq!(agent.get(service.url("/nowhere/at/all")).call().expect("answer").status(), 404);
    let text = metrics(&service);
    assert!(text.ends_with("# EOF\n"), "{text}");
    assert_eq!(value(&text, r#"retina_requests_total{route="/v1/predict",status="200"}"#), 4.0);
    assert_eq!(value(&text, r#"retina_requests_total{route="/v1/predict",status="422"}"#), 1.0);
    assert_eq!(value(&text, r#"retina_requests_total{route="other",status="404"}"#), 1.0);
    assert_eq!(value(&text, r#"retina_problems_total{kind="unknown-name"}"#), 1.0);
    assert_eq!(value(&text, r#"retina_request_seconds_count{route="/v1/predict"}"#), 5.0);
    assert_eq!(value(&text, r#"retina_stage_seconds_count{level="linear",stage="linear"}"#), 3.0);
    assert_eq!(value(&text, r#"retina_stage_seconds_count{level="coarse",stage="equilibrium"}"#), 1.0);
    let spent = value(&text, r#"retina_stage_seconds_sum{level="coarse",stage="equilibrium"}"#);
    assert!(spent > 1e-4 && spent < 10.0, "{spent} s");
    assert_eq!(value(&text, "retina_queue_places"), 7.0);
    assert_eq!(value(&text, "retina_queue_length"), 0.0);
    assert_eq!(value(&text, "retina_threads"), 1.0);
    assert_eq!(value(&text, "retina_panics_total"), 0.0);
}

#[test]
fn streams_are_counted_too() {
    let service = Running::start(&["--threads", "1"]);
    runtime().block_on(async {
        let mut client = StreamClient::connect(service.address).await.expect("handshake");
        client.open(json!({"accuracy": {"level": "linear"}})).await.expect("session");
        for sequence in 1..=3 {
            client.send(&json!({"pose": {"sequence": sequence, "tip_mm": [0, 0, -0.01]}})).await.expect("sent");
            client.receive().await;
        }
        client.send(&json!({"pose": {}})).await.expect("sent");
        client.receive().await;
        let text = tokio::task::block_in_place(|| metrics(&service));
        assert_eq!(value(&text, "retina_streams"), 1.0);
        assert_eq!(value(&text, r#"retina_stream_poses_total{outcome="answered"}"#), 3.0);
        assert_eq!(value(&text, r#"retina_stream_poses_total{outcome="refused"}"#), 1.0);
        drop(client);
    });
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(value(&metrics(&service), "retina_streams"), 0.0);
}

#[test]
fn about_says_what_is_allowed() {
    let service = Running::start(&["--threads", "2", "--queue", "9", "--max-wait-ms", "70", "--batch-poses", "12"]);
    let mut response = agent().get(service.url("/v1/about")).call().expect("answer");
    let about: serde_json::Value =
        serde_json::from_str(&response.body_mut().read_to_string().expect("text")).expect("JSON");
    assert_matches("About", &about);
    assert_eq!(about["version"], env!("CARGO_PKG_VERSION"));
    let limits = &about["limits"];
    for (name, expected) in [("threads", 2), ("queue", 9), ("max_wait_ms", 70), ("batch_poses", 12), ("streams", 64)] {
        assert_eq!(limits[name], expected, "{name}");
    }
    assert_eq!(about["effects"].as_array().map(Vec::len), Some(retina_core::effects::EFFECT_NAMES.len()));
}

/// A file of settings that is deleted when dropped.
struct Settings(PathBuf);

impl Settings {
    fn new(name: &str, text: &str) -> Self {
        let path = std::env::temp_dir().join(format!("retina-{}-{name}.toml", std::process::id()));
        fs::write(&path, text).expect("file");
        Self(path)
    }

    fn read(&self, words: &[&str]) -> Result<CommandLine, String> {
        let path = self.0.to_str().expect("UTF-8");
        let file = ["--config", path];
        let words = ["retina-server"].iter().chain(words).chain(&file);
        CommandLine::read(words).map_err(|error| error.to_string())
    }
}

impl Drop for Settings {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn a_file_lies_under_the_command_line() {
    let file = Settings::new(
        "whole",
        "threads = 3\nqueue = 11\nlog = \"json\"\nlisten = \"127.0.0.1:0\"\ntoken = [\"0123456789abcdef\", \"fedcba9876543210\"]\n",
    );
    let config = file.read(&["--queue", "5"]).expect("settings").config;
    assert_eq!((config.threads, config.queue, config.listen.port()), (Some(3), 5, 0));
    assert_eq!(config.tokens, ["0123456789abcdef", "fedcba9876543210"]);
    assert_eq!(config.streams, 64, "what nobody says is the default");
    let serve = file.read(&["serve"]).expect("settings").command;
    assert!(matches!(serve, Some(Command::Serve(config)) if config.queue == 11));
    assert!(CommandLine::read(["retina-server", "predict", "-"]).is_ok());
}

#[test]
fn a_file_that_is_wrong_is_refused_by_name() {
    let cases = [
        ("treads = 3", "treads"),
        ("threads = 0", "threads"),
        ("threads = \"many\"", "threads"),
        ("queue = 1.5", "queue"),
        ("log = \"loud\"", "log"),
        ("token = [\"short\"]", "token"),
        ("cors-origin = [\"*\"]", "cors-origin"),
        ("config = \"other.toml\"", "config"),
        ("threads = ", "threads"),
    ];
    for (index, (text, name)) in cases.into_iter().enumerate() {
        let file = Settings::new(&format!("wrong-{index}"), text);
        let error = file.read(&[]).expect_err(text);
        assert!(error.contains(name) && error.contains(file.0.to_str().expect("UTF-8")), "{text}: {error}");
    }
    let error = CommandLine::read(["retina-server", "--config", "/nowhere/settings.toml"]).expect_err("no file");
    assert!(error.to_string().contains("/nowhere/settings.toml"));
}

#[test]
fn the_readme_has_every_setting() {
    let readme = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md")).expect("README");
    let table = table::settings();
    assert!(table.lines().count() > 15, "{table}");
    assert!(
        readme.contains(&table),
        "the table of settings is not the one that `retina-server settings` prints:\n{table}"
    );
}

#[test]
fn ready_means_that_the_first_request_is_as_quick_as_the_next() {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let total = || {
        let (status, _, body) = service.predict(&agent, &request("coarse"));
        assert_eq!(status, 200, "{body}");
        let answer: serde_json::Value = serde_json::from_str(&body).expect("JSON");
        answer["time_us"]["total"].as_f64().expect("number")
    };
    let first = total();
    let mut later: Vec<f64> = (0..9).map(|_| total()).collect();
    later.sort_by(f64::total_cmp);
    // What readiness waits for, topology and symbolic factorisation, takes ten times a prediction.
    assert!(first < 4.0 * later[4], "the first took {first} µs, the median of the others is {} µs", later[4]);
}

#[test]
fn a_service_that_stops_is_not_ready() {
    let state = state(&["--threads", "1"]);
    while state.ready().is_err() {
        std::thread::sleep(Duration::from_millis(10));
    }
    runtime().block_on(state.end_streams());
    assert!(state.ready().is_err_and(|problem| problem.detail.contains("stopping")));
}

#[test]
fn a_request_id_is_kept_or_given() {
    let service = Running::start(&["--threads", "1"]);
    let get = || agent().get(service.url("/healthz"));
    let kept = get().header("x-request-id", "from-the-client").call().expect("answer");
    assert_eq!(kept.headers()["x-request-id"], "from-the-client");
    let (one, other) = (get().call().expect("answer"), get().call().expect("answer"));
    assert_ne!(one.headers()["x-request-id"], other.headers()["x-request-id"]);
    let refused = service.predict(&agent(), &with(request("linear"), "/force_mn", json!(0)));
    assert_eq!(refused.0, 422);
}
