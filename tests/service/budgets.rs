//! Promises of error and time: which level answers, and what the answer says of itself.

use serde_json::{Value, json};

use crate::harness::{Running, agent, predict, request, with};

fn asking(accuracy: Value) -> Value {
    let reply = predict(&with(request("linear"), "/accuracy", accuracy));
    assert_eq!(reply.status, 200, "{}", reply.body);
    reply.body
}

#[test]
fn the_cheapest_level_that_keeps_the_error_answers() {
    let loose = asking(json!({"max_error_um": 1000.0}));
    assert_eq!(loose["accuracy"]["level"], "linear");
    assert!(!loose["warnings"].to_string().contains("asked for"), "{}", loose["warnings"]);
    let linear_p95 = loose["accuracy"]["expected_error_um"]["p95"].as_f64().unwrap();
    let tighter = asking(json!({"max_error_um": linear_p95 * 0.99}));
    assert_ne!(tighter["accuracy"]["level"], "linear");
    assert!(tighter["accuracy"]["expected_error_um"]["p95"].as_f64().unwrap() < linear_p95);
    assert_eq!(tighter["accuracy"]["calibrated"], true);
}

#[test]
fn a_short_time_is_kept_or_said_to_be_broken() {
    let answer = asking(json!({"max_error_um": 0.02, "max_time_ms": 0.02}));
    assert_eq!(answer["accuracy"]["level"], "linear");
    let warnings = answer["warnings"].as_array().unwrap();
    let broken = warnings.iter().filter(|warning| warning.as_str().unwrap().contains("asked for")).count();
    assert_eq!(broken, 2, "{warnings:?}");
    assert!(answer["time_us"]["stages"]["choose"].is_number());
}

#[test]
fn a_needle_that_does_not_touch_is_exact_at_any_level() {
    let away = with(request("linear"), "/needle/tip_mm", json!([0.0, 0.0, 2.0]));
    let away = with(with(away, "/force_mn", json!([0, 0, 0])), "/accuracy", json!({"max_error_um": 0.01}));
    let answer: Value = predict(&away).body;
    assert_eq!(answer["accuracy"]["expected_error_um"], json!({"median": 0.0, "p95": 0.0}));
}

/// What an answer takes around its prediction counts too: a time in which the prediction alone would be ready is not promised.
#[test]
fn a_deadline_counts_from_the_arrival_to_the_answer() {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let ask = |accuracy: Value| {
        let body = with(request("linear"), "/accuracy", accuracy).to_string();
        let post = agent.post(service.url("/v1/predict")).header("content-type", "application/json");
        let mut response = post.send(body).expect("answer");
        let timing = response.headers()["server-timing"].to_str().expect("text").to_owned();
        let took_ms: f64 = timing.strip_prefix("total;dur=").expect("a duration").parse().expect("a number");
        let text = response.body_mut().read_to_string().expect("body");
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        (took_ms, answer)
    };
    for _ in 0..150 {
        let (took_ms, answer) = ask(json!({"max_time_ms": 1000.0}));
        assert!(
            1e3 * took_ms > answer["time_us"]["total"].as_f64().unwrap(),
            "the answer is written after what it tells"
        );
    }
    // Between what `linear` takes by itself and what its answer takes there is nothing to promise.
    let (_, alone) = ask(json!({"level": "linear"}));
    let linear_ms = 1e-3 * alone["time_us"]["stages"]["linear"].as_f64().unwrap();
    let (_, hurried) = ask(json!({"max_time_ms": 1.05 * linear_ms}));
    assert!(hurried["warnings"].to_string().contains("asked for"), "{}", hurried["warnings"]);
}
