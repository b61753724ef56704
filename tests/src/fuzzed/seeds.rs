//! Inputs that are in order, to begin a search with.

use retina_core::network::weights::hash;
use serde_json::{Value, json};

/// A square, as vertices.
const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

const OBJ: &str =
    "# a square\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 1e-3\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3 -1\n";

const STL: &str = "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0\n  endloop\n endfacet\nendsolid a\n";

/// The seeds of a target; none for a name that is no target's.
pub fn of(target: &str) -> Vec<Vec<u8>> {
    match target {
        "mesh" => meshes(),
        "request" => requests(),
        "scene" => scenes().iter().map(text).collect(),
        "stream" => stream(),
        "weights" => ["contact", "corrected", "faithful"].map(weights).into(),
        _ => Vec::new(),
    }
}

fn text(value: &Value) -> Vec<u8> {
    value.to_string().into_bytes()
}

fn with_first(first: u8, rest: &[u8]) -> Vec<u8> {
    [&[first], rest].concat()
}

fn ply(encoding: &str) -> String {
    format!(
        "ply\nformat {encoding} 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty double z\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n"
    )
}

fn meshes() -> Vec<Vec<u8>> {
    let ascii = ply("ascii") + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
    let mut binary = ply("binary_little_endian").into_bytes();
    for [x, y, z] in SQUARE {
        binary.extend(x.to_le_bytes());
        binary.extend((y as f32).to_le_bytes());
        binary.extend(z.to_le_bytes());
    }
    for face in [[0i32, 1, 2], [0, 2, 3]] {
        binary.push(3);
        binary.extend(face.iter().flat_map(|corner| corner.to_le_bytes()));
    }
    let mut stl = format!("{:80}", "solid").into_bytes();
    stl.extend(1u32.to_le_bytes());
    let numbers = [[0.0, 0.0, 1.0], SQUARE[0], SQUARE[1], SQUARE[2]];
    stl.extend(numbers.iter().flatten().flat_map(|number| (*number as f32).to_le_bytes()));
    stl.extend([0; 2]);
    // In the order of the formats' list: PLY, OBJ, STL.
    vec![
        with_first(0, ascii.as_bytes()),
        with_first(0, &binary),
        with_first(1, OBJ.as_bytes()),
        with_first(2, STL.as_bytes()),
        with_first(2, &stl),
    ]
}

fn needle() -> Value {
    json!({"tip_mm": [0.1, -0.05, 0.0], "direction": [0, 0, -1], "gauge": "25G", "tip": {"bevelled": {"angle_deg": 30.0}}})
}

fn scenes() -> Vec<Value> {
    vec![
        json!({}),
        json!({"surface": {"kind": "foveal_pit", "depth_mm": 0.1},
            "tissue": {"retina": [{"thickness_mm": 0.1}, {}], "bond": {"strength_kpa": 10}, "rate": {"retina_relaxation": []}},
            "pose": {"position_mm": [0, 0, 1], "orientation_xyzw": [0, 0, 0, 1]},
            "friction_coefficient": 0.1, "puncture": {"max_force_mn": 2}}),
        json!({"surface": {"kind": "mesh", "vertices_mm": SQUARE, "triangles": [[0, 1, 2], [0, 2, 3]]}}),
        json!({"surface": {"kind": "mesh", "obj": OBJ}}),
        json!({"surface": {"kind": "mesh", "stl": STL}}),
    ]
}

fn requests() -> Vec<Vec<u8>> {
    let accuracy = json!({"level": "linear", "max_error_um": 5, "max_time_ms": 2, "strict": true});
    let predict = json!({"scene": scenes()[1], "needle": needle(), "force_mn": [0, 0.1, -0.8], "accuracy": accuracy,
        "effects": ["contact"], "control": "force"});
    let batch = json!({"scene": "fovea", "poses": [{"needle": needle(), "force_mn": [0, 0, -0.1]},
        {"needle": needle(), "control": "pose"}], "accuracy": accuracy, "effects": "all"});
    let simulate = json!({"needle": needle(), "steps": [{"time_s": 0.2, "force_mn": [0, 0, -0.4]},
        {"time_s": 1.2, "tip_mm": [0, 0, 0]}], "effects": "auto"});
    (0..).zip([predict, batch, simulate]).map(|(first, message)| with_first(first, &text(&message))).collect()
}

fn stream() -> Vec<Vec<u8>> {
    let pose = crate::stream_client::encode_pose(7, 1.5, [0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], Some([0.0, 0.0, -0.1]));
    let open = json!({"open": {"scene": "macula", "needle": {"gauge": "25G"}, "accuracy": {"level": "linear"}, "format": "binary"}});
    let told = json!({"pose": {"sequence": 1, "client_time_us": 1.5, "tip_mm": [0, 0, 0], "force_mn": [0, 0, -0.1]}});
    let step = json!({"time_s": 0.1, "tip_mm": [0, 0, -0.05], "direction": [0, 0, -1]});
    let memory = json!({"open": {"accuracy": {"level": "coarse"}, "memory": {"rehearsal": [step, step]}}});
    let timed = crate::stream_client::at_time(pose.clone(), 0.2);
    vec![pose, timed, text(&open), text(&told), text(&memory)]
}

fn weights(network: &str) -> Vec<u8> {
    let data: Vec<u8> = (0..6u8).flat_map(|number| f32::from(number).to_le_bytes()).collect();
    let header = format!(
        r#"{{"__metadata__":{{"sha256":"{}","network":"{network}"}},"a":{{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]}}}}"#,
        hash(&data)
    );
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &data].concat()
}
