//! KServe's Open Inference Protocol: tensors in, tensors out, in JSON and in binary, and what is refused.

use axum::body::{Body, to_bytes};
use axum::http::{Request, StatusCode};
use retina_server::app;
use serde_json::{Value, json};
use tower::ServiceExt as _;

use crate::harness::{Reply, get, predict, request, runtime, send, shared, state, with};

fn infer(model: &str, body: &Value) -> Reply {
    let request = Request::post(format!("/v2/models/{model}/infer")).header("content-type", "application/json");
    send(request.body(Body::from(body.to_string())).expect("request"))
}

fn input(name: &str, shape: &[usize], data: Value) -> Value {
    let datatype = if data.to_string().contains('"') { "BYTES" } else { "FP64" };
    json!({"name": name, "shape": shape, "datatype": datatype, "data": data})
}

/// One row that presses like [`request`].
fn asked() -> Value {
    json!({"inputs": [input("tip_mm", &[1, 3], json!([0.1, -0.05, 0.0])), input("force_mn", &[1, 3], json!([0.0, 0.0, -0.4]))]})
}

fn output<'a>(body: &'a Value, name: &str) -> &'a Value {
    let outputs = body["outputs"].as_array().unwrap_or_else(|| panic!("{body}"));
    outputs.iter().find(|output| output["name"] == name).unwrap_or_else(|| panic!("no {name}"))
}

fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        other => vec![other.as_f64().unwrap_or(f64::NAN)],
    }
}

/// Equal in 32 bits.
fn same(name: &str, told: &Value, long: &Value) {
    let (told, long) = (flat(told), flat(long));
    assert_eq!(told.len(), long.len(), "{name}");
    for (told, long) in told.iter().zip(long) {
        assert!(*told as f32 == long as f32, "{name}: {told} against {long}");
    }
}

#[test]
fn the_server_and_its_models_tell_of_themselves() {
    assert_eq!(get("/v2").body["extensions"], json!(["binary_tensor_data"]));
    assert_eq!(get("/v2/health/live").body, json!({"live": true}));
    while get("/v2/health/ready").status == StatusCode::SERVICE_UNAVAILABLE {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert_eq!(get("/v2/health/ready").body, json!({"ready": true}));
    assert_eq!(get("/v2/models/retina-network/ready").body, json!({"name": "retina-network", "ready": true}));
    for level in ["linear", "network", "coarse", "corrected", "reference"] {
        let told = get(&format!("/v2/models/retina-{level}"));
        assert_eq!((told.status, &told.body["name"]), (StatusCode::OK, &json!(format!("retina-{level}"))));
        assert_eq!(told.body["inputs"][0], json!({"name": "tip_mm", "datatype": "FP32", "shape": [-1, 3]}));
        assert_eq!(told.body["outputs"][0], json!({"name": "vertices_mm", "datatype": "FP32", "shape": [-1, 64, 3]}));
    }
    for path in ["/v2/models/resnet", "/v2/models/retina-", "/v2/models/resnet/ready", "/v2/models/%ff"] {
        let told = get(path);
        assert_eq!(told.status, StatusCode::NOT_FOUND, "{path}");
        assert!(told.body["error"].as_str().is_some_and(|error| error.contains("retina-network")), "{}", told.body);
    }
}

#[test]
fn a_row_is_the_prediction_in_32_bits() {
    for level in ["linear", "network", "coarse"] {
        let alone = predict(&request(level)).body;
        let body = with(asked(), "/id", json!("forty-two"));
        let told = infer(&format!("retina-{level}"), &body);
        assert_eq!((told.status, told.media_type()), (StatusCode::OK, "application/json"), "{}", told.body);
        assert_eq!(
            (&told.body["id"], &told.body["model_name"]),
            (&json!("forty-two"), &json!(format!("retina-{level}")))
        );
        let (surface, needle, contact) = (&alone["surface"], &alone["needle"], &alone["contact"]);
        let expected = &alone["accuracy"]["expected_error_um"];
        let error = json!([expected["median"], expected["p95"]]);
        for (name, shape, long) in [
            ("vertices_mm", json!([1, 64, 3]), &surface["vertices_mm"]),
            ("normals", json!([1, 64, 3]), &surface["normals"]),
            ("displacement_um", json!([1, 64]), &surface["displacement_um"]),
            ("needle_tip_mm", json!([1, 3]), &needle["tip_mm"]),
            ("travel_mm", json!([1, 1]), &json!([needle["travel_mm"]])),
            ("reaction_mn", json!([1, 3]), &needle["reaction_mn"]),
            ("contact_area_mm2", json!([1, 1]), &json!([contact["area_mm2"]])),
            ("max_strain", json!([1, 1]), &json!([contact["max_strain"]])),
            ("puncture_share", json!([1, 1]), &json!([contact["puncture_share"]])),
            ("expected_error_um", json!([1, 2]), &error),
        ] {
            let tensor = output(&told.body, name);
            assert_eq!((&tensor["shape"], &tensor["datatype"]), (&shape, &json!("FP32")), "{name}");
            same(name, &tensor["data"], long);
        }
        assert_eq!(output(&told.body, "calibrated")["data"], json!([alone["accuracy"]["calibrated"]]));
    }
}

#[test]
fn a_batch_is_its_rows_one_by_one_with_needle_and_tissue() {
    // More rows than a piece has, so that pieces are joined.
    const ROWS: usize = 150;
    let x = |row: usize| (row as f64 - 75.0) * 0.004;
    let tips: Vec<[f64; 3]> = (0..ROWS).map(|row| [x(row), 0.1, 0.0]).collect();
    let forces: Vec<[f64; 3]> = (0..ROWS).map(|row| [0.0, 0.02, -0.2 - 0.001 * row as f64]).collect();
    let gauges: Vec<&str> = (0..ROWS).map(|row| if row % 2 == 0 { "27G" } else { "25G" }).collect();
    let kinds: Vec<&str> = (0..ROWS).map(|row| if row % 3 == 0 { "flat" } else { "hemispherical" }).collect();
    let moduli: Vec<f64> = (0..ROWS).map(|row| if row < 50 { 20.0 } else { 30.0 }).collect();
    let body = json!({
        "parameters": {"scene": "flat"},
        "inputs": [
            input("tip_mm", &[ROWS, 3], json!(tips)),
            input("force_mn", &[ROWS, 3], json!(forces)),
            input("gauge", &[ROWS, 1], json!(gauges)),
            input("tip", &[ROWS], json!(kinds)),
            input("retina_youngs_modulus_kpa", &[ROWS, 1], json!(moduli)),
        ],
        "outputs": [{"name": "travel_mm"}, {"name": "displacement_um"}],
    });
    let told = infer("retina-linear", &body);
    assert_eq!(told.status, StatusCode::OK, "{}", told.body);
    assert_eq!(told.body["outputs"].as_array().expect("list").len(), 2);
    let travels = flat(&output(&told.body, "travel_mm")["data"]);
    let displacements = flat(&output(&told.body, "displacement_um")["data"]);
    assert_eq!((travels.len(), displacements.len()), (ROWS, 64 * ROWS));
    for row in [0, 1, 49, 50, 63, 64, 149] {
        let alone = predict(&json!({
            "scene": {"surface": {"kind": "flat"}, "tissue": {"retina": {"youngs_modulus_kpa": moduli[row]}}},
            "needle": {"tip_mm": tips[row], "gauge": gauges[row], "tip": kinds[row]},
            "force_mn": forces[row],
            "accuracy": {"level": "linear"},
        }))
        .body;
        assert_eq!(travels[row] as f32, alone["needle"]["travel_mm"].as_f64().expect("travel") as f32, "row {row}");
        same("displacement_um", &json!(displacements[64 * row..64 * row + 64]), &alone["surface"]["displacement_um"]);
    }
    let without = with(body, "/inputs/1", input("radius_mm", &[ROWS, 1], json!(vec![0.2; ROWS])));
    let both = infer("retina-linear", &without);
    assert_eq!(both.status, StatusCode::BAD_REQUEST);
    assert!(both.body["error"].as_str().expect("text").starts_with("row 0: "), "{}", both.body);
}

#[test]
fn binary_tensors_are_the_json_ones() {
    let in_json = infer("retina-network", &asked()).body;
    let numbers = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let (tip, force) = (numbers(&[0.1, -0.05, 0.0]), numbers(&[0.0, 0.0, -0.4]));
    let gauge = [&3u32.to_le_bytes()[..], b"25G"].concat();
    let tensor = |name: &str, shape: Value, datatype: &str, bytes: &[u8]| json!({"name": name, "shape": shape, "datatype": datatype, "parameters": {"binary_data_size": bytes.len()}});
    let head = json!({
        "inputs": [
            tensor("tip_mm", json!([1, 3]), "FP64", &tip),
            tensor("gauge", json!([1, 1]), "BYTES", &gauge),
            tensor("force_mn", json!([1, 3]), "FP64", &force),
        ],
        "outputs": [
            {"name": "vertices_mm", "parameters": {"binary_data": true}},
            {"name": "travel_mm"},
            {"name": "calibrated", "parameters": {"binary_data": true}},
        ],
    })
    .to_string();
    let body = [head.as_bytes(), &tip, &gauge, &force].concat();
    let request =
        Request::post("/v2/models/retina-network/infer").header("inference-header-content-length", head.len());
    let request = request.header("content-type", "application/octet-stream").body(Body::from(body)).expect("request");
    let (length, bytes) = tokio::task::block_in_place(|| {
        runtime().block_on(async {
            let response = app(shared()).oneshot(request).await.expect("infallible");
            assert_eq!(response.status(), StatusCode::OK);
            let length = response.headers()["inference-header-content-length"].to_str().expect("text").to_owned();
            (length, to_bytes(response.into_body(), usize::MAX).await.expect("body"))
        })
    });
    let (head, data) = bytes.split_at(length.parse().expect("number"));
    let head: Value = serde_json::from_slice(head).expect("JSON");
    let sizes: Vec<&Value> =
        ["vertices_mm", "calibrated"].map(|name| &output(&head, name)["parameters"]["binary_data_size"]).into();
    assert_eq!(sizes, [&json!(4 * 192), &json!(1)]);
    let vertices: Vec<f32> =
        data[..4 * 192].as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    same("vertices_mm", &json!(vertices), &output(&in_json, "vertices_mm")["data"]);
    assert_eq!(output(&head, "travel_mm")["data"], output(&in_json, "travel_mm")["data"]);
    assert_eq!(json!([data[4 * 192] == 1]), output(&in_json, "calibrated")["data"]);
    assert_eq!(data.len(), 4 * 192 + 1);
}

#[test]
fn without_a_force_the_needle_is_held() {
    let held = json!({"inputs": [input("tip_mm", &[1, 3], json!([[0.0, 0.0, -0.05]]))]});
    let told = infer("retina-linear", &held).body;
    assert_eq!(output(&told, "travel_mm")["data"], json!([0.0]));
    assert!(flat(&output(&told, "reaction_mn")["data"])[2] > 0.0);
}

#[test]
fn what_is_wrong_is_an_error_of_the_protocol_that_says_where() {
    let second = "/inputs/1";
    for (name, model, body, said) in [
        ("unknown model", "retina-magic", asked(), "known are retina-linear"),
        ("unknown input", "retina-linear", with(asked(), "/inputs/1/name", json!("velocity")), "no input \"velocity\""),
        (
            "no tip",
            "retina-linear",
            json!({"inputs": [input("force_mn", &[1, 3], json!([0, 0, -1]))]}),
            "tip_mm is missing",
        ),
        ("shape", "retina-linear", with(asked(), "/inputs/1/shape", json!([3])), "must be [N, 3]"),
        ("no rows", "retina-linear", with(asked(), second, input("force_mn", &[0, 3], json!([]))), "N from 1"),
        (
            "rows",
            "retina-linear",
            with(asked(), second, input("force_mn", &[2, 3], json!([0, 0, -1, 0, 0, -1]))),
            "has 2 rows",
        ),
        ("elements", "retina-linear", with(asked(), "/inputs/1/data", json!([0.0, 1.0])), "has 2 elements"),
        ("element", "retina-linear", with(asked(), "/inputs/1/data", json!([0.0, null, 1.0])), "null"),
        ("datatype", "retina-linear", with(asked(), "/inputs/1/datatype", json!("INT64")), "FP32 or FP64"),
        ("outside", "retina-linear", with(asked(), "/inputs/0/data", json!([9.0, 0.0, 0.0])), "row 0:"),
        ("output", "retina-linear", with(asked(), "/outputs", json!([{"name": "logits"}])), "no output \"logits\""),
        ("parameter", "retina-linear", with(asked(), "/parameters", json!({"speed": 1})), "\"speed\""),
        ("scene", "retina-linear", with(asked(), "/parameters", json!({"scene": "moon"})), "known are"),
        ("gauge", "retina-linear", with(asked(), second, input("gauge", &[1], json!(["26G"]))), "there is no \"26G\""),
        ("twice", "retina-linear", with(asked(), "/inputs/1/name", json!("tip_mm")), "given twice"),
        (
            "binary",
            "retina-linear",
            with(asked(), "/inputs/1/parameters", json!({"binary_data_size": 24})),
            "beyond the end",
        ),
        ("field", "retina-linear", with(asked(), "/speed", json!(1)), "unknown field"),
    ] {
        let told = infer(model, &body);
        let expected = if name == "unknown model" { StatusCode::NOT_FOUND } else { StatusCode::BAD_REQUEST };
        assert_eq!(told.status, expected, "{name}: {}", told.body);
        let error = told.body["error"].as_str().unwrap_or_else(|| panic!("{name}: {}", told.body));
        assert!(error.contains(said), "{name}: {error}");
        assert_eq!(told.body.as_object().map(serde_json::Map::len), Some(1), "{name}");
    }
    let wrong = [
        ("inference-header-content-length", "many"),
        ("inference-header-content-length", "99999"),
        ("content-encoding", "gzip"),
    ];
    for (header, value) in wrong {
        let request = Request::post("/v2/models/retina-linear/infer").header(header, value);
        let told = send(request.body(Body::from(asked().to_string())).expect("request"));
        assert!(told.status.is_client_error() && told.body["error"].is_string(), "{header}: {}", told.body);
    }
}

#[test]
fn models_need_the_token_and_health_does_not() {
    let token = "a-token-of-the-test-0123456789";
    let guarded = app(state(&["--threads", "1", "--token", token]));
    let status = |path: &str, authorization: Option<&str>| {
        let mut request = Request::get(path);
        if let Some(value) = authorization {
            request = request.header("authorization", value);
        }
        let request = request.body(Body::empty()).expect("request");
        let answered = guarded.clone().oneshot(request);
        tokio::task::block_in_place(|| runtime().block_on(answered)).expect("infallible").status()
    };
    assert_eq!(status("/v2/health/live", None), StatusCode::OK);
    assert_eq!(status("/v2/models/retina-linear", None), StatusCode::UNAUTHORIZED);
    assert_eq!(status("/v2/models/retina-linear", Some(&format!("Bearer {token}"))), StatusCode::OK);
}
