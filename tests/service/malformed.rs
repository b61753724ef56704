//! Requests that nobody should send, over sockets: each is answered, none by a fault of the server, and the service goes on.
//!
//! `RETINA_MALFORMED` says how many (3000 when it does not), `RETINA_MALFORMED_SEED` from which seed.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use retina_tests::malformed::{Generator, Malformed};
use retina_tests::stream_client::StreamClient;
use serde_json::Value;
use tokio_tungstenite::tungstenite::Message;
use ureq::http::{Request, Response};

use crate::harness::{Running, agent, request, runtime};

fn number(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{variable}={text}")))
}

fn healthy(service: &Running) {
    assert_eq!(service.predict(&agent(), &request("linear")).0, 200);
    let text = agent().get(service.url("/metrics")).call().expect("metrics").body_mut().read_to_string().expect("text");
    assert!(text.contains("\nretina_panics_total 0\n"), "{text}");
}

fn send(agent: &ureq::Agent, service: &Running, wrong: &Malformed) -> Result<Response<ureq::Body>, ureq::Error> {
    let mut builder = Request::builder().method(wrong.method).uri(service.url(wrong.path));
    if let Some(content_type) = wrong.content_type {
        builder = builder.header("content-type", content_type);
    }
    agent.run(builder.body(wrong.body.clone())?)
}

#[test]
fn no_malformed_request_is_a_fault_of_the_server() {
    let (count, seed) = (number("RETINA_MALFORMED", 3000), number("RETINA_MALFORMED_SEED", 1));
    let service = Running::start(&["--threads", "2", "--stored-scenes", "16"]);
    let (mut generator, agent) = (Generator::new(seed), agent());
    let (mut answered, mut refused) = (0, 0);
    for index in 0..count {
        let wrong = generator.request();
        // A server may close a kept connection at any time, and does where it does not want the body: then a new one must do.
        let answer = send(&agent, &service, &wrong).or_else(|_| send(&crate::harness::agent(), &service, &wrong));
        let mut response = answer.unwrap_or_else(|error| panic!("seed {seed}, number {index}: {error}"));
        let status = response.status().as_u16();
        let text = response.body_mut().read_to_string().expect("body");
        let what = || format!("seed {seed}, number {index}: {status} {text}\n{wrong:?}");
        match status {
            200 | 201 => answered += 1,
            // 507: by then there are as many scenes as there may be.
            400..=499 | 507 => {
                refused += 1;
                let problem: Value = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{}", what()));
                assert_eq!(problem["status"], status, "{}", what());
            }
            _ => panic!("{}", what()),
        }
    }
    assert!(answered > 0 && refused > count / 3, "{answered} answered, {refused} refused");
    healthy(&service);
}

#[test]
fn no_malformed_message_ends_a_stream() {
    let (count, seed) = (number("RETINA_MALFORMED", 3000) / 3, number("RETINA_MALFORMED_SEED", 1));
    let service = Running::start(&["--threads", "1"]);
    let mut generator = Generator::new(seed);
    runtime().block_on(async {
        let mut client = StreamClient::connect(service.address).await.expect("handshake");
        let mut refused = 0;
        for index in 0..count {
            let text = generator.text();
            client.socket.send(Message::text(text.clone())).await.expect("sent");
            let reply = loop {
                match client.socket.next().await {
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                    Some(Ok(Message::Text(reply))) => break serde_json::from_str::<Value>(&reply).expect("JSON"),
                    Some(Ok(Message::Binary(_))) => break Value::Null,
                    other => panic!("seed {seed}, number {index}: {other:?} after {text}"),
                }
            };
            if let Some(problem) = reply.get("problem") {
                refused += 1;
                assert_ne!(problem["problem"]["status"], 500, "seed {seed}, number {index}: {problem} after {text}");
            }
        }
        assert!(refused > count / 3, "{refused}");
    });
    healthy(&service);
}

#[test]
fn bytes_that_are_no_http_are_cut_off() {
    let (count, seed) = (number("RETINA_MALFORMED", 3000) / 10, number("RETINA_MALFORMED_SEED", 1));
    let service = Running::start(&["--threads", "1", "--body-limit-ms", "200", "--connection-idle-ms", "200"]);
    let mut generator = Generator::new(seed);
    for index in 0..count {
        let mut connection = TcpStream::connect(service.address).expect("connection");
        connection.set_read_timeout(Some(Duration::from_secs(10))).expect("timeout");
        // The service may have closed already.
        let _ = connection.write_all(&generator.bytes());
        let _ = connection.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        let ended = connection.read_to_end(&mut answer);
        if let Err(error) = &ended {
            assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset, "seed {seed}, number {index}: {error}");
        }
        assert!(!answer.starts_with(b"HTTP/1.1 5"), "number {index}: {}", String::from_utf8_lossy(&answer));
    }
    healthy(&service);
}
