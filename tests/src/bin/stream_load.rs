//! How long a stream's answers take at a steady rate: `cargo run --release -p retina-tests --bin stream_load [-- RATE SECONDS LEVEL FORMAT
//! [memory]]` (1000 poses a second, 10 seconds, `linear`, `binary`).
//!
//! One connection on loopback, the service in this process as the program runs it. One thread of the client sends a pose whenever it is due,
//! whatever has come back; another reads. The time of an answer is from just before its pose was sent until it was read.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use retina_core::comparison::quantile;
use retina_tests::local_service;
use retina_tests::stream_client::{at_time, decode, encode_pose};
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::protocol::Role;
use tokio_tungstenite::tungstenite::{Message, WebSocket, client};

/// Longest run, so that no argument makes one without end (s).
const LONGEST_S: f64 = 60.0;
/// Highest rate (1/s).
const FASTEST: f64 = 100_000.0;
/// How long to wait for the last answers.
const PATIENCE: Duration = Duration::from_secs(2);
/// Radius of the circle that the needle goes along once a second (mm).
const CIRCLE_MM: f64 = 0.2;
/// Force that presses it (mN).
const FORCE_MN: f64 = 0.4;
/// The goal at level `linear`: answers a second and the time that 99 of 100 keep (ms).
const GOAL: (f64, f64) = (1000.0, 2.0);

/// What came back.
#[derive(Default)]
struct Seen {
    milliseconds: Vec<f64>,
    dropped: u64,
    problems: u64,
    last_us: f64,
}

fn main() {
    let argument = |index: usize, usual: &str| std::env::args().nth(index).unwrap_or(usual.to_owned());
    let rate: f64 = argument(1, "1000").parse::<f64>().expect("RATE").clamp(1.0, FASTEST);
    let seconds: f64 = argument(2, "10").parse::<f64>().expect("SECONDS").clamp(0.1, LONGEST_S);
    let (level, format) = (argument(3, "linear"), argument(4, "binary"));
    let address = local_service::start(&[]).expect("service");

    let stream = TcpStream::connect(address).expect("connection");
    stream.set_nodelay(true).expect("nodelay");
    stream.set_read_timeout(Some(PATIENCE)).expect("timeout");
    let (mut socket, _) = client(format!("ws://{address}/v1/stream"), stream).expect("handshake");
    let remembers = std::env::args().nth(5).is_some_and(|word| word == "memory");
    let mut session = json!({"accuracy": {"level": level}, "format": format});
    if remembers {
        session["memory"] = json!({"rehearsal": rehearsal()});
    }
    let open = json!({"open": session});
    socket.send(Message::text(open.to_string())).expect("sent");
    let opened = socket.read().expect("answer").to_string();
    assert!(opened.starts_with("{\"opened\""), "{opened}");

    // One side of the socket for each thread: nothing but answers comes before the first ping.
    let writer = socket.get_ref().try_clone().expect("socket");
    let writer = WebSocket::from_raw_socket(writer, Role::Client, None);
    let count = (rate * seconds) as u64;
    let began = Instant::now();
    let reading = std::thread::spawn(move || read(socket, began, count));
    send(writer, began, rate, count, remembers);
    let mut seen = reading.join().expect("reader");

    let answered = seen.milliseconds.len();
    seen.milliseconds.sort_by(f64::total_cmp);
    let at = |share: f64| quantile(&seen.milliseconds, share);
    let per_second = answered as f64 / (seen.last_us * 1e-6);
    let memory = if remembers { ", with memory" } else { "" };
    println!("{level}, {format}{memory}: {count} poses at {rate} a second on one connection");
    println!(
        "answered {answered} ({per_second:.0} a second), dropped {}, problems {}; ms: p50 {:.3}, p99 {:.3}, largest {:.3}",
        seen.dropped,
        seen.problems,
        at(0.5),
        at(0.99),
        at(1.0)
    );
    if remembers {
        return;
    }
    let kept = per_second >= 0.99 * GOAL.0 && at(0.99) <= GOAL.1;
    println!("1000 a second with p99 of 2 ms or less: {}", if kept { "kept" } else { "not kept" });
}

/// Where the needle is after so many seconds (mm).
fn place(seconds: f64) -> [f64; 3] {
    let angle = std::f64::consts::TAU * seconds;
    [CIRCLE_MM * angle.cos(), CIRCLE_MM * angle.sin(), 0.0]
}

/// A session with memory is planned from a quarter of the circle at a time.
fn rehearsal() -> Vec<Value> {
    let step = |quarter: i32| {
        let seconds = 0.25 * f64::from(quarter);
        json!({"time_s": seconds, "tip_mm": place(seconds), "force_mn": [0.0, 0.0, -FORCE_MN]})
    };
    (1..=4).map(step).collect()
}

fn send(mut socket: WebSocket<TcpStream>, began: Instant, rate: f64, count: u64, remembers: bool) {
    for index in 0..count {
        let due = Duration::from_secs_f64(index as f64 / rate);
        std::thread::sleep(due.saturating_sub(began.elapsed()));
        // A needle that circles at 1 Hz, so that no answer is the one before.
        let tip_mm = place(due.as_secs_f64()).map(|mm| mm as f32);
        let now_us = began.elapsed().as_secs_f64() * 1e6;
        let force_mn = [0.0, 0.0, -FORCE_MN as f32];
        let pose = encode_pose(index + 1, now_us, tip_mm, [0.0, 0.0, 0.0, 1.0], Some(force_mn));
        let pose = if remembers { at_time(pose, (index + 1) as f64 / rate) } else { pose };
        socket.send(Message::binary(pose)).expect("sent");
    }
}

/// Reads until the last pose is answered or nothing more comes.
fn read(mut socket: WebSocket<TcpStream>, began: Instant, count: u64) -> Seen {
    let mut seen = Seen::default();
    let mut last = 0;
    while last < count {
        let Ok(message) = socket.read() else { break };
        let now_us = began.elapsed().as_secs_f64() * 1e6;
        let (sequence, sent_us, dropped) = match message {
            Message::Binary(bytes) => {
                let answer = decode(&bytes).expect("an answer of the layout");
                (answer.sequence, answer.client_time_us, u64::from(answer.dropped))
            }
            Message::Text(text) => {
                let message: Value = serde_json::from_str(&text).expect("JSON");
                let answer = &message["answer"];
                match (answer["sequence"].as_u64(), answer["client_time_us"].as_f64(), answer["dropped"].as_u64()) {
                    (Some(sequence), Some(sent_us), Some(dropped)) => (sequence, sent_us, dropped),
                    _ => {
                        seen.problems += 1;
                        continue;
                    }
                }
            }
            _ => continue,
        };
        last = sequence;
        seen.dropped += dropped;
        seen.last_us = now_us;
        seen.milliseconds.push((now_us - sent_us) * 1e-3);
    }
    seen
}
