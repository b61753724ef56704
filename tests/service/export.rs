//! Spans of requests at an OpenTelemetry collector: here a socket that keeps what it is sent.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpListener;
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use retina_tests::spawned::Spawned;

use crate::harness::agent;

/// A collector on a free port: its address, and each request as its first line and its body.
pub fn collector() -> (String, Receiver<(String, Vec<u8>)>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("port");
    let address = format!("http://{}", listener.local_addr().expect("address"));
    let (sender, received) = channel();
    thread::spawn(move || {
        for connection in listener.incoming() {
            let mut reader = BufReader::new(connection.expect("connection"));
            let (mut first, mut length) = (String::new(), 0);
            reader.read_line(&mut first).expect("request");
            loop {
                let mut line = String::new();
                reader.read_line(&mut line).expect("header");
                if let Some(value) = line.to_ascii_lowercase().strip_prefix("content-length:") {
                    length = value.trim().parse().expect("length");
                }
                if line.trim().is_empty() {
                    break;
                }
            }
            let mut body = vec![0; length];
            reader.read_exact(&mut body).expect("body");
            reader
                .get_mut()
                .write_all(b"HTTP/1.1 200 OK\r\nconnection: close\r\ncontent-length: 0\r\n\r\n")
                .expect("answer");
            if sender.send((first, body)).is_err() {
                return;
            }
        }
    });
    (address, received)
}

pub fn contains(body: &[u8], part: &[u8]) -> bool {
    body.windows(part.len()).any(|window| window == part)
}

#[test]
fn the_span_of_a_request_comes_to_the_collector_under_the_callers_trace() {
    let (endpoint, received) = collector();
    let program = Path::new(env!("CARGO_BIN_EXE_serve"));
    let running = Spawned::start(program, &["--threads", "1", "--otlp-endpoint", &endpoint]).expect("program");
    let trace: [u8; 16] = *b"\x4b\xf9\x2f\x35\x77\xb3\x4d\xa6\xa3\xce\x92\x9d\x0e\x0e\x47\x36";
    let get = agent().get(running.url("/v1/levels")).header("x-request-id", "press-4711");
    let get = get.header("traceparent", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01");
    assert_eq!(get.call().expect("answer").status(), 200);
    let (first, body) = received.recv_timeout(Duration::from_secs(30)).expect("spans");
    assert!(first.starts_with("POST /v1/traces "), "{first}");
    for part in [&b"retina-server"[..], b"request", b"press-4711", b"/v1/levels", b"status", &trace] {
        assert!(contains(&body, part), "{} is not in the span", String::from_utf8_lossy(part));
    }
}

#[test]
fn a_collector_that_is_not_there_hurts_nobody() {
    let free = TcpListener::bind("127.0.0.1:0").expect("port").local_addr().expect("address");
    let program = Path::new(env!("CARGO_BIN_EXE_serve"));
    let running =
        Spawned::start(program, &["--threads", "1", "--otlp-endpoint", &format!("http://{free}")]).expect("program");
    for _ in 0..20 {
        assert_eq!(agent().get(running.url("/v1/levels")).call().expect("answer").status(), 200);
    }
    for wrong in ["https://127.0.0.1:4318", "nonsense"] {
        let refused = Spawned::start(program, &["--otlp-endpoint", wrong]).err().expect("refused");
        assert!(refused.to_string().contains("the program ended"), "{refused}");
    }
}
