//! What HTTP costs on top of a prediction: `cargo run --release -p retina-tests --example http_overhead [linear|coarse|reference] [count]
//! [--record FILE.rrd]`. Whatever follows the count is the service's command line; to record needs `--features rerun`.
//!
//! One kept connection on loopback, one request after the other, the service in this process with one numerical thread. The overhead of
//! a request is its round trip as the client sees it less the time that the answer says the core took (all stages but `queue`, `read`
//! and `prepare`); so it holds both ways over the socket, the queue, reading, writing and finding the scene.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
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
    for index in 0..count + count / 10 {
        // A little elsewhere each time, so that nothing is answered from memory.
        let x = 0.3 * ((index as f64) * 0.618).fract() - 0.15;
        let body = json!({
            "needle": {"tip_mm": [x, -0.05, 0.0]}, "force_mn": [0.0, 0.0, -0.4], "accuracy": {"level": level},
        })
        .to_string();
        let started = Instant::now();
        let answer = exchange(&mut reader, &body);
        let round_trip = started.elapsed().as_nanos() as f64 * 1e-3;
        // The first tenth warms up.
        if index >= count / 10 {
            let answer: Value = serde_json::from_slice(&answer).expect("JSON");
            let stages = answer["time_us"]["stages"].as_object().unwrap_or_else(|| panic!("{answer}"));
            let core = stages.iter().filter(|(name, _)| !OWN_STAGES.contains(&name.as_str()));
            let core: f64 = core.filter_map(|(_, time)| time.as_f64()).sum();
            queues.push(stages["queue"].as_f64().expect("number"));
            reads.push(stages["read"].as_f64().expect("number"));
            round_trips.push(round_trip);
            overheads.push(round_trip - core);
        }
    }
    println!("{level}, {count} requests on one kept connection, µs");
    println!("round trip: {}", summary(&mut round_trips));
    println!("overhead:   {}", summary(&mut overheads));
    println!("  of it queue: {}", summary(&mut queues));
    println!("  of it read:  {}", summary(&mut reads));
    if let Some(recorder) = recorder {
        println!("recording:  {:?}", recorder.finish(Duration::from_secs(60)));
    }
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

/// Sends one request and reads the whole answer; panics unless it is a success.
fn exchange(connection: &mut BufReader<TcpStream>, body: &str) -> Vec<u8> {
    let request = format!(
        "POST /v1/predict HTTP/1.1\r\nhost: retina\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    );
    connection.get_mut().write_all(request.as_bytes()).expect("request");
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
