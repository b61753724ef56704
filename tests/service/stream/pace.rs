//! Newest pose wins, and a slow reader gets what is new and not what has piled up.

use retina_tests::stream_client::{Received, StreamClient};
use serde_json::json;
use std::time::{Duration, Instant};
use tokio::net::TcpSocket;
use tokio_tungstenite::MaybeTlsStream;

use super::{level, pose, text, with_client};
use crate::harness::{Running, runtime, with};

/// Reads until the answer of that number: numbers in order, and how many were overtaken.
async fn read_until(client: &mut StreamClient, last: u64) -> (Vec<u64>, u64) {
    let (mut answered, mut dropped) = (Vec::new(), 0);
    while answered.last() != Some(&last) {
        let answer = text(client.receive().await)["answer"].clone();
        answered.push(answer["sequence"].as_u64().unwrap_or_else(|| panic!("{answer}")));
        dropped += answer["dropped"].as_u64().expect("number");
    }
    (answered, dropped)
}

#[test]
fn the_newest_pose_wins_and_the_others_are_counted() {
    with_client(&["--threads", "1"], async |_, mut client| {
        client.open(level("coarse")).await.expect("session");
        let count = 60;
        for sequence in 1..=count {
            client.send(&pose(sequence)).await.expect("sent");
        }
        let (answered, dropped) = read_until(&mut client, count).await;
        assert!(answered.is_sorted() && answered.len() < count as usize / 2, "{answered:?}");
        assert_eq!(answered.len() as u64 + dropped, count, "{answered:?}");
    });
}

#[test]
fn a_client_that_waits_for_each_answer_loses_none() {
    with_client(&["--threads", "1"], async |_, mut client| {
        client.open(level("linear")).await.expect("session");
        for sequence in 1..300 {
            client.send(&pose(sequence)).await.expect("sent");
            let answer = text(client.receive().await)["answer"].clone();
            assert_eq!((&answer["sequence"], &answer["dropped"]), (&json!(sequence), &json!(0)));
        }
    });
}

#[test]
fn a_slow_reader_holds_nothing_up_and_gets_the_newest() {
    let service = Running::start(&["--threads", "1"]);
    runtime().block_on(async {
        // A small window, so that a few answers fill it.
        let socket = TcpSocket::new_v4().expect("socket");
        socket.set_recv_buffer_size(8 << 10).expect("buffer");
        let stream = MaybeTlsStream::Plain(socket.connect(service.address).await.expect("connection"));
        let url = format!("ws://{}/v1/stream", service.address);
        let (socket, _) = tokio_tungstenite::client_async(url, stream).await.expect("handshake");
        let mut slow = StreamClient { socket };
        slow.open(level("linear")).await.expect("session");
        let mut quick = StreamClient::connect(service.address).await.expect("handshake");
        quick.open(level("linear")).await.expect("session");
        let count = 6000;
        let mut worst = Duration::ZERO;
        for sequence in 1..=count {
            slow.send(&pose(sequence)).await.expect("a pose is taken although nothing is read");
            if sequence % 100 == 0 {
                let asked = Instant::now();
                quick.send(&pose(sequence)).await.expect("sent");
                assert!(matches!(quick.receive().await, Received::Text(_)));
                worst = worst.max(asked.elapsed());
            }
        }
        assert!(worst < Duration::from_secs(1), "another stream waited {worst:?}");
        let (answered, dropped) = read_until(&mut slow, count).await;
        assert_eq!(answered.len() as u64 + dropped, count);
        // Some megabytes of sockets at a dozen kilobytes an answer; all of them would be seventy.
        assert!(answered.len() < 2000, "{} answers were kept", answered.len());
        slow.send(&with(pose(count + 1), "/pose/tip_mm", json!([0.0, 0.0, 0.0]))).await.expect("sent");
        assert_eq!(read_until(&mut slow, count + 1).await.0, [count + 1], "the stream goes on");
    });
}

#[test]
fn a_pose_that_would_be_answered_too_late_is_refused_and_the_stream_goes_on() {
    with_client(&["--threads", "1"], async |service, mut client| {
        client.open(json!({"accuracy": {"level": "linear", "max_time_ms": 200.0}})).await.expect("session");
        let mut long = StreamClient::connect(service.address).await.expect("handshake");
        long.open(level("reference")).await.expect("session");
        long.send(&pose(1)).await.expect("sent");
        tokio::time::sleep(Duration::from_millis(150)).await;
        client.send(&pose(1)).await.expect("sent");
        let reply = text(client.receive().await)["problem"].clone();
        assert_eq!(
            (&reply["sequence"], &reply["problem"]["type"]),
            (&json!(1), &json!("/problems/too-late")),
            "{reply}"
        );
        assert_eq!(text(long.receive().await)["answer"]["sequence"], 1);
        client.send(&pose(2)).await.expect("sent");
        assert_eq!(text(client.receive().await)["answer"]["sequence"], 2);
    });
}
