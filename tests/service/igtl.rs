//! OpenIGTLink: what comes back over a socket, in which axes, who wins, what is refused.

mod codec;
mod refused;

use std::collections::BTreeMap;
use std::net::SocketAddr;

use retina_server::igtl::{listen, unit};
use retina_tests::igtl_client::{IgtlClient, Message, UPRIGHT, sensor, string, transform};
use serde_json::{Value, json};
use tokio::net::TcpListener;

use crate::harness::{Running, agent, predict, request, runtime, state, with};

/// A service with these arguments, on HTTP and on OpenIGTLink.
pub fn start(arguments: &[&str]) -> (Running, SocketAddr) {
    let state = state(arguments);
    let listener = runtime().block_on(TcpListener::bind("127.0.0.1:0")).expect("port");
    let address = listener.local_addr().expect("address");
    runtime().spawn(listen(listener, state.clone()));
    (Running::of(state), address)
}

/// A client whose first session is open.
fn client(address: SocketAddr) -> IgtlClient {
    let mut client = IgtlClient::connect(address).expect("connection");
    let first = client.until("Session").expect("session");
    assert_eq!(first["Retina"].status().0, 1);
    client
}

fn open(client: &mut IgtlClient, session: Value) -> Value {
    client.send(&string(&json!({"open": session}).to_string())).expect("sent");
    let messages = client.until("Session").expect("session");
    serde_json::from_str(&messages["Session"].text()).expect("JSON")
}

/// The answer to a needle at `tip_mm` that pushes with `force_mn`.
fn press(client: &mut IgtlClient, tip_mm: [f32; 3], force_mn: [f64; 3]) -> BTreeMap<String, Message> {
    client.send(&sensor(unit::MILLINEWTON, &force_mn)).expect("sent");
    client.send(&transform(UPRIGHT, tip_mm)).expect("sent");
    client.until("Answer").expect("answer")
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap_or_else(|| panic!("{other}"))],
    }
}

/// Holds 32-bit numbers against those of JSON.
fn near(name: &str, short: &[f32], long: &Value, allowed: f64) {
    let long = numbers(long);
    assert_eq!(short.len(), long.len(), "{name}");
    for (short, long) in short.iter().zip(long) {
        assert!((f64::from(*short) - long).abs() <= allowed, "{name}: {short} against {long}");
    }
}

#[test]
fn an_answer_is_the_prediction_as_points_surface_and_sensors() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    // What 32 bits hold exactly, so that both are asked the same.
    let tip_mm = [0.125, -0.0625, 0.0];
    let asked = with(request("coarse"), "/needle/tip_mm", json!(tip_mm));
    let alone = predict(&with(asked, "/force_mn", json!([0.0, 0.125, -0.5]))).body;
    let told = press(&mut client, tip_mm, [0.0, 0.125, -0.5]);
    let surface = &alone["surface"];
    let points = told["Nodes"].points();
    assert_eq!((points[0].0.as_str(), points[63].0.as_str()), ("0", "63"));
    let positions: Vec<f32> = points.iter().flat_map(|(_, position)| *position).collect();
    near("POINT", &positions, &surface["vertices_mm"], 1e-6);
    let polydata = &told["Surface"];
    assert_eq!(polydata.counts(0, 40), [64, 0, 0, 0, 0, 98, 98 * 16, 0, 0, 2]);
    near("POLYDATA points", &polydata.floats(40, 40 + 768), &surface["vertices_mm"], 1e-6);
    let mut at = 40 + 768;
    let corners: Vec<Vec<u32>> =
        (0..98).map(|triangle| polydata.counts(at + 16 * triangle, at + 16 * triangle + 16)).collect();
    at += 98 * 16;
    for (corners, triangle) in corners.iter().zip(surface["triangles"].as_array().expect("list")) {
        assert_eq!((corners[0], json!(corners[1..])), (3, triangle.clone()));
    }
    // Scalars of one component, normals of three, 64 of each, their names, then their numbers.
    assert_eq!(polydata.content[at..at + 12], [0, 1, 0, 0, 0, 64, 2, 3, 0, 0, 0, 64]);
    at += 12;
    assert_eq!(&polydata.content[at..at + 24], b"Displacement_um\0Normals\0");
    at += 24;
    near("scalars", &polydata.floats(at, at + 256), &surface["displacement_um"], 1e-4);
    near("normals", &polydata.floats(at + 256, polydata.content.len()), &surface["normals"], 1e-6);
    let needle = &alone["needle"];
    near("needle", &told["NeedleTip"].floats(36, 48), &needle["tip_mm"], 1e-6);
    assert_eq!(told["NeedleTip"].floats(0, 36), UPRIGHT.as_flattened());
    assert_eq!(told["Reaction"].sensor(), (0xb2c4_0000_0000_0000, numbers(&needle["reaction_mn"])));
    assert_eq!(told["Travel"].sensor(), (0xb044_0000_0000_0000, numbers(&json!([needle["travel_mm"]]))));
    let expected = &alone["accuracy"]["expected_error_um"];
    assert_eq!(
        told["ExpectedError"].sensor(),
        (0xc044_0000_0000_0000, numbers(&json!([expected["median"], expected["p95"]])))
    );
    let answer: Value = serde_json::from_str(&told["Answer"].text()).expect("JSON");
    for part in ["needle", "contact", "accuracy", "warnings"] {
        assert_eq!(answer["answer"][part], alone[part], "{part}");
    }
}

#[test]
fn lps_is_the_same_world_with_x_and_y_the_other_way_round() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    // A bevelled needle, whose sharp point shows how it is turned about its axis.
    let session = |axes: &str| json!({"needle": {"tip": "bevelled"}, "accuracy": {"level": "linear"}, "axes": axes});
    assert_eq!(open(&mut client, session("ras"))["opened"]["axes"], "ras");
    let (cosine, sine) = (0.8, 0.6);
    let ras_columns = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]];
    client.send(&sensor(unit::MILLINEWTON, &[0.05, 0.1, -0.4])).expect("sent");
    client.send(&transform(ras_columns, [0.125, 0.25, 0.0])).expect("sent");
    let ras = client.until("Answer").expect("answer");
    assert_eq!(open(&mut client, session("lps"))["opened"]["axes"], "lps");
    let turned = ras_columns.map(|[x, y, z]| [-x, -y, z]);
    client.send(&sensor(unit::MILLINEWTON, &[-0.05, -0.1, -0.4])).expect("sent");
    client.send(&transform(turned, [-0.125, -0.25, 0.0])).expect("sent");
    let lps = client.until("Answer").expect("answer");
    for ((_, ras), (_, lps)) in ras["Nodes"].points().iter().zip(lps["Nodes"].points()) {
        assert_eq!([-ras[0], -ras[1], ras[2]], lps);
    }
    let turn = |values: &[f64]| vec![-values[0], -values[1], values[2]];
    assert_eq!(turn(&ras["Reaction"].sensor().1), lps["Reaction"].sensor().1);
    assert_eq!(ras["Travel"], lps["Travel"]);
    assert_eq!(lps["NeedleTip"].floats(0, 36), turned.as_flattened());
    let words =
        |told: &BTreeMap<String, Message>| -> Value { serde_json::from_str(&told["Answer"].text()).expect("JSON") };
    let (ras, lps) = (words(&ras), words(&lps));
    assert_eq!(turn(&numbers(&ras["answer"]["needle"]["tip_mm"])), numbers(&lps["answer"]["needle"]["tip_mm"]));
    // The same numbers in the other axes are another question.
    client.send(&transform(ras_columns, [0.125, 0.25, 0.0])).expect("sent");
    let other = words(&client.until("Answer").expect("answer"));
    assert_ne!(numbers(&other["answer"]["needle"]["tip_mm"]), numbers(&ras["answer"]["needle"]["tip_mm"]));
}

#[test]
fn without_a_force_the_needle_is_held_and_a_text_gives_and_takes_it() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    open(&mut client, json!({"accuracy": {"level": "linear"}}));
    let travel = |client: &mut IgtlClient, z_mm: f32| {
        client.send(&transform(UPRIGHT, [0.0, 0.0, z_mm])).expect("sent");
        client.until("Answer").expect("answer")["Travel"].sensor().1[0]
    };
    assert_eq!(travel(&mut client, -0.0625), 0.0);
    client.send(&string("{\"force_mn\": [0, 0, -0.5]}")).expect("sent");
    let pushed = travel(&mut client, 0.0);
    assert!(pushed > 0.01, "{pushed}");
    // Half a millinewton in newtons and in micronewtons.
    for (unit, value) in [(unit::NEWTONS, -5e-4), (0xc2c4_0000_0000_0000, -500.0)] {
        client.send(&string("{\"control\": \"pose\"}")).expect("sent");
        assert_eq!(travel(&mut client, 0.0), 0.0);
        client.send(&sensor(unit, &[0.0, 0.0, value])).expect("sent");
        let again = travel(&mut client, 0.0);
        assert!((again - pushed).abs() < 1e-12, "{again} against {pushed}");
    }
}

#[test]
fn headers_of_version_2_are_answered_in_kind_with_time_and_number() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    open(&mut client, json!({"accuracy": {"level": "linear"}}));
    let asked =
        Message { version: 2, time: 0x1234_5678_9abc_def0, message_id: 77, ..transform(UPRIGHT, [0.0, 0.0, -0.0625]) };
    client.send(&asked).expect("sent");
    for (device, told) in client.until("Answer").expect("answer") {
        assert_eq!((told.version, told.time, told.message_id), (2, asked.time, 77), "{device}");
    }
    client.send(&transform(UPRIGHT, [0.0, 0.0, -0.0625])).expect("sent");
    assert!(client.until("Answer").expect("answer").values().all(|told| told.version == 1 && told.time == 0));
}

#[test]
fn the_newest_pose_wins_and_those_overtaken_are_counted() {
    const POSES: u64 = 300;
    let (service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    client.send(&sensor(unit::MILLINEWTON, &[0.0, 0.0, -0.5])).expect("sent");
    for number in 1..=POSES {
        client.send(&transform(UPRIGHT, [number as f32 * 1e-3, 0.0, 0.0])).expect("sent");
    }
    let (mut answered, mut dropped, mut last) = (0, 0, 0);
    while last < POSES {
        let answer: Value =
            serde_json::from_str(&client.until("Answer").expect("answer")["Answer"].text()).expect("JSON");
        let sequence = answer["answer"]["sequence"].as_u64().expect("number");
        assert!(sequence > last);
        (answered, last) = (answered + 1, sequence);
        dropped += answer["answer"]["dropped"].as_u64().expect("number");
    }
    assert_eq!(answered + dropped, POSES);
    assert!(dropped > 0, "coarse answers {POSES} poses as fast as a socket brings them");
    let metrics =
        agent().get(service.url("/metrics")).call().expect("metrics").body_mut().read_to_string().expect("text");
    assert!(metrics.contains("\nretina_streams 1\n"), "{metrics}");
}
