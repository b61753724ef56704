//! A service asked for more than it can do: how much it still does, and how long those wait who are let in.
//!
//! Capacity is measured with clients that wait for each answer, overload with requests that come at a fixed rate whatever is answered. Both
//! run in turn several times, because the machine may be busy with something else in either.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use retina_core::comparison::quantile;
use serde_json::{Value, json};

/// What is asked of whom.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// The service.
    pub address: SocketAddr,
    /// How long each turn takes.
    pub turn: Duration,
    /// Turns of each kind.
    pub turns: usize,
    /// Requests that come, in capacities.
    pub times_capacity: f64,
    /// Clients that send in overload; more than can be in flight.
    pub clients: usize,
}

/// One turn of each kind.
#[derive(Clone, Debug, Default)]
pub struct Turn {
    /// Answers a second of clients that wait.
    pub capacity: f64,
    /// 99 of 100 such answers come within this time (ms).
    pub calm_p99_ms: f64,
    /// Share of that time in which the one numerical thread worked on them.
    pub calm_useful: f64,
    /// Answers a second in overload.
    pub goodput: f64,
    /// 99 of 100 of them come within this time (ms).
    pub p99_ms: f64,
    /// Share of that time in which the one numerical thread worked on answers that were delivered. Over `calm_useful` it is what goodput is of
    /// capacity, however fast the machine is in either turn.
    pub useful: f64,
    /// The longest that one of them waited for a thread, by the service's clock (ms).
    pub longest_queue_ms: f64,
    /// Requests sent in overload.
    pub sent: usize,
    /// Requests refused, each with the time to come back.
    pub refused: usize,
    /// Half of the refusals come within this time (ms).
    pub refused_p50_ms: f64,
    /// 99 of 100 refusals come within this time (ms).
    pub refused_p99_ms: f64,
    /// Whatever else came back.
    pub other: Vec<String>,
}

/// What came back to one request.
enum Reply {
    Answered { ms: f64, queue_ms: f64, work_ms: f64 },
    Refused { ms: f64 },
    Other(String),
}

fn ask(agent: &ureq::Agent, address: SocketAddr, index: u64) -> Reply {
    // A little elsewhere each time.
    let x = 0.3 * (index as f64 * 0.618).fract() - 0.15;
    let body =
        json!({"needle": {"tip_mm": [x, -0.05, 0.0]}, "force_mn": [0.0, 0.0, -0.4], "accuracy": {"level": "coarse"}});
    let started = Instant::now();
    let post = agent.post(format!("http://{address}/v1/predict")).header("content-type", "application/json");
    let mut response = match post.send(body.to_string()) {
        Ok(response) => response,
        Err(error) => return Reply::Other(error.to_string()),
    };
    let (status, again) = (response.status().as_u16(), response.headers().get("retry-after").is_some());
    let text = response.body_mut().read_to_string().unwrap_or_default();
    let ms = started.elapsed().as_secs_f64() * 1e3;
    match (status, again) {
        (200, _) => {
            let answer: Value = serde_json::from_str(&text).unwrap_or_default();
            let time = &answer["time_us"];
            let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN) * 1e-3;
            let queue_ms = number(&time["stages"]["queue"]);
            Reply::Answered { ms, queue_ms, work_ms: number(&time["total"]) - queue_ms }
        }
        (503, true) => Reply::Refused { ms },
        _ => Reply::Other(format!("{status}: {text}")),
    }
}

fn agent() -> ureq::Agent {
    ureq::Agent::config_builder().http_status_as_error(false).build().into()
}

/// Two clients that wait for each answer.
fn calm(plan: &Plan, turn: &mut Turn) {
    let (until, counter) = (Instant::now() + plan.turn, AtomicU64::new(0));
    let client = || {
        let (agent, mut times) = (agent(), Vec::new());
        while Instant::now() < until {
            let index = counter.fetch_add(1, Ordering::Relaxed);
            if let Reply::Answered { ms, work_ms, .. } = ask(&agent, plan.address, index) {
                times.push((ms, work_ms));
            }
        }
        times
    };
    let started = Instant::now();
    let replies: Vec<(f64, f64)> = thread::scope(|scope| {
        let clients: Vec<_> = (0..2).map(|_| scope.spawn(client)).collect();
        clients.into_iter().flat_map(|client| client.join().unwrap_or_default()).collect()
    });
    let seconds = started.elapsed().as_secs_f64();
    let times: Vec<f64> = replies.iter().map(|(ms, _)| *ms).collect();
    turn.capacity = times.len() as f64 / seconds;
    turn.calm_p99_ms = quantile(&times, 0.99);
    turn.calm_useful = replies.iter().map(|(_, work_ms)| work_ms * 1e-3).sum::<f64>() / seconds;
}

/// Requests at a fixed rate.
fn flood(plan: &Plan, turn: &mut Turn) {
    let rate = plan.times_capacity * turn.capacity;
    let (started, counter) = (Instant::now(), AtomicU64::new(0));
    let client = || {
        let (agent, mut replies) = (agent(), Vec::new());
        loop {
            let index = counter.fetch_add(1, Ordering::Relaxed);
            let due = Duration::from_secs_f64(index as f64 / rate);
            if due > plan.turn {
                return replies;
            }
            thread::sleep(due.saturating_sub(started.elapsed()));
            replies.push(ask(&agent, plan.address, index));
        }
    };
    let replies: Vec<Reply> = thread::scope(|scope| {
        let clients: Vec<_> = (0..plan.clients).map(|_| scope.spawn(client)).collect();
        clients.into_iter().flat_map(|client| client.join().unwrap_or_default()).collect()
    });
    let seconds = started.elapsed().as_secs_f64();
    let (mut answered, mut refused) = (Vec::new(), Vec::new());
    turn.sent = replies.len();
    for reply in replies {
        match reply {
            Reply::Answered { ms, queue_ms, work_ms } => {
                answered.push(ms);
                turn.useful += work_ms * 1e-3 / seconds;
                turn.longest_queue_ms = turn.longest_queue_ms.max(queue_ms);
            }
            Reply::Refused { ms } => refused.push(ms),
            Reply::Other(what) => turn.other.push(what),
        }
    }
    turn.goodput = answered.len() as f64 / seconds;
    turn.p99_ms = quantile(&answered, 0.99);
    turn.refused = refused.len();
    turn.refused_p50_ms = quantile(&refused, 0.5);
    turn.refused_p99_ms = quantile(&refused, 0.99);
}

/// All turns.
pub fn measure(plan: &Plan) -> Vec<Turn> {
    let turn = |_| {
        let mut turn = Turn::default();
        calm(plan, &mut turn);
        flood(plan, &mut turn);
        turn
    };
    (0..plan.turns).map(turn).collect()
}

/// Median over the turns of what `of` says of each.
pub fn median(turns: &[Turn], of: impl Fn(&Turn) -> f64) -> f64 {
    let values: Vec<f64> = turns.iter().map(of).collect();
    quantile(&values, 0.5)
}
