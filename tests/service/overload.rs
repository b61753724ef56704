//! More than the service can do, and answers that would come too late.

use std::sync::Barrier;
use std::thread;
use std::time::{Duration, Instant};

use retina_core::comparison::quantile;
use retina_tests::overload::{Plan, measure, median};
use serde_json::{Value, json};

use crate::harness::{Running, agent, request, with};

/// How long a request may wait, in predictions: enough that the queue is never empty by chance.
const MAX_WAIT_IN_PREDICTIONS: f64 = 8.0;

/// What a prediction at level `coarse` takes on this machine now, ms, the median of a few.
fn usual_ms() -> f64 {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let one = |_| {
        let started = Instant::now();
        assert_eq!(service.predict(&agent, &request("coarse")).0, 200);
        started.elapsed().as_secs_f64() * 1e3
    };
    quantile(&(0..15).map(one).collect::<Vec<_>>(), 0.5)
}

#[test]
fn at_three_times_its_capacity_the_service_does_its_work_and_refuses_the_rest_at_once() {
    let max_wait_ms = (MAX_WAIT_IN_PREDICTIONS * usual_ms()).ceil();
    let service = Running::start(&["--threads", "1", "--max-wait-ms", &max_wait_ms.to_string()]);
    let plan = Plan {
        address: service.address,
        turn: Duration::from_millis(1500),
        turns: 5,
        times_capacity: 3.0,
        clients: 48,
    };
    let turns = measure(&plan);
    for turn in &turns {
        assert!(turn.other.is_empty(), "{turn:#?}");
        // What is let in has not waited for longer, whatever the machine did; some milliseconds are the way from the check to the stopwatch.
        assert!(turn.longest_queue_ms < max_wait_ms + 5.0, "{turn:#?}");
    }
    let refused = median(&turns, |turn| turn.refused as f64 / turn.sent as f64);
    assert!(refused > 0.33, "{refused} refused, where two thirds cannot be done: {turns:#?}");
    // Goodput over capacity, both in time of the one thread: how fast the machine is in either turn does not count.
    let share = median(&turns, |turn| turn.useful / turn.calm_useful);
    assert!(share >= 0.9, "{share} of its capacity: {turns:#?}");
    // The bound on the wait and the slowest work, as clients see it that wait for each answer.
    let over = median(&turns, |turn| turn.p99_ms / (max_wait_ms + turn.calm_p99_ms));
    assert!(over <= 1.0, "{over} of the bound: {turns:#?}");
    let refusal = median(&turns, |turn| turn.refused_p50_ms);
    assert!(refusal < 0.25 * max_wait_ms, "a refusal takes {refusal} ms: {turns:#?}");
}

#[test]
fn an_answer_that_would_come_too_late_is_refused_at_once() {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let hurried = with(request("linear"), "/accuracy/max_time_ms", json!(200.0));
    assert_eq!(service.predict(&agent, &hurried).0, 200, "nobody else is there");
    thread::scope(|scope| {
        let long = scope.spawn(|| service.predict(&crate::harness::agent(), &request("reference")));
        thread::sleep(Duration::from_millis(150));
        let started = Instant::now();
        let (status, retry_after, body) = service.predict(&agent, &hurried);
        let took = started.elapsed();
        let problem: Value = serde_json::from_str(&body).expect("JSON");
        assert_eq!((status, &problem["type"]), (503, &json!("/problems/too-late")), "{body}");
        assert!(retry_after.is_some_and(|seconds| seconds.parse::<u32>().is_ok_and(|seconds| seconds >= 1)));
        assert!(took < Duration::from_millis(200) && !long.is_finished(), "refused after {took:?}");
        assert_eq!(long.join().expect("caller").0, 200);
    });
    assert_eq!(service.predict(&agent, &hurried).0, 200);
}

#[test]
fn the_wait_is_bounded_for_those_who_say_nothing() {
    let service = Running::start(&["--threads", "1", "--max-wait-ms", "60", "--queue", "64"]);
    let callers = 24;
    let together = Barrier::new(callers);
    let replies: Vec<_> = thread::scope(|scope| {
        let call = || {
            let agent = agent();
            together.wait();
            service.predict(&agent, &request("coarse"))
        };
        let calls: Vec<_> = (0..callers).map(|_| scope.spawn(call)).collect();
        calls.into_iter().map(|call| call.join().expect("caller")).collect()
    });
    let refused: Vec<_> = replies.iter().filter(|(status, ..)| *status == 503).collect();
    assert!(!refused.is_empty() && refused.len() < callers, "{} refused", refused.len());
    for (_, retry_after, body) in refused {
        assert!(body.contains("/problems/too-late") && retry_after.is_some(), "{body}");
    }
    for (_, _, body) in replies.iter().filter(|(status, ..)| *status == 200) {
        let answer: Value = serde_json::from_str(body).expect("JSON");
        let queue_ms = answer["time_us"]["stages"]["queue"].as_f64().expect("number") * 1e-3;
        assert!(queue_ms < 65.0, "waited {queue_ms} ms");
    }
}
