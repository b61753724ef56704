//! What HTTP costs on top of a prediction: `cargo run --release -p retina-tests --example http_overhead [linear|coarse|reference] [count]
//! [--record FILE.rrd]`. Whatever follows the count is the service's command line; to record needs `--features rerun`.
//!
//! One kept connection on loopback, one request after the other, the service in this process with one numerical thread. The overhead of
//! a request is its round trip as the client sees it less the time that the answer says the core took (all stages but `queue`, `read`
//! and `prepare`); so it holds both ways over the socket, the queue, reading, writing and finding the scene.
//!
//! Beside it the floor: the same client asks a server that only hands each request from one thread to another, which is busy for as long as the core was,
//! and sends an answer of the same length. That is what two threads, two sockets and waking them after such a pause take on this machine.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use clap::Parser as _;
use retina_server::config::CommandLine;
use retina_server::{App, AppState, recording, run};
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

/// Stages that are the service's and not the core's.
const OWN_STAGES: [&str; 3] = ["queue", "read", "prepare"];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let level = arguments.next().unwrap_or("linear".to_owned());
    let count: usize = arguments.next().map_or(2000, |count| count.parse().expect("count"));
    let words = ["retina-server", "--threads", "1"].map(str::to_owned).into_iter().chain(arguments);
    let config = CommandLine::parse_from(words).config;
    let recorder = config.recording().map(|destination| recording::start(&destination).expect("a recording"));
    let (sender, receiver) = std::sync::mpsc::channel();
    let service = App::start_recorded(&config, recorder.clone()).expect("threads");
    std::thread::spawn(move || serve(&sender, service));
    let address = receiver.recv().expect("address");

    let stream = TcpStream::connect(address).expect("connection");
    stream.set_nodelay(true).expect("nodelay");
    let mut reader = BufReader::new(stream);
    let (mut round_trips, mut overheads, mut queues, mut reads) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut cores, mut length) = (Vec::new(), 0);
    for index in 0..count + count / 10 {
        // A little elsewhere each time, so that nothing is answered from memory.
        let x = 0.3 * ((index as f64) * 0.618).fract() - 0.15;
        let body = body(x, &level);
        let started = Instant::now();
        let answer = exchange(&mut reader, &body);
        let round_trip = started.elapsed().as_nanos() as f64 * 1e-3;
        // The first tenth warms up.
        if index >= count / 10 {
            length = answer.len();
            let answer: Value = serde_json::from_slice(&answer).expect("JSON");
            let stages = answer["time_us"]["stages"].as_object().unwrap_or_else(|| panic!("{answer}"));
            let core = stages.iter().filter(|(name, _)| !OWN_STAGES.contains(&name.as_str()));
            let core: f64 = core.filter_map(|(_, time)| time.as_f64()).sum();
            queues.push(stages["queue"].as_f64().expect("number"));
            reads.push(stages["read"].as_f64().expect("number"));
            round_trips.push(round_trip);
            overheads.push(round_trip - core);
            cores.push(core);
        }
    }
    println!("{level}, {count} requests on one kept connection, µs");
    println!("round trip: {}", summary(&mut round_trips));
    println!("overhead:   {}", summary(&mut overheads));
    println!("  of it queue: {}", summary(&mut queues));
    println!("  of it read:  {}", summary(&mut reads));
    cores.sort_by(f64::total_cmp);
    println!("floor:      {}", summary(&mut floor(cores[cores.len() / 2], length, count, &body(0.0, &level))));
    if let Some(recorder) = recorder {
        println!("recording:  {:?}", recorder.finish(Duration::from_secs(60)));
    }
}

/// A request that presses at `x` (mm).
fn body(x: f64, level: &str) -> String {
    let needle = json!({"tip_mm": [x, -0.05, 0.0]});
    json!({"needle": needle, "force_mn": [0.0, 0.0, -0.4], "accuracy": {"level": level}}).to_string()
}

/// What `count` requests take beyond `busy_us` each (µs), of a server of two threads that answers so many bytes.
fn floor(busy_us: f64, length: usize, count: usize, body: &str) -> Vec<f64> {
    let (jobs, work) = std::sync::mpsc::channel::<()>();
    let (results, done) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for () in work {
            let began = Instant::now();
            while began.elapsed().as_secs_f64() * 1e6 < busy_us {
                std::hint::spin_loop();
            }
            results.send(vec![b'0'; length]).expect("talking thread");
        }
    });
    let listener = TcpListener::bind("127.0.0.1:0").expect("port");
    let address = listener.local_addr().expect("address");
    let expected = request(body).len();
    std::thread::spawn(move || {
        let (mut socket, _) = listener.accept().expect("client");
        socket.set_nodelay(true).expect("nodelay");
        let mut asked = vec![0; expected];
        // Until the client goes.
        while socket.read_exact(&mut asked).is_ok() {
            jobs.send(()).expect("busy thread");
            let answer = done.recv().expect("busy thread");
            let head = format!("HTTP/1.1 200 OK\r\ncontent-length: {length}\r\n\r\n");
            socket.write_all(&[head.as_bytes(), &answer].concat()).expect("answer");
        }
    });
    let stream = TcpStream::connect(address).expect("connection");
    stream.set_nodelay(true).expect("nodelay");
    let mut reader = BufReader::new(stream);
    let mut beyond_us = Vec::new();
    for _ in 0..count {
        let started = Instant::now();
        exchange(&mut reader, body);
        beyond_us.push(started.elapsed().as_secs_f64() * 1e6 - busy_us);
    }
    beyond_us
}

/// The service as the program runs it: one thread that talks, one that computes.
fn serve(bound: &Sender<SocketAddr>, service: AppState) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("runtime");
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("port");
        bound.send(listener.local_addr().expect("address")).expect("main thread");
        run(listener, service, CancellationToken::new()).await.expect("service");
    });
}

/// The text of a request.
fn request(body: &str) -> String {
    let length = body.len();
    format!(
        "POST /v1/predict HTTP/1.1\r\nhost: retina\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n{body}"
    )
}

/// Sends one request and reads the whole answer; panics unless it is a success.
fn exchange(connection: &mut BufReader<TcpStream>, body: &str) -> Vec<u8> {
    connection.get_mut().write_all(request(body).as_bytes()).expect("request");
    let (mut line, mut length, mut head) = (String::new(), 0, String::new());
    while connection.read_line(&mut line).expect("head") > 2 {
        let field = line.split_once(": ");
        if let Some((_, value)) = field.filter(|(name, _)| name.eq_ignore_ascii_case("content-length")) {
            length = value.trim().parse().expect("length");
        }
        head.push_str(&line);
        line.clear();
    }
    let mut answer = vec![0; length];
    connection.read_exact(&mut answer).expect("body");
    assert!(head.starts_with("HTTP/1.1 200"), "{head}{}", String::from_utf8_lossy(&answer));
    answer
}

fn summary(times_us: &mut [f64]) -> String {
    times_us.sort_by(f64::total_cmp);
    let at = |share: f64| times_us[((times_us.len() - 1) as f64 * share) as usize];
    format!("median {:.0}, p95 {:.0}, p99 {:.0}, largest {:.0}", at(0.5), at(0.95), at(0.99), at(1.0))
}
