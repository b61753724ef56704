//! Clients that go, in order or without a word, messages without end, and the end of the service.

use std::time::{Duration, Instant};

use futures_util::SinkExt as _;
use retina_tests::stream_client::{Received, StreamClient};
use serde_json::{Value, json};
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;

use super::{level, pose, text, with_client};
use crate::harness::{Running, agent, request, runtime};

#[test]
fn a_client_that_goes_stops_its_work() {
    with_client(&["--threads", "1"], async |service, first| {
        let predict = |level: &str| {
            let started = Instant::now();
            let status = tokio::task::block_in_place(|| service.predict(&agent(), &request(level)).0);
            assert_eq!(status, 200);
            started.elapsed()
        };
        let whole = predict("reference");
        drop(first);
        let mut waited = Duration::MAX;
        // A busy machine may hold up one of them.
        for _ in 0..3 {
            let mut client = StreamClient::connect(service.address).await.expect("handshake");
            client.open(level("reference")).await.expect("session");
            client.send(&pose(1)).await.expect("sent");
            tokio::time::sleep(whole / 10).await;
            drop(client);
            waited = waited.min(predict("linear"));
        }
        assert!(waited < whole / 2, "waited {waited:?} behind work of {whole:?} that nobody wanted");
    });
}

#[test]
fn a_silent_client_is_taken_for_gone_and_a_quiet_one_is_not() {
    with_client(&["--threads", "1", "--streams", "2", "--stream-idle-ms", "600"], async |service, mut quiet| {
        quiet.open(level("linear")).await.expect("session");
        // Nobody reads from this one, so its pings are not answered: a half-open connection.
        let half_open = StreamClient::connect(service.address).await.expect("handshake");
        // Waiting for a message answers pings.
        assert!(timeout(Duration::from_millis(2500), quiet.receive()).await.is_err(), "a quiet client was sent away");
        quiet.send(&pose(1)).await.expect("sent");
        assert_eq!(text(quiet.receive().await)["answer"]["sequence"], 1);
        let next = StreamClient::connect(service.address).await.expect("the place of the silent one is free");
        drop((half_open, next));
    });
}

#[test]
fn a_message_without_end_is_cut_off() {
    with_client(&["--threads", "1"], async |_, mut client| {
        client.open(level("linear")).await.expect("session");
        let long = json!({"open": {"scene": "m".repeat(2 << 20)}}).to_string();
        // The server may close before all of it is written.
        let _ = client.socket.send(Message::text(long)).await;
        match client.receive().await {
            Received::Closed(Some((code, reason))) => assert_eq!((code, reason.contains("1 MiB")), (1009, true)),
            Received::Closed(None) => {}
            other => panic!("{other:?}"),
        }
    });
}

#[test]
fn a_long_text_may_open_a_session_and_nothing_else() {
    with_client(&["--threads", "1"], async |_, mut client| {
        let padded = |message: Value| Message::text(format!("{message}{}", " ".repeat(10_000)));
        client.socket.send(padded(json!({"open": level("linear")}))).await.expect("sent");
        assert!(text(client.receive().await).get("opened").is_some());
        client.socket.send(padded(pose(1))).await.expect("sent");
        assert_eq!(text(client.receive().await)["problem"]["problem"]["type"], "/problems/body-too-large");
    });
}

#[test]
fn the_end_answers_what_is_at_work_and_says_goodbye() {
    let mut service = Running::start(&["--threads", "1"]);
    runtime().block_on(async {
        let mut busy = StreamClient::connect(service.address).await.expect("handshake");
        busy.open(level("reference")).await.expect("session");
        let mut idle = StreamClient::connect(service.address).await.expect("handshake");
        busy.send(&pose(1)).await.expect("sent");
        tokio::time::sleep(Duration::from_millis(100)).await;
        service.shutdown.cancel();
        assert_eq!(text(busy.receive().await)["answer"]["sequence"], 1);
        for client in [&mut busy, &mut idle] {
            assert!(matches!(client.receive().await, Received::Closed(Some((1001, _)))));
        }
    });
    service.ended.take().expect("running").join().expect("the service ends in order");
}
