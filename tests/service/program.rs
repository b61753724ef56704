//! The program without HTTP.

use std::fs;
use std::path::PathBuf;

use clap::Parser as _;
use retina_server::cli::{Streams, predict_file};
use retina_server::config::{Command, CommandLine};
use serde_json::{Value, json};

use crate::answers::{plane_obj, plane_ply};
use crate::harness::{predict, request, with};

/// Exit code, standard output and standard error of `retina-server predict`.
fn program(arguments: &[&str], input: &str) -> (u8, String, String) {
    let words = ["retina-server", "predict"].iter().chain(arguments);
    let Some(Command::Predict(args)) = CommandLine::try_parse_from(words).expect("arguments").command else {
        panic!("not predict");
    };
    let (mut output, mut problems) = (Vec::new(), Vec::new());
    let streams = Streams { input: &mut input.as_bytes(), output: &mut output, problems: &mut problems };
    let code = predict_file(&args, streams).expect("streams");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (code, text(output), text(problems))
}

fn timeless(text: &str) -> Value {
    let mut answer: Value = serde_json::from_str(text).expect("JSON");
    answer.as_object_mut().expect("object").remove("time_us").expect("time");
    answer
}

/// A file that is deleted when dropped.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str, text: &str) -> Self {
        let path = std::env::temp_dir().join(format!("retina-{}-{name}", std::process::id()));
        fs::write(&path, text).expect("file");
        Self(path)
    }

    fn path(&self) -> &str {
        self.0.to_str().expect("UTF-8")
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn the_program_answers_as_the_service_does() {
    for level in ["linear", "coarse"] {
        let request = request(level);
        let (code, output, problems) = program(&["-"], &request.to_string());
        assert_eq!((code, problems.as_str()), (0, ""));
        let mut served = predict(&request).body;
        served.as_object_mut().expect("object").remove("time_us").expect("time");
        assert_eq!(timeless(&output), served, "{level}");
        let file = Scratch::new(&format!("{level}.json"), &request.to_string());
        let (_, pretty, _) = program(&[file.path(), "--pretty"], "");
        assert!(pretty.lines().count() > 10);
        assert_eq!(timeless(&pretty), served, "{level}");
    }
}

#[test]
fn the_program_refuses_as_the_service_does() {
    let bad = with(request("linear"), "/needle/radius_mm", json!(-1));
    let (code, output, problems) = program(&["-"], &bad.to_string());
    assert_eq!((code, output.as_str()), (1, ""));
    let problem: Value = serde_json::from_str(&problems).expect("a problem document");
    assert_eq!(problem, predict(&bad).body);
    let (code, _, problems) = program(&["/nowhere/request.json"], "");
    assert_eq!(code, 2);
    assert!(problems.contains("/nowhere/request.json"));
}

#[test]
fn a_mesh_file_takes_the_place_of_the_surface() {
    let inline = with(request("coarse"), "/scene", json!({"surface": {"kind": "mesh", "obj": plane_obj()}}));
    let mut served = predict(&inline).body;
    served.as_object_mut().expect("object").remove("time_us").expect("time");
    for (name, text) in [("plane.obj", plane_obj()), ("plane.ply", plane_ply())] {
        let file = Scratch::new(name, &text);
        let (code, output, problems) = program(&["-", "--mesh", file.path()], &request("coarse").to_string());
        assert_eq!(code, 0, "{problems}");
        assert_eq!(timeless(&output), served, "{name}");
    }
    let wrong = Scratch::new("plane.txt", "");
    let (code, _, problems) = program(&["-", "--mesh", wrong.path()], &request("coarse").to_string());
    assert_eq!(code, 1);
    assert!(problems.contains(".ply"), "{problems}");
}

#[test]
fn the_command_line_serves_by_default() {
    let parsed = CommandLine::try_parse_from(["retina-server", "--listen", "127.0.0.1:0"]).expect("arguments");
    assert!(parsed.command.is_none());
    assert_eq!(parsed.config.listen.port(), 0);
    let parsed = CommandLine::try_parse_from(["retina-server", "serve", "--queue", "3"]).expect("arguments");
    assert!(matches!(parsed.command, Some(Command::Serve(config)) if config.queue == 3));
    assert!(CommandLine::try_parse_from(["retina-server", "--threads", "0"]).is_err());
}
