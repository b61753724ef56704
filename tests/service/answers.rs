//! What a prediction looks like on the wire.

use serde_json::{Value, json};

use crate::harness::{Reply, predict, request, with};
use crate::schema::assert_matches;

fn answered(reply: Reply) -> Value {
    assert_eq!(reply.status, 200, "{}", reply.body);
    assert_eq!(reply.media_type(), "application/json");
    reply.body
}

/// An answer without what depends on the clock.
fn timeless(mut answer: Value) -> String {
    let time = answer.as_object_mut().expect("object").remove("time_us");
    assert!(time.is_some());
    answer.to_string()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("array").iter().map(|number| number.as_f64().expect("number")).collect()
}

#[test]
fn a_press_answers_with_the_grid_and_a_balanced_needle() {
    for level in ["linear", "coarse"] {
        let answer = answered(predict(&request(level)));
        assert_matches("PredictResponse", &answer);
        let surface = &answer["surface"];
        assert_eq!(surface["vertices_mm"].as_array().map(Vec::len), Some(64), "{level}");
        assert_eq!(surface["normals"].as_array().map(Vec::len), Some(64));
        assert_eq!(surface["triangles"].as_array().map(Vec::len), Some(98));
        let moved = numbers(&surface["displacement_um"]);
        assert_eq!(moved.len(), 64);
        assert!(moved.iter().any(|&um| um > 1.0), "{level}: nothing moved");
        for normal in surface["normals"].as_array().expect("array") {
            let length = numbers(normal).iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-9, "{level}: normal of length {length}");
        }
        assert_eq!(answer["contact"]["state"], "touching");
        assert_eq!(answer["accuracy"]["level"], level);
        assert!(answer["needle"]["travel_mm"].as_f64().expect("travel") > 0.0);
        let reaction = numbers(&answer["needle"]["reaction_mn"]);
        assert!((reaction[2] - 0.4).abs() < 1e-5, "{level}: reaction {reaction:?}");
        assert_eq!(answer["surface"].get("source_indices"), None);
    }
}

#[test]
fn times_are_told_by_stage_and_add_up() {
    let answer = answered(predict(&request("coarse")));
    let stages = answer["time_us"]["stages"].as_object().expect("stages");
    for name in ["queue", "read", "prepare"] {
        assert!(stages.contains_key(name), "{stages:?}");
    }
    let sum: f64 = stages.values().map(|time| time.as_f64().expect("number")).sum();
    let total = answer["time_us"]["total"].as_f64().expect("total");
    assert!(total > 0.0 && (sum - total).abs() < 1e-6 * total, "{sum} against {total}");
}

#[test]
fn the_same_request_has_the_same_answer() {
    for level in ["linear", "coarse"] {
        let first = timeless(answered(predict(&request(level))));
        let other = timeless(answered(predict(&with(request(level), "/force_mn/2", json!(-0.2)))));
        let again = timeless(answered(predict(&request(level))));
        assert_eq!(first, again, "{level}");
        assert_ne!(first, other, "{level}: the force changes nothing");
    }
}

#[test]
fn defaults_are_what_they_are_said_to_be() {
    let short = json!({"needle": {"tip_mm": [0, 0, 0]}, "force_mn": [0, 0, -0.3]});
    let long = json!({
        "scene": "macula",
        "needle": {"tip_mm": [0, 0, 0], "direction": [0, 0, -5], "gauge": "25G", "tip": "hemispherical"},
        "force_mn": [0, 0, -0.3],
        "control": "force",
        "accuracy": {"level": "coarse"},
        "effects": "auto",
    });
    let quaternion = with(short.clone(), "/needle/orientation_xyzw", json!([0, 0, 0, 1.0005]));
    let radius = with(short.clone(), "/needle/radius_mm", json!(0.257));
    let expected = timeless(answered(predict(&short)));
    for request in [long, quaternion, radius] {
        assert_eq!(timeless(answered(predict(&request))), expected, "{request}");
    }
}

#[test]
fn a_listed_scene_can_be_sent_back_as_it_stands() {
    let list = crate::harness::get("/v1/scenes").body;
    for entry in list["scenes"].as_array().expect("scenes") {
        let named = with(request("linear"), "/scene", entry["name"].clone());
        let written_out = with(request("linear"), "/scene", entry["scene"].clone());
        let (named, written_out) = (answered(predict(&named)), answered(predict(&written_out)));
        assert_eq!(timeless(named), timeless(written_out), "{}", entry["name"]);
    }
}

#[test]
fn a_leaning_needle_bends_by_its_stiffness() {
    let leaning = json!({
        "needle": {"tip_mm": [0, 0, 0], "direction": [0.5, 0, -0.8], "gauge": "27G"}, "force_mn": [0.25, 0, -0.4],
    });
    let bent = answered(predict(&leaning));
    assert_matches("PredictResponse", &bent);
    let length = |vector: &Value| numbers(vector).iter().map(|x| x * x).sum::<f64>().sqrt();
    // Reaction along the motion 0.472 mN, across it 0.472 tan(32 degrees) = 0.295 mN, over 32 mN/mm.
    assert!((length(&bent["needle"]["deflection_mm"]) - 0.0092).abs() < 0.0006, "{}", bent["needle"]);
    let stated = answered(predict(&with(leaning.clone(), "/needle/stiffness_mn_per_mm", json!(32))));
    assert_eq!(timeless(stated), timeless(bent.clone()), "that is the default of 27G");
    let softer = answered(predict(&with(leaning.clone(), "/needle/stiffness_mn_per_mm", json!(16))));
    let ratio = length(&softer["needle"]["deflection_mm"]) / length(&bent["needle"]["deflection_mm"]);
    assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
    let rigid = answered(predict(&with(leaning, "/needle/stiffness_mn_per_mm", json!(1e6))));
    assert_eq!(rigid["needle"].get("deflection_mm"), None);
    assert!(timeless(rigid) != timeless(bent));
}

#[test]
fn fluid_under_the_retina_is_told_with_its_pressure() {
    let wet = json!({"bleb": {"volume_mm3": 0.02, "radius_mm": 0.6}});
    let answer = answered(predict(&with(request("coarse"), "/scene", wet.clone())));
    assert_matches("PredictResponse", &answer);
    let bleb = |answer: &Value, field: &str| answer["contact"]["bleb"][field].as_f64().expect("number");
    assert!((bleb(&answer, "volume_mm3") / 0.02 - 1.0).abs() < 1e-3);
    let unpressed = answered(predict(&with(with(request("coarse"), "/scene", wet), "/force_mn/2", json!(0))));
    assert!((bleb(&answer, "pressure_kpa") / bleb(&answer, "pressure_mmhg") - 0.133_322).abs() < 1e-6);
    assert!(bleb(&answer, "pressure_kpa") > bleb(&unpressed, "pressure_kpa"));
    assert_eq!((&unpressed["contact"]["state"], &answer["contact"]["state"]), (&json!("clear"), &json!("touching")));
    assert!(numbers(&unpressed["surface"]["displacement_um"]).iter().any(|&um| um > 20.0));
    assert_eq!(answered(predict(&request("coarse")))["contact"].get("bleb"), None);
}

#[test]
fn puncture_is_always_told() {
    let row = |answer: &Value| {
        let effects = answer["effects"].as_array().expect("effects");
        effects.iter().find(|effect| effect["name"] == "puncture").expect("always there").clone()
    };
    for level in ["linear", "coarse"] {
        for (max_force_mn, state) in [(0.39, "punctured"), (0.41, "touching")] {
            let scene = json!({"puncture": {"max_force_mn": max_force_mn, "max_strain": 5}});
            let answer = answered(predict(&with(request(level), "/scene", scene)));
            assert_matches("PredictResponse", &answer);
            assert_eq!(answer["contact"]["state"], state, "{level}");
            let row = row(&answer);
            assert_eq!((&row["simulated"], &row["threshold"]), (&json!(true), &json!(max_force_mn)));
            assert!((row["value"].as_f64().expect("number") - 0.4).abs() < 1e-3, "{row}");
            let told = answer["warnings"].to_string().contains("the tissue is punctured");
            assert_eq!(told, state == "punctured", "{}", answer["warnings"]);
        }
        // Held at a depth and limited by strain: the answer measures it.
        let held = json!({
            "needle": {"tip_mm": [0, 0, -0.1]}, "control": "pose", "accuracy": {"level": level},
            "scene": {"puncture": {"max_strain": 0.02}},
        });
        let answer = answered(predict(&held));
        assert_eq!(answer["contact"]["state"], "punctured");
        assert!(row(&answer)["reason"].as_str().expect("text").ends_with("the strain"), "{}", row(&answer));
        assert_eq!(row(&answer)["value"], answer["contact"]["max_strain"]);
    }
}

#[test]
fn a_needle_that_stays_away_moves_nothing() {
    let request = json!({
        "needle": {"tip_mm": [0, 0, 1]}, "control": "pose", "accuracy": {"level": "linear"},
    });
    let answer = answered(predict(&request));
    assert_eq!(answer["contact"]["state"], "clear");
    assert!(numbers(&answer["surface"]["displacement_um"]).iter().all(|&um| um == 0.0));
}

/// A 13 × 13 grid of vertices 0.25 mm apart on a plane, as vertices and triangles.
pub fn plane() -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let side = 13;
    let coordinate = |index: usize| 0.25 * (index as f64 - 6.0);
    let vertices = (0..side * side).map(|i| [coordinate(i % side), coordinate(i / side), 0.0]).collect();
    let squares = (0..(side - 1) * (side - 1)).map(|i| (i / (side - 1)) * side + i % (side - 1));
    let triangles = squares.flat_map(|c| [[c, c + 1, c + side + 1], [c, c + side + 1, c + side]]).collect();
    (vertices, triangles)
}

/// The plane as the text of an OBJ file.
pub fn plane_obj() -> String {
    let (vertices, triangles) = plane();
    let vertices = vertices.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    vertices.chain(faces).collect()
}

/// The plane as the text of a PLY file.
pub fn plane_ply() -> String {
    let (vertices, triangles) = plane();
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    let vertices = vertices.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    let faces = triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    [header].into_iter().chain(vertices).chain(faces).collect()
}

#[test]
fn a_mesh_answers_the_same_however_it_is_written() {
    let (vertices, triangles) = plane();
    let ways = [
        json!({"kind": "mesh", "vertices_mm": vertices, "triangles": triangles}),
        json!({"kind": "mesh", "obj": plane_obj()}),
        json!({"kind": "mesh", "ply": plane_ply()}),
    ];
    let answers = ways.map(|surface| {
        let request = with(request("coarse"), "/scene", json!({"surface": surface}));
        let answer = answered(predict(&request));
        assert_matches("PredictResponse", &answer);
        assert_eq!(answer["surface"]["source_indices"].as_array().map(Vec::len), Some(64));
        timeless(answer)
    });
    assert_eq!(answers[0], answers[1]);
    assert_eq!(answers[0], answers[2]);
}

#[test]
fn a_request_id_comes_back() {
    let request = axum::http::Request::get("/healthz").header("x-request-id", "press-17");
    let reply = crate::harness::send(request.body(axum::body::Body::empty()).expect("request"));
    assert_eq!(reply.headers["x-request-id"], "press-17");
    assert!(!crate::harness::get("/healthz").headers["x-request-id"].is_empty());
}
