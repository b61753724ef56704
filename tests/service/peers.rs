//! Clients that others wrote, of `tests/peers`, against a service on sockets.

use std::process::Command;

use serde_json::{Value, json};

use crate::harness::{Running, predict, request, with};
use crate::igtl::start;

/// Where a Python with the packages is; it is then not a matter of luck whether they are there.
const PYTHON: &str = "RETINA_PEERS_PYTHON";

/// What the program of `tests/peers` prints; `None`, and said so, where no Python has the package.
fn run(script: &str, package: &str, argument: &str) -> Option<Value> {
    let chosen = std::env::var(PYTHON).ok();
    let python = chosen.clone().unwrap_or_else(|| if cfg!(windows) { "python" } else { "python3" }.to_owned());
    let has_package = Command::new(&python).args(["-c", &format!("import {package}")]).output();
    if !has_package.is_ok_and(|run| run.status.success()) {
        assert!(chosen.is_none(), "{PYTHON} is {python}, which has no {package}");
        eprintln!("no Python with {package}, see tests/peers/README.md; {script} is not tried");
        return None;
    }
    let path = format!("{}/peers/{script}", env!("CARGO_MANIFEST_DIR"));
    let run = Command::new(&python).arg("-B").arg(path).arg(argument).output().expect("Python");
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
    Some(serde_json::from_str(text.lines().last().expect("a line")).unwrap_or_else(|error| panic!("{error}: {text}")))
}

/// The prediction that the programs ask for.
fn alone(level: &str) -> Value {
    let asked = with(request(level), "/needle/tip_mm", json!([0.125, -0.0625, 0.0]));
    predict(&with(asked, "/force_mn", json!([0.0, 0.125, -0.5]))).body
}

fn near(name: &str, told: &Value, expected: &Value) {
    match (told, expected) {
        (Value::Array(told), Value::Array(expected)) => {
            assert_eq!(told.len(), expected.len(), "{name}");
            told.iter().zip(expected).for_each(|(told, expected)| near(name, told, expected));
        }
        _ => {
            let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{name}: {value}"));
            let (told, expected) = (number(told), number(expected));
            // Numbers of 32 bits, below a hundred.
            assert!((told - expected).abs() <= 1e-5, "{name}: {told} against {expected}");
        }
    }
}

#[test]
fn pyigtl_presses_the_retina() {
    let (_service, address) = start(&["--threads", "2"]);
    let Some(told) = run("igtl.py", "pyigtl", &address.port().to_string()) else { return };
    let alone = alone("coarse");
    assert_eq!(told["triangles"], alone["surface"]["triangles"]);
    near("nodes", &told["nodes_mm"], &alone["surface"]["vertices_mm"]);
    near("tip", &told["tip_mm"], &alone["needle"]["tip_mm"]);
    assert_eq!((&told["names"][0], &told["names"][63]), (&json!("0"), &json!("63")));
    assert_eq!(told["timestamp"], json!(12.5));
    assert_eq!(told["answer"]["needle"], alone["needle"]);
    assert_eq!(told["answer"]["accuracy"], alone["accuracy"]);
    assert_eq!(told["problem"]["errors"][0]["field"], "TRANSFORM.matrix");
}

#[test]
fn tritonclient_presses_the_retina_in_json_and_in_binary() {
    let service = Running::start(&["--threads", "2"]);
    let Some(out) = run("kserve.py", "tritonclient.http", &service.address.to_string()) else { return };
    let (told, alone) = (&out["told"], alone("network"));
    near("vertices", &told["vertices_mm"][0], &alone["surface"]["vertices_mm"]);
    near("normals", &told["normals"][0], &alone["surface"]["normals"]);
    near("travel", &told["travel_mm"][0][0], &alone["needle"]["travel_mm"]);
    near("reaction", &told["reaction_mn"][0], &alone["needle"]["reaction_mn"]);
    assert_eq!(told["calibrated"][0][0], alone["accuracy"]["calibrated"]);
    assert_eq!(told["vertices_mm"].as_array().expect("list").len(), 2);
    assert!(out["inputs"].as_array().expect("list").contains(&json!("choroid_thickness_mm")));
    assert!(out["refused"].as_str().is_some_and(|error| error.contains("row 0")), "{}", out["refused"]);
}
