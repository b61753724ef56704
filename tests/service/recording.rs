//! A recording is a guest: it changes no answer, holds none up, and counts what it loses.

#[cfg(feature = "rerun")]
mod rrd;

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::body::{Body, to_bytes};
use axum::http::{Request, header};
use clap::Parser as _;
use retina_server::config::CommandLine;
use retina_server::problem::{Kind, Problem};
use retina_server::recording::{Exchange, Recorder, RecordingError, Sink, Totals};
use retina_server::{App, AppState, app};
use serde_json::json;
use tower::ServiceExt as _;

use crate::harness::{request, with};

/// How long any sink here may take to end.
const PATIENCE: Duration = Duration::from_secs(20);

/// Remembers in a line what it is given.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<String>>>);

impl Sink for Lines {
    fn write(&mut self, exchange: &Exchange, _dropped: u64) -> Result<(), RecordingError> {
        let outcome = match &exchange.outcome {
            Ok((request, prediction)) => {
                format!("{} {} nodes", request.level.name(), prediction.vertices.len())
            }
            Err(problem) => problem.kind.name().to_owned(),
        };
        self.0.lock().unwrap().push(format!("{} {outcome}: {}", exchange.number, exchange.asked));
        Ok(())
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        Ok(())
    }
}

/// Says when it begins to write, and then waits to be let go.
struct Stuck {
    began: Sender<()>,
    go: Receiver<()>,
}

impl Sink for Stuck {
    fn write(&mut self, _exchange: &Exchange, _dropped: u64) -> Result<(), RecordingError> {
        let _ = self.began.send(());
        let _ = self.go.recv();
        Ok(())
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        Ok(())
    }
}

/// Fails at every other exchange and at the end; panics at the one of this number.
struct Broken {
    panics_at: u64,
}

impl Sink for Broken {
    fn write(&mut self, exchange: &Exchange, _dropped: u64) -> Result<(), RecordingError> {
        assert!(exchange.number != self.panics_at, "as it was told");
        match exchange.number % 2 {
            0 => Err(RecordingError::Write("full".into())),
            _ => Ok(()),
        }
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        Err(RecordingError::Close("gone".into()))
    }
}

/// A service with two numerical threads and this recorder.
fn service(recorder: Option<Recorder>) -> AppState {
    let config = CommandLine::try_parse_from(["retina-server", "--threads", "2"]).expect("arguments").config;
    App::start_recorded(&config, recorder).expect("threads")
}

/// The answer's text without its times, which no two answers share.
fn ask(state: &AppState, body: String) -> String {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("runtime");
    runtime.block_on(async {
        let request = Request::post("/v1/predict").header(header::CONTENT_TYPE, "application/json");
        let request = request.body(Body::from(body)).expect("request");
        let response = app(state.clone()).oneshot(request).await.expect("infallible");
        let bytes = to_bytes(response.into_body(), usize::MAX).await.expect("body");
        let text = String::from_utf8(bytes.to_vec()).expect("UTF-8");
        match (text.find("\"time_us\""), text.find("\"warnings\"")) {
            (Some(from), Some(to)) if from < to => format!("{}{}", &text[..from], &text[to..]),
            _ => text,
        }
    })
}

fn questions() -> Vec<String> {
    let good = ["linear", "coarse"].map(request);
    let bad = with(request("linear"), "/needle/radius_mm", json!(-1));
    let mut questions: Vec<String> = good.iter().map(ToString::to_string).collect();
    questions.extend([bad.to_string(), "{".to_owned()]);
    questions
}

fn refuse(recorder: &Recorder) {
    let problem = Problem::new(Kind::Busy, "no");
    let returned = recorder.record(b"{}", Instant::now(), Err(problem.clone()));
    assert_eq!(returned, Err(problem));
}

#[test]
fn answers_are_the_same_bits_with_a_recording() {
    let lines = Lines::default();
    let recorder = Recorder::start(lines.clone(), 64).expect("thread");
    let broken = Recorder::start(Broken { panics_at: 3 }, 64).expect("thread");
    let plain = service(None);
    for recorded in [service(Some(recorder.clone())), service(Some(broken.clone()))] {
        for question in questions() {
            let answer = ask(&plain, question.clone());
            assert!(answer.len() > 50, "{answer}");
            assert_eq!(ask(&recorded, question), answer);
        }
    }
    let totals = recorder.finish(PATIENCE);
    assert_eq!(totals, Totals { written: 4, dropped: 0, failed: 0, closed: true });
    let lines = lines.0.lock().unwrap();
    let begins = ["1 linear 64 nodes: {", "2 coarse 64 nodes: {", "3 out-of-range: {", "4 malformed-json: {"];
    for (line, begin) in lines.iter().zip(begins) {
        assert!(line.starts_with(begin), "{line}");
    }
}

#[test]
fn a_full_queue_drops_and_counts() {
    let ((began, has_begun), (let_go, go)) = (channel(), channel());
    let recorder = Recorder::start(Stuck { began, go }, 2).expect("thread");
    refuse(&recorder);
    has_begun.recv_timeout(PATIENCE).expect("the sink is at work on the first, so the queue is empty");
    let started = Instant::now();
    (0..9).for_each(|_| refuse(&recorder));
    assert!(started.elapsed() < Duration::from_secs(1), "recording waited for its sink: {:?}", started.elapsed());
    (0..3).for_each(|_| let_go.send(()).expect("the sink waits"));
    let totals = recorder.finish(PATIENCE);
    assert_eq!(totals, Totals { written: 3, dropped: 7, failed: 0, closed: true });
}

#[test]
fn the_end_does_not_wait_for_ever() {
    let ((began, _has_begun), (_let_go, go)) = (channel(), channel());
    let recorder = Recorder::start(Stuck { began, go }, 1).expect("thread");
    (0..5).for_each(|_| refuse(&recorder));
    let started = Instant::now();
    let totals = recorder.finish(Duration::from_millis(200));
    assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
    assert!(!totals.closed && totals.dropped >= 3, "{totals:?}");
}

#[test]
fn what_a_sink_cannot_write_is_counted() {
    let recorder = Recorder::start(Broken { panics_at: u64::MAX }, 64).expect("thread");
    (0..7).for_each(|_| refuse(&recorder));
    assert_eq!(recorder.finish(PATIENCE), Totals { written: 4, dropped: 0, failed: 3, closed: false });
}

#[cfg(not(feature = "rerun"))]
#[test]
fn a_program_without_its_recorder_says_how_to_get_it() {
    use retina_server::recording::{Destination, start};
    let destination = Destination::File(std::env::temp_dir().join("never.rrd"));
    let Err(error) = start(&destination) else { panic!("nothing can be recorded without the feature") };
    assert!(matches!(error, RecordingError::NotBuilt));
    assert!(error.to_string().contains("cargo build --release --features rerun"), "{error}");
    assert!(!std::env::temp_dir().join("never.rrd").exists());
}

#[test]
fn a_review_has_one_destination() {
    let parse = |words: &[&str]| CommandLine::try_parse_from(["retina-server", "review"].iter().chain(words));
    assert!(parse(&["--save", "a.rrd"]).is_ok());
    assert!(parse(&[]).is_err(), "nowhere");
    assert!(parse(&["--save", "a.rrd", "--connect", "rerun+http://127.0.0.1:9876/proxy"]).is_err(), "two places");
    let error = parse(&["--save", "a.rrd", "--level", "reference"]).expect_err("nothing to compare").to_string();
    assert!(error.contains("linear, network, coarse, corrected"), "{error}");
    assert!(CommandLine::try_parse_from(["retina-server", "--record", "a.rrd", "--record-connect", "x"]).is_err());
}
