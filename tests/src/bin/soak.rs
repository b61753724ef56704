//! The service under load for a long time: `cargo build --release -p retina-tests --bins && target/release/soak [MINUTES]` (10).
//!
//! The program as a process of its own, two numerical threads, a folder for scenes; five clients: two ask for predictions (every level but `reference`, random
//! poses, scenes by name, written out and stored, one in twenty malformed), one for batches, one streams 200 poses a second, one stores and deletes
//! scenes. Prints requests, faults (an answer of 500 or above that is not a refusal, a connection that broke), refusals, times, and the resident memory
//! at a tenth of the time, in the middle and at the end (Linux).

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use fastrand::Rng;
use retina_core::comparison::quantile;
use retina_tests::spawned::Spawned;
use retina_tests::stream_client::StreamClient;
use serde_json::{Value, json};

/// Longest run, minutes.
const LONGEST: f64 = 24.0 * 60.0;
/// Between two requests of a client, so that five of them do not fill the machine.
const PAUSE: Duration = Duration::from_millis(3);
/// Between two poses of the stream.
const POSE: Duration = Duration::from_millis(5);
/// Times of a kind that are kept, each in the place of a random earlier one once there are so many.
const KEPT: usize = 100_000;

#[derive(Default)]
struct Seen {
    answered: u64,
    refused: u64,
    faults: u64,
    milliseconds: Vec<f64>,
}

/// What the clients share.
struct Shared {
    url: String,
    stop: AtomicBool,
    seen: Mutex<BTreeMap<&'static str, Seen>>,
    stored: Mutex<Option<String>>,
    first_fault: Mutex<Option<String>>,
    number: AtomicU64,
}

impl Shared {
    fn goes_on(&self) -> bool {
        !self.stop.load(Ordering::Relaxed)
    }

    fn saw(&self, kind: &'static str, status: u16, took: Duration, what: impl FnOnce() -> String) {
        let mut all = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        let seen = all.entry(kind).or_default();
        match status {
            200..=299 => seen.answered += 1,
            // Too much work, or no room.
            400..=499 | 503 | 507 => seen.refused += 1,
            _ => {
                seen.faults += 1;
                let mut first = self.first_fault.lock().unwrap_or_else(PoisonError::into_inner);
                first.get_or_insert_with(|| format!("{kind}: {status} {}", what()));
            }
        }
        let milliseconds = took.as_secs_f64() * 1e3;
        if seen.milliseconds.len() < KEPT {
            seen.milliseconds.push(milliseconds);
        } else {
            seen.milliseconds[fastrand::usize(0..KEPT)] = milliseconds;
        }
    }

    /// Sends a request; status 0 for a connection that broke.
    fn send(&self, agent: &ureq::Agent, kind: &'static str, method: &str, path: &str, body: &str) -> Value {
        let started = Instant::now();
        let request = ureq::http::Request::builder().method(method).uri(format!("{}{path}", self.url));
        let request = request.header("content-type", "application/json").body(body.to_owned());
        let answer =
            request.map_err(ureq::Error::from).and_then(|request| agent.run(request)).and_then(|mut response| {
                let text = response.body_mut().with_config().limit(64 << 20).read_to_string()?;
                Ok((response.status().as_u16(), text))
            });
        let (status, text) = answer.unwrap_or_else(|error| (0, error.to_string()));
        self.saw(kind, status, started.elapsed(), || text.chars().take(300).collect());
        serde_json::from_str(&text).unwrap_or_default()
    }
}

fn agent() -> ureq::Agent {
    ureq::Agent::config_builder().http_status_as_error(false).build().into()
}

fn pose(rng: &mut Rng) -> Value {
    let at = |rng: &mut Rng| 0.6 * rng.f64() - 0.3;
    json!({"needle": {"tip_mm": [at(rng), at(rng), 0.0], "gauge": rng.choice(["41G", "27G", "25G"])},
        "force_mn": [0.2 * rng.f64() - 0.1, 0.0, -0.05 - 0.5 * rng.f64()]})
}

fn predictions(shared: &Shared, seed: u64) {
    let (mut rng, agent) = (Rng::with_seed(seed), agent());
    while shared.goes_on() {
        let mut body = pose(&mut rng);
        let stored = shared.stored.lock().unwrap_or_else(PoisonError::into_inner).clone();
        body["scene"] = match rng.u8(0..4) {
            0 => "fovea".into(),
            1 => json!({"tissue": {"retina": {"youngs_modulus_kpa": 10.0 + 20.0 * f64::from(rng.u8(0..100)) / 100.0}}}),
            2 => stored.map_or_else(|| "macula".into(), Value::from),
            _ => "macula".into(),
        };
        let (kind, level) = rng
            .choice([("linear", "linear"), ("network", "network"), ("coarse", "coarse"), ("corrected", "corrected")])
            .unwrap_or(("linear", "linear"));
        body["accuracy"] = json!({"level": level});
        let mut text = body.to_string();
        let malformed = rng.u8(0..20) == 0;
        if malformed {
            text.truncate(rng.usize(0..text.len()));
        }
        shared.send(&agent, if malformed { "malformed" } else { kind }, "POST", "/v1/predict", &text);
        thread::sleep(PAUSE);
    }
}

fn batches(shared: &Shared) {
    let (mut rng, agent) = (Rng::with_seed(99), agent());
    while shared.goes_on() {
        let poses: Vec<Value> = (0..50).map(|_| pose(&mut rng)).collect();
        let body = json!({"poses": poses, "accuracy": {"level": "linear"}}).to_string();
        shared.send(&agent, "batch of 50", "POST", "/v1/predict/batch", &body);
        thread::sleep(100 * PAUSE);
    }
}

fn scenes(shared: &Shared) {
    let agent = agent();
    while shared.goes_on() {
        let number = shared.number.fetch_add(1, Ordering::Relaxed);
        let scene =
            json!({"friction_coefficient": 0.0, "tissue": {"choroid": {"thickness_mm": 0.2 + 1e-6 * number as f64}}});
        let told = shared.send(&agent, "store", "POST", "/v1/scenes", &scene.to_string());
        let Some(id) = told["id"].as_str() else { continue };
        *shared.stored.lock().unwrap_or_else(PoisonError::into_inner) = Some(id.to_owned());
        for _ in 0..10 {
            thread::sleep(100 * PAUSE);
            shared.send(&agent, "list", "GET", "/v1/scenes", "");
        }
        *shared.stored.lock().unwrap_or_else(PoisonError::into_inner) = None;
        shared.send(&agent, "delete", "DELETE", &format!("/v1/scenes/{id}"), "");
    }
}

/// Streams of ten seconds each, one after the other.
async fn streams(shared: Arc<Shared>) {
    let address = shared.url.trim_start_matches("http://").parse().expect("address");
    while shared.goes_on() {
        let streamed = async {
            let mut client = StreamClient::connect(address).await.map_err(|error| error.to_string())?;
            client.open(json!({"accuracy": {"level": "linear"}, "format": "binary"})).await?;
            for sequence in 0..2000u64 {
                let started = Instant::now();
                let x = 0.3 * (sequence as f64 * 0.01).sin();
                client
                    .send(
                        &json!({"pose": {"sequence": sequence, "tip_mm": [x, 0.0, 0.0], "force_mn": [0.0, 0.0, -0.3]}}),
                    )
                    .await
                    .map_err(|error| error.to_string())?;
                client.receive().await;
                shared.saw("stream", 200, started.elapsed(), String::new);
                if !shared.goes_on() {
                    break;
                }
                tokio::time::sleep(POSE.saturating_sub(started.elapsed())).await;
            }
            Ok::<_, String>(())
        };
        if let Err(error) = streamed.await {
            shared.saw("stream", 0, Duration::ZERO, || error);
        }
    }
}

/// Resident memory of a process, MiB; `None` where the system does not say.
fn resident_mib(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<f64>().ok().map(|kib| kib / 1024.0)
}

fn main() {
    let minutes =
        std::env::args().nth(1).map_or(10.0, |text| text.parse::<f64>().expect("MINUTES")).clamp(0.05, LONGEST);
    let program: PathBuf =
        std::env::current_exe().expect("own path").with_file_name(format!("serve{}", std::env::consts::EXE_SUFFIX));
    let folder = std::env::temp_dir().join(format!("retina-soak-{}", std::process::id()));
    let arguments = ["--threads", "2", "--scene-store", folder.to_str().expect("UTF-8")];
    let service = Spawned::start(&program, &arguments).expect("the program `serve` beside this one");
    while !agent().get(service.url("/readyz")).call().is_ok_and(|answer| answer.status().as_u16() == 200) {
        thread::sleep(Duration::from_millis(50));
    }
    let shared = Arc::new(Shared {
        url: service.url(""),
        stop: AtomicBool::new(false),
        seen: Mutex::default(),
        stored: Mutex::default(),
        first_fault: Mutex::default(),
        number: AtomicU64::new(0),
    });
    let whole = Duration::from_secs_f64(60.0 * minutes);
    let process = service.child.id();
    let mut memory = Vec::new();
    thread::scope(|scope| {
        for seed in [1, 2] {
            let shared = &shared;
            scope.spawn(move || predictions(shared, seed));
        }
        scope.spawn(|| batches(&shared));
        scope.spawn(|| scenes(&shared));
        let streaming = Arc::clone(&shared);
        scope.spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("runtime");
            runtime.block_on(streams(streaming));
        });
        let began = Instant::now();
        for (share, name) in [(0.1, "a tenth of the time"), (0.5, "the middle"), (1.0, "the end")] {
            thread::sleep(whole.mul_f64(share).saturating_sub(began.elapsed()));
            memory.push((name, resident_mib(process)));
        }
        shared.stop.store(true, Ordering::Relaxed);
    });
    println!(
        "{minutes} minutes\n\n| what | answered | refused | faults | p50 ms | p99 ms |\n|---|---|---|---|---|---|"
    );
    let seen = shared.seen.lock().unwrap_or_else(PoisonError::into_inner);
    let mut total = [0; 3];
    for (kind, Seen { answered, refused, faults, milliseconds }) in &*seen {
        let time = |share| quantile(milliseconds, share);
        println!("| {kind} | {answered} | {refused} | {faults} | {:.2} | {:.2} |", time(0.5), time(0.99));
        total.iter_mut().zip([answered, refused, faults]).for_each(|(sum, count)| *sum += count);
    }
    println!(
        "\n{} requests and poses: {} answered, {} refused, {} faults",
        total.iter().sum::<u64>(),
        total[0],
        total[1],
        total[2]
    );
    if let Some(fault) = shared.first_fault.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
        println!("the first fault: {fault}");
    }
    let memory: Vec<String> = memory
        .iter()
        .map(|(name, mib)| format!("at {name} {}", mib.map_or("not told".to_owned(), |mib| format!("{mib:.1} MiB"))))
        .collect();
    println!("resident memory: {}", memory.join(", "));
    drop(service);
    let _ = std::fs::remove_dir_all(&folder);
}
