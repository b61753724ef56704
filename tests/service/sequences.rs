//! `POST /v1/simulate`: lines in order as they are computed, refusals before the first, clients that go, limits.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser as _;
use retina_server::cli::{Streams, simulate_file};
use retina_server::config::{Command, CommandLine};
use serde_json::{Value, json};

use crate::harness::{Running, agent, predict, request, with};
use crate::schema::{assert_matches, description};

/// A sequence that presses harder from step to step, then lets go.
fn ramp(steps: usize) -> Value {
    let mut list: Vec<Value> = (1..steps)
        .map(|k| json!({"time_s": 0.1 * k as f64, "force_mn": [0.0, 0.0, -0.4 * k as f64 / steps as f64]}))
        .collect();
    list.push(json!({"time_s": 0.1 * steps as f64, "force_mn": [0.0, 0.0, 0.0]}));
    json!({
        "needle": {"tip_mm": [0.1, -0.05, 0.0]},
        "steps": list,
        "effects": ["elasticity", "finite_strain", "contact"],
    })
}

pub fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("one JSON object a line")).collect()
}

/// Status, media type and body of a simulation over a socket.
pub fn simulate(service: &Running, request: &Value) -> (u16, String, String) {
    let post = agent().post(service.url("/v1/simulate")).header("content-type", "application/json");
    let mut response = post.send(request.to_string()).expect("answer");
    let media_type = response.headers()["content-type"].to_str().expect("text").to_owned();
    let body = response.body_mut().read_to_string().expect("body");
    (response.status().as_u16(), media_type, body)
}

/// Writes a simulation's request on a bare connection that closes after its answer.
fn begin(service: &Running, request: &Value) -> TcpStream {
    let mut connection = TcpStream::connect(service.address).expect("connection");
    let body = request.to_string();
    let head = format!(
        "POST /v1/simulate HTTP/1.1\r\nhost: retina\r\nconnection: close\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    connection.write_all(head.as_bytes()).expect("head");
    connection.write_all(body.as_bytes()).expect("body");
    connection
}

#[test]
fn lines_come_in_order_and_match_their_schema() {
    let service = Running::start(&["--threads", "1"]);
    let (status, media_type, body) = simulate(&service, &ramp(5));
    assert_eq!((status, media_type.as_str()), (200, "application/x-ndjson"), "{body}");
    let lines = lines(&body);
    assert_eq!(lines.len(), 7, "{body}");
    for line in &lines {
        assert_eq!(line.as_object().expect("object").len(), 1);
        assert_matches("SimulateLine", line);
    }
    assert_eq!(lines[0]["begin"]["steps"], 5);
    assert_eq!(lines[0]["begin"]["triangles"].as_array().expect("list").len(), 98);
    let depth = |line: &Value| {
        let nodes = line["step"]["surface"]["displacement_um"].as_array().expect("list").clone();
        nodes.iter().filter_map(Value::as_f64).fold(0.0, f64::max)
    };
    for index in 0..5 {
        let step = &lines[index + 1]["step"];
        assert_eq!(step["index"], index);
        assert_eq!(step["surface"]["vertices_mm"].as_array().expect("list").len(), 64);
    }
    assert!((1..4).all(|index| depth(&lines[index]) < depth(&lines[index + 1])));
    assert_eq!(depth(&lines[5]), 0.0);
    assert_eq!(lines[6], json!({"end": {"steps": 5}}));
}

#[test]
fn a_static_step_is_the_prediction() {
    let mut sequence = ramp(2);
    sequence["steps"] = json!([{"time_s": 1.0, "force_mn": [0.0, 0.0, -0.4]}]);
    let service = Running::start(&["--threads", "1"]);
    let step = lines(&simulate(&service, &sequence).2)[1]["step"].clone();
    let alone = predict(&request("coarse")).body;
    for part in ["needle", "contact", "solver"] {
        assert_eq!(step[part], alone[part], "{part}");
    }
    assert_eq!(step["surface"]["vertices_mm"], alone["surface"]["vertices_mm"]);
}

#[test]
fn punctured_tissue_stays_punctured() {
    let service = Running::start(&["--threads", "1"]);
    let limited = with(ramp(5), "/scene", json!({"puncture": {"max_force_mn": 0.2, "max_strain": 5}}));
    let lines = lines(&simulate(&service, &limited).2);
    let steps: Vec<&Value> = lines[1..6].iter().map(|line| &line["step"]).collect();
    let states: Vec<&str> = steps.iter().map(|step| step["contact"]["state"].as_str().expect("state")).collect();
    // 0.08, 0.16, 0.24, 0.32 mN, then nothing.
    assert_eq!(states, ["touching", "touching", "punctured", "punctured", "punctured"]);
    let since = |step: &&&Value| step["warnings"].to_string().contains("punctured since");
    assert_eq!(steps.iter().filter(since).count(), 2);
    let row = lines[0]["begin"]["effects"].as_array().expect("list").iter().find(|effect| effect["name"] == "puncture");
    assert!(row.expect("always there")["value"].as_f64() > Some(0.3), "{row:?}");
}

#[test]
fn the_first_step_is_there_before_the_last_is_computed() {
    let service = Running::start(&["--threads", "1"]);
    let started = Instant::now();
    let mut reader = BufReader::new(begin(&service, &ramp(200)));
    let mut line = String::new();
    while !line.contains("\"step\"") {
        line.clear();
        assert!(reader.read_line(&mut line).expect("line") > 0, "the answer ends without a step");
    }
    let first = started.elapsed();
    reader.read_to_string(&mut line).expect("the rest");
    let whole = started.elapsed();
    assert!(line.contains("\"end\"") && first < whole / 4, "first after {first:?} of {whole:?}");
}

#[test]
fn a_client_that_goes_stops_its_simulation() {
    let service = Running::start(&["--threads", "1"]);
    let long = with(ramp(2000), "/accuracy", json!({"level": "reference"}));
    let connection = begin(&service, &long);
    thread::sleep(Duration::from_millis(1500));
    let busy = simulate(&service, &ramp(3));
    assert_eq!(busy.0, 503, "one thread, one simulation: {}", busy.2);
    drop(connection);
    let started = Instant::now();
    while simulate(&service, &ramp(3)).0 != 200 {
        assert!(started.elapsed() < Duration::from_secs(20), "the thread is not free again");
        thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn what_cannot_be_is_refused_before_the_first_line() {
    let service = Running::start(&["--threads", "1", "--simulation-steps", "4"]);
    let cases = [
        (with(ramp(3), "/steps", json!([])), "out-of-range", "steps"),
        (ramp(5), "out-of-range", "steps"),
        (with(ramp(3), "/steps/1/time_s", json!(0.1)), "out-of-range", "steps[1].time_s"),
        (with(ramp(3), "/steps/0/time_s", json!(0)), "out-of-range", "steps[0].time_s"),
        (with(ramp(3), "/steps/2/force_mn", json!([0, 0, -101])), "out-of-range", "steps[2].force_mn"),
        (with(ramp(3), "/steps/1/force_mn", json!([0, 0, 0.1])), "points-away", "steps[1].force_mn"),
        (with(ramp(3), "/steps/1/force_mn", json!([0, 0, -90])), "beyond-puncture", "steps[1].force_mn"),
        (with(ramp(3), "/steps/1", json!({"time_s": 0.2, "tip_mm": [0, 0, -0.45]})), "too-deep", "steps[1].tip_mm"),
        (with(ramp(3), "/steps/1/tip_mm", json!([5, 0, 0])), "outside-patch", "steps[1].tip_mm"),
        (with(ramp(3), "/steps/1/direction", json!([0, 0, 0])), "out-of-range", "steps[1].direction"),
        (with(ramp(3), "/steps/1/when", json!(1)), "invalid-request", "steps[1].when"),
        (with(ramp(3), "/accuracy", json!({"level": "linear"})), "unknown-name", "accuracy.level"),
        (with(ramp(3), "/effects", json!(["elasticity", "magic"])), "unknown-name", "effects[1]"),
        (
            with(ramp(3), "/scene", json!({"tissue": {"rate": {"density_kg_per_mm3": 1.0}}})),
            "out-of-range",
            "scene.tissue.rate.density_kg_per_mm3",
        ),
        (
            with(
                ramp(3),
                "/scene",
                json!({"tissue": {"rate": {"retina_relaxation": [{"relaxation_time_s": 1.0, "share": 1.5}]}}}),
            ),
            "out-of-range",
            "scene.tissue.rate.retina_relaxation[0].share",
        ),
    ];
    for (request, kind, field) in cases {
        let (status, media_type, body) = simulate(&service, &request);
        assert_eq!((status, media_type.as_str()), (422, "application/problem+json"), "{field}: {body}");
        let problem: Value = serde_json::from_str(&body).expect("JSON");
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{body}");
        assert_eq!(problem["errors"][0]["field"], field, "{body}");
    }
    assert_eq!(simulate(&service, &ramp(4)).0, 200, "what is allowed goes on");
}

#[test]
fn a_step_without_an_answer_ends_the_list_with_its_cause() {
    let service = Running::start(&["--threads", "1", "--simulation-time-limit-ms", "700"]);
    let long = with(ramp(1500), "/accuracy", json!({"level": "reference"}));
    let (status, _, body) = simulate(&service, &long);
    assert_eq!(status, 200, "{body}");
    let lines = lines(&body);
    let error = &lines[lines.len() - 1]["error"];
    assert_matches("SimulateLine", &lines[lines.len() - 1]);
    assert_eq!(error["problem"]["type"], "/problems/took-too-long", "{error}");
    let step = error["step"].as_u64().expect("index");
    assert_eq!(step as usize, lines.len() - 2, "every step before it has its line");
    assert!(lines.iter().all(|line| line.get("end").is_none()));
}

#[test]
fn the_program_simulates_as_the_service_does() {
    let run = |request: &Value| {
        let words = ["retina-server", "simulate", "-"];
        let Some(Command::Simulate(args)) = CommandLine::try_parse_from(words).expect("arguments").command else {
            panic!("not simulate");
        };
        let (mut output, mut problems) = (Vec::new(), Vec::new());
        let input = request.to_string();
        let streams = Streams { input: &mut input.as_bytes(), output: &mut output, problems: &mut problems };
        let code = simulate_file(&args, streams).expect("streams");
        (code, String::from_utf8(output).expect("UTF-8"), String::from_utf8(problems).expect("UTF-8"))
    };
    let timeless = |text: &str| {
        let mut lines = lines(text);
        for line in &mut lines {
            if let Some(step) = line.get_mut("step") {
                step.as_object_mut().expect("object").remove("time_us").expect("time");
            }
        }
        lines
    };
    let service = Running::start(&["--threads", "1"]);
    let example = description()["components"]["schemas"]["SimulateRequest"]["example"].clone();
    let (code, output, problems) = run(&example);
    assert_eq!((code, problems.as_str()), (0, ""));
    assert_eq!(timeless(&output), timeless(&simulate(&service, &example).2));
    let (code, output, problems) = run(&with(ramp(3), "/steps", json!([])));
    assert_eq!((code, output.as_str()), (1, ""));
    assert!(problems.contains("\"steps\""), "{problems}");
}

#[test]
fn a_drag_with_friction_sticks_slips_and_says_so() {
    let service = Running::start(&["--threads", "1"]);
    let places = [0.0, 0.01, 0.02, 0.03, 0.04, 0.04, 0.03, 0.02, 0.01, 0.0, -0.01];
    let steps: Vec<Value> =
        (0..).zip(places).map(|(k, x)| json!({"time_s": 0.1 * f64::from(k + 1), "tip_mm": [x, 0.0, -0.06]})).collect();
    let dragging = json!({
        "scene": {"surface": {"kind": "flat"}, "friction_coefficient": 0.3, "pressure_kpa": 2.5},
        "needle": {"tip_mm": [0.0, 0.0, 0.1]},
        "steps": steps,
        "effects": ["elasticity", "finite_strain", "contact", "friction", "pressure", "viscoelasticity"],
    });
    let (status, _, body) = simulate(&service, &dragging);
    assert_eq!(status, 200, "{body}");
    let lines = lines(&body);
    let simulated = |name: &str| {
        let effects = lines[0]["begin"]["effects"].as_array().expect("list");
        effects.iter().any(|effect| effect["name"] == name && effect["simulated"] == true)
    };
    assert!(["friction", "pressure", "viscoelasticity"].into_iter().all(simulated), "{}", lines[0]);
    let steps: Vec<&Value> = lines[1..=places.len()].iter().map(|line| &line["step"]).collect();
    steps.iter().zip(&lines[1..]).for_each(|(_, line)| assert_matches("SimulateLine", line));
    let drag = |k: usize| steps[k]["needle"]["reaction_mn"][0].as_f64().expect("number");
    let share = |k: usize| steps[k]["contact"]["slipping_share"].as_f64().expect("number");
    let states: Vec<&str> = steps.iter().map(|step| step["contact"]["state"].as_str().expect("state")).collect();
    assert!(drag(1) < 0.0 && drag(3) < drag(1), "the tissue holds the needle back");
    assert_eq!((states[4], states[10]), ("slipping", "slipping"), "{states:?}");
    assert!(share(4) > 0.9 && share(6) < 0.9, "turned back it sticks at first: {} {}", share(4), share(6));
    assert!(drag(10) > 0.0, "and is held back the other way");
    // The same by auto, which says why; a bond out of its range is refused by name.
    let auto = with(dragging.clone(), "/effects", json!("auto"));
    let begin = self::lines(&simulate(&service, &auto).2).remove(0);
    let effects = begin["begin"]["effects"].as_array().expect("list").clone();
    let friction = effects.iter().find(|effect| effect["name"] == "friction").expect("always there");
    assert!(friction["simulated"] == true && friction["value"].as_f64() > friction["threshold"].as_f64(), "{friction}");
    let wrong = with(dragging, "/scene/tissue", json!({"bond": {"rate_exponent": 0.7}}));
    let (status, _, body) = simulate(&service, &wrong);
    let problem: Value = serde_json::from_str(&body).expect("JSON");
    assert_eq!((status, &problem["errors"][0]["field"]), (422, &json!("scene.tissue.bond.rate_exponent")), "{body}");
}

/// Fluid is injected under the retina, a needle presses it, and it is drawn off.
pub fn injection() -> Value {
    json!({
        "scene": {"surface": {"kind": "flat"}, "bleb": {"volume_mm3": 0.01, "radius_mm": 0.6}},
        "needle": {"tip_mm": [0.0, 0.0, 0.1]},
        "steps": [
            {"time_s": 0.5, "force_mn": [0.0, 0.0, 0.0], "bleb": {"volume_mm3": 0.03}},
            {"time_s": 1.0, "force_mn": [0.0, 0.0, -0.2]},
            {"time_s": 1.5, "force_mn": [0.0, 0.0, 0.0], "bleb": {"pressure_kpa": 0.1}},
            {"time_s": 5.0, "bleb": {"volume_mm3": 0.0}, "force_mn": [0.0, 0.0, 0.0]},
        ],
    })
}

#[test]
fn fluid_is_injected_pressed_and_drawn_off() {
    let service = Running::start(&["--threads", "1"]);
    let (status, _, body) = simulate(&service, &injection());
    assert_eq!(status, 200, "{body}");
    let lines = lines(&body);
    lines.iter().for_each(|line| assert_matches("SimulateLine", line));
    let told = lines[0]["begin"]["effects"].as_array().expect("list");
    let simulated = |name: &str| told.iter().any(|effect| effect["name"] == name && effect["simulated"] == true);
    assert!(simulated("bleb") && simulated("viscoelasticity"), "{told:?}");
    let fluid = |step: usize, number: &str| lines[step + 1]["step"]["contact"]["bleb"][number].as_f64();
    let volume = |step: usize| fluid(step, "volume_mm3").expect("fluid");
    let pressure = |step: usize| fluid(step, "pressure_kpa").expect("fluid");
    for step in [0, 1] {
        assert!((volume(step) / 0.03 - 1.0).abs() < 1e-3, "the volume is kept: {body}");
    }
    assert!(pressure(1) > pressure(0), "the needle presses on it");
    assert!((pressure(2) - 0.1).abs() < 1e-9 && volume(2) < volume(1));
    assert_eq!(fluid(3, "volume_mm3"), None, "nothing is left");
}

#[test]
fn fluid_that_cannot_be_is_refused_by_step() {
    let service = Running::start(&["--threads", "1"]);
    let cases = [
        ("/steps/0/bleb", json!({"volume_mm3": 0.6}), "out-of-range", "steps[0].bleb.volume_mm3"),
        ("/steps/2/bleb", json!({"pressure_kpa": -1}), "out-of-range", "steps[2].bleb.pressure_kpa"),
        ("/steps/0/bleb", json!({}), "invalid-request", "steps[0].bleb.volume_mm3"),
        (
            "/steps/0/bleb",
            json!({"volume_mm3": 0.1, "pressure_kpa": 1}),
            "invalid-request",
            "steps[0].bleb.pressure_kpa",
        ),
        ("/steps/0/bleb", json!({"volume_mm3": 0.1, "radius_mm": 1}), "invalid-request", "steps[0].bleb.radius_mm"),
        ("/scene", json!("macula"), "not-possible", "steps[0].bleb"),
        ("/scene/bleb/radius_mm", json!(3), "out-of-range", "scene.bleb.radius_mm"),
        ("/scene/bleb/center_mm", json!([1.5, 0, 0]), "outside-patch", "scene.bleb.center_mm"),
        ("/steps/1/tip_mm", json!([0.7, 0, 0.1]), "not-possible", "steps[1].tip_mm"),
    ];
    for (place, value, kind, field) in cases {
        let request = with(injection(), place, value);
        let (status, _, body) = simulate(&service, &request);
        let problem: Value = serde_json::from_str(&body).expect("a problem");
        assert!((400..500).contains(&status), "{place}: {status}");
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{place}: {problem}");
        assert_eq!(problem["errors"][0]["field"], field, "{place}: {problem}");
    }
}
