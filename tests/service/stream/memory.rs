//! Sessions with memory: the steps of a simulation one by one, friction and relaxation in a stream, what is refused, what is overtaken.

use std::time::{Duration, Instant};

use retina_tests::stream_client::{Fluid, Received, StreamClient, at_time, encode_pose, where_it_is, with_fluid};
use serde_json::{Value, json};

use super::{binary, text, with_client};
use crate::harness::{Running, runtime, with};
use crate::schema::assert_matches;
use crate::sequences::{injection, lines, simulate};

/// A needle dragged over rough tissue until it slips, back, pushed by a force, let be, lifted.
fn drag() -> Vec<Value> {
    let places = [0.0, 0.01, 0.02, 0.03, 0.04, 0.03, 0.02];
    let mut steps: Vec<Value> =
        (1..).zip(places).map(|(k, x)| json!({"time_s": 0.1 * f64::from(k), "tip_mm": [x, 0.0, -0.06]})).collect();
    steps.push(json!({"time_s": 0.9, "force_mn": [0.0, 0.0, -0.3]}));
    steps.push(json!({"time_s": 2.0}));
    steps.push(json!({"time_s": 2.1, "force_mn": [0.0, 0.0, 0.0]}));
    steps
}

/// A session that remembers, planned from these steps.
fn session(rehearsal: &[Value]) -> Value {
    json!({"scene": {"surface": {"kind": "flat"}, "friction_coefficient": 0.3}, "memory": {"rehearsal": rehearsal}})
}

/// The pose of that number that is a step.
fn pose(sequence: u64, step: &Value) -> Value {
    json!({"pose": with(step.clone(), "/sequence", json!(sequence))})
}

/// The steps of the simulation of `steps` in that session's scene.
fn simulated(service: &Running, steps: &[Value]) -> Vec<Value> {
    let needle = json!({"tip_mm": drag()[0]["tip_mm"]});
    let request = json!({"scene": session(&[])["scene"], "needle": needle, "steps": steps});
    let (status, _, body) = tokio::task::block_in_place(|| simulate(service, &request));
    assert_eq!(status, 200, "{body}");
    lines(&body).into_iter().filter_map(|mut line| line.get_mut("step").map(Value::take)).collect()
}

/// That an answer is that step, to the bit.
fn assert_is_step(answer: &Value, step: &Value) {
    assert_eq!(answer["time_s"], step["time_s"], "{answer}");
    for part in ["needle", "contact", "warnings"] {
        assert_eq!(answer["prediction"][part], step[part], "{part} at {} s", step["time_s"]);
    }
    for part in ["vertices_mm", "normals", "displacement_um"] {
        assert_eq!(answer["prediction"]["surface"][part], step["surface"][part], "{part} at {} s", step["time_s"]);
    }
}

async fn ask(client: &mut StreamClient, message: &Value) -> Value {
    client.send(message).await.expect("sent");
    let reply = text(client.receive().await);
    assert_matches("StreamMessage", &reply);
    reply
}

#[test]
fn a_stream_with_memory_is_the_simulation_of_its_poses() {
    with_client(&["--threads", "2"], async |service, mut client| {
        let listed = simulated(service, &drag());
        // A second session begins with tissue at rest again.
        for _ in 0..2 {
            let opened = client.open(session(&drag())).await.expect("session");
            assert_matches("OpenedMessage", &opened);
            let effects = opened["memory"]["effects"].as_array().expect("list").clone();
            let simulated: Vec<&str> = effects
                .iter()
                .filter_map(|effect| effect["simulated"].as_bool()?.then(|| effect["name"].as_str())?)
                .collect();
            assert!(["friction", "viscoelasticity"].iter().all(|name| simulated.contains(name)), "{opened}");
            let mut states = Vec::new();
            for ((sequence, step), listed) in (1..).zip(drag()).zip(&listed) {
                let answer = ask(&mut client, &pose(sequence, &step)).await["answer"].take();
                assert_is_step(&answer, listed);
                assert_eq!(answer["prediction"]["effects"].as_array().map(Vec::len), Some(simulated.len()));
                states.push(answer["prediction"]["contact"]["state"].as_str().expect("state").to_owned());
            }
            assert_eq!((states[0].as_str(), states[4].as_str(), states[9].as_str()), ("touching", "slipping", "clear"));
        }
    });
}

#[test]
fn held_tissue_relaxes_in_a_binary_stream() {
    with_client(&["--threads", "1"], async |_, mut client| {
        let press = json!({"time_s": 0.2, "tip_mm": [0.0, 0.0, -0.06]});
        let opened = json!({"format": "binary", "memory": {"rehearsal": [press]}});
        client.open(opened).await.expect("session");
        let mut reactions = Vec::new();
        for (sequence, time_s) in (1..).zip([0.2, 1.2, 10.0, 100.0]) {
            let placed = encode_pose(sequence, 7.0, [0.0, 0.0, -0.06], [0.0, 0.0, 0.0, 1.0], None);
            let message = if sequence == 1 { placed } else { where_it_is(placed) };
            client.send_bytes(at_time(message, time_s)).await.expect("sent");
            let answer = binary(client.receive().await);
            assert_eq!((answer.time_s, answer.client_time_us, answer.contact), (time_s, 7.0, 1));
            reactions.push(answer.reaction_mn[2]);
        }
        assert!(reactions.windows(2).all(|pair| pair[1] < 0.97 * pair[0]), "{reactions:?}");
        assert!(reactions[3] > 0.1, "{reactions:?}");
    });
}

#[test]
fn a_pose_that_brings_no_time_has_the_servers() {
    with_client(&["--threads", "1"], async |_, mut client| {
        let asked = Instant::now();
        client.open(session(&drag())).await.expect("session");
        let mut before_s = 0.0;
        for sequence in 1..4 {
            let answer = ask(&mut client, &json!({"pose": {"sequence": sequence, "tip_mm": [0.0, 0.0, -0.05]}})).await;
            let time_s = answer["answer"]["time_s"].as_f64().expect("time");
            assert!(time_s > before_s + 0.02 && time_s <= asked.elapsed().as_secs_f64(), "{time_s} after {before_s}");
            before_s = time_s;
            tokio::time::sleep(Duration::from_millis(30)).await;
        }
    });
}

#[test]
fn a_pose_that_is_overtaken_is_no_step() {
    with_client(&["--threads", "2"], async |service, mut client| {
        client.open(session(&drag())).await.expect("session");
        let count = 80;
        let step =
            |sequence: u64| json!({"time_s": 0.01 * sequence as f64, "tip_mm": [5e-4 * sequence as f64, 0.0, -0.06]});
        for sequence in 1..=count {
            client.send(&pose(sequence, &step(sequence))).await.expect("sent");
        }
        let (mut answers, mut dropped) = (Vec::new(), 0);
        while answers.last().is_none_or(|last: &Value| last["sequence"] != count) {
            let answer = text(client.receive().await)["answer"].take();
            dropped += answer["dropped"].as_u64().expect("number");
            answers.push(answer);
        }
        assert!(dropped > 0 && answers.len() as u64 + dropped == count, "{} and {dropped}", answers.len());
        let answered: Vec<Value> =
            answers.iter().map(|answer| step(answer["sequence"].as_u64().expect("number"))).collect();
        let mut again = StreamClient::connect(service.address).await.expect("handshake");
        again.open(session(&drag())).await.expect("session");
        for ((sequence, step), answer) in (1..).zip(&answered).zip(&answers) {
            let alone = ask(&mut again, &pose(sequence, step)).await["answer"].take();
            assert_eq!(answer["prediction"], alone["prediction"], "at {}", alone["time_s"]);
        }
    });
}

#[test]
fn what_makes_no_sense_is_a_problem_and_changes_nothing() {
    with_client(&["--threads", "2"], async |service, mut client| {
        let listed = simulated(service, &drag());
        client.open(session(&drag())).await.expect("session");
        let mut sequence = 0;
        for (step, listed) in drag().iter().zip(&listed) {
            let wrong = [
                ("time_s", json!(0.05), "out-of-range", "pose.time_s"),
                ("time_s", json!(5000.0), "out-of-range", "pose.time_s"),
                ("tip_mm", json!([5, 0, -0.05]), "outside-patch", "pose.tip_mm"),
                ("tip_mm", json!([0, 0, -0.45]), "too-deep", "pose.tip_mm"),
                ("tip_mm", json!([0, 2000, 0]), "out-of-range", "pose.tip_mm[1]"),
                ("force_mn", json!([0, 0, -90]), "beyond-puncture", "pose.force_mn"),
                ("force_mn", json!([0, 0, -101]), "out-of-range", "pose.force_mn"),
                ("force_mn", json!([0, 0, 0.1]), "points-away", "pose.force_mn"),
                ("direction", json!([0, 0, 0]), "out-of-range", "pose.direction"),
            ];
            for (part, value, kind, field) in wrong {
                if (part, step["time_s"].as_f64()) == ("time_s", Some(0.1)) && value == json!(0.05) {
                    continue;
                }
                if part == "tip_mm" && step.get("force_mn").is_some() {
                    continue;
                }
                sequence += 1;
                let message = pose(sequence, &with(step.clone(), &format!("/{part}"), value));
                let reply = ask(&mut client, &message).await["problem"].take();
                assert_eq!(reply["sequence"], sequence, "{message}: {reply}");
                assert_eq!(reply["problem"]["type"], format!("/problems/{kind}"), "{message}: {reply}");
                assert_eq!(reply["problem"]["errors"][0]["field"], field, "{message}: {reply}");
            }
            sequence += 1;
            let answer = ask(&mut client, &pose(sequence, step)).await["answer"].take();
            assert_is_step(&answer, listed);
        }
    });
}

/// What 32-bit numbers of poses and answers leave of a step's displacements (µm).
const BINARY_UM: f64 = 1e-2;

/// The binary pose of a step whose needle points down.
fn in_bytes(sequence: u64, step: &Value) -> Vec<u8> {
    let vector = |part: &str| -> Option<[f32; 3]> {
        let numbers: Vec<f32> = step.get(part)?.as_array()?.iter().filter_map(|n| Some(n.as_f64()? as f32)).collect();
        numbers.try_into().ok()
    };
    let tip_mm = vector("tip_mm");
    let pose = encode_pose(
        sequence,
        0.0,
        tip_mm.unwrap_or_default(),
        tip_mm.map_or([0.0; 4], |_| [0.0, 0.0, 0.0, 1.0]),
        vector("force_mn"),
    );
    let pose = if tip_mm.is_some() { pose } else { where_it_is(pose) };
    let pose = at_time(pose, step["time_s"].as_f64().expect("time"));
    let bleb = &step["bleb"];
    match (bleb["volume_mm3"].as_f64(), bleb["pressure_kpa"].as_f64()) {
        (Some(volume_mm3), _) => with_fluid(pose, Fluid::VolumeMm3(volume_mm3)),
        (_, Some(pressure_kpa)) => with_fluid(pose, Fluid::PressureKpa(pressure_kpa)),
        _ => pose,
    }
}

#[test]
fn fluid_comes_and_goes_in_a_stream_as_in_a_simulation() {
    with_client(&["--threads", "2"], async |service, mut client| {
        let request = injection();
        let (status, _, body) = tokio::task::block_in_place(|| simulate(service, &request));
        assert_eq!(status, 200, "{body}");
        let listed: Vec<Value> =
            lines(&body).into_iter().filter_map(|mut line| line.get_mut("step").map(Value::take)).collect();
        let steps = request["steps"].as_array().expect("list");
        let mut rehearsal = steps.clone();
        rehearsal[0]["tip_mm"] = request["needle"]["tip_mm"].clone();
        let session = json!({"scene": request["scene"], "memory": {"rehearsal": rehearsal}});
        client.open(session.clone()).await.expect("session");
        for (sequence, (step, listed)) in (1..).zip(rehearsal.iter().zip(&listed)) {
            let answer = ask(&mut client, &pose(sequence, step)).await["answer"].take();
            assert_is_step(&answer, listed);
        }
        let more = json!({"pose": {"sequence": 9, "time_s": 9.0, "bleb": {"volume_mm3": 0.6}}});
        let reply = ask(&mut client, &more).await["problem"]["problem"].take();
        assert_eq!(reply["errors"][0]["field"], "pose.bleb.volume_mm3", "{reply}");
        client.open(json!({"accuracy": {"level": "linear"}})).await.expect("one without memory");
        let wet = json!({"pose": {"sequence": 1, "tip_mm": [0.0, 0.0, 0.0], "bleb": {"volume_mm3": 0.02}}});
        let reply = ask(&mut client, &wet).await["problem"]["problem"].take();
        assert_eq!(reply["errors"][0]["field"], "pose.bleb", "{reply}");
        client.open(with(session, "/format", json!("binary"))).await.expect("session");
        for (sequence, (step, listed)) in (1..).zip(rehearsal.iter().zip(&listed)) {
            client.send_bytes(in_bytes(sequence, step)).await.expect("sent");
            let answer = binary(client.receive().await);
            let listed_um = listed["surface"]["displacement_um"].as_array().expect("list");
            for (told_um, listed_um) in answer.displacement_um.iter().zip(listed_um) {
                let listed_um = listed_um.as_f64().expect("number");
                assert!((f64::from(*told_um) - listed_um).abs() < BINARY_UM, "{sequence}: {told_um}, {listed_um} µm");
            }
        }
    });
}

#[test]
fn a_session_with_memory_that_cannot_be_says_why() {
    with_client(&["--threads", "1", "--simulation-steps", "10"], async |_, mut client| {
        let good = session(&drag());
        let cases = [
            (with(good.clone(), "/accuracy", json!({"level": "linear"})), "unknown-name", "open.accuracy.level"),
            (with(good.clone(), "/accuracy", json!({"level": "network"})), "unknown-name", "open.accuracy.level"),
            (with(good.clone(), "/accuracy", json!({"max_error_um": 5})), "invalid-request", "open.accuracy"),
            (with(good.clone(), "/memory", json!({})), "invalid-request", "open.memory.rehearsal"),
            (with(good.clone(), "/memory/future", json!([])), "invalid-request", "open.memory.future"),
            (session(&[]), "out-of-range", "open.memory.rehearsal"),
            (session(&vec![drag()[0].clone(); 11]), "out-of-range", "open.memory.rehearsal"),
            (session(&drag()[7..]), "invalid-request", "open.memory.rehearsal[0].tip_mm"),
            (session(&[json!({"time_s": 1, "tip_mm": [0, 0, 0.1]})]), "invalid-request", "open.memory.rehearsal"),
            (
                with(good.clone(), "/memory/rehearsal/2/time_s", json!(0.2)),
                "out-of-range",
                "open.memory.rehearsal[2].time_s",
            ),
            (
                with(good.clone(), "/memory/rehearsal/3/tip_mm", json!([0, 0, -0.45])),
                "too-deep",
                "open.memory.rehearsal[3].tip_mm",
            ),
            (
                with(good.clone(), "/memory/rehearsal/7/force_mn", json!([0, 0, -101])),
                "out-of-range",
                "open.memory.rehearsal[7].force_mn",
            ),
        ];
        for (session, kind, field) in cases {
            let reply = ask(&mut client, &json!({"open": session})).await["problem"]["problem"].take();
            assert_eq!(reply["type"], format!("/problems/{kind}"), "{session}: {reply}");
            assert_eq!(reply["errors"][0]["field"], field, "{session}: {reply}");
        }
        client.open(good).await.expect("a session after all");
        client.open(json!({"accuracy": {"level": "linear"}})).await.expect("one without memory");
        let timed = json!({"pose": {"sequence": 1, "time_s": 1.0, "tip_mm": [0.0, 0.0, -0.05]}});
        let placeless = json!({"pose": {"sequence": 2}});
        for (message, field) in [(timed, "pose.time_s"), (placeless, "pose.tip_mm")] {
            let reply = ask(&mut client, &message).await["problem"]["problem"].take();
            assert_eq!(reply["errors"][0]["field"], field, "{reply}");
        }
    });
}

#[test]
fn memories_are_counted_and_end_with_their_session() {
    let service = Running::start(&["--threads", "1", "--stream-memories", "1"]);
    runtime().block_on(async {
        let mut first = StreamClient::connect(service.address).await.expect("handshake");
        first.open(session(&drag())).await.expect("session");
        let mut second = StreamClient::connect(service.address).await.expect("handshake");
        let refused = ask(&mut second, &json!({"open": session(&drag())})).await;
        assert_eq!(refused["problem"]["problem"]["type"], "/problems/busy", "{refused}");
        second.open(json!({"accuracy": {"level": "linear"}})).await.expect("one without memory has room");
        // The first's next session takes the place of its own.
        first.open(session(&drag())).await.expect("session");
        drop(first);
        let waited = Instant::now();
        while second.open(session(&drag())).await.is_err() {
            assert!(waited.elapsed() < Duration::from_secs(10), "the place of a client that went is not free");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        assert!(matches!(second.send(&pose(1, &drag()[0])).await, Ok(())));
        assert!(matches!(second.receive().await, Received::Text(answer) if answer.get("answer").is_some()));
    });
}
