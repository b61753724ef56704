//! More work than threads: the queue is bounded, and what is kept of scenes is too.

use std::sync::Barrier;
use std::thread;

use retina_server::scenes::Scenes;
use retina_server::wire::request::SceneChoice;
use serde_json::{Value, json};

use crate::harness::{Running, agent, request};

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
        calls
            .into_iter()
            .map(|call| call.join().expect("caller"))
            .collect()
    });
    let busy: Vec<_> = replies
        .iter()
        .filter(|(status, ..)| *status == 503)
        .collect();
    let answered = replies.iter().filter(|(status, ..)| *status == 200).count();
    assert!(
        (1..=2).contains(&answered) && busy.len() == callers - answered,
        "{replies:?}"
    );
    for (_, retry_after, body) in busy {
        assert_eq!(retry_after.as_deref(), Some("1"));
        let problem: Value = serde_json::from_str(body).expect("JSON");
        assert_eq!(problem["type"], "/problems/busy");
    }
    let (status, ..) = service.predict(&agent(), &request("linear"));
    assert_eq!(status, 200, "the service recovers");
}

fn sphere(radius_mm: f64) -> SceneChoice {
    serde_json::from_value(json!({"surface": {"kind": "sphere", "radius_mm": radius_mm}}))
        .expect("scene")
}

#[test]
fn a_scene_is_prepared_once_for_all_who_ask() {
    let scenes = Scenes::new(64 << 20);
    let prepared: Vec<_> = thread::scope(|scope| {
        let calls: Vec<_> = (0..8)
            .map(|_| scope.spawn(|| scenes.get(Some(&sphere(11.0))).ok()))
            .collect();
        calls
            .into_iter()
            .map(|call| call.join().expect("thread").expect("scene"))
            .collect()
    });
    assert!(
        prepared
            .iter()
            .all(|scene| std::sync::Arc::ptr_eq(scene, &prepared[0]))
    );
    let other = scenes.get(Some(&sphere(11.5))).expect("scene");
    assert!(
        !std::sync::Arc::ptr_eq(&other, &prepared[0]),
        "another radius is another scene"
    );
}

#[test]
fn scenes_that_nobody_uses_make_room_and_used_ones_stay() {
    let one = {
        let scenes = Scenes::new(usize::MAX);
        drop(scenes.get(Some(&sphere(10.0))));
        scenes.inline_bytes()
    };
    let scenes = Scenes::new(2 * one + one / 2);
    let used = scenes.get(Some(&sphere(9.0))).expect("scene");
    for step in 0..8 {
        drop(scenes.get(Some(&sphere(10.0 + 0.1 * f64::from(step)))));
        assert!(
            scenes.inline_bytes() <= 3 * one + one / 2,
            "{} bytes",
            scenes.inline_bytes()
        );
    }
    let again = scenes.get(Some(&sphere(9.0))).expect("scene");
    assert!(
        std::sync::Arc::ptr_eq(&used, &again),
        "a scene in use was forgotten"
    );
}

#[test]
fn a_scene_that_cannot_be_prepared_is_not_kept() {
    let scenes = Scenes::new(64 << 20);
    for _ in 0..2 {
        assert!(scenes.get(Some(&sphere(1.0))).is_err());
        assert_eq!(scenes.inline_bytes(), 0);
    }
}
