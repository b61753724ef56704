//! Whether the service keeps its promises: `cargo run --release -p retina-tests --bin promises [-- REQUESTS [SEED]]` (2000, 1).
//!
//! Random requests of the working range over the built-in scenes ask a service in this process for an error, a time or both. First the truth of each is computed, that of
//! the data sets (`retina_models::dataset::truth`): half an hour, whatever else the machine does. It is kept in `target/promises-SEED.jsonl` as it comes, so an
//! interrupted run goes on where it stopped. Then all are asked, one at a time, in some ten minutes: deadlines are promised for an idle machine, and what else it was
//! busy with meanwhile is told.

use std::error::Error;

use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::Point3;
use retina_core::predict::{Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;
use retina_models::dataset::truth::{NAME, TRUTH};
use retina_models::journal::Journal;
use retina_tests::local_service;
use retina_tests::machine_time::{MachineTime, cpu_seconds};
use retina_tests::promise::question::{Asked, asked, body};
use retina_tests::promise::reply::{Audited, audited, post};
use retina_tests::promise::tally::table;

/// Requests asked first, so that the service knows how long its levels take here.
const WARM_UP: usize = 150;

/// True vertices in the patch frame (mm).
type Vertices = Vec<Point3<f64>>;

/// A request, the number of its scene, and what is asked for.
struct Question {
    scene: usize,
    request: Request,
    asked: Asked,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let requests: usize = arguments.next().map_or(Ok(2000), |a| a.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |a| a.parse())?;
    let names = Scene::built_in_names().iter().filter_map(|name| Scene::built_in(name));
    let scenes: Vec<PreparedScene> = names.map(PreparedScene::new).collect::<Result<_, _>>()?;
    let (questions, refused) = drawn(&scenes, requests, seed);
    let truths = truths(&scenes, &questions, seed)?;
    let (before, own_before) = (MachineTime::now(), cpu_seconds());
    let all = answers(&scenes, &questions, &truths)?;
    let own_s = cpu_seconds().zip(own_before).map_or(f64::NAN, |(after, before)| after - before);
    let without = requests - all.len();
    println!(
        "{requests} requests, seed {seed}; {refused} refused by every level and drawn again, {without} without an answer or a truth (`{NAME}`)"
    );
    if let Some((now, before)) = MachineTime::now().zip(before) {
        let (others, stolen) = now.shares_since(&before, own_s);
        println!(
            "of the machine's time meanwhile: {:.1} % other programs, {:.1} % the hypervisor",
            100.0 * others,
            100.0 * stolen
        );
    }
    println!("\n{}", table(&all));
    Ok(())
}

/// The questions, and how many requests were drawn that no level answers.
fn drawn(scenes: &[PreparedScene], requests: usize, seed: u64) -> (Vec<Question>, usize) {
    let range = |(scene, seed): (&PreparedScene, u64)| WorkingRange::new(&scene.scene().tissue, seed);
    let mut ranges: Vec<WorkingRange> = scenes.iter().zip(seed..).map(range).collect();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut workspace = Workspace::default();
    let mut refused = 0;
    let question = |index: usize| {
        let scene = index % scenes.len();
        let request = loop {
            let drawn = ranges[scene].request(Level::Linear);
            if scenes[scene].predict(&drawn, &mut workspace, &mut Silent).is_ok() {
                break drawn;
            }
            refused += 1;
        };
        Question { scene, request, asked: asked(&mut random) }
    };
    ((0..requests).map(question).collect(), refused)
}

/// The truth of each question; `None` where there is no equilibrium.
fn truths(
    scenes: &[PreparedScene],
    questions: &[Question],
    seed: u64,
) -> Result<Vec<Option<Vertices>>, Box<dyn Error>> {
    let path = format!("{}/../target/promises-{seed}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let mut journal: Journal<Option<Vec<[f64; 3]>>> = Journal::open(path.as_ref())?;
    let bar = bar(questions.len(), "truth")?;
    let mut workspace = Workspace::default();
    let mut truths = Vec::new();
    for (index, question) in questions.iter().enumerate() {
        let truth = journal.take_or_find(index as u64, || {
            let precise = Request { level: Level::Reference, ..question.request.clone() };
            let truth = scenes[question.scene].predict_at(&precise, &TRUTH, &mut workspace, &mut Silent);
            truth.ok().map(|truth| truth.vertices.iter().map(|at| at.coords.into()).collect())
        })?;
        truths.push(truth.map(|truth| truth.into_iter().map(Point3::from).collect()));
        bar.inc(1);
    }
    bar.finish();
    Ok(truths)
}

/// What a service answers to the questions that have a truth, held against it.
fn answers(
    scenes: &[PreparedScene],
    questions: &[Question],
    truths: &[Option<Vertices>],
) -> Result<Vec<Audited>, Box<dyn Error>> {
    let address = local_service::start(&[])?;
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
    let bodies: Vec<_> = questions.iter().map(|q| body(&scenes[q.scene].scene().name, &q.request, q.asked)).collect();
    for (at, question) in bodies.iter().cycle().take(WARM_UP).enumerate() {
        let mut level = question.clone();
        level["accuracy"] = serde_json::json!({"level": Level::ALL[at % 4].name()});
        // Whatever comes back, its time is known.
        let _ = post(&agent, address, &level);
    }
    let bar = bar(questions.len(), "asked")?;
    let mut all = Vec::new();
    for (index, (question, body)) in questions.iter().zip(&bodies).enumerate() {
        if let Some(truth) = &truths[index] {
            let reply = post(&agent, address, body).inspect_err(|said| bar.println(format!("{index}: {said}")));
            all.extend(reply.ok().and_then(|reply| audited(index, question.asked, &reply, truth)));
        }
        bar.inc(1);
    }
    bar.finish();
    Ok(all)
}

fn bar(length: usize, what: &'static str) -> Result<ProgressBar, Box<dyn Error>> {
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos}/{len} {eta}")?;
    Ok(ProgressBar::new(length as u64).with_style(style).with_message(what))
}
