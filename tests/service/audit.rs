//! Live audit: what answers were off by beside what they promised, and never at the expense of an answer.

use std::thread;
use std::time::{Duration, Instant};

use retina_core::comparison::quantile;
use serde_json::{Value, json};

use crate::harness::{Running, agent, request, with};
use crate::operations::{metrics, value};

/// The value of a series that may not be there yet.
fn count(text: &str, series: &str) -> f64 {
    if text.contains(series) { value(text, series) } else { 0.0 }
}

fn surface(service: &Running, asked: &Value) -> (Vec<[f64; 3]>, Value) {
    let (status, _, body) = service.predict(&agent(), asked);
    assert_eq!(status, 200, "{body}");
    let answer: Value = serde_json::from_str(&body).expect("JSON");
    let vertices = serde_json::from_value(answer["surface"]["vertices_mm"].clone()).expect("vertices");
    (vertices, answer["accuracy"].clone())
}

#[test]
fn an_idle_service_measures_what_its_answers_were_off_by() {
    let service = Running::start(&["--threads", "1", "--audit-rate", "1"]);
    let (answered, promised) = surface(&service, &request("linear"));
    let within = r#"retina_audits_total{level="linear",outcome="within"}"#;
    let beyond = r#"retina_audits_total{level="linear",outcome="beyond"}"#;
    let patience = Instant::now() + Duration::from_secs(120);
    let text = loop {
        let text = metrics(&service);
        if count(&text, within) + count(&text, beyond) > 0.0 {
            break text;
        }
        assert!(Instant::now() < patience, "{text}");
        thread::sleep(Duration::from_millis(100));
    };
    let (truth, _) = surface(&service, &request("reference"));
    let distance =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() * 1e3;
    let error_um = answered.iter().zip(&truth).map(distance).fold(0.0, f64::max);
    let p95_um = promised["expected_error_um"]["p95"].as_f64().expect("promise");
    let measured = value(&text, r#"retina_audit_measured_um_sum{level="linear"}"#);
    assert!(error_um > 0.0 && (measured - error_um).abs() < 1e-6 * error_um, "{measured} and {error_um} µm");
    assert_eq!(value(&text, r#"retina_audit_promised_um_sum{level="linear"}"#), p95_um);
    assert_eq!(count(&text, within), f64::from(u8::from(error_um <= p95_um)), "{error_um} of {p95_um} µm");
    // The truth itself is not audited.
    thread::sleep(Duration::from_millis(300));
    assert!(!metrics(&service).contains(r#"level="reference",outcome="#));
}

#[test]
fn an_audit_gives_way_to_every_request() {
    let (alone, audited) =
        (Running::start(&["--threads", "1"]), Running::start(&["--threads", "1", "--audit-rate", "1"]));
    let median_ms = |service: &Running| {
        let mut times = Vec::new();
        for _ in 0..25 {
            // Long enough for an audit to begin between two requests, not for one to end.
            thread::sleep(Duration::from_millis(120));
            let (status, _, body) = service.predict(&agent(), &request("linear"));
            assert_eq!(status, 200, "{body}");
            let answer: Value = serde_json::from_str(&body).expect("JSON");
            times.push(answer["time_us"]["stages"]["queue"].as_f64().expect("time") * 1e-3);
        }
        quantile(&times, 0.5)
    };
    let (without, mut with_audit) = (median_ms(&alone), median_ms(&audited));
    let interrupted = || count(&metrics(&audited), r#"retina_audits_total{level="linear",outcome="interrupted"}"#);
    // On a busy machine a thread of the lowest priority rarely begins.
    for _ in 0..5 {
        if interrupted() < 5.0 {
            with_audit = with_audit.max(median_ms(&audited));
        }
    }
    assert!(interrupted() >= 5.0, "{}", metrics(&audited));
    // A computation at level reference takes a second or more: whoever waited for one would see it.
    assert!(
        with_audit < without + 50.0,
        "a request waits {with_audit} ms for a thread, {without} ms without the audit"
    );
}

#[test]
fn nothing_is_audited_that_nobody_asked_for() {
    let service = Running::start(&["--threads", "1"]);
    assert_eq!(service.predict(&agent(), &request("linear")).0, 200);
    let too_much = with(request("linear"), "/force_mn", json!([0, 0, -90]));
    assert_eq!(service.predict(&agent(), &too_much).0, 422);
    thread::sleep(Duration::from_millis(300));
    assert!(!metrics(&service).contains("outcome=\"within\""));
}
