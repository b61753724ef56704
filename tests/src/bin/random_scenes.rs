//! Random search for trouble: random requests on random tissues over the whole ranges, every answer held against every law.
//!
//! `cargo run --release -p retina-tests --bin random_scenes [-- COUNT [SEED]]` prints the report that the README shows. Trial `i` of a seed is always the same: fifty
//! requests share a tissue, because preparing one takes as long as some ten answers. What is known is kept in `target/random_scenes-SEED.jsonl` tissue by tissue,
//! so an interrupted run goes on where it stopped, and a longer one adds to a shorter one.
//!
//! `-- show SEED INDEX` asks trial INDEX again, shrinks it if it fails, and prints it as a line for `tests/data/regressions.jsonl`.

use std::collections::BTreeMap;
use std::error::Error;

use indicatif::{ProgressBar, ProgressStyle};
use retina_core::comparison::quantile;
use retina_core::predict::{PreparedScene, Workspace};
use retina_models::journal::Journal;
use retina_tests::random_scene::{REQUEST_UNITS, RequestNumbers, SCENE_UNITS, SceneNumbers, shrink, units};
use retina_tests::search::{Class, Outcome, REQUESTS_PER_TISSUE, ask, prepare, request, tissue};
use serde::Serialize;

/// Trials per run unless told.
const COUNT: u64 = 10_000;
/// The seed unless told.
const SEED: u64 = 1;
/// Trials named in the report for each way to fail.
const NAMED: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [word, seed, index] = &arguments[..]
        && word == "show"
    {
        return show(seed.parse()?, index.parse()?);
    }
    let count: u64 = arguments.first().map_or(Ok(COUNT), |a| a.parse())?;
    let seed: u64 = arguments.get(1).map_or(Ok(SEED), |a| a.parse())?;
    let path = format!("{}/../target/random_scenes-{seed}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let mut journal: Journal<Vec<Outcome>> = Journal::open(path.as_ref())?;
    let tissues = count.div_ceil(REQUESTS_PER_TISSUE);
    let bar = ProgressBar::new(count).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {eta}")?);
    let mut workspace = Workspace::default();
    let mut outcomes = Vec::new();
    for index in 0..tissues {
        outcomes.extend(journal.take_or_find(index, || try_tissue(seed, index, &mut workspace))?);
        bar.inc(REQUESTS_PER_TISSUE);
    }
    bar.finish();
    outcomes.truncate(count as usize);
    report(&outcomes, tissues, seed);
    Ok(())
}

fn try_tissue(seed: u64, index: u64, workspace: &mut Workspace) -> Vec<Outcome> {
    let numbers = tissue(seed, index);
    let prepared = prepare(&numbers);
    let trials = index * REQUESTS_PER_TISSUE..(index + 1) * REQUESTS_PER_TISSUE;
    trials
        .map(|trial| match &prepared {
            Ok(scene) => ask(scene, &request(seed, trial, &numbers), workspace),
            Err(outcome) => outcome.clone(),
        })
        .collect()
}

fn report(outcomes: &[Outcome], tissues: u64, seed: u64) {
    let mut ends: BTreeMap<(usize, &str, &str), Vec<usize>> = BTreeMap::new();
    let mut iterations: BTreeMap<Class, Vec<f64>> = BTreeMap::new();
    for (index, outcome) in outcomes.iter().enumerate() {
        let end = match outcome {
            Outcome::Answered { class, iterations: spent } => {
                iterations.entry(*class).or_default().push(*spent as f64);
                (0, "answered, every law obeyed", "")
            }
            Outcome::Refused(cause) => (1, "refused", cause.as_str()),
            Outcome::Failed(cause) => (2, "failed", cause.as_str()),
            // Numbers differ from trial to trial: the law is what comes before the first of them.
            Outcome::Broken(law) => (3, "a law broken", law.split(['(', '0', '1', '2']).next().unwrap_or(law).trim()),
        };
        ends.entry(end).or_default().push(index);
    }
    let not_finite = outcomes.iter().filter(|o| matches!(o, Outcome::Broken(law) if law.contains("not finite")));
    println!(
        "{} trials on {tissues} tissues, seed {seed}; non-finite answers: {}\n",
        outcomes.len(),
        not_finite.count()
    );
    println!("| end | cause | trials | % | for example |");
    println!("|---|---|---|---|---|");
    for ((order, end, cause), trials) in &ends {
        let shown: Vec<String> = trials.iter().take(NAMED).map(usize::to_string).collect();
        let shown = if *order >= 2 { shown.join(", ") } else { String::new() };
        let share = 100.0 * trials.len() as f64 / outcomes.len() as f64;
        println!("| {end} | {cause} | {} | {share:.2} | {shown} |", trials.len());
    }
    println!("\n| simulated | answers | Newton iterations p50 | p99 | max |");
    println!("|---|---|---|---|---|");
    for (class, spent) in &iterations {
        let name = match class {
            Class::Still => "nothing touches",
            Class::Contact => "tissue and contact",
            Class::Pressure => "… and pressure",
            Class::Friction => "… and friction",
            Class::Adhesion => "… and adhesion",
            Class::Both => "… and friction and adhesion",
        };
        let [median, most, all] = [0.5, 0.99, 1.0].map(|share| quantile(spent, share));
        println!("| {name} | {} | {median:.0} | {most:.0} | {all:.0} |", spent.len());
    }
}

/// A trial as it is written down.
#[derive(Serialize)]
struct Regression<'a> {
    name: String,
    scene: &'a SceneNumbers,
    request: &'a RequestNumbers,
}

/// Asks one trial again, shrunk if it fails.
fn show(seed: u64, index: u64) -> Result<(), Box<dyn Error>> {
    let scene_units = units(seed, 1, index / REQUESTS_PER_TISSUE, SCENE_UNITS);
    let both = [scene_units, units(seed, 2, index, REQUEST_UNITS)].concat();
    let came_to = |both: &[f64]| {
        let numbers = SceneNumbers::draw(&both[..SCENE_UNITS]);
        let request = RequestNumbers::draw(&both[SCENE_UNITS..], &numbers);
        let ask = |scene: PreparedScene| ask(&scene, &request, &mut Workspace::default());
        let outcome = prepare(&numbers).map_or_else(|outcome| outcome, ask);
        (numbers, request, outcome)
    };
    let print = |title: &str, both: &[f64]| -> Result<Outcome, Box<dyn Error>> {
        let (scene, request, outcome) = came_to(both);
        let name = format!("trial {index} of seed {seed}");
        println!(
            "{title}: {outcome:?}\n{}\n",
            serde_json::to_string(&Regression { name, scene: &scene, request: &request })?
        );
        Ok(outcome)
    };
    let first = print("as drawn", &both)?;
    if let Outcome::Failed(_) | Outcome::Broken(_) = first {
        let kind = std::mem::discriminant(&first);
        let shrunk = shrink(both, |tried| std::mem::discriminant(&came_to(tried).2) == kind);
        print("shrunk", &shrunk)?;
    }
    Ok(())
}
