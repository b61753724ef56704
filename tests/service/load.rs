//! More work than threads: the queue is bounded, and what is kept of scenes is too.

use std::io::Write as _;
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use retina_core::predict::Workspace;
use retina_server::library::Store;
use retina_server::library::reader::Reader;
use retina_server::pool::{Pool, PoolError, Ticket};
use retina_server::scenes::Scenes;
use retina_server::wire::request::SceneChoice;
use retina_server::write::{Layout, write};
use serde_json::{Value, json};

use crate::harness::{Running, agent, request, runtime};

#[test]
fn a_full_queue_says_when_to_come_back() {
    let service = Running::start(&["--threads", "1", "--queue", "1"]);
    let callers = 6;
    let together = Barrier::new(callers);
    let replies: Vec<_> = thread::scope(|scope| {
        let call = || {
            let agent = agent();
            together.wait();
            service.predict(&agent, &request("reference"))
        };
        let calls: Vec<_> = (0..callers).map(|_| scope.spawn(call)).collect();
        calls.into_iter().map(|call| call.join().expect("caller")).collect()
    });
    let busy: Vec<_> = replies.iter().filter(|(status, ..)| *status == 503).collect();
    let answered = replies.iter().filter(|(status, ..)| *status == 200).count();
    assert!((1..=2).contains(&answered) && busy.len() == callers - answered, "{replies:?}");
    for (_, retry_after, body) in busy {
        let seconds: u32 = retry_after.as_deref().and_then(|text| text.parse().ok()).expect("whole seconds");
        assert!((1..=60).contains(&seconds), "{seconds} s, for two that take some seconds each");
        let problem: Value = serde_json::from_str(body).expect("JSON");
        assert_eq!(problem["type"], "/problems/busy");
    }
    let (status, ..) = service.predict(&agent(), &request("linear"));
    assert_eq!(status, 200, "the service recovers");
}

#[test]
fn work_beyond_the_time_limit_is_stopped() {
    let service = Running::start(&["--threads", "1", "--time-limit-ms", "100"]);
    let started = Instant::now();
    let heavy = json!({
        "needle": {"tip_mm": [0.3, -0.2, 0.0], "gauge": "41G", "direction": [0.3, 0.0, -1.0]},
        "force_mn": [0.0, 0.0, -0.1],
        "accuracy": {"level": "reference"},
    });
    let (status, _, body) = service.predict(&agent(), &heavy);
    let problem: Value = serde_json::from_str(&body).expect("JSON");
    assert_eq!((status, &problem["type"]), (503, &json!("/problems/took-too-long")), "{:?}", started.elapsed());
}

#[test]
fn a_panic_ends_its_job_and_not_its_thread() {
    let runtime = tokio::runtime::Runtime::new().expect("runtime");
    let pool = Pool::start(1, 4, |_| {}).expect("thread");
    let panicked = runtime.block_on(pool.run(Ticket::default(), |_, _| -> u32 { panic!("on purpose") }));
    assert_eq!(panicked, Err(PoolError::Panicked));
    assert_eq!(runtime.block_on(pool.run(Ticket::default(), |_, _| 7)), Ok(7));
}

#[test]
fn a_job_whose_caller_has_gone_is_not_begun() {
    let runtime = tokio::runtime::Runtime::new().expect("runtime");
    let pool = Arc::new(Pool::start(1, 4, |_| {}).expect("thread"));
    let (open, gate) = mpsc::channel::<()>();
    let (begun, ran) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    runtime.block_on(async {
        let (first, flag) = (Arc::clone(&pool), Arc::clone(&begun));
        let blocked = tokio::spawn(async move {
            let wait = move |_: &mut Workspace, _: &dyn Fn() -> bool| {
                flag.store(true, Ordering::SeqCst);
                gate.recv().is_ok()
            };
            first.run(Ticket::default(), wait).await
        });
        while !begun.load(Ordering::SeqCst) {
            tokio::task::yield_now().await;
        }
        let (second, flag) = (Arc::clone(&pool), Arc::clone(&ran));
        let gone =
            tokio::spawn(
                async move { second.run(Ticket::default(), move |_, _| flag.store(true, Ordering::SeqCst)).await },
            );
        tokio::task::yield_now().await;
        tokio::time::sleep(Duration::from_millis(20)).await;
        gone.abort();
        assert!(gone.await.is_err());
        open.send(()).expect("the first job waits");
        assert_eq!(blocked.await.expect("task"), Ok(true));
        assert_eq!(pool.run(Ticket::default(), |_, _| 1).await, Ok(1));
    });
    assert!(!ran.load(Ordering::SeqCst), "the job ran for nobody");
}

#[test]
fn large_bodies_are_bounded_together() {
    let service = Running::start(&["--threads", "1"]);
    let large = format!("{}{}", request("linear"), " ".repeat(1 << 20));
    // Clients that have sent half of a large body and stay keep it held.
    let slow: Vec<TcpStream> = (0..12).map(|_| half_sent(&service, &large)).collect();
    let send = || {
        let request = agent().post(service.url("/v1/predict"));
        let mut response = request.header("content-type", "application/json").send(large.as_str()).expect("answer");
        (response.status().as_u16(), response.body_mut().read_to_string().expect("body"))
    };
    thread::sleep(Duration::from_millis(200));
    let (status, body) = send();
    assert_eq!(status, 503, "{body}");
    assert_eq!(service.predict(&agent(), &request("linear")).0, 200, "small ones go on");
    drop(slow);
    thread::sleep(Duration::from_millis(200));
    let (status, body) = send();
    assert_eq!(status, 200, "{body}");
}

fn half_sent(service: &Running, body: &str) -> TcpStream {
    let mut connection = TcpStream::connect(service.address).expect("connection");
    let length = body.len();
    let head = format!(
        "POST /v1/predict HTTP/1.1\r\nhost: retina\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n"
    );
    connection.write_all(head.as_bytes()).expect("head");
    connection.write_all(&body.as_bytes()[..length / 2]).expect("half");
    connection
}

#[test]
fn an_answer_never_holds_a_number_that_is_none() {
    assert!(write(&[1.0, f64::NAN], Layout::Compact).is_err());
    assert!(write(&[f64::INFINITY], Layout::Indented).is_err());
    assert_eq!(write(&[1.0, -0.5], Layout::Compact).expect("numbers"), b"[1.0,-0.5]");
}

fn sphere(radius_mm: f64) -> SceneChoice {
    serde_json::from_value(json!({"surface": {"kind": "sphere", "radius_mm": radius_mm}})).expect("scene")
}

/// Scenes kept up to so many bytes, none of them stored.
fn scenes(limit_bytes: usize) -> Scenes {
    Scenes::new(limit_bytes, Reader::new(Store::in_memory(), runtime().handle().clone()))
}

#[test]
fn a_scene_is_prepared_once_for_all_who_ask() {
    let scenes = scenes(64 << 20);
    let prepared: Vec<_> = thread::scope(|scope| {
        let calls: Vec<_> = (0..8).map(|_| scope.spawn(|| scenes.get(Some(&sphere(11.0))).ok())).collect();
        calls.into_iter().map(|call| call.join().expect("thread").expect("scene")).collect()
    });
    assert!(prepared.iter().all(|scene| Arc::ptr_eq(scene, &prepared[0])));
    let other = scenes.get(Some(&sphere(11.5))).expect("scene");
    assert!(!Arc::ptr_eq(&other, &prepared[0]), "another radius is another scene");
}

#[test]
fn scenes_that_nobody_uses_make_room_and_used_ones_stay() {
    let one = {
        let scenes = scenes(usize::MAX);
        drop(scenes.get(Some(&sphere(10.0))));
        scenes.inline_bytes()
    };
    let scenes = scenes(2 * one + one / 2);
    let used = scenes.get(Some(&sphere(9.0))).expect("scene");
    for step in 0..8 {
        drop(scenes.get(Some(&sphere(10.0 + 0.1 * f64::from(step)))));
        assert!(scenes.inline_bytes() <= 3 * one + one / 2, "{} bytes", scenes.inline_bytes());
    }
    let again = scenes.get(Some(&sphere(9.0))).expect("scene");
    assert!(Arc::ptr_eq(&used, &again), "a scene in use was forgotten");
}

#[test]
fn a_scene_that_cannot_be_prepared_is_not_kept() {
    let scenes = scenes(64 << 20);
    for _ in 0..2 {
        assert!(scenes.get(Some(&sphere(1.0))).is_err());
        assert_eq!(scenes.inline_bytes(), 0);
    }
}
