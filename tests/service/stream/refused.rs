//! What is wrong is said by name, and the stream goes on.

use retina_tests::stream_client::{Fluid, Received, at_time, encode_pose, where_it_is, with_fluid};
use serde_json::{Value, json};

use super::{level, pose, text, with_client};
use crate::harness::{agent, get, with};
use crate::schema::assert_matches;

fn open(session: Value) -> Value {
    json!({"open": session})
}

#[test]
fn a_wrong_message_is_a_problem_and_the_next_is_answered() {
    with_client(&["--threads", "1"], async |_, mut client| {
        client.open(level("linear")).await.expect("session");
        let poses = [
            (with(pose(1), "/pose/tip_mm", json!([0, 2000, 0])), "out-of-range", "pose.tip_mm[1]"),
            (with(pose(2), "/pose/tip_mm", json!([5, 0, 0])), "outside-patch", "pose.tip_mm"),
            (with(pose(3), "/pose/force_mn", json!([0, 0, 0.5])), "points-away", "pose.force_mn"),
            (with(pose(4), "/pose/force_mn", json!([0, 0, -90])), "beyond-puncture", "pose.force_mn"),
            (with(pose(5), "/pose/direction", json!([0, 0, 0])), "out-of-range", "pose.direction"),
            (with(pose(6), "/pose/direction", json!([0, 0, 1])), "points-away", "pose.direction"),
            (with(pose(7), "/pose/orientation_xyzw", json!([0, 0, 0, 2])), "out-of-range", "pose.orientation_xyzw"),
            (pose(7), "out-of-range", "pose.sequence"),
            (with(pose(8), "/pose/needle", json!({})), "invalid-request", "pose.needle"),
            (with(pose(8), "/pose/sequence", json!(-1)), "invalid-request", "pose.sequence"),
            (with(pose(8), "/pose/tip_mm", json!([0, 0])), "invalid-request", "pose.tip_mm"),
            (json!({"pose": {"sequence": 8}}), "invalid-request", "pose.tip_mm"),
            (json!({}), "invalid-request", ""),
            (json!({"push": 1}), "invalid-request", "push"),
            (json!(["pose"]), "invalid-request", ""),
        ];
        for (message, kind, field) in poses {
            client.send(&message).await.expect("sent");
            let reply = text(client.receive().await);
            assert_matches("StreamMessage", &reply);
            let problem = &reply["problem"]["problem"];
            assert_eq!(problem["type"], format!("/problems/{kind}"), "{message}: {reply}");
            assert_eq!(problem["errors"][0]["field"], field, "{message}: {reply}");
            if ["outside-patch", "points-away"].contains(&kind) {
                assert_eq!(reply["problem"]["sequence"], message["pose"]["sequence"]);
                assert_eq!(reply["problem"]["client_time_us"], message["pose"]["client_time_us"]);
            }
        }
        client.send(&Value::String("no JSON object".into())).await.expect("sent");
        assert!(text(client.receive().await).get("problem").is_some());
        client.send(&pose(9)).await.expect("sent");
        assert_eq!(text(client.receive().await)["answer"]["sequence"], 9, "the session goes on");
    });
}

#[test]
fn binary_messages_that_do_not_keep_the_layout() {
    with_client(&["--threads", "1"], async |_, mut client| {
        client.open(json!({"accuracy": {"level": "linear"}, "format": "binary"})).await.expect("session");
        let good = || encode_pose(1, 0.0, [0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], Some([0.0, 0.0, -0.4]));
        let changed = |at: usize, byte: u8| {
            let mut bytes = good();
            bytes[at] = byte;
            bytes
        };
        let infinite = encode_pose(1, 0.0, [0.1, f32::INFINITY, 0.0], [0.0, 0.0, 0.0, 1.0], None);
        let no_time = encode_pose(1, f64::NAN, [0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None);
        let cases = [
            (good()[..63].to_vec(), "pose.length"),
            (Vec::new(), "pose.length"),
            (changed(0, b'X'), "pose.magic"),
            (changed(4, 2), "pose.version"),
            (changed(5, 2), "pose.kind"),
            (changed(6, 33), "pose.flags"),
            (changed(6, 25), "pose.flags"),
            (changed(6, 9), "pose.length"),
            (with_fluid(at_time(good(), 1.0), Fluid::VolumeMm3(0.1))[..79].to_vec(), "pose.length"),
            (with_fluid(good(), Fluid::PressureKpa(f64::NAN)), "pose.bleb"),
            (changed(6, 3), "pose.length"),
            ([good(), vec![0; 8]].concat(), "pose.length"),
            (at_time(good(), 1.0)[..71].to_vec(), "pose.length"),
            (at_time(good(), f64::INFINITY), "pose.time_s"),
            (infinite, "pose.tip_mm"),
            (no_time, "pose.client_time_us"),
            (changed(51, 0), "pose.orientation_xyzw"),
            (at_time(encode_pose(2, 0.0, [0.0; 3], [0.0, 0.0, 0.0, 1.0], None), 1.0), "pose.time_s"),
            (where_it_is(encode_pose(3, 0.0, [0.0; 3], [0.0; 4], None)), "pose.tip_mm"),
            (
                with_fluid(encode_pose(4, 0.0, [0.0; 3], [0.0, 0.0, 0.0, 1.0], None), Fluid::PressureKpa(0.1)),
                "pose.bleb",
            ),
        ];
        for (bytes, field) in cases {
            client.send_bytes(bytes).await.expect("sent");
            let reply = text(client.receive().await);
            assert_eq!(reply["problem"]["problem"]["errors"][0]["field"], field, "{reply}");
        }
        let next = encode_pose(5, 0.0, [0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], Some([0.0, 0.0, -0.4]));
        client.send_bytes(next).await.expect("sent");
        assert!(matches!(client.receive().await, Received::Answer(answer) if answer.sequence == 5));
    });
}

#[test]
fn a_session_that_cannot_be_opened_says_why() {
    with_client(&["--threads", "1"], async |_, mut client| {
        client.send(&pose(1)).await.expect("sent");
        let reply = text(client.receive().await)["problem"].clone();
        assert!(reply["problem"]["detail"].as_str().is_some_and(|detail| detail.contains("open")), "{reply}");
        let cases = [
            (json!({"scene": "moon"}), "open.scene"),
            (
                json!({"scene": {"tissue": {"choroid": {"youngs_modulus_kpa": 0}}}}),
                "open.scene.tissue.choroid.youngs_modulus_kpa",
            ),
            (json!({"needle": {"gauge": "26G"}}), "open.needle.gauge"),
            (json!({"needle": {"radius_mm": 7}}), "open.needle.radius_mm"),
            (json!({"accuracy": {"level": "exact"}}), "open.accuracy.level"),
            (json!({"effects": ["contact", "viscoelasticity"]}), "open.effects[1]"),
            (json!({"effects": ["inertia"]}), "open.effects[0]"),
            (json!({"format": "xml"}), "open.format"),
            (json!({"format": null}), "open.format"),
            (json!({"formats": "json"}), "open.formats"),
        ];
        for (session, field) in cases {
            client.send(&open(session.clone())).await.expect("sent");
            let reply = text(client.receive().await)["problem"]["problem"].clone();
            assert_eq!(reply["errors"][0]["field"], field, "{session}: {reply}");
            let remembers = field.starts_with("open.effects");
            assert_eq!(reply.to_string().contains("/v1/simulate"), remembers, "{reply}");
        }
        client.open(level("linear")).await.expect("a session after all");
    });
}

#[test]
fn what_is_no_stream_is_told_so() {
    let reply = get("/v1/stream");
    assert_eq!((reply.status.as_u16(), reply.media_type()), (426, "application/problem+json"));
    assert_eq!(reply.body["type"], "/problems/upgrade-required");
    with_client(&["--threads", "1", "--streams", "1"], async |service, client| {
        let request = agent().get(service.url("/v1/stream"));
        let handshake = request
            .header("connection", "upgrade")
            .header("upgrade", "websocket")
            .header("sec-websocket-version", "13")
            .header("sec-websocket-key", "dGhlIHNhbXBsZSBub25jZQ==");
        let mut refused = tokio::task::block_in_place(|| handshake.call()).expect("answer");
        assert_eq!(refused.status(), 503, "{:?}", refused.body_mut().read_to_string());
        drop(client);
    });
}
