//! `clients/unity`, without the engine.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use super::CLIENTS;
use crate::harness::{Running, predict};

/// Compilers of C# and what runs their programs must be there where this variable is set.
const REQUIRED: &str = "RETINA_MONO";

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.expect("entry").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "cs")).collect()
}

#[test]
fn the_unity_component_presses_a_mesh() {
    let is_there = |program: &str| Command::new(program).arg("--version").output().is_ok();
    if !is_there("mcs") || !is_there("mono") {
        assert!(std::env::var_os(REQUIRED).is_none(), "{REQUIRED} is set, and mcs or mono is not there");
        eprintln!("no mcs and mono (Debian: apt install mono-mcs mono-runtime); the Unity client is not tried");
        return;
    }
    let root = Path::new(CLIENTS).join("unity");
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("press_unity.exe");
    let mut compiler = Command::new("mcs");
    compiler.args(["-langversion:7", "-warnaserror"]).arg(format!("-out:{}", program.display()));
    compiler.args(["Runtime", "Runtime/Wire", "Tests~"].iter().flat_map(|folder| sources(&root.join(folder))));
    let compiled = compiler.output().expect("mcs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let service = Running::start(&["--threads", "2"]);
    let run =
        Command::new("mono").arg(&program).arg(format!("ws://{}/v1/stream", service.address)).output().expect("mono");
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
    // The same press over HTTP, its deepest node exchanged by hand.
    let asked = json!({"needle": {"tip_mm": [0.125, -0.25, 0.0]}, "force_mn": [0.0, 0.0, -0.5], "accuracy": {"level": "linear"}});
    let alone = predict(&asked).body;
    let vertices: Vec<[f64; 3]> = serde_json::from_value(alone["surface"]["vertices_mm"].clone()).expect("vertices");
    let deepest = vertices.iter().copied().min_by(|a, b| a[2].total_cmp(&b[2])).expect("vertices");
    let travel = &alone["needle"]["travel_mm"];
    let pressed = text.lines().find(|line| line.starts_with("pressed:")).unwrap_or_else(|| panic!("{text}"));
    let told: Vec<f64> = pressed.split(' ').filter_map(|word| word.parse().ok()).collect();
    let expected = [deepest[0], deepest[2], deepest[1], 0.5, Value::as_f64(travel).expect("travel")];
    assert_eq!(told.len(), expected.len(), "{pressed}");
    for (told, expected) in told.iter().zip(expected) {
        assert!((told - expected).abs() < 1e-6, "{pressed} against {expected:?}");
    }
    assert!(text.contains("refused: ") && text.contains("26G"), "{text}");
}
