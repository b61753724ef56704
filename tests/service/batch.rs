//! `POST /v1/predict/batch`: an answer or a problem for each pose, in order, and an end when the client goes.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::harness::{Running, agent, predict, request, with};
use crate::schema::{assert_matches, description};

/// A batch of touches along a line, at a level.
fn batch(count: usize, level: &str) -> Value {
    let pose = |index: usize| {
        let x = 0.4 * (index as f64 / count as f64) - 0.2;
        json!({"needle": {"tip_mm": [x, -0.05, 0.0]}, "force_mn": [0.0, 0.0, -0.4]})
    };
    json!({"poses": (0..count).map(pose).collect::<Vec<_>>(), "accuracy": {"level": level}})
}

fn ask(service: &Running, request: &Value) -> (u16, Value) {
    let post = agent().post(service.url("/v1/predict/batch")).header("content-type", "application/json");
    let mut response = post.send(request.to_string()).expect("answer");
    let body = response.body_mut().with_config().limit(64 << 20).read_to_string().expect("body");
    (response.status().as_u16(), serde_json::from_str(&body).unwrap_or_else(|error| panic!("{error}: {body}")))
}

#[test]
fn every_pose_has_the_answer_that_it_has_alone() {
    let service = Running::start(&["--threads", "2"]);
    let question = batch(70, "linear");
    let (status, reply) = ask(&service, &question);
    assert_eq!(status, 200, "{reply}");
    assert_matches("BatchResponse", &reply);
    let answers = reply["answers"].as_array().expect("list");
    assert_eq!(answers.len(), 70);
    for (index, answer) in answers.iter().enumerate() {
        let pose = &question["poses"][index];
        let alone = predict(&with(request("linear"), "/needle", pose["needle"].clone())).body;
        let prediction = &answer["prediction"];
        assert_eq!(prediction["surface"]["vertices_mm"], alone["surface"]["vertices_mm"], "{index}");
        for part in ["needle", "contact", "accuracy", "warnings"] {
            assert_eq!(prediction[part], alone[part], "{index} {part}");
        }
        assert_eq!(reply["triangles"], alone["surface"]["triangles"]);
    }
    let example = &description()["components"]["schemas"]["BatchRequest"]["example"];
    assert_eq!(ask(&service, example).0, 200);
}

#[test]
fn a_pose_that_makes_no_sense_is_a_problem_in_its_place() {
    let service = Running::start(&["--threads", "1"]);
    let mut question = batch(6, "linear");
    question = with(question, "/poses/1/force_mn", json!([0, 0, -90]));
    question = with(question, "/poses/2/needle/gauge", json!("26G"));
    question = with(question, "/poses/4", json!({"needle": {"tip_mm": [0, 0, -0.9]}, "control": "pose"}));
    let (status, reply) = ask(&service, &question);
    assert_eq!(status, 200, "{reply}");
    assert_matches("BatchResponse", &reply);
    let problems = [
        (1, "beyond-puncture", "poses[1].force_mn"),
        (2, "unknown-name", "poses[2].needle.gauge"),
        (4, "too-deep", "poses[4].needle.tip_mm"),
    ];
    for (index, kind, field) in problems {
        let problem = &reply["answers"][index]["problem"];
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{problem}");
        assert_eq!(problem["errors"][0]["field"], field, "{problem}");
    }
    for index in [0, 3, 5] {
        assert!(reply["answers"][index].get("prediction").is_some(), "{index}");
    }
}

#[test]
fn what_all_share_is_refused_for_all() {
    let service = Running::start(&["--threads", "1", "--batch-poses", "4"]);
    let cases = [
        (batch(5, "linear"), "out-of-range", "poses"),
        (with(batch(2, "linear"), "/poses", json!([])), "out-of-range", "poses"),
        (batch(2, "exact"), "unknown-name", "accuracy.level"),
        (with(batch(2, "linear"), "/scene", json!("moon")), "unknown-name", "scene"),
        (with(batch(2, "linear"), "/effects", json!(["magic"])), "unknown-name", "effects[0]"),
        (with(batch(2, "linear"), "/poses/1/forces", json!(1)), "invalid-request", "poses[1].forces"),
        (with(batch(2, "linear"), "/poses/1", json!([])), "invalid-request", "poses[1]"),
    ];
    for (question, kind, field) in cases {
        let (status, reply) = ask(&service, &question);
        assert_eq!((status, &reply["type"]), (422, &json!(format!("/problems/{kind}"))), "{field}: {reply}");
        assert_eq!(reply["errors"][0]["field"], field, "{reply}");
    }
    assert_eq!(ask(&service, &batch(4, "linear")).0, 200);
}

/// Begins a batch on a bare connection and reads the head of its answer.
fn begun(service: &Running, question: &Value) -> BufReader<TcpStream> {
    let mut connection = TcpStream::connect(service.address).expect("connection");
    let body = question.to_string();
    let head = format!(
        "POST /v1/predict/batch HTTP/1.1\r\nhost: retina\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    connection.write_all(head.as_bytes()).expect("head");
    connection.write_all(body.as_bytes()).expect("body");
    let mut reader = BufReader::new(connection);
    let mut status = String::new();
    reader.read_line(&mut status).expect("status");
    assert!(status.contains("200"), "{status}");
    reader
}

#[test]
fn a_client_that_goes_ends_its_batch_and_others_are_served_meanwhile() {
    let service = Running::start(&["--threads", "1"]);
    let agent = agent();
    let reader = begun(&service, &batch(1000, "coarse"));
    // Between two pieces there is room for others: the batch as a whole takes ten seconds and more.
    let started = Instant::now();
    assert_eq!(service.predict(&agent, &request("linear")).0, 200);
    let beside = started.elapsed();
    assert!(beside < Duration::from_secs(2), "waited {beside:?} behind a batch");
    drop(reader);
    thread::sleep(Duration::from_millis(500));
    let stages = || {
        let text =
            agent.get(service.url("/metrics")).call().expect("metrics").body_mut().read_to_string().expect("text");
        let line = text
            .lines()
            .find(|line| line.starts_with("retina_stage_seconds_count{level=\"coarse\",stage=\"equilibrium\"}"));
        line.map(str::to_owned)
    };
    let counted = stages();
    thread::sleep(Duration::from_millis(500));
    assert!(counted.is_some());
    assert_eq!(stages(), counted, "the batch goes on for nobody");
}
