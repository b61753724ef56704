//! The wall clock is set forwards and backwards under the program while it works: what it measures, keeps and promises does not depend on it.
//!
//! Needs libfaketime (Debian's `libfaketime`), which tells the program another time; `RETINA_FAKETIME` names the library and says that it must be there. Where
//! there is none the test says so and is not run.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use retina_tests::spawned::Spawned;
use retina_tests::stream_client::{Received, StreamClient};
use serde_json::{Value, json};

use crate::export::{collector, contains};
use crate::harness::{agent, get, request, runtime};
use crate::stored::durable::Folder;
use crate::stored::{call, id, prepared, shifted};

/// Far forwards, beyond what 32 bits of seconds hold; back to where clocks without a battery begin; and forwards again.
const STEPS: [(&str, &str); 3] =
    [("@2109-01-12 00:00:00", "2109"), ("@1970-01-02 00:00:00", "1970"), ("@2030-06-01 00:00:00", "2030")];
/// Steps of the sequence that is at work while the clock is set: some tenths of a second.
const SEQUENCE: usize = 30;

/// The library that lies about the time.
fn library() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("RETINA_FAKETIME") {
        let named = PathBuf::from(named);
        assert!(named.exists(), "RETINA_FAKETIME={} is not there", named.display());
        return Some(named);
    }
    let folders = fs::read_dir("/usr/lib").ok()?.flatten();
    folders.map(|entry| entry.path().join("faketime/libfaketimeMT.so.1")).find(|path| path.exists())
}

/// A clock that can be set, as a file that the library reads whenever the program asks for the time.
struct Clock {
    folder: Folder,
    library: String,
}

impl Clock {
    fn new(library: &Path) -> Self {
        let folder = Folder::new("clock");
        fs::create_dir_all(&folder.0).expect("folder");
        Self { folder, library: library.to_str().expect("UTF-8").to_owned() }
    }

    fn set(&self, time: &str) {
        // In one piece: the program may look at any moment.
        fs::write(self.folder.0.join("next"), format!("{time}\n")).expect("written");
        fs::rename(self.folder.0.join("next"), self.folder.0.join("time")).expect("renamed");
    }

    fn serve(&self, arguments: &[&str]) -> Spawned {
        let time = self.folder.0.join("time");
        let variables = [
            ("LD_PRELOAD", self.library.as_str()),
            ("FAKETIME_TIMESTAMP_FILE", time.to_str().expect("UTF-8")),
            ("FAKETIME_NO_CACHE", "1"),
            // A step of the wall clock leaves the monotonic one alone.
            ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
            ("TZ", "UTC"),
            ("OTEL_BSP_SCHEDULE_DELAY", "50"),
        ];
        let service = Spawned::start_among(&variables, Path::new(env!("CARGO_BIN_EXE_serve")), arguments);
        let service = service.expect("program");
        let patience = Instant::now() + Duration::from_secs(60);
        while call("GET", &service.url("/readyz"), None).0 != 200 {
            assert!(Instant::now() < patience, "not ready");
            thread::sleep(Duration::from_millis(20));
        }
        service
    }
}

/// The answer to a prediction, which took some time and no more than passed here.
fn surface(service: &Spawned, request: &Value) -> Value {
    let began = Instant::now();
    let (status, answer) = call("POST", &service.url("/v1/predict"), Some(request));
    assert_eq!(status, 200, "{answer}");
    let took_us = answer["time_us"]["total"].as_f64().expect("a time");
    assert!(took_us > 0.0 && took_us < began.elapsed().as_secs_f64() * 1e6, "{took_us} µs");
    answer["surface"].clone()
}

/// Sets the clock while a sequence is at work: the sequence comes to its end, and who is refused meanwhile is told to come back soon.
fn step_during_a_sequence(service: &Spawned, clock: &Clock, time: &str) {
    let steps: Vec<Value> = (1..=SEQUENCE)
        .map(|k| json!({"time_s": 0.1 * k as f64, "force_mn": [0.0, 0.0, -0.4 * k as f64 / SEQUENCE as f64]}))
        .collect();
    let sequence = json!({"needle": {"tip_mm": [0.1, -0.05, 0.0]}, "steps": steps}).to_string();
    let ask = || {
        let post = agent().post(service.url("/v1/simulate")).header("content-type", "application/json");
        post.send(&sequence).expect("answer")
    };
    let mut first = ask();
    clock.set(time);
    let second = ask();
    assert_eq!(second.status(), 503, "the only thread is at work");
    let seconds: u32 = second.headers()["retry-after"].to_str().expect("text").parse().expect("seconds");
    assert!((1..=60).contains(&seconds), "{seconds} s");
    let lines = first.body_mut().read_to_string().expect("body");
    let last: Value = serde_json::from_str(lines.lines().last().expect("a line")).expect("JSON");
    assert!(last.get("end").is_some() && lines.lines().count() == SEQUENCE + 2, "{last}");
}

/// When a pose of the stream was received, by the stream's own time (µs), and its answer.
fn pose(stream: &mut StreamClient, sequence: usize) -> (f64, Value) {
    runtime().block_on(async {
        let pose = json!({"pose": {"sequence": sequence, "tip_mm": [0.1, -0.05, 0.0], "force_mn": [0.0, 0.0, -0.4]}});
        stream.send(&pose).await.expect("sent");
        match stream.receive().await {
            Received::Text(message) => {
                let answer = &message["answer"];
                let received = answer["time_us"]["received"].as_f64().unwrap_or_else(|| panic!("{message}"));
                (received, answer["prediction"]["surface"].clone())
            }
            other => panic!("{other:?}"),
        }
    })
}

/// Seconds that the service says its predictions took together.
fn seconds_of_predictions(service: &Spawned) -> f64 {
    let text = call("GET", &service.url("/metrics"), None).1;
    let text = text.as_str().expect("text");
    let line = text.lines().find_map(|line| line.strip_prefix(r#"retina_request_seconds_sum{route="/v1/predict"} "#));
    line.expect("predictions").parse().expect("a number")
}

#[test]
fn the_clock_is_set_and_nothing_stops_or_is_lost() {
    let Some(library) = library() else {
        eprintln!("libfaketime is not here: not run");
        return;
    };
    let (clock, scenes) = (Clock::new(&library), Folder::new("clock-scenes"));
    clock.set("+0");
    let (endpoint, spans) = collector();
    let began = Instant::now();
    let service = clock.serve(&["--threads", "1", "--scene-store", scenes.text(), "--otlp-endpoint", &endpoint]);
    let predicted = ["linear", "coarse"].map(request);
    let before = predicted.each_ref().map(|request| surface(&service, request));
    let mut stream = runtime().block_on(async {
        let mut stream = StreamClient::connect(service.address.parse().expect("address")).await.expect("stream");
        stream.open(json!({"accuracy": {"level": "linear"}, "format": "json"})).await.expect("open");
        stream
    });
    let opened = Instant::now();
    let (mut received_us, streamed) = pose(&mut stream, 1);
    let mut stored = Vec::new();
    for (number, (time, year)) in STEPS.into_iter().enumerate() {
        step_during_a_sequence(&service, &clock, time);
        let marked = agent().get(service.url("/healthz")).header("x-request-id", format!("in-{year}"));
        let date = marked.call().expect("answer").headers()["date"].to_str().expect("text").to_owned();
        assert!(date.contains(&format!(" {year} ")), "set to {time}, the answer is of {date}");
        assert_eq!(predicted.each_ref().map(|request| surface(&service, request)), before, "{year}");
        let again = pose(&mut stream, number + 2);
        let passed_us = opened.elapsed().as_secs_f64() * 1e6;
        assert!(again.0 > received_us && again.0 < passed_us + 1e6, "{received_us}, {} of {passed_us} µs", again.0);
        assert_eq!(again.1, streamed, "{year}");
        received_us = again.0;
        let (status, told) = call("POST", &service.url("/v1/scenes"), Some(&shifted(0.1 * (number + 1) as f64)));
        assert_eq!(status, 201, "{told}");
        assert_eq!(prepared(&service.url(""), id(&told))["state"], "ready");
        stored.push(id(&told).to_owned());
        let list = call("GET", &service.url("/v1/scenes"), None).1;
        assert_eq!(list["store"]["scenes"], json!(stored.len()), "{list}");
    }
    let seconds = seconds_of_predictions(&service);
    assert!(seconds > 0.0 && seconds < began.elapsed().as_secs_f64(), "{seconds} s of predictions");
    let mut exported = Vec::new();
    for (_, year) in STEPS {
        while !contains(&exported, format!("in-{year}").as_bytes()) {
            let (_, body) = spans.recv_timeout(Duration::from_secs(20)).unwrap_or_else(|_| panic!("no span of {year}"));
            exported.extend(body);
        }
    }
    // Killed, and started at a time before some of the scenes were stored and after others.
    service.kill().expect("killed");
    clock.set("@1999-12-31 23:59:59");
    let service = clock.serve(&["--threads", "1", "--scene-store", scenes.text()]);
    for id in &stored {
        assert_eq!(prepared(&service.url(""), id)["state"], "ready");
    }
    assert_eq!(predicted.each_ref().map(|request| surface(&service, request)), before, "after the start");
}

#[test]
fn every_answer_has_the_date() {
    let before = SystemTime::now() - Duration::from_secs(1);
    for path in ["/healthz", "/no/such/page"] {
        let date = get(path).headers["date"].to_str().expect("text").to_owned();
        let date = httpdate::parse_http_date(&date).unwrap_or_else(|error| panic!("{path}, {date}: {error}"));
        assert!(date >= before && date <= SystemTime::now(), "{path}: {date:?}");
    }
}
