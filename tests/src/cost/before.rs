//! Where the levels stood before: the results of an earlier program beside those of this one.
//!
//! `docs/accuracy/before.json` is the `results.json` that the program of an earlier commit wrote for the same requests in a run of its own; its
//! circumstances name the commit and the machine, and the row of `linear` tells how fast that was then. Without that file there is nothing to compare.

use std::fmt::Write;
use std::{fs, io, path::Path};

use super::measure::{Measured, Standing};
use super::report::Results;

/// The earlier results in `folder`, if there are any.
///
/// # Errors
/// If the file cannot be read or is not one of results.
pub fn read(folder: &Path) -> io::Result<Option<Results>> {
    match fs::read(folder.join("before.json")) {
        Ok(bytes) => Ok(Some(serde_json::from_slice(&bytes)?)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// The levels that stand in `panel` and in the panel of that name of `before`: earlier, now.
pub fn levels_twice<'a>(panel: &'a Measured, before: &'a [Measured]) -> Vec<(&'a Standing, &'a Standing)> {
    let earlier = before.iter().filter(|earlier| earlier.panel == panel.panel).flat_map(levels);
    let pair = |earlier: &'a Standing| levels(panel).find(|now| now.name == earlier.name).map(|now| (earlier, now));
    earlier.filter_map(pair).collect()
}

/// The levels that a panel has answers of.
fn levels(panel: &Measured) -> impl Iterator<Item = &Standing> {
    let everybody = panel.standings.iter().chain([&panel.reference]);
    everybody.filter(|standing| standing.knob == "level" && standing.answered > 0)
}

/// The table of both, as Markdown.
pub fn markdown(before: &Results, panels: &[Measured]) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        out,
        "## Before and now\n\nRings of the chart: the same requests, answered by commit {} on {} × {}. Each is held against its own `reference`.\n\n\
         | panel | level | median ms before | now | times as fast | p99 ms before | now | worst node, median µm before | now | p99 µm before | now |\n\
         |---|---|---|---|---|---|---|---|---|---|---|",
        before.circumstances.commit, before.circumstances.processors, before.circumstances.processor
    );
    for panel in panels {
        for (earlier, now) in levels_twice(panel, &before.panels) {
            let _ = writeln!(
                out,
                "| {} | `{}` | {:.3} | {:.3} | {:.1} | {:.3} | {:.3} | {:.2} | {:.2} | {:.2} | {:.2} |",
                panel.panel,
                now.name,
                earlier.median_ms,
                now.median_ms,
                earlier.median_ms / now.median_ms,
                earlier.p99_ms,
                now.p99_ms,
                earlier.median_um,
                now.median_um,
                earlier.p99_um,
                now.p99_um
            );
        }
    }
    out
}
