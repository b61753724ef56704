//! Stored scenes outlive the program, however it ends, and are never anything but what was given.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime};

use retina_tests::spawned::Spawned;
use serde_json::{Value, json};

use crate::harness::{Running, request, with};
use crate::stored::{call, id, prepared, shifted};

/// A folder that is removed when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("retina-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        Self(path)
    }

    pub fn text(&self) -> &str {
        self.0.to_str().expect("UTF-8")
    }

    fn serve(&self) -> Running {
        Running::start(&["--threads", "1", "--scene-store", self.text()])
    }

    fn file(&self, id: &str) -> PathBuf {
        self.0.join(format!("{id}.json"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn post(url: &str, scene: &Value) -> String {
    let (status, told) = call("POST", &format!("{url}/v1/scenes"), Some(scene));
    assert!(status == 201 && told["durable"] == true, "{status} {told}");
    id(&told).to_owned()
}

fn predict(url: &str, id: &str) -> (u16, Value) {
    let request = with(request("linear"), "/scene", json!(id));
    call("POST", &format!("{url}/v1/predict"), Some(&with(request, "/needle/tip_mm/2", json!(0.25))))
}

#[test]
fn a_stored_scene_is_there_after_a_restart() {
    let folder = Folder::new("restart");
    let (kept, before) = {
        let service = folder.serve();
        let id = post(&service.url(""), &shifted(0.25));
        let answer = predict(&service.url(""), &id);
        (id, answer.1["surface"].clone())
    };
    let service = folder.serve();
    assert_eq!(prepared(&service.url(""), &kept)["state"], "ready");
    let (status, after) = predict(&service.url(""), &kept);
    assert_eq!((status, &after["surface"]), (200, &before), "the same bits as before");
}

#[test]
fn two_services_over_one_folder_see_what_the_other_does() {
    let folder = Folder::new("two");
    let (one, other) = (folder.serve(), folder.serve());
    let kept = post(&one.url(""), &shifted(0.125));
    assert_eq!(predict(&other.url(""), &kept).0, 200, "at once, before anybody looked");
    assert_eq!(prepared(&other.url(""), &kept)["state"], "ready");
    assert_eq!(call("POST", &other.url("/v1/scenes"), Some(&shifted(0.125))).0, 200);
    assert_eq!(call("DELETE", &one.url(&format!("/v1/scenes/{kept}")), None).0, 204);
    assert_eq!(call("GET", &other.url("/v1/scenes"), None).1["stored"], json!([]));
    assert_eq!(predict(&other.url(""), &kept).0, 422);
}

#[test]
fn what_is_not_what_was_given_is_told_and_never_used() {
    let folder = Folder::new("corrupt");
    let (changed, cut) = {
        let service = folder.serve();
        (post(&service.url(""), &shifted(0.1)), post(&service.url(""), &shifted(0.2)))
    };
    let mut content = fs::read(folder.file(&changed)).expect("content");
    let digit = content.iter().rposition(u8::is_ascii_digit).expect("a digit");
    content[digit] = if content[digit] == b'1' { b'2' } else { b'1' };
    fs::write(folder.file(&changed), &content).expect("written");
    let content = fs::read(folder.file(&cut)).expect("content");
    fs::write(folder.file(&cut), &content[..content.len() / 2]).expect("written");
    fs::write(folder.0.join("notes.txt"), "not a scene").expect("written");

    let service = folder.serve();
    for id in [&changed, &cut] {
        let told = prepared(&service.url(""), id);
        assert_eq!(told["state"], "corrupt", "{told}");
        assert!(told["cause"].as_str().is_some_and(|cause| cause.contains(id.as_str())), "{told}");
        let (status, problem) = predict(&service.url(""), id);
        assert_eq!((status, &problem["type"]), (422, &json!("/problems/corrupt-scene")), "{problem}");
    }
    // Stored again it is whole, deleted it is gone.
    assert_eq!(post(&service.url(""), &shifted(0.1)), changed);
    assert_eq!(prepared(&service.url(""), &changed)["state"], "ready");
    assert_eq!(predict(&service.url(""), &changed).0, 200);
    assert_eq!(call("DELETE", &service.url(&format!("/v1/scenes/{cut}")), None).0, 204);
    let (_, list) = call("GET", &service.url("/v1/scenes"), None);
    assert_eq!(list["store"]["scenes"], 1, "{list}");
    assert!(folder.0.join("notes.txt").exists(), "what is no scene is left alone");
}

#[test]
fn files_that_were_being_written_are_not_scenes_and_go_once_they_are_old() {
    let folder = Folder::new("leftovers");
    fs::create_dir_all(&folder.0).expect("folder");
    let unfinished = |digit: &str, written: SystemTime| {
        let path = folder.0.join(format!("{}.json#1", digit.repeat(64)));
        fs::write(&path, "{\"surface\":").expect("written");
        let file = fs::File::options().write(true).open(&path).expect("file");
        file.set_modified(written).expect("time");
        path
    };
    let (now, hour) = (SystemTime::now(), Duration::from_secs(3600));
    let (old, young) = (unfinished("a", now - hour), unfinished("b", now));
    let of_a_time_to_come = unfinished("c", now + hour);
    let service = folder.serve();
    assert_eq!(call("GET", &service.url("/v1/scenes"), None).1["stored"], json!([]));
    assert!(!old.exists() && young.exists(), "a young one may be another server's at this moment");
    assert!(!of_a_time_to_come.exists(), "written before the clock was set back, it would be young for as long");
}

/// A mesh of many vertices, so that writing it takes a while.
fn large(number: usize) -> Value {
    let side = 60;
    let coordinate = |index: usize| 0.1 * (index as f64 - 30.0);
    let height = number as f64 * 1e-3 + 1.0 / 3.0;
    let vertices: Vec<_> = (0..side * side).map(|i| [coordinate(i % side), coordinate(i / side), height]).collect();
    let squares = (0..(side - 1) * (side - 1)).map(|i| (i / (side - 1)) * side + i % (side - 1));
    let triangles: Vec<_> = squares.flat_map(|c| [[c, c + 1, c + side + 1], [c, c + side + 1, c + side]]).collect();
    json!({"surface": {"kind": "mesh", "vertices_mm": vertices, "triangles": triangles}})
}

/// Scenes that must have been stored for the test to tell anything.
const LEAST: usize = 6;

/// Times that the program is killed: at least, and at most.
const ROUNDS: (usize, usize) = (12, 80);

/// Stores scenes until the program is gone; those that it said it had.
fn store_until_killed(url: &str, from: usize) -> Vec<String> {
    let mut acknowledged = Vec::new();
    for number in from.. {
        let body = large(number).to_string();
        let post = ureq::post(format!("{url}/v1/scenes")).header("content-type", "application/json").send(body);
        let Ok(text) = post.and_then(|mut response| response.body_mut().read_to_string()) else { break };
        let told: Value = serde_json::from_str(&text).expect("JSON");
        acknowledged.push(id(&told).to_owned());
    }
    acknowledged
}

#[test]
fn killed_at_any_moment_it_keeps_what_it_said_it_had_and_nothing_half() {
    let folder = Folder::new("killed");
    let (program, mut random) = (Path::new(env!("CARGO_BIN_EXE_serve")), fastrand::Rng::with_seed(7));
    let arguments = ["--threads", "1", "--scene-store", folder.text()];
    let (mut acknowledged, mut round) = (Vec::new(), 0);
    // A slow machine needs more rounds to store anything before it is killed.
    while round < ROUNDS.0 || (acknowledged.len() < LEAST && round < ROUNDS.1) {
        let running = Spawned::start(program, &arguments).expect("program");
        // While it warms up, everybody waits for the one thread.
        while ureq::get(running.url("/readyz")).call().is_err() {
            thread::sleep(Duration::from_millis(10));
        }
        let url = running.url("");
        let storing = thread::spawn(move || store_until_killed(&url, 1000 * round));
        thread::sleep(Duration::from_millis(random.u64(20..400)));
        running.kill().expect("killed");
        acknowledged.extend(storing.join().expect("thread"));
        round += 1;
    }
    assert!(acknowledged.len() >= LEAST, "too few to tell anything: {}", acknowledged.len());
    let running = Spawned::start(program, &arguments).expect("program");
    let (_, list) = call("GET", &running.url("/v1/scenes"), None);
    let listed: Vec<&str> = list["stored"].as_array().expect("list").iter().map(id).collect();
    for known in &acknowledged {
        assert!(listed.contains(&known.as_str()), "{known} was acknowledged and is lost");
    }
    for known in listed {
        let told = prepared(&running.url(""), known);
        assert_eq!(told["state"], "ready", "{told}");
    }
}
