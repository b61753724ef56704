//! The report: what was measured, on what, in a table a panel.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::measure::{Measured, Standing};
use super::pareto::undominated;

/// What a run was made with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Circumstances {
    /// Commit of the program; `unknown` outside of a checkout.
    pub commit: String,
    /// The processor.
    pub processor: String,
    /// Processors that the machine has; the run uses one.
    pub processors: usize,
    /// Version of this program.
    pub version: String,
    /// Seed of the requests.
    pub seed: u64,
    /// Requests of each panel.
    pub requests: usize,
    /// Timed repeats of each fast answer.
    pub repeats: usize,
}

/// Everything of one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// What it was made with.
    pub circumstances: Circumstances,
    /// What came out.
    pub panels: Vec<Measured>,
    /// The small run on the held-out sample, which the accuracy tier repeats.
    pub small: Vec<Standing>,
}

/// The report as Markdown, the chart being the file `chart` beside it.
pub fn markdown(results: &Results, chart: &str) -> String {
    let Circumstances { commit, processor, processors, version, seed, requests, repeats } = &results.circumstances;
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        out,
        "# What accuracy costs in time\n\n![error against time]({chart})\n\n\
         Printed by `cargo run --release -p retina-tests --bin accuracy -- {requests} {seed}`: version {version}, commit {commit}, one thread of {processors} × {processor}, \
         {requests} requests a panel, medians of {repeats} repeats.\n\
         Errors are those of the worst of the 64 nodes of each request against `reference`, whose own error (what refinement may still change) is its row.\n"
    );
    for panel in &results.panels {
        let _ = writeln!(
            out,
            "## {}: {}\n\n{} requests ({} that `reference` did not answer are left out); largest displacement: median {:.1} µm, largest {:.1} µm; if nothing moved, \
             the mean error would be {:.2} µm.\n\n\
             | | knob | worst node: median µm | p99 µm | max µm | mean of all nodes µm | % of RMS motion | median ms | p99 ms | Newton | failed | beaten by none |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|",
            panel.panel,
            panel.caption,
            panel.requests,
            panel.without_truth,
            panel.motion_median_um,
            panel.motion_max_um,
            panel.nothing_moves_um
        );
        let everybody: Vec<&Standing> = panel.standings.iter().chain([&panel.reference]).collect();
        for (s, best) in everybody.iter().zip(undominated(&everybody)) {
            let _ = writeln!(
                out,
                "| `{}` | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} | {:.3} | {:.3} | {:.0} | {} | {} |",
                s.name,
                s.knob,
                s.median_um,
                s.p99_um,
                s.max_um,
                s.mean_um,
                s.rms_percent,
                s.median_ms,
                s.p99_ms,
                s.iterations,
                s.failed,
                if best { "yes" } else { "" }
            );
        }
        out.push('\n');
    }
    out
}
