//! What there is to choose from, the service's description of itself, and its pages.

use axum::body::Body;
use axum::http::Request;
use serde_json::Value;

use crate::harness::{get, post, predict, request, send};
use crate::schema::{assert_matches, check, description};

const ROUTES: [(&str, &str); 16] = [
    ("post", "/v1/predict"),
    ("post", "/v1/predict/batch"),
    ("post", "/v1/simulate"),
    ("get", "/v1/stream"),
    ("get", "/v1/scenes"),
    ("post", "/v1/scenes"),
    ("get", "/v1/scenes/{id}"),
    ("delete", "/v1/scenes/{id}"),
    ("get", "/v1/levels"),
    ("get", "/v1/accuracy"),
    ("get", "/v1/gauges"),
    ("get", "/v1/about"),
    ("get", "/metrics"),
    ("get", "/healthz"),
    ("get", "/readyz"),
    ("get", "/problems/{name}"),
];

#[test]
fn the_description_has_every_route_and_no_other() {
    let paths = description()["paths"].as_object().expect("paths");
    let mut described: Vec<(&str, &str)> = paths
        .iter()
        .flat_map(|(path, item)| {
            let methods = item.as_object().expect("methods");
            methods.keys().map(move |method| (method.as_str(), path.as_str()))
        })
        .collect();
    let mut expected = ROUTES.to_vec();
    described.sort_unstable();
    expected.sort_unstable();
    assert_eq!(described, expected);
}

#[test]
fn every_answer_matches_its_schema() {
    for (path, schema) in [
        ("/v1/scenes", "SceneList"),
        ("/v1/levels", "LevelList"),
        ("/v1/accuracy", "CostTable"),
        ("/v1/gauges", "GaugeList"),
        ("/healthz", "Readiness"),
        ("/nowhere", "ProblemDocument"),
    ] {
        assert_matches(schema, &get(path).body);
    }
    assert_matches("ProblemDocument", &post("{}").body);
}

#[test]
fn every_example_matches_its_schema_and_the_request_is_answered() {
    let schemas = description()["components"]["schemas"].as_object().expect("schemas");
    let with_example: Vec<_> = schemas.iter().filter(|(_, schema)| schema.get("example").is_some()).collect();
    assert!(with_example.len() >= 3, "{with_example:?}");
    for (name, schema) in with_example {
        check(schema, &schema["example"], name).expect("the example matches");
    }
    let reply = predict(&schemas["PredictRequest"]["example"]);
    assert_eq!(reply.status, 200, "{}", reply.body);
}

#[test]
fn the_validator_itself_refuses() {
    let mut answer = get("/v1/levels").body;
    answer["default"] = Value::Null;
    let schema = &description()["components"]["schemas"]["LevelList"];
    assert!(check(schema, &answer, "LevelList").is_err());
}

#[test]
fn the_lists_name_what_requests_may_name() {
    let levels = get("/v1/levels").body;
    let names: Vec<&str> =
        levels["levels"].as_array().expect("levels").iter().filter_map(|level| level["name"].as_str()).collect();
    assert_eq!(names, ["linear", "network", "coarse", "corrected", "reference"]);
    let gauges = get("/v1/gauges").body;
    for gauge in gauges["gauges"].as_array().expect("gauges") {
        let request = crate::harness::with(request("linear"), "/needle/gauge", gauge["name"].clone());
        let reply = predict(&crate::harness::with(request, "/force_mn/2", serde_json::json!(-0.01)));
        assert_eq!(reply.status, 200, "{gauge}: {}", reply.body);
        assert!(gauge["stiffness_mn_per_mm"].as_f64() > Some(1.0), "{gauge}");
    }
    let parameters = get("/v1/scenes").body["parameters"].clone();
    for parameter in parameters.as_array().expect("parameters") {
        let number = |key: &str| parameter[key].as_f64().expect("number");
        assert!(number("min") <= number("default") && number("default") <= number("max"), "{parameter}");
        assert!(!parameter["source"].as_str().expect("source").is_empty());
    }
}

#[test]
fn every_kind_of_problem_has_a_page() {
    let kind = post("{}").body["type"].as_str().expect("type").to_owned();
    let page = get(&kind);
    assert_eq!(page.status, 200);
    assert!(page.body.as_str().is_some_and(|text| text.contains("422")), "{}", page.body);
    assert_eq!(get("/problems/%ff").media_type(), "application/problem+json");
    let known = get("/problems/nothing");
    assert_eq!(known.status, 404);
    let detail = known.body["detail"].as_str().expect("detail");
    for name in detail.split("known are ").nth(1).expect("list").trim_end_matches('.').split(", ") {
        assert_eq!(get(&format!("/problems/{name}")).status, 200, "{name}");
    }
}

#[test]
fn the_documentation_loads_without_another_server() {
    assert_eq!(get("/docs").status, 303);
    let docs = get("/docs/").body;
    let docs = docs.as_str().expect("page");
    let linked = |attribute: &str| {
        let parts: Vec<String> =
            docs.split(attribute).skip(1).filter_map(|part| part.split('"').next().map(str::to_owned)).collect();
        parts
    };
    let files: Vec<String> = [linked("src=\""), linked("href=\"")].concat();
    assert!(!files.is_empty());
    for file in files {
        assert!(!file.contains("//"), "{file} is elsewhere");
        assert_eq!(get(&format!("/docs/{}", file.trim_start_matches("./"))).status, 200, "{file}");
    }
}

#[test]
fn a_wrong_url_or_method_is_a_problem_too() {
    let lost = get("/v2/predict");
    assert_eq!((lost.status.as_u16(), lost.media_type()), (404, "application/problem+json"));
    let wrong = get("/v1/predict");
    assert_eq!((wrong.status.as_u16(), wrong.media_type()), (405, "application/problem+json"));
    assert_eq!(wrong.headers["allow"], "POST");
    let delete = send(Request::delete("/v1/scenes").body(Body::empty()).expect("request"));
    assert_eq!(delete.status, 405);
}
