//! `GET /v1/stream`: what comes back, who wins, what is refused, who is taken for gone.

mod going;
mod memory;
mod pace;
mod refused;

use std::collections::BTreeMap;

use retina_tests::stream_client::{BinaryAnswer, Received, StreamClient, encode_pose};
use serde_json::{Value, json};

use crate::answers::plane_obj;
use crate::harness::{Running, predict, request, runtime, with};
use crate::schema::assert_matches;

/// A pose that presses like [`request`].
fn pose(sequence: u64) -> Value {
    json!({"pose": {
        "sequence": sequence, "client_time_us": 1.5 * sequence as f64,
        "tip_mm": [0.1, -0.05, 0.0], "force_mn": [0.0, 0.0, -0.4],
    }})
}

fn level(name: &str) -> Value {
    json!({"accuracy": {"level": name}})
}

fn text(received: Received) -> Value {
    match received {
        Received::Text(message) => message,
        other => panic!("{other:?}"),
    }
}

fn binary(received: Received) -> BinaryAnswer {
    match received {
        Received::Answer(answer) => *answer,
        other => panic!("{other:?}"),
    }
}

/// Runs a test against a service with these arguments.
fn with_client(arguments: &[&str], test: impl AsyncFnOnce(&Running, StreamClient)) {
    let service = Running::start(arguments);
    runtime().block_on(async {
        let client = StreamClient::connect(service.address).await.expect("handshake");
        test(&service, client).await;
    });
}

/// Numbers of a JSON list, lists inside it joined.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap_or_else(|| panic!("{other}"))],
    }
}

#[test]
fn an_answer_is_the_prediction_with_the_poses_number_and_time() {
    with_client(&["--threads", "1"], async |_, mut client| {
        for name in ["linear", "coarse"] {
            let opened = client.open(level(name)).await.expect("session");
            assert_matches("OpenedMessage", &opened);
            let alone = predict(&request(name)).body;
            assert_eq!(opened["triangles"], alone["surface"]["triangles"]);
            client.send(&pose(7)).await.expect("sent");
            let message = text(client.receive().await);
            assert_matches("StreamMessage", &message);
            let answer = &message["answer"];
            assert_eq!((&answer["sequence"], &answer["client_time_us"]), (&json!(7), &json!(10.5)));
            assert_eq!(answer["dropped"], 0);
            let prediction = &answer["prediction"];
            for part in ["needle", "contact", "accuracy", "warnings"] {
                assert_eq!(prediction[part], alone[part], "{name} {part}");
            }
            for part in ["vertices_mm", "normals", "displacement_um"] {
                assert_eq!(prediction["surface"][part], alone["surface"][part], "{name} {part}");
            }
            let simulated =
                alone["effects"].as_array().expect("list").iter().filter(|effect| effect["simulated"] == true);
            let simulated: Vec<&Value> = simulated.map(|effect| &effect["name"]).collect();
            assert_eq!(prediction["effects"].as_array().expect("list").iter().collect::<Vec<_>>(), simulated);
            assert!(answer["time_us"]["computed"].as_f64().expect("time") > 0.0);
        }
    });
}

#[test]
fn a_binary_answer_is_the_text_answer_in_32_bits() {
    with_client(&["--threads", "1"], async |_, mut client| {
        let session = with(level("coarse"), "/needle", json!({"gauge": "27G", "tip": "flat"}));
        client.open(session.clone()).await.expect("session");
        client.send(&pose(1)).await.expect("sent");
        let told = text(client.receive().await)["answer"]["prediction"].clone();
        let opened = client.open(with(session, "/format", json!("binary"))).await.expect("session");
        assert_eq!(opened["format"], "binary");
        let bytes = encode_pose(1 << 40, -2.25, [0.1, -0.05, 0.0], [0.0, 0.0, 0.0, 1.0], Some([0.0, 0.0, -0.4]));
        assert_eq!(bytes.len(), 64);
        client.send_bytes(bytes).await.expect("sent");
        let answer = binary(client.receive().await);
        assert_eq!((answer.sequence, answer.client_time_us, answer.dropped), (1 << 40, -2.25, 0));
        assert_eq!((answer.level, answer.contact, answer.vertices_mm.len()), (1, 1, 64));
        // The pose itself was rounded to 32 bits.
        let near = |name: &str, short: &[f32], long: &Value, allowed: f64| {
            let long = numbers(long);
            assert_eq!(short.len(), long.len(), "{name}");
            for (short, long) in short.iter().zip(long) {
                assert!((f64::from(*short) - long).abs() <= allowed, "{name}: {short} against {long}");
            }
        };
        let surface = &told["surface"];
        near("vertices_mm", answer.vertices_mm.as_flattened(), &surface["vertices_mm"], 1e-6);
        near("normals", answer.normals.as_flattened(), &surface["normals"], 1e-6);
        near("displacement_um", &answer.displacement_um, &surface["displacement_um"], 1e-3);
        near("tip_mm", &answer.tip_mm, &told["needle"]["tip_mm"], 1e-6);
        near("travel_mm", &[answer.travel_mm], &told["needle"]["travel_mm"], 1e-6);
        near("reaction_mn", &answer.reaction_mn, &told["needle"]["reaction_mn"], 1e-4);
        let contact = &told["contact"];
        near("area_mm2", &[answer.area_mm2], &contact["area_mm2"], 1e-5);
        near("max_strain", &[answer.max_strain], &contact["max_strain"], 1e-4);
        near("max_pressure_kpa", &[answer.max_pressure_kpa], &contact["max_pressure_kpa"], 1e-2);
        near("max_penetration_um", &[answer.max_penetration_um], &contact["max_penetration_um"], 1e-3);
        let calibrated = told["accuracy"]["calibrated"] == true;
        assert_eq!(answer.flags & 1 == 1, calibrated);
        assert_eq!(answer.flags & 2 == 2, told["warnings"] != json!([]));
        match told["accuracy"]["expected_error_um"]["p95"].as_f64() {
            Some(p95) => assert!((f64::from(answer.p95_um) - p95).abs() < 1e-3 * p95),
            None => assert!(answer.p95_um.is_nan() && answer.median_um.is_nan()),
        }
        assert_eq!(answer.effects.count_ones() as usize, told["effects"].as_array().expect("list").len());
    });
}

#[test]
fn a_pose_without_a_force_holds_the_needle() {
    with_client(&["--threads", "1"], async |_, mut client| {
        let held = json!({"needle": {"tip_mm": [0.0, 0.0, -0.05]}, "control": "pose", "accuracy": {"level": "linear"}});
        let alone = predict(&held).body;
        client.open(level("linear")).await.expect("session");
        client.send(&json!({"pose": {"sequence": 1, "tip_mm": [0.0, 0.0, -0.05]}})).await.expect("sent");
        let answer = text(client.receive().await)["answer"].clone();
        assert_eq!(answer["prediction"]["needle"], alone["needle"]);
        assert_eq!(answer.get("client_time_us"), None);
        client.open(json!({"accuracy": {"level": "linear"}, "format": "binary"})).await.expect("session");
        let bytes = encode_pose(2, 0.0, [0.0, 0.0, -0.05], [0.0, 0.0, 0.0, 1.0], None);
        client.send_bytes(bytes).await.expect("sent");
        let short = binary(client.receive().await);
        assert_eq!(short.travel_mm, 0.0);
        let reaction = numbers(&alone["needle"]["reaction_mn"]);
        assert!((f64::from(short.reaction_mn[2]) - reaction[2]).abs() < 1e-4 * reaction[2]);
    });
}

#[test]
fn a_patch_cut_from_a_mesh_brings_its_triangles() {
    with_client(&["--threads", "1"], async |_, mut client| {
        let scene = json!({"surface": {"kind": "mesh", "obj": plane_obj()}});
        let alone = predict(&with(request("linear"), "/scene", scene.clone())).body;
        let session = with(level("linear"), "/scene", scene);
        let opened = client.open(session.clone()).await.expect("session");
        assert_eq!(opened["triangles"], json!([]));
        client.send(&pose(1)).await.expect("sent");
        let told = text(client.receive().await)["answer"]["prediction"]["surface"].clone();
        for part in ["triangles", "source_indices", "vertices_mm"] {
            assert_eq!(told[part], alone["surface"][part], "{part}");
        }
        client.open(with(session, "/format", json!("binary"))).await.expect("session");
        client.send(&pose(2)).await.expect("sent");
        let answer = binary(client.receive().await);
        assert_eq!(answer.flags & 4, 4);
        let indices: Vec<f64> = answer.source_indices.iter().map(|index| f64::from(*index)).collect();
        assert_eq!(indices, numbers(&told["source_indices"]));
        let corners: Vec<f64> = answer.triangles.as_flattened().iter().map(|index| f64::from(*index)).collect();
        assert_eq!(corners, numbers(&told["triangles"]));
    });
}

#[test]
fn streams_do_not_mix() {
    let service = Running::start(&["--threads", "2"]);
    runtime().block_on(async {
        let mut clients = Vec::new();
        for (index, gauge) in ["41G", "27G", "23G"].into_iter().enumerate() {
            let mut client = StreamClient::connect(service.address).await.expect("handshake");
            client.open(with(level("linear"), "/needle", json!({"gauge": gauge}))).await.expect("session");
            clients.push((client, 100 * index as u64));
        }
        let mut travels = BTreeMap::new();
        for round in 1..20 {
            for (client, base) in &mut clients {
                let touch = with(pose(*base + round), "/pose/force_mn", json!([0.0, 0.0, -0.05]));
                client.send(&touch).await.expect("sent");
            }
            for (client, base) in &mut clients {
                let answer = text(client.receive().await)["answer"].clone();
                assert_eq!(answer["sequence"], *base + round);
                let travel = answer["prediction"]["needle"]["travel_mm"].to_string();
                assert_eq!(travels.entry(*base).or_insert(travel.clone()), &travel);
            }
        }
        let different: std::collections::BTreeSet<_> = travels.values().collect();
        assert_eq!(different.len(), 3, "{travels:?}");
    });
}
