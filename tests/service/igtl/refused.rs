//! What OpenIGTLink clients are refused, and that the connection and the service go on.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use fastrand::Rng;
use retina_server::igtl::unit;
use retina_tests::igtl_client::{IgtlClient, Message, UPRIGHT, encode, message, sensor, string, transform};
use serde_json::{Value, json};

use super::{client, open, press, start};
use crate::harness::{agent, request};

/// Code of the STATUS and field of the problem that come next.
fn refusal(client: &mut IgtlClient) -> (u16, String) {
    let told = client.until("Problem").expect("problem");
    let document: Value = serde_json::from_str(&told["Problem"].text()).expect("JSON");
    let (code, own, _, text) = told["Retina"].status();
    assert_eq!((json!(own), json!(text)), (document["status"].clone(), document["detail"].clone()));
    (code, document["errors"][0]["field"].as_str().unwrap_or_default().to_owned())
}

#[test]
fn what_is_wrong_is_a_status_with_its_cause_and_the_connection_goes_on() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    open(&mut client, json!({"accuracy": {"level": "linear"}}));
    press(&mut client, [0.0, 0.0, 0.0], [0.0, 0.0, -0.25]);
    let mut damaged = encode(&transform(UPRIGHT, [0.0; 3]));
    damaged[60] ^= 1;
    let other = Message { device: "Probe".to_owned(), ..transform(UPRIGHT, [0.0; 3]) };
    let stretched = transform([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]);
    let mut short = transform(UPRIGHT, [0.0; 3]);
    short.content.pop();
    for (name, bytes, code, field) in [
        ("checksum", damaged, 9, ""),
        ("type", encode(&message("IMAGE", "Camera", vec![1, 2, 3])), 12, "type"),
        ("device", encode(&other), 12, "device"),
        ("matrix", encode(&stretched), 8, "TRANSFORM.matrix"),
        ("length", encode(&short), 12, "TRANSFORM.length"),
        ("not finite", encode(&transform(UPRIGHT, [f32::NAN, 0.0, 0.0])), 12, "TRANSFORM.matrix"),
        ("outside", encode(&transform(UPRIGHT, [5.0, 0.0, 0.0])), 8, "pose.tip_mm"),
        ("unit", encode(&sensor(0, &[0.0, 0.0, -0.5])), 12, "SENSOR.unit"),
        ("count", encode(&sensor(unit::MILLINEWTON, &[0.0; 6])), 12, "SENSOR.data"),
        ("no JSON", encode(&string("press!")), 12, ""),
        ("field", encode(&string("{\"forse_mn\": [0, 0, 1]}")), 12, "forse_mn"),
        ("two fields", encode(&string("{\"force_mn\": [0, 0, -1], \"control\": \"pose\"}")), 12, ""),
        ("scene", encode(&string("{\"open\": {\"scene\": \"moon\"}}")), 12, "open.scene"),
    ] {
        client.send_bytes(&bytes).expect("sent");
        assert_eq!(refusal(&mut client), (code, field.to_owned()), "{name}");
    }
    // The third TRANSFORM was read and has no answer: its problem has its number.
    open(&mut client, json!({"accuracy": {"level": "linear"}}));
    client.send(&transform(UPRIGHT, [5.0, 0.0, 0.0])).expect("sent");
    let document: Value =
        serde_json::from_str(&client.until("Problem").expect("problem")["Problem"].text()).expect("JSON");
    assert_eq!((&document["sequence"], &document["dropped"]), (&json!(3), &json!(0)));
    let told = press(&mut client, [0.0, 0.0, 0.0], [0.0, 0.0, -0.25]);
    assert!(told["Travel"].sensor().1[0] > 0.0);
}

#[test]
fn what_a_service_is_asked_besides_is_answered() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    client.send(&message("GET_CAPABIL", "", Vec::new())).expect("sent");
    let told = client.receive().expect("message").expect("message");
    assert_eq!(told.kind, "CAPABILITY");
    assert!(told.content.as_chunks::<12>().0.contains(b"TRANSFORM\0\0\0"));
    // Answers are not answered.
    client.send(&message("STATUS", "", vec![0; 30])).expect("sent");
    client.send(&message("RTS_POINT", "", vec![0])).expect("sent");
    client.send(&message("GET_STATUS", "", Vec::new())).expect("sent");
    assert_eq!(client.receive().expect("message").expect("message").status().0, 1);
}

#[test]
fn a_stream_out_of_step_is_told_so_and_closed() {
    let (_service, address) = start(&["--threads", "1"]);
    let mut out_of_step = client(address);
    out_of_step.send_bytes(&[0x47; 64]).expect("sent");
    let (code, _, _, text) = out_of_step.receive().expect("message").expect("message").status();
    assert!(code == 17 && text.contains("version"), "{code} {text}");
    assert_eq!(out_of_step.receive().ok().flatten(), None);
    press(&mut client(address), [0.0; 3], [0.0, 0.0, -0.25]);
}

#[test]
fn a_silent_client_and_one_too_many_are_told_and_closed() {
    let (_service, address) = start(&["--threads", "1", "--streams", "1", "--stream-idle-ms", "1000"]);
    let mut silent = client(address);
    let mut second = IgtlClient::connect(address).expect("connection");
    assert_eq!(second.receive().expect("message").expect("message").status().0, 6);
    assert_eq!(silent.receive().expect("message").expect("message").status().0, 7);
    assert_eq!(silent.receive().expect("end"), None);
    // Its place is free again.
    client(address);
}

#[test]
fn a_service_that_stops_says_so() {
    let (service, address) = start(&["--threads", "1"]);
    let mut client = client(address);
    service.shutdown.cancel();
    assert_eq!(client.receive().expect("message").expect("message").status().0, 19);
    assert_eq!(client.receive().expect("end"), None);
}

#[test]
fn a_token_is_shown_before_anything_is_answered() {
    let token = "a-token-of-the-test-0123456789";
    let (_service, address) = start(&["--threads", "1", "--token", token]);
    let mut client = client(address);
    for message in
        [transform(UPRIGHT, [0.0; 3]), string("{\"open\": {}}"), string("{\"token\": \"not-the-token-of-the-test\"}")]
    {
        client.send(&message).expect("sent");
        assert_eq!(refusal(&mut client).0, 5);
    }
    client.send(&string(&json!({"token": token}).to_string())).expect("sent");
    assert_eq!(client.receive().expect("message").expect("message").status().0, 1);
    press(&mut client, [0.0; 3], [0.0, 0.0, -0.25]);
}

/// From a seed: messages with a few bytes changed, some with their checksum made right again, some cut short, and noise.
#[test]
fn no_malformed_message_is_a_fault_of_the_server() {
    const CONNECTIONS: usize = 150;
    let (service, address) = start(&["--threads", "2"]);
    let mut rng = Rng::with_seed(18944);
    let good = [
        transform(UPRIGHT, [0.1, 0.0, 0.0]),
        sensor(unit::MILLINEWTON, &[0.0, 0.0, -0.5]),
        string("{\"open\": {\"scene\": \"fovea\", \"accuracy\": {\"level\": \"linear\"}, \"axes\": \"lps\"}}"),
        message("GET_CAPABIL", "", Vec::new()),
        Message { version: 2, message_id: 9, ..transform(UPRIGHT, [0.0, 0.1, 0.0]) },
    ];
    for _ in 0..CONNECTIONS {
        let mut socket = TcpStream::connect(address).expect("connection");
        socket.set_read_timeout(Some(Duration::from_secs(10))).expect("time");
        for _ in 0..rng.usize(1..8) {
            let mut message = good[rng.usize(..good.len())].clone();
            for _ in 0..rng.usize(0..4) {
                if !message.content.is_empty() {
                    let at = rng.usize(..message.content.len());
                    message.content[at] = rng.u8(..);
                }
            }
            let mut bytes = encode(&message);
            match rng.u8(..8) {
                0 => bytes.iter_mut().for_each(|byte| *byte = rng.u8(..)),
                1 => bytes.truncate(rng.usize(..bytes.len())),
                2 => {
                    let at = rng.usize(..58);
                    bytes[at] ^= 1 << rng.u8(..8);
                }
                _ => {}
            }
            // A server that has closed is not written to.
            if socket.write_all(&bytes).is_err() {
                break;
            }
        }
        let _ = socket.shutdown(Shutdown::Write);
        // Whatever comes, it ends.
        let mut told = Vec::new();
        match socket.read_to_end(&mut told) {
            Ok(_) => {}
            Err(error) => assert_ne!(error.kind(), std::io::ErrorKind::WouldBlock, "the server keeps the connection"),
        }
    }
    press(&mut client(address), [0.0; 3], [0.0, 0.0, -0.25]);
    assert_eq!(service.predict(&agent(), &request("linear")).0, 200);
    let text = agent().get(service.url("/metrics")).call().expect("metrics").body_mut().read_to_string().expect("text");
    assert!(text.contains("\nretina_panics_total 0\n") && !text.contains("kind=\"internal\""), "{text}");
}
