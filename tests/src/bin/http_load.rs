//! How many predictions a second the service gives over HTTP, and how long each takes: `cargo run --release -p retina-tests --bin http_load
//! [-- LEVEL CONNECTIONS SECONDS TURNS RATE]` (`network`, 8, 2, 5, 2000). On loopback, the service in this process as the program runs it.
//!
//! Two turns in turns: clients that ask again as soon as they are answered, which fill the machine and say how many answers there are; and RATE requests a
//! second on a schedule, which say how long an answer takes, counted from the scheduled time. Beside these, in the same turns, an empty server that sends an answer of
//! the same length at once: what the clients, the sockets and the system take by themselves; and what other programs and the hypervisor took of the machine.
//!
//! With `RETINA_PEERS_PYTHON` set to a Python that has `tests/comparison/fastapi/requirements.txt`, a FastAPI server around the paper's network is asked the same
//! in turns with the service, so that what else runs on the machine meets both, and the ratio is printed.

use std::net::{SocketAddr, TcpListener};
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use retina_core::comparison::quantile;
use retina_tests::http_load::{Client, Measured, Pace, measure, post, start_empty};
use retina_tests::local_service;
use retina_tests::paper_network::displacement_um;
use serde_json::{Value, json};

/// Most connections, seconds and turns, so that no argument makes a run without end.
const MOST: (usize, f64, usize) = (512, 60.0, 100);
/// Most requests a second on a schedule.
const MOST_A_SECOND: f64 = 1e6;
/// Requests that are told apart.
const REQUESTS: usize = 256;
/// The goal at level `network` with 8 connections: answers a second; p50 and p99 (ms) when so many are asked for.
const GOAL: (f64, f64, f64) = (2000.0, 1.0, 3.0);
/// How many times the requests a second of the FastAPI server are the goal.
const TIMES: f64 = 20.0;
/// Two evaluations of one network in 32 bits are no further apart than this (µm).
const SAME_UM: f64 = 0.1;
/// How long the FastAPI server may take to start.
const PATIENCE: Duration = Duration::from_secs(60);

fn main() {
    let argument = |index: usize, usual: &str| std::env::args().nth(index).unwrap_or(usual.to_owned());
    let level = argument(1, "network");
    let connections = argument(2, "8").parse::<usize>().expect("CONNECTIONS").clamp(1, MOST.0);
    let turn = Duration::from_secs_f64(argument(3, "2").parse::<f64>().expect("SECONDS").clamp(0.1, MOST.1));
    let turns = argument(4, "5").parse::<usize>().expect("TURNS").clamp(1, MOST.2);
    let rate = argument(5, "2000").parse::<f64>().expect("RATE").clamp(1.0, MOST_A_SECOND);
    let began = Instant::now();
    let ours = local_service::start(&[]).expect("service");
    println!("ready {:.2} s after the start", began.elapsed().as_secs_f64());
    let theirs = std::env::var("RETINA_PEERS_PYTHON").ok().map(|python| FastApi::start(&python));
    if let Some(theirs) = &theirs {
        let apart_um = apart_um(theirs.address);
        println!("FastAPI's network and core's are {apart_um:.4} µm apart");
        assert!(apart_um <= SAME_UM, "another network");
    }

    // A little elsewhere each time; both are asked the same.
    let bodies: Vec<String> = (0..REQUESTS)
        .map(|index| {
            let x = 0.3 * (index as f64 * 0.618).fract() - 0.15;
            json!({"needle": {"tip_mm": [x, -0.05, 0.0]}, "force_mn": [0.0, 0.0, -0.4], "accuracy": {"level": level}})
                .to_string()
        })
        .collect();
    let requests =
        |address: SocketAddr| bodies.iter().map(|body| post(address, "/v1/predict", body)).collect::<Vec<_>>();
    let ask = |address: SocketAddr, pace: Pace| {
        measure(address, &requests(address), connections, turn, pace).expect("answers")
    };
    let empty = start_empty(&answer_to(ours, &bodies[0])).expect("empty server");
    let (mut mine, mut scheduled, mut floor, mut other) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for _ in 0..turns {
        mine.push(ask(ours, Pace::Answered));
        scheduled.push(ask(ours, Pace::Scheduled(rate)));
        floor.push(ask(empty, Pace::Scheduled(rate)));
        other.extend(theirs.as_ref().map(|theirs| ask(theirs.address, Pace::Answered)));
    }
    println!("{level}, {connections} connections, {turns} turns of {} s, medians over the turns", turn.as_secs_f64());
    let told = |name: &str, turns: &[Measured]| {
        let of = |pick: fn(&Measured) -> f64| {
            let mut values: Vec<f64> = turns.iter().map(pick).collect();
            values.sort_by(f64::total_cmp);
            quantile(&values, 0.5)
        };
        let measured = Measured {
            per_second: of(|m| m.per_second),
            cpu_us: of(|m| m.cpu_us),
            p50_ms: of(|m| m.p50_ms),
            p99_ms: of(|m| m.p99_ms),
            others_share: of(|m| m.others_share),
            stolen_share: of(|m| m.stolen_share),
        };
        let Measured { per_second, p50_ms, p99_ms, .. } = measured;
        println!("{name}: {per_second:.0} answers a second; ms: p50 {p50_ms:.3}, p99 {p99_ms:.3}");
        measured
    };
    let mine_told = told("the service", &mine);
    println!("processor time of an answer, service and clients together: {:.0} µs", mine_told.cpu_us);
    let word = |kept: bool| if kept { "kept" } else { "not kept" };
    let (goal, goal_p50_ms, goal_p99_ms) = GOAL;
    println!("{goal} a second: {}", word(mine_told.per_second >= goal));
    let scheduled = told(&format!("{rate} a second on a schedule"), &scheduled);
    let kept = scheduled.p50_ms <= goal_p50_ms && scheduled.p99_ms <= goal_p99_ms;
    println!("p50 of {goal_p50_ms} ms and p99 of {goal_p99_ms} ms or less, from the scheduled time: {}", word(kept));
    println!("processor time of an answer, service and clients together: {:.0} µs", scheduled.cpu_us);
    println!(
        "of the machine's time meanwhile: {:.1} % other programs, {:.1} % the hypervisor",
        100.0 * scheduled.others_share,
        100.0 * scheduled.stolen_share
    );
    let floor = told("an empty server on the same schedule", &floor);
    println!("processor time of an answer, empty server and clients together: {:.0} µs", floor.cpu_us);
    if !other.is_empty() {
        told("FastAPI", &other);
        let mut ratios: Vec<f64> =
            mine.iter().zip(&other).map(|(mine, other)| mine.per_second / other.per_second).collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = quantile(&ratios, 0.5);
        println!(
            "times the answers of FastAPI, turn by turn: median {ratio:.1}, from {:.1} to {:.1}",
            ratios[0],
            ratios[ratios.len() - 1]
        );
        println!("{TIMES} times: {}", word(ratio >= TIMES));
    }
}

/// The body of the answer to one request.
fn answer_to(address: SocketAddr, body: &str) -> Vec<u8> {
    let mut text = Vec::new();
    let mut client = Client::connect(address).expect("connection");
    let status = client.ask(&post(address, "/v1/predict", body), &mut text).expect("answer");
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&text));
    text
}

/// How far the server's answer to one request is from that of the same network in core, at the worst node (µm).
fn apart_um(address: SocketAddr) -> f64 {
    let body = json!({"needle": {"tip_mm": [0.12, -0.05, 0.0]}, "force_mn": [0.0, 0.1, -0.8]}).to_string();
    let answer: Value = serde_json::from_slice(&answer_to(address, &body)).expect("JSON");
    let told: Vec<f64> = serde_json::from_value(answer["surface"]["displacement_um"].clone()).expect("numbers");
    let core = displacement_um(0.12, -0.05, Vector3::new(0.0, 0.1, -0.8));
    assert_eq!(told.len(), core.len());
    told.iter().zip(core).map(|(told, core)| (told - core).abs()).fold(0.0, f64::max)
}

/// A FastAPI server as a process; ends when dropped.
struct FastApi {
    process: Child,
    address: SocketAddr,
}

impl FastApi {
    fn start(python: &str) -> Self {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/comparison/fastapi/server.py");
        let free = TcpListener::bind("127.0.0.1:0").expect("port");
        let address = free.local_addr().expect("address");
        drop(free);
        let process =
            Command::new(python).arg("-B").arg(script).arg(address.port().to_string()).spawn().expect("Python");
        let server = Self { process, address };
        let began = Instant::now();
        while Client::connect(address).is_err() {
            assert!(began.elapsed() < PATIENCE, "the FastAPI server does not start");
            thread::sleep(Duration::from_millis(50));
        }
        server
    }
}

impl Drop for FastApi {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
