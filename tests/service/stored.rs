//! Scenes of one's own: stored, used, listed, deleted.

pub mod durable;
mod forms;
mod full;

use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::answers::{plane, plane_obj};
use crate::harness::{Running, agent, get, request, with};
use crate::schema::assert_matches;

/// Status and body of a request to a URL.
pub fn call(method: &str, url: &str, body: Option<&Value>) -> (u16, Value) {
    let builder = ureq::http::Request::builder().method(method).uri(url).header("content-type", "application/json");
    let body = body.map(Value::to_string).unwrap_or_default();
    let mut response = agent().run(builder.body(body).expect("request")).expect("answer");
    let text = response.body_mut().read_to_string().expect("body");
    (response.status().as_u16(), serde_json::from_str(&text).unwrap_or(Value::String(text)))
}

/// A scene of a mesh whose third coordinate is shifted, so that each shift is another scene.
pub fn shifted(shift_mm: f64) -> Value {
    let (mut vertices, triangles) = plane();
    vertices.iter_mut().for_each(|vertex| vertex[2] += shift_mm);
    json!({"surface": {"kind": "mesh", "vertices_mm": vertices, "triangles": triangles}})
}

/// Waits until a scene is no longer being prepared, and says what became of it.
pub fn prepared(url: &str, id: &str) -> Value {
    let patience = Instant::now() + Duration::from_secs(60);
    loop {
        let (status, told) = call("GET", &format!("{url}/v1/scenes/{id}"), None);
        assert_eq!(status, 200, "{told}");
        assert_matches("StoredScene", &told);
        if told["state"] != "preparing" {
            return told;
        }
        assert!(told["progress"]["done"].as_u64() < told["progress"]["of"].as_u64(), "{told}");
        assert!(Instant::now() < patience, "{told}");
        thread::sleep(Duration::from_millis(10));
    }
}

pub fn id(told: &Value) -> &str {
    told["id"].as_str().expect("id")
}

#[test]
fn a_scene_is_stored_once_prepared_used_listed_and_deleted() {
    let service = Running::start(&["--threads", "2"]);
    let (url, scenes) = (service.url(""), service.url("/v1/scenes"));
    let scene =
        json!({"surface": {"kind": "mesh", "obj": plane_obj()}, "tissue": {"retina": {"youngs_modulus_kpa": 12}}});
    let (status, told) = call("POST", &scenes, Some(&scene));
    assert_eq!((status, &told["durable"]), (201, &json!(false)), "{told}");
    let ready = prepared(&url, id(&told));
    assert_eq!(ready["state"], "ready", "{ready}");
    assert_eq!(ready["surface"], json!({"kind": "mesh", "vertices": 169, "triangles": 288}));
    let (status, again) = call("POST", &scenes, Some(&scene));
    assert_eq!((status, id(&again)), (200, id(&told)));

    // The touch that it tells of is a request that is answered, and the scene answers as it does written out.
    let mut touch = ready["touch"].clone();
    touch["scene"] = told["id"].clone();
    assert_eq!(call("POST", &service.url("/v1/predict"), Some(&touch)).0, 200);
    for level in ["linear", "coarse"] {
        let by_id =
            call("POST", &service.url("/v1/predict"), Some(&with(request(level), "/scene", told["id"].clone())));
        let inline = call("POST", &service.url("/v1/predict"), Some(&with(request(level), "/scene", scene.clone())));
        assert_eq!((by_id.0, &by_id.1["surface"]), (200, &inline.1["surface"]), "{level}");
    }
    let pose = json!({"needle": {"tip_mm": [0, 0, 0]}, "force_mn": [0, 0, -0.2]});
    let batch = json!({"scene": told["id"], "poses": [pose], "accuracy": {"level": "linear"}});
    let (status, answers) = call("POST", &service.url("/v1/predict/batch"), Some(&batch));
    assert!(status == 200 && answers["answers"][0]["prediction"].is_object(), "{answers}");
    let steps = json!({"scene": told["id"], "needle": {"tip_mm": [0, 0, 0]}, "steps": [{"time_s": 1, "force_mn": [0, 0, -0.2]}], "accuracy": {"level": "coarse"}});
    let (status, lines) = call("POST", &service.url("/v1/simulate"), Some(&steps));
    assert!(status == 200 && lines.as_str().is_some_and(|text| text.contains("\"end\"")), "{lines}");

    let (_, list) = call("GET", &scenes, None);
    assert_matches("SceneList", &list);
    assert_eq!(list["stored"], json!([ready]));
    assert_eq!((&list["store"]["scenes"], &list["store"]["bytes"]), (&json!(1), &ready["bytes"]));
    let at = format!("{scenes}/{}", id(&told));
    assert_eq!(call("DELETE", &at, None).0, 204);
    assert_eq!(call("DELETE", &at, None).0, 404);
    assert_eq!(call("GET", &at, None).0, 404);
    assert_eq!(call("GET", &scenes, None).1["stored"], json!([]));
    let (status, gone) = call("POST", &service.url("/v1/predict"), Some(&touch));
    assert_eq!((status, &gone["errors"][0]["field"]), (422, &json!("scene")), "{gone}");
}

#[test]
fn the_same_scene_has_the_same_id_however_it_is_written() {
    let service = Running::start(&["--threads", "1"]);
    let post = |scene: Value| id(&call("POST", &service.url("/v1/scenes"), Some(&scene)).1).to_owned();
    let (vertices, triangles) = plane();
    let mesh = post(json!({"surface": {"kind": "mesh", "obj": plane_obj()}}));
    assert_eq!(
        mesh,
        post(
            json!({"surface": {"kind": "mesh", "vertices_mm": vertices, "triangles": triangles}, "friction_coefficient": 0})
        )
    );
    assert_ne!(mesh, post(json!({"surface": {"kind": "mesh", "obj": plane_obj()}, "friction_coefficient": 0.1})));
    let sphere = post(json!({}));
    assert_eq!(sphere, post(json!({"surface": {"kind": "sphere"}, "pose": {"position_mm": [0, 0, 0]}})));
    assert_ne!(sphere, post(json!({"pose": {"position_mm": [0.1, 0, 0]}})));
    assert!(mesh.len() == 64 && mesh.bytes().all(|digit| digit.is_ascii_hexdigit()), "{mesh}");
}

#[test]
fn what_is_wrong_is_said_at_once_and_nothing_is_stored() {
    let service = Running::start(&["--threads", "1"]);
    let scenes = service.url("/v1/scenes");
    for (scene, kind, field) in [
        (
            json!({"tissue": {"retina": {"youngs_modulus_kpa": -1}}}),
            "out-of-range",
            "scene.tissue.retina.youngs_modulus_kpa",
        ),
        (json!({"surface": {"kind": "mesh", "obj": "v 0 0 0"}}), "invalid-mesh", "scene.surface.obj"),
        (json!({"surface": {"kind": "mesh", "stl": "solid\nendsolid\n"}}), "invalid-mesh", "scene.surface.stl"),
        (json!({"surface": {"kind": "mesh", "stl": "solid", "obj": ""}}), "invalid-request", "scene.surface"),
        (json!({"surface": {"kind": "flat", "stl": "solid"}}), "invalid-request", "scene.surface.stl"),
        (json!({"colour": "red"}), "invalid-request", "colour"),
    ] {
        let (status, problem) = call("POST", &scenes, Some(&scene));
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{status} {problem}");
        assert_eq!(problem["errors"][0]["field"], field, "{problem}");
    }
    assert_eq!(call("GET", &scenes, None).1["stored"], json!([]));
    for name in ["../../etc/passwd", &"A".repeat(64), &"0".repeat(63), &"0".repeat(64)] {
        let (status, problem) =
            call("POST", &service.url("/v1/predict"), Some(&with(request("linear"), "/scene", json!(name))));
        assert_eq!((status, &problem["type"]), (422, &json!("/problems/unknown-name")), "{name}: {problem}");
    }
}

#[test]
fn a_mesh_without_room_for_a_patch_fails_with_its_cause() {
    let service = Running::start(&["--threads", "1"]);
    let small = json!({"surface": {"kind": "mesh", "vertices_mm": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}});
    let (status, told) = call("POST", &service.url("/v1/scenes"), Some(&small));
    assert_eq!(status, 201);
    let failed = prepared(&service.url(""), id(&told));
    assert_eq!(failed["state"], "failed");
    assert!(failed["cause"].as_str().is_some_and(|cause| cause.contains("64 are needed")), "{failed}");
}

#[test]
fn built_in_scenes_are_told_of_and_stay() {
    let told = get("/v1/scenes/fovea").body;
    assert_matches("StoredScene", &told);
    assert_eq!((&told["state"], &told["surface"]["kind"]), (&json!("ready"), &json!("foveal_pit")));
    let service = Running::start(&["--threads", "1"]);
    assert_eq!(call("DELETE", &service.url("/v1/scenes/fovea"), None).0, 405);
    assert_eq!(call("GET", &service.url("/v1/scenes/nowhere"), None).0, 404);
}

#[test]
fn a_stream_takes_a_stored_scene() {
    use retina_tests::stream_client::StreamClient;
    let service = Running::start(&["--threads", "1"]);
    let (_, told) = call("POST", &service.url("/v1/scenes"), Some(&shifted(0.5)));
    crate::harness::runtime().block_on(async {
        let mut client = StreamClient::connect(service.address).await.expect("handshake");
        client.open(json!({"scene": told["id"], "accuracy": {"level": "linear"}})).await.expect("session");
        client.send(&json!({"pose": {"sequence": 1, "tip_mm": [0, 0, 0.49]}})).await.expect("sent");
        client.receive().await;
    });
    assert_eq!(prepared(&service.url(""), id(&told))["state"], "ready");
}
