//! Who may ask: tokens, origins of web pages, and what stays open.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;

use serde_json::Value;

use crate::harness::{Running, agent, request};

const TOKEN: &str = "a-token-of-the-test-0123456789";

#[test]
fn with_a_token_only_those_who_bring_it_may_ask() {
    let other = "another-token-0123456789";
    let service = Running::start(&["--threads", "1", "--token", &format!("{TOKEN},{other}")]);
    let ask = |authorization: Option<&str>| {
        let mut post = agent().post(service.url("/v1/predict")).header("content-type", "application/json");
        if let Some(authorization) = authorization {
            post = post.header("authorization", authorization);
        }
        let mut response = post.send(request("linear").to_string()).expect("answer");
        let challenge = response.headers().get("www-authenticate").is_some();
        (response.status().as_u16(), challenge, response.body_mut().read_to_string().expect("text"))
    };
    for refused in [
        None,
        Some("Bearer"),
        Some("Bearer "),
        Some(&TOKEN[1..]),
        Some("Bearer a-token-of-the-test-012345678"),
        Some("Bearer a-token-of-the-test-01234567890"),
        Some(&format!("Basic {TOKEN}")),
    ] {
        let (status, challenge, body) = ask(refused);
        assert_eq!((status, challenge), (401, true), "{refused:?}: {body}");
        let problem: Value = serde_json::from_str(&body).expect("JSON");
        assert_eq!(problem["type"], "/problems/unauthorized");
        assert!(!body.contains(TOKEN) && !body.contains(other));
    }
    for taken in [TOKEN, other] {
        assert_eq!(ask(Some(&format!("Bearer {taken}"))).0, 200);
        assert_eq!(ask(Some(&format!("bearer  {taken}"))).0, 200);
    }
    for guarded in ["/metrics", "/v1/about", "/v1/stream", "/v1/scenes", "/v1/levels", "/v1/nothing"] {
        assert_eq!(agent().get(service.url(guarded)).call().expect("answer").status(), 401, "{guarded}");
    }
    for open in ["/healthz", "/readyz", "/openapi.json", "/problems/busy", "/"] {
        assert_ne!(agent().get(service.url(open)).call().expect("answer").status(), 401, "{open}");
    }
}

/// Status of a WebSocket handshake of a page of that origin.
fn handshake(service: &Running, origin: &str) -> u16 {
    let mut connection = TcpStream::connect(service.address).expect("connection");
    let head = format!(
        "GET /v1/stream HTTP/1.1\r\nhost: {}\r\norigin: {origin}\r\nconnection: upgrade\r\nupgrade: websocket\r\n\
         sec-websocket-version: 13\r\nsec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        service.address
    );
    connection.write_all(head.as_bytes()).expect("head");
    let mut status = String::new();
    BufReader::new(connection).read_line(&mut status).expect("status");
    status.split(' ').nth(1).expect("status").parse().expect("number")
}

#[test]
fn pages_of_other_origins_ask_only_where_they_are_allowed() {
    let service = Running::start(&["--threads", "1", "--cors-origin", "https://simulator.example"]);
    let preflight = |origin: &str| {
        let request = ureq::http::Request::builder()
            .method("OPTIONS")
            .uri(service.url("/v1/predict"))
            .header("origin", origin)
            .header("access-control-request-method", "POST")
            .header("access-control-request-headers", "content-type")
            .body(())
            .expect("request");
        let response = agent().run(request).expect("answer");
        response.headers().get("access-control-allow-origin").map(|value| value.to_str().expect("text").to_owned())
    };
    assert_eq!(preflight("https://simulator.example").as_deref(), Some("https://simulator.example"));
    assert_eq!(preflight("https://elsewhere.example"), None);
    let own = format!("http://{}", service.address);
    for (origin, status) in [
        ("https://simulator.example", 101),
        (own.as_str(), 101),
        ("https://elsewhere.example", 403),
        ("null", 403),
        ("http://127.0.0.1.elsewhere.example", 403),
    ] {
        assert_eq!(handshake(&service, origin), status, "{origin}");
    }
}

#[test]
fn nothing_is_said_to_other_origins_by_default() {
    let service = Running::start(&["--threads", "1"]);
    let response = agent().get(service.url("/v1/levels")).header("origin", "https://elsewhere.example").call();
    assert!(response.expect("answer").headers().get("access-control-allow-origin").is_none());
}
