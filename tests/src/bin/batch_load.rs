//! How many predictions a second batches give: `cargo run --release -p retina-tests --bin batch_load [-- BATCHES POSES LEVEL]` (20 batches of 1000
//! poses, `linear`). One after the other on loopback, the service in this process as the program runs it.

use std::time::Instant;

use retina_core::comparison::quantile;
use retina_tests::local_service;
use retina_tests::machine_time::cpu_seconds;
use serde_json::json;

/// Most batches, and most poses of one: what the service allows by default.
const MOST: (usize, usize) = (1000, 1024);
/// Largest answer that is read, bytes.
const LARGEST: u64 = 64 << 20;

fn main() {
    let argument = |index: usize, usual: &str| std::env::args().nth(index).unwrap_or(usual.to_owned());
    let batches: usize = argument(1, "20").parse::<usize>().expect("BATCHES").clamp(1, MOST.0);
    let poses: usize = argument(2, "1000").parse::<usize>().expect("POSES").clamp(1, MOST.1);
    let level = argument(3, "linear");
    let address = local_service::start(&[]).expect("service");
    let agent = ureq::Agent::new_with_defaults();
    let pose = |index: usize| {
        let x = 0.3 * (index as f64 * 0.618).fract() - 0.15;
        json!({"needle": {"tip_mm": [x, -0.05, 0.0]}, "force_mn": [0.0, 0.0, -0.4]})
    };
    let list: Vec<_> = (0..poses).map(pose).collect();
    let body = json!({"poses": list, "accuracy": {"level": level}}).to_string();
    let mut rates = Vec::with_capacity(batches);
    let before = cpu_seconds();
    for _ in 0..batches {
        let started = Instant::now();
        let post = agent.post(format!("http://{address}/v1/predict/batch")).header("content-type", "application/json");
        let mut response = post.send(&body).expect("answer");
        let text = response.body_mut().with_config().limit(LARGEST).read_to_vec().expect("body");
        let seconds = started.elapsed().as_secs_f64();
        let answered = text.windows(14).filter(|word| word == b"{\"prediction\":").count();
        assert_eq!(answered, poses, "{}", String::from_utf8_lossy(&text[..text.len().min(1000)]));
        rates.push(poses as f64 / seconds);
    }
    let at = |share: f64| quantile(&rates, share);
    println!("{level}, {batches} batches of {poses} poses, one after the other");
    if let Some((after, before)) = cpu_seconds().zip(before) {
        let each_us = 1e6 * (after - before) / (batches * poses) as f64;
        println!("processor time of a prediction, service and client together: {each_us:.0} µs");
    }
    println!("predictions a second: median {:.0}, p10 {:.0}, p90 {:.0}", at(0.5), at(0.1), at(0.9));
}
