//! Every bad input has a clear answer: a status, a problem document, the field at fault and what is allowed there.

use axum::body::{Body, Bytes};
use axum::http::{Request, header};
use serde_json::{Value, json};

use crate::harness::{Reply, post, predict, request, send, with};

fn assert_problem(reply: &Reply, status: u16, kind: &str) {
    assert_eq!(reply.status, status, "{}", reply.body);
    assert_eq!(reply.media_type(), "application/problem+json");
    assert_eq!(reply.body["type"], format!("/problems/{kind}"), "{}", reply.body);
    assert_eq!(reply.body["status"], status);
    assert!(reply.body["detail"].as_str().is_some_and(|detail| !detail.is_empty()));
}

/// A problem with one field; returns the field's entry.
fn assert_field(reply: &Reply, status: u16, kind: &str, field: &str) -> Value {
    assert_problem(reply, status, kind);
    let errors = reply.body["errors"].as_array().expect("errors");
    assert_eq!(errors.len(), 1, "{}", reply.body);
    assert_eq!(errors[0]["field"], field, "{}", reply.body);
    assert!(errors[0]["allowed"].as_str().is_some_and(|allowed| !allowed.is_empty()));
    errors[0].clone()
}

#[test]
fn values_out_of_range() {
    let cases = [
        ("/needle/radius_mm", json!(-0.1), "needle.radius_mm", "0.01 to 0.5 mm"),
        ("/needle/radius_mm", json!(0), "needle.radius_mm", "0.01 to 0.5 mm"),
        ("/needle/direction", json!([0, 0, 0]), "needle.direction", "a vector of length 1e-9 or more"),
        ("/needle/direction", json!([0, 1e-10, 0]), "needle.direction", "a vector of length 1e-9 or more"),
        (
            "/needle/orientation_xyzw",
            json!([0, 0, 0, 0]),
            "needle.orientation_xyzw",
            "four numbers of length 1 within 0.001",
        ),
        (
            "/needle/orientation_xyzw",
            json!([0, 0, 0, 1.01]),
            "needle.orientation_xyzw",
            "four numbers of length 1 within 0.001",
        ),
        ("/needle/tip_mm", json!([0, 2000, 0]), "needle.tip_mm[1]", "-1000 to 1000 mm"),
        ("/needle/tip", json!({"bevelled": {"angle_deg": 90}}), "needle.tip.bevelled.angle_deg", "15 to 75 deg"),
        ("/needle/tip", json!({"flat": {"edge_radius_mm": 1}}), "needle.tip.flat.edge_radius_mm", "0.0001 to 0.257 mm"),
        ("/needle/stiffness_mn_per_mm", json!(0), "needle.stiffness_mn_per_mm", "1 to 1000000 mN/mm"),
        ("/force_mn", json!([0, 0, -101]), "force_mn", "length 0 to 100 mN"),
        ("/force_mn", json!([0, 0, -1e300]), "force_mn", "length 0 to 100 mN"),
        ("/scene", json!({"surface": {"kind": "sphere", "radius_mm": -12}}), "scene.surface.radius_mm", "8 to 20 mm"),
        (
            "/scene",
            json!({"surface": {"kind": "foveal_pit", "depth_mm": 0.21}}),
            "scene.surface.depth_mm",
            "0 to 0.2 mm",
        ),
        (
            "/scene",
            json!({"tissue": {"retina": {"thickness_mm": -1}}}),
            "scene.tissue.retina.thickness_mm",
            "0.005 to 0.32 mm",
        ),
        (
            "/scene",
            json!({"tissue": {"retina": [{}, {"poisson_ratio": 0.5}]}}),
            "scene.tissue.retina[1].poisson_ratio",
            "0 to 0.4999",
        ),
        (
            "/scene",
            json!({"tissue": {"choroid": {"youngs_modulus_kpa": 0}}}),
            "scene.tissue.choroid.youngs_modulus_kpa",
            "1 to 1300 kPa",
        ),
        ("/scene", json!({"pose": {"position_mm": [0, 0, 1e9]}}), "scene.pose.position_mm[2]", "-1000 to 1000 mm"),
        (
            "/scene",
            json!({"pose": {"orientation_xyzw": [1, 1, 0, 0]}}),
            "scene.pose.orientation_xyzw",
            "four numbers of length 1 within 0.001",
        ),
    ];
    for (pointer, value, field, allowed) in cases {
        let error = assert_field(&predict(&with(request("linear"), pointer, value)), 422, "out-of-range", field);
        assert_eq!(error["allowed"], allowed, "{field}");
        assert!(!error["value"].is_null(), "{field}");
    }
}

#[test]
fn names_of_nothing() {
    let cases = [
        ("/needle/gauge", json!("26G"), "needle.gauge", "25G"),
        ("/needle/tip", json!("pointed"), "needle.tip", "hemispherical"),
        ("/scene", json!("moon"), "scene", "macula"),
        ("/effects", json!("some"), "effects", "auto"),
        ("/effects", json!(["contact", "magic"]), "effects[1]", "elasticity"),
        ("/accuracy/level", json!("exact"), "accuracy.level", "reference"),
        ("/control", json!("velocity"), "control", "pose"),
    ];
    for (pointer, value, field, known) in cases {
        let error = assert_field(&predict(&with(request("linear"), pointer, value)), 422, "unknown-name", field);
        assert!(error["allowed"].as_str().is_some_and(|allowed| allowed.contains(known)), "{error}");
    }
}

#[test]
fn fields_that_are_unknown_missing_or_of_another_type() {
    let cases = [
        ("/forces", json!(1), "forces"),
        ("/needle/gage", json!("25G"), "needle.gage"),
        ("/needle/tip", json!({"flat": {"edge_mm": 1}}), "needle.tip.flat.edge_mm"),
        ("/accuracy/levle", json!("coarse"), "accuracy.levle"),
        ("/scene", json!({"tissue": {"retina": [{}, {"stiffness": 1}]}}), "scene.tissue.retina[1].stiffness"),
        ("/scene", json!({"surface": {"kind": "flat", "color": 1}}), "scene.surface.color"),
        ("/scene", json!({"surface": {"kind": "flat", "radius_mm": 12}}), "scene.surface.radius_mm"),
        ("/scene", json!({"surface": {}}), "scene.surface.kind"),
        ("/scene", json!({"surface": {"kind": "mesh"}}), "scene.surface"),
        ("/scene", json!(["macula"]), "scene"),
        ("/needle", json!({"gauge": "25G"}), "needle.tip_mm"),
        ("/needle", json!([[0, 0, 0]]), "needle"),
        ("/needle", json!("25G"), "needle"),
        ("/needle/tip_mm", json!([0, 0]), "needle.tip_mm"),
        ("/needle/tip_mm", json!([0, 0, 0, 0]), "needle.tip_mm"),
        ("/needle/tip_mm", json!([0, 0, "Infinity"]), "needle.tip_mm[2]"),
        ("/needle/tip_mm", json!([0, 0, "NaN"]), "needle.tip_mm[2]"),
        ("/needle/tip_mm", json!([0, null, 0]), "needle.tip_mm[1]"),
        ("/needle/tip", json!({}), "needle.tip"),
        ("/accuracy", json!(["linear"]), "accuracy"),
        ("/force_mn", json!(null), "force_mn"),
        ("/force_mn", json!({"x": 1}), "force_mn"),
        ("/control", json!("pose"), "force_mn"),
        ("/effects", json!([1]), "effects[0]"),
    ];
    for (pointer, value, field) in cases {
        assert_field(&predict(&with(request("linear"), pointer, value)), 422, "invalid-request", field);
    }
    let both = with(request("linear"), "/needle/direction", json!([0, 0, -1]));
    let both = with(both, "/needle/orientation_xyzw", json!([0, 0, 0, 1]));
    assert_field(&predict(&both), 422, "invalid-request", "needle.direction");
    let both = with(request("linear"), "/needle/gauge", json!("25G"));
    assert_field(&predict(&with(both, "/needle/radius_mm", json!(0.2))), 422, "invalid-request", "needle.radius_mm");
    let twice = r#"{"needle": {"tip_mm": [0,0,0], "tip_mm": [0,0,0]}, "force_mn": [0,0,-1]}"#;
    assert_field(&post(twice), 422, "invalid-request", "needle.tip_mm");
}

#[test]
fn promises_that_no_level_keeps() {
    let asking = |accuracy| with(request("linear"), "/accuracy", accuracy);
    let reply = predict(&asking(json!({"max_error_um": 0.01, "max_time_ms": 0.01, "strict": true})));
    assert_field(&reply, 422, "not-possible", "accuracy");
    for key in ["max_error_um", "max_time_ms"] {
        for value in [0.0, -1.0, 1e9] {
            assert_field(&predict(&asking(json!({key: value}))), 422, "out-of-range", &format!("accuracy.{key}"));
        }
    }
}

#[test]
fn bodies_that_are_not_json() {
    let nan = r#"{"needle": {"tip_mm": [0, NaN, 0]}, "force_mn": [0, 0, -1]}"#;
    assert_field(&post(nan), 400, "malformed-json", "needle.tip_mm[1]");
    let infinity = r#"{"needle": {"tip_mm": [0, 0, 0]}, "force_mn": [0, 0, -Infinity]}"#;
    assert_field(&post(infinity), 400, "malformed-json", "force_mn[2]");
    let whole = request("linear").to_string();
    for length in 0..whole.len() {
        assert_problem(&post(whole[..length].to_owned()), 400, "malformed-json");
    }
    assert_problem(&post(format!("{whole} {whole}")), 400, "malformed-json");
    assert_problem(&post(b"{\"needle\": \"\xff\"}".to_vec()), 400, "malformed-json");
}

#[test]
fn numbers_that_are_too_large() {
    for token in ["1e999", "-1e999", &"9".repeat(400)] {
        let text = format!(r#"{{"needle": {{"tip_mm": [0, {token}, 0]}}, "force_mn": [0, 0, -1]}}"#);
        let error = assert_field(&post(text), 422, "out-of-range", "needle.tip_mm[1]");
        let shown = error["value"].as_str().expect("text");
        assert!(token.starts_with(shown) && !shown.is_empty(), "{shown}");
    }
}

#[test]
fn bodies_of_another_shape() {
    for body in ["[]", "null", "3", "\"macula\"", &"[".repeat(200_000), &format!("[{}]", request("linear"))] {
        assert_field(&post(body.to_owned()), 422, "invalid-request", "");
    }
    let deep = format!(r#"{{"needle": {}"#, r#"{"needle":"#.repeat(100_000));
    assert_field(&post(deep), 422, "invalid-request", "needle.needle");
    let long_name = format!(r#"{{"{}": 1}}"#, "x".repeat(1 << 20));
    let reply = post(long_name);
    assert_problem(&reply, 422, "invalid-request");
    assert!(reply.body.to_string().len() < 2000, "the answer repeats the request");
}

#[test]
fn content_types() {
    let body = request("linear").to_string();
    for (given, status) in [
        ("application/json; charset=utf-8", 200),
        ("application/vnd.retina+json", 200),
        ("text/plain", 415),
        ("application/x-www-form-urlencoded", 415),
    ] {
        let request = Request::post("/v1/predict").header(header::CONTENT_TYPE, given);
        let reply = send(request.body(Body::from(body.clone())).expect("request"));
        assert_eq!(reply.status, status, "{given}: {}", reply.body);
    }
    let reply = send(Request::post("/v1/predict").body(Body::from(body)).expect("request"));
    assert_problem(&reply, 415, "unsupported-media-type");
}

#[test]
fn a_needle_or_a_force_that_points_away() {
    let reply = predict(&with(request("linear"), "/needle/direction", json!([0, 0, 1])));
    assert_field(&reply, 422, "points-away", "needle.direction");
    let reply = predict(&with(request("linear"), "/force_mn", json!([0, 0, 0.5])));
    assert_field(&reply, 422, "points-away", "force_mn");
}

#[test]
fn fluid_that_cannot_be() {
    let wet = |bleb: Value| predict(&with(request("coarse"), "/scene", json!({"bleb": bleb})));
    let cases = [
        (json!({"volume_mm3": -0.01}), "scene.bleb.volume_mm3", "0 to 0.5 mm3"),
        (json!({"volume_mm3": 0.6}), "scene.bleb.volume_mm3", "0 to 0.5 mm3"),
        (json!({"pressure_kpa": 9}), "scene.bleb.pressure_kpa", "0 to 8 kPa"),
        (json!({"volume_mm3": 0.01, "radius_mm": 3}), "scene.bleb.radius_mm", "0.2 to 1 mm"),
    ];
    for (bleb, field, allowed) in cases {
        assert_eq!(assert_field(&wet(bleb), 422, "out-of-range", field)["allowed"], allowed);
    }
    let outside = wet(json!({"volume_mm3": 0.01, "center_mm": [1.2, 0, 0]}));
    assert_field(&outside, 422, "outside-patch", "scene.bleb.center_mm");
    let both = wet(json!({"volume_mm3": 0.01, "pressure_kpa": 1}));
    assert_field(&both, 422, "invalid-request", "scene.bleb.pressure_kpa");
    let neither = wet(json!({"radius_mm": 0.5}));
    assert_field(&neither, 422, "invalid-request", "scene.bleb.volume_mm3");
    let beside = wet(json!({"volume_mm3": 0.01, "center_mm": [0.9, 0.9, 0]}));
    assert_field(&beside, 422, "not-possible", "needle.tip_mm");
    let names = json!(["elasticity", "contact", "bleb"]);
    let request = with(request("network"), "/scene", json!({"bleb": {"volume_mm3": 0.02}}));
    assert_eq!(
        assert_field(&predict(&with(request, "/effects", names)), 422, "unknown-name", "effects")["value"],
        "finite_strain"
    );
}

#[test]
fn limits_of_puncture() {
    let limited = |puncture: Value| predict(&with(request("linear"), "/scene", json!({"puncture": puncture})));
    let cases = [
        (json!({"max_strain": 0}), "scene.puncture.max_strain", "0.01 to 5"),
        (json!({"max_force_mn": -1}), "scene.puncture.max_force_mn", "0.001 to 100 mN"),
        (json!({"pressure_per_modulus": 0.8}), "scene.puncture.pressure_per_modulus", "0.005 to 0.75"),
    ];
    for (puncture, field, allowed) in cases {
        assert_eq!(assert_field(&limited(puncture), 422, "out-of-range", field)["allowed"], allowed);
    }
    let both = limited(json!({"max_force_mn": 1, "pressure_per_modulus": 0.5}));
    assert_field(&both, 422, "invalid-request", "scene.puncture.max_force_mn");
    assert_problem(&limited(json!({"force": 1})), 422, "invalid-request");
    assert_eq!(limited(json!({})).status, 200);
}

#[test]
fn a_press_outside_of_the_patch_or_beyond_the_tissue() {
    let reply = predict(&with(request("coarse"), "/needle/tip_mm", json!([5, 0, 0])));
    assert_field(&reply, 422, "outside-patch", "needle.tip_mm");
    let reply = predict(&with(request("coarse"), "/force_mn", json!([0, 0, -90])));
    let error = assert_field(&reply, 422, "beyond-puncture", "force_mn");
    assert!(error["allowed"].as_str().is_some_and(|allowed| allowed.contains("mN")));
    let deep = json!({"needle": {"tip_mm": [0, 0, -0.9]}, "control": "pose"});
    assert_field(&predict(&deep), 422, "too-deep", "needle.tip_mm");
}

#[test]
fn meshes_that_are_no_surface() {
    let corner = json!([[0, 0, 0], [1, 0, 0], [0, 1, 0]]);
    let cases = [
        (json!({"kind": "mesh", "vertices_mm": corner, "triangles": [[0, 1, 7]]}), "scene.surface.triangles[0]"),
        (json!({"kind": "mesh", "vertices_mm": corner, "triangles": [[0, 1, 1]]}), "scene.surface.triangles[0]"),
        (json!({"kind": "mesh", "obj": "v 0 0\nf 1 2 3"}), "scene.surface.obj"),
        (json!({"kind": "mesh", "ply": "ply\nformat ascii 1.0\nelement vertex 99999999999\n"}), "scene.surface.ply"),
        (json!({"kind": "mesh", "vertices_mm": corner, "triangles": [[0, 1, 2]]}), "scene.surface"),
    ];
    for (surface, field) in cases {
        let reply = predict(&with(request("coarse"), "/scene", json!({"surface": surface})));
        assert_field(&reply, 422, "invalid-mesh", field);
    }
}

#[test]
fn a_body_beyond_the_limit_is_never_held_in_memory() {
    use std::convert::Infallible;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A piece of a body that counts the bytes that are alive.
    struct Piece(Vec<u8>, Arc<AtomicUsize>);
    impl AsRef<[u8]> for Piece {
        fn as_ref(&self) -> &[u8] {
            &self.0
        }
    }
    impl Drop for Piece {
        fn drop(&mut self) {
            self.1.fetch_sub(self.0.len(), Ordering::Relaxed);
        }
    }
    const PIECE: usize = 1 << 16;
    let (alive, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let pieces = {
        let (alive, most) = (Arc::clone(&alive), Arc::clone(&most));
        (0..100_000_000 / PIECE).map(move |_| {
            let now = alive.fetch_add(PIECE, Ordering::Relaxed) + PIECE;
            most.fetch_max(now, Ordering::Relaxed);
            Ok::<_, Infallible>(Bytes::from_owner(Piece(vec![b' '; PIECE], Arc::clone(&alive))))
        })
    };
    let reply = post(Body::from_stream(futures_util::stream::iter(pieces)));
    assert_problem(&reply, 413, "body-too-large");
    let most = most.load(Ordering::Relaxed);
    assert!(most <= 9 << 20, "{most} bytes at once");
    let almost = format!("{}{}", request("linear"), " ".repeat((8 << 20) - 1000));
    assert_eq!(post(almost).status, 200, "a body just below the limit is read");
}
