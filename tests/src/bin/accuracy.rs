//! What accuracy costs in time: every level, and every knob of levels `network` and `coarse`, against the reference, in one run on one thread.
//!
//! `cargo run --release -p retina-tests --bin accuracy [-- REQUESTS [SEED]]` writes `docs/accuracy/report.md`, `results.json` and `chart.svg`. Requests are those
//! of each of three panels (default, hard, outside); a reference takes seconds, so 30 a panel take about ten minutes on a quiet machine. Where `docs/accuracy/before.json` holds the results of an earlier program, they are shown
//! beside (`cost::before`).

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

use indicatif::{ProgressBar, ProgressStyle};
use retina_tests::cost::contestant::contestants;
use retina_tests::cost::measure::measure;
use retina_tests::cost::panel::Panel;
use retina_tests::cost::report::{Circumstances, Results, markdown};
use retina_tests::cost::{before, chart, report, small};

/// Requests of each panel unless told.
const REQUESTS: usize = 30;
/// The seed unless told.
const SEED: u64 = 41;
/// Timed repeats of a fast answer.
const REPEATS: usize = 5;
/// Where the report goes.
const OUTPUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/accuracy");

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let requests: usize = arguments.next().map_or(Ok(REQUESTS), |a| a.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(SEED), |a| a.parse())?;
    let bar = ProgressBar::new((requests * Panel::ALL.len()) as u64)
        .with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {eta}")?);
    let contestants = contestants();
    let mut panels = Vec::new();
    for panel in Panel::ALL {
        let questions = panel.questions(requests, seed)?;
        panels.push(measure((panel.name(), panel.caption()), &questions, &contestants, REPEATS, &bar));
    }
    bar.finish();
    let small = small::standings(REPEATS)?;
    let results = Results { circumstances: circumstances(requests, seed), panels, small };
    let folder = Path::new(OUTPUT);
    fs::create_dir_all(folder)?;
    let before = before::read(folder)?;
    let rings = before.as_ref().map_or(&[][..], |before| &before.panels);
    fs::write(folder.join("chart.svg"), chart::svg(&results.panels, rings, "What accuracy costs in time"))?;
    fs::write(folder.join("results.json"), serde_json::to_string_pretty(&results)?)?;
    let mut text = markdown(&results, "chart.svg");
    text.extend(before.map(|before| before::markdown(&before, &results.panels)));
    fs::write(folder.join("report.md"), &text)?;
    println!("{text}");
    Ok(())
}

fn circumstances(requests: usize, seed: u64) -> report::Circumstances {
    let commit = Command::new("git").args(["rev-parse", "--short", "HEAD"]).output();
    let commit = commit.ok().filter(|output| output.status.success());
    let commit =
        commit.map_or_else(|| "unknown".to_owned(), |output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    Circumstances {
        commit,
        processor: processor(),
        processors: std::thread::available_parallelism().map_or(1, usize::from),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed,
        requests,
        repeats: REPEATS,
    }
}

/// The processor's name where the system tells it in a file, its architecture elsewhere.
fn processor() -> String {
    let told = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = told.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}
