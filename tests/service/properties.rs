//! Whatever is sent, the answer is a prediction or a problem of the caller's: never a fault of the server, never a number that is none.

use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::{Map, Value, json};

use crate::harness::{post, predict, request, with};

/// What a value may be replaced by.
fn value() -> impl Strategy<Value = Value> {
    let number = prop_oneof![
        any::<f64>().prop_map(|number| json!(number)),
        (-2.0..2.0).prop_map(|number| json!(number)),
        any::<i64>().prop_map(|number| json!(number)),
        prop_oneof![Just(0.0), Just(-0.0), Just(1e308), Just(5e-324), Just(0.4999)].prop_map(|number| json!(number)),
    ];
    let word = prop_oneof![
        "[ -~]{0,12}",
        prop_oneof![
            Just("flat"),
            Just("mesh"),
            Just("sphere"),
            Just("foveal_pit"),
            Just("pose"),
            Just("25G"),
            Just("41G"),
            Just("fovea"),
            Just("all"),
            Just("auto"),
            Just("linear"),
            Just("bevelled"),
            Just("finite_strain"),
            Just("v 0 0 0\nf 1 1 1"),
        ]
        .prop_map(str::to_owned),
    ];
    let leaf = prop_oneof![Just(Value::Null), any::<bool>().prop_map(Value::from), number, word.prop_map(Value::from)];
    leaf.prop_recursive(3, 16, 4, |inner| {
        let key = prop_oneof![
            Just("kind"),
            Just("radius_mm"),
            Just("tip_mm"),
            Just("retina"),
            Just("flat"),
            Just("thickness_mm"),
            Just("zzz"),
        ];
        prop_oneof![
            vec(inner.clone(), 0..4).prop_map(Value::from),
            vec((key.prop_map(str::to_owned), inner), 0..3).prop_map(|fields| Value::Object(Map::from_iter(fields))),
        ]
    })
}

/// Places inside a value, as JSON pointers.
fn pointers(value: &Value, at: String, found: &mut Vec<String>) {
    let mut inside = |key: &str, value: &Value| pointers(value, format!("{at}/{key}"), found);
    match value {
        Value::Array(items) => items.iter().enumerate().for_each(|(index, item)| inside(&index.to_string(), item)),
        Value::Object(fields) => fields.iter().for_each(|(key, field)| inside(key, field)),
        _ => {}
    }
    if !at.is_empty() {
        found.push(at);
    }
}

fn mutated(mut request: Value, changes: &[(prop::sample::Index, Value)]) -> Value {
    for (place, value) in changes {
        let mut found = Vec::new();
        pointers(&request, String::new(), &mut found);
        request = with(request, &found[place.index(found.len())], value.clone());
    }
    request
}

fn base() -> impl Strategy<Value = Value> {
    let scenes = prop_oneof![
        Just(json!("macula")),
        Just(json!("fovea")),
        Just(json!({
            "surface": {"kind": "foveal_pit", "radius_mm": 11.0, "depth_mm": 0.1, "sigma_mm": 0.3},
            "tissue": {
                "retina": [{"thickness_mm": 0.1}, {"thickness_mm": 0.15, "youngs_modulus_kpa": 9.0}],
                "choroid": {"youngs_modulus_kpa": 5.0},
                "sclera": {"poisson_ratio": 0.4},
            },
            "pose": {"position_mm": [0.1, 0.0, 0.0], "orientation_xyzw": [0.0, 0.0, 0.0, 1.0]},
        })),
    ];
    let needles = prop_oneof![
        Just(json!({"tip_mm": [0.1, 0.0, 0.0], "gauge": "27G", "direction": [0.0, 0.1, -1.0]})),
        Just(
            json!({"tip_mm": [0.0, 0.2, 0.1], "radius_mm": 0.2, "tip": {"bevelled": {"angle_deg": 45.0, "edge_radius_mm": 0.03}}})
        ),
    ];
    (scenes, needles, prop_oneof![Just("linear"), Just("coarse")]).prop_map(|(scene, needle, level)| {
        let request = with(with(request(level), "/scene", scene), "/needle", needle);
        with(request, "/effects", json!("auto"))
    })
}

fn assert_answer_or_problem(reply: &crate::harness::Reply) {
    if reply.status == 200 {
        assert_eq!(reply.body["surface"]["vertices_mm"].as_array().map(Vec::len), Some(64));
        return;
    }
    assert!(reply.status.is_client_error(), "{}: {}", reply.status, reply.body);
    assert_eq!(reply.media_type(), "application/problem+json");
    assert!(reply.body["type"].as_str().is_some_and(|kind| kind.starts_with("/problems/")));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mutated_request_is_answered_or_refused(base in base(), changes in vec((any::<prop::sample::Index>(), value()), 1..4)) {
        assert_answer_or_problem(&predict(&mutated(base, &changes)));
    }

    #[test]
    fn random_bytes_are_refused(bytes in vec(any::<u8>(), 0..200)) {
        let reply = post(bytes);
        prop_assert!(reply.status.is_client_error());
    }

    #[test]
    fn a_damaged_request_is_answered_or_refused(place in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut text = request("linear").to_string().into_bytes();
        let place = place.index(text.len());
        text[place] = byte;
        assert_answer_or_problem(&post(text));
    }
}
