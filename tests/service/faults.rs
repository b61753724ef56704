//! Clients that are slow or half gone, jobs that panic, and the end by signal.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use crate::harness::{Running, agent, request};

/// Reads what comes until the connection ends; panics if it does not end in time.
fn until_closed(mut connection: TcpStream, patience: Duration) -> String {
    connection.set_read_timeout(Some(patience)).expect("timeout");
    let mut answer = Vec::new();
    match connection.read_to_end(&mut answer) {
        Err(error) if error.kind() != std::io::ErrorKind::ConnectionReset => panic!("still open: {error}"),
        _ => String::from_utf8_lossy(&answer).into_owned(),
    }
}

#[test]
fn slow_clients_hold_nothing_up_and_are_closed() {
    let service = Running::start(&["--threads", "1", "--connection-idle-ms", "1500", "--body-limit-ms", "1500"]);
    let half_open: Vec<TcpStream> = (0..60).map(|_| TcpStream::connect(service.address).expect("connection")).collect();
    let mut half_headed: Vec<TcpStream> =
        (0..60).map(|_| TcpStream::connect(service.address).expect("connection")).collect();
    let half_bodied: Vec<TcpStream> = (0..60)
        .map(|_| {
            let mut connection = TcpStream::connect(service.address).expect("connection");
            let head = "POST /v1/predict HTTP/1.1\r\nhost: a\r\ncontent-type: application/json\r\ncontent-length: 100\r\n\r\n{";
            connection.write_all(head.as_bytes()).expect("head");
            connection
        })
        .collect();
    // A byte at a time keeps no connection alive: the whole head must be there in time.
    for piece in "GET / HT".as_bytes().chunks(1) {
        for connection in &mut half_headed {
            connection.write_all(piece).expect("a byte");
        }
        let started = Instant::now();
        assert_eq!(service.predict(&agent(), &request("linear")).0, 200);
        assert!(started.elapsed() < Duration::from_secs(1), "waited {:?} behind slow clients", started.elapsed());
        thread::sleep(Duration::from_millis(50));
    }
    let patience = Duration::from_secs(10);
    half_open.into_iter().for_each(|connection| assert_eq!(until_closed(connection, patience), ""));
    half_headed.into_iter().for_each(|connection| assert!(!until_closed(connection, patience).contains(" 200 ")));
    for connection in half_bodied {
        let answer = until_closed(connection, patience);
        assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("/problems/request-timeout"), "{answer}");
    }
}

#[test]
fn no_more_connections_than_allowed_are_served_at_once() {
    let service = Running::start(&["--threads", "1", "--connections", "4", "--connection-idle-ms", "3000"]);
    // What the harness asked with may still be kept open; its places come back with the idle time.
    let held: Vec<TcpStream> = (0..4).map(|_| TcpStream::connect(service.address).expect("connection")).collect();
    thread::sleep(Duration::from_millis(200));
    let started = Instant::now();
    assert_eq!(service.predict(&agent(), &request("linear")).0, 200, "a place comes free");
    let waited = started.elapsed();
    assert!(waited > Duration::from_secs(1), "served beside four others after {waited:?}");
    drop(held);
}

#[test]
fn a_client_that_reads_slowly_slows_only_itself() {
    let service = Running::start(&["--threads", "1"]);
    let poses: Vec<_> =
        (0..1000).map(|_| serde_json::json!({"needle": {"tip_mm": [0, 0, 0]}, "force_mn": [0, 0, -0.3]})).collect();
    let body = serde_json::json!({"poses": poses, "accuracy": {"level": "linear"}}).to_string();
    let mut slow = TcpStream::connect(service.address).expect("connection");
    let head = format!(
        "POST /v1/predict/batch HTTP/1.1\r\nhost: a\r\nconnection: close\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    slow.write_all(head.as_bytes()).and_then(|()| slow.write_all(body.as_bytes())).expect("request");
    for _ in 0..20 {
        let started = Instant::now();
        assert_eq!(service.predict(&agent(), &request("linear")).0, 200);
        assert!(started.elapsed() < Duration::from_secs(1), "waited {:?}", started.elapsed());
        thread::sleep(Duration::from_millis(20));
    }
    let mut reader = BufReader::new(slow);
    let (mut line, mut length) = (String::new(), 0);
    while reader.read_line(&mut line).expect("line") > 0 {
        length += line.len();
        line.clear();
    }
    assert!(length > 1000 * 5000, "{length} bytes: the whole answer came in the end");
}

#[cfg(unix)]
#[test]
fn the_program_ends_in_order_when_it_is_told_to() {
    let program = env!("CARGO_BIN_EXE_serve");
    let mut child = std::process::Command::new(program)
        .args(["--listen", "127.0.0.1:0", "--threads", "1", "--log", "json"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("program");
    let mut log = BufReader::new(child.stderr.take().expect("log"));
    let mut line = String::new();
    while !line.contains("listening on http://") {
        line.clear();
        assert!(log.read_line(&mut line).expect("log") > 0, "the program ended");
    }
    let address = line.split("http://").nth(1).and_then(|rest| rest.split(',').next()).expect("address").to_owned();
    let mut connection = TcpStream::connect(&address).expect("connection");
    let body = request("reference").to_string();
    let head = format!(
        "POST /v1/predict HTTP/1.1\r\nhost: a\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    );
    connection.write_all(head.as_bytes()).expect("request");
    thread::sleep(Duration::from_millis(300));
    let told = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill");
    assert!(told.success());
    let mut answer = String::new();
    connection.read_to_string(&mut answer).expect("answer");
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    assert!(child.wait().expect("end").success());
}
