//! Promises of error and time: which level answers, and what the answer says of itself.

use serde_json::{Value, json};

use crate::harness::{predict, request, with};

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
