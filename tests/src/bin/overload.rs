//! What a service does at three times its capacity: `cargo run --release -p retina-tests --bin overload [-- TURNS SECONDS MAX_WAIT_MS]` (3
//! turns of 3 seconds each for capacity and overload, 100 ms). Level `coarse`, one numerical thread, service and clients in one process.

use std::time::Duration;

use retina_tests::local_service;
use retina_tests::overload::{Plan, measure, median};

/// Most turns, and the longest (s).
const MOST: (usize, f64) = (20, 30.0);

fn main() {
    let argument = |index: usize, usual: &str| std::env::args().nth(index).unwrap_or(usual.to_owned());
    let turns: usize = argument(1, "3").parse::<usize>().expect("TURNS").clamp(1, MOST.0);
    let seconds: f64 = argument(2, "3").parse::<f64>().expect("SECONDS").clamp(0.5, MOST.1);
    let max_wait = argument(3, "100");
    let address = local_service::start(&["--threads", "1", "--max-wait-ms", &max_wait]).expect("service");
    let turn = Duration::from_secs_f64(seconds);
    let turns = measure(&Plan { address, turn, turns, times_capacity: 3.0, clients: 48 });
    println!(
        "| capacity /s | p99 ms | at three times that: answered /s | share of capacity | thread at useful work, before / then | p99 ms | longest in the queue ms | refused | refusal median / p99 ms | other |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for turn in &turns {
        println!(
            "| {:.1} | {:.1} | {:.1} | {:.2} | {:.2} / {:.2} | {:.1} | {:.1} | {} of {} | {:.1} / {:.1} | {} |",
            turn.capacity,
            turn.calm_p99_ms,
            turn.goodput,
            turn.goodput / turn.capacity,
            turn.calm_useful,
            turn.useful,
            turn.p99_ms,
            turn.longest_queue_ms,
            turn.refused,
            turn.sent,
            turn.refused_p50_ms,
            turn.refused_p99_ms,
            turn.other.len()
        );
    }
    let share = median(&turns, |turn| turn.goodput / turn.capacity);
    let useful = median(&turns, |turn| turn.useful / turn.calm_useful);
    println!("medians: {share:.2} of the capacity in answers, {useful:.2} in the thread's time");
}
