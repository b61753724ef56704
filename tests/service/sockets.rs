//! Over real sockets: connections that are kept, bodies that are too large, clients that go, and the end.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::harness::{Running, agent, request};

/// Writes a request's head and body on a bare connection.
fn begin(service: &Running, body: &str) -> TcpStream {
    let mut connection = TcpStream::connect(service.address).expect("connection");
    let length = body.len();
    let head = format!(
        "POST /v1/predict HTTP/1.1\r\nhost: retina\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n"
    );
    connection.write_all(head.as_bytes()).expect("head");
    connection.write_all(body.as_bytes()).expect("body");
    connection
}

#[test]
fn a_kept_connection_answers_again_and_again() {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let mut answers = (0..20).map(|_| {
        let (status, _, body) = service.predict(&agent, &request("linear"));
        assert_eq!(status, 200, "{body}");
        let mut answer: Value = serde_json::from_str(&body).expect("JSON");
        answer.as_object_mut().expect("object").remove("time_us");
        answer
    });
    let first = answers.next().expect("an answer");
    assert!(answers.all(|answer| answer == first));
}

#[test]
fn a_hundred_megabytes_are_refused_in_words() {
    let service = Running::start(&["--threads", "1"]);
    let mut connection = TcpStream::connect(service.address).expect("connection");
    let pieces = 1600;
    let piece = vec![b' '; 1 << 16];
    let head = format!(
        "POST /v1/predict HTTP/1.1\r\nhost: retina\r\ncontent-type: application/json\r\nconnection: close\r\ncontent-length: {}\r\n\r\n",
        pieces * piece.len()
    );
    connection.write_all(head.as_bytes()).expect("head");
    for _ in 0..pieces {
        connection.write_all(&piece).expect("the server reads on");
    }
    let mut answer = String::new();
    connection.read_to_string(&mut answer).expect("answer");
    assert!(answer.starts_with("HTTP/1.1 413"), "{answer}");
    assert!(answer.contains("/problems/body-too-large"), "{answer}");
}

#[test]
fn a_client_that_goes_frees_its_thread() {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let long = request("reference");
    let started = Instant::now();
    assert_eq!(service.predict(&agent, &long).0, 200);
    let whole = started.elapsed();
    let connection = begin(&service, &long.to_string());
    thread::sleep(whole / 10);
    drop(connection);
    let started = Instant::now();
    assert_eq!(service.predict(&agent, &request("linear")).0, 200);
    let waited = started.elapsed();
    assert!(waited < whole / 2, "waited {waited:?} behind work of {whole:?} that nobody wanted");
}

#[test]
fn the_end_waits_for_what_was_accepted() {
    let mut service = Running::start(&["--threads", "1"]);
    let mut connection = begin(&service, &request("reference").to_string());
    thread::sleep(Duration::from_millis(50));
    service.shutdown.cancel();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).expect("answer");
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    service.ended.take().expect("running").join().expect("the service ends in order");
    assert!(TcpStream::connect(service.address).is_err(), "connections are accepted after the end");
}
