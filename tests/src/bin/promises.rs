//! Whether the service keeps its promises: `cargo run --release -p retina-tests --bin promises [-- REQUESTS [SEED]]` (2000, 1).
//!
//! Random requests of the working range over the built-in scenes ask a service in this process for an error, a time or both, one at a time. The truth
//! is that of the data sets (`retina_models::dataset::truth`), computed while the service rests. What is measured is kept in `target/promises-SEED.jsonl` as it
//! comes, so an interrupted run goes on where it stopped.

use std::collections::HashMap;
use std::error::Error;
use std::fs::{self, OpenOptions};
use std::io::Write as _;

use indicatif::{ProgressBar, ProgressStyle};
use retina_core::predict::{Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;
use retina_models::dataset::truth::{NAME, TRUTH};
use retina_tests::local_service;
use retina_tests::promise::question::{asked, body};
use retina_tests::promise::reply::{Audited, audited, post};
use retina_tests::promise::tally::table;

/// Requests asked first, so that the service knows how long its levels take here.
const WARM_UP: usize = 150;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let requests: usize = arguments.next().map_or(Ok(2000), |a| a.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |a| a.parse())?;
    let journal = format!("{}/../target/promises-{seed}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let mut known: HashMap<usize, Option<Audited>> = HashMap::new();
    for line in fs::read_to_string(&journal).unwrap_or_default().lines() {
        // A line cut short by an interruption is measured again.
        if let Ok((index, audited)) = serde_json::from_str(line) {
            known.insert(index, audited);
        }
    }
    let mut journal = OpenOptions::new().create(true).append(true).open(&journal)?;
    let address = local_service::start(&[])?;
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
    let scenes: Vec<PreparedScene> = Scene::built_in_names()
        .iter()
        .filter_map(|name| Scene::built_in(name))
        .map(PreparedScene::new)
        .collect::<Result<_, _>>()?;
    let mut ranges: Vec<WorkingRange> =
        scenes.iter().zip(seed..).map(|(s, seed)| WorkingRange::new(&s.scene().tissue, seed)).collect();
    let mut workspace = Workspace::default();
    let bar = ProgressBar::new(requests as u64).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {eta}")?);
    let (mut all, mut without, mut refused) = (Vec::new(), 0, 0);
    let mut random = fastrand::Rng::with_seed(seed);
    let mut warm = 0;
    for index in 0..requests {
        let (scene, range) = (&scenes[index % scenes.len()], &mut ranges[index % scenes.len()]);
        let drawn = loop {
            let drawn = range.request(Level::Linear);
            if scene.predict(&drawn, &mut workspace, &mut Silent).is_ok() {
                break drawn;
            }
            refused += 1;
        };
        let promise = asked(&mut random);
        let measured = match known.remove(&index) {
            Some(measured) => measured,
            None => {
                let question = body(&scene.scene().name, &drawn, promise);
                while warm < WARM_UP {
                    let mut level = question.clone();
                    level["accuracy"] = serde_json::json!({"level": Level::ALL[warm % 4].name()});
                    warm += 1;
                    // Whatever comes back, its time is known.
                    let _ = post(&agent, address, &level);
                }
                let precise = Request { level: Level::Reference, ..drawn };
                let truth = scene.predict_at(&precise, &TRUTH, &mut workspace, &mut Silent).ok();
                let reply =
                    post(&agent, address, &question).inspect_err(|said| bar.println(format!("{index}: {said}")));
                let measured =
                    truth.zip(reply.ok()).and_then(|(truth, reply)| audited(index, promise, &reply, &truth.vertices));
                writeln!(journal, "{}", serde_json::to_string(&(index, &measured))?)?;
                measured
            }
        };
        match measured {
            Some(measured) => all.push(measured),
            None => without += 1,
        }
        bar.inc(1);
    }
    bar.finish();
    println!(
        "{requests} requests, seed {seed}; {refused} refused by every level and drawn again, {without} without an answer or a truth (`{NAME}`)\n\n{}",
        table(&all)
    );
    Ok(())
}
