//! The paper's network in ONNX Runtime beside the core's: the same weights and inputs, first the answers, then the times in turns.
//!
//! The other side is `tests/comparison/onnxruntime/session.py`. It takes its times itself, so what passes between the two programs is in none of them; only one of
//! the two computes at a time.

use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader, Error, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use retina_core::network::faithful::tool;
use retina_core::network::faithful::{UNIT_MM, features};
use retina_core::network::input::Input;
use retina_core::patch::NODE_COUNT;

use super::runtime::{Paper, Times};
use crate::describe;

/// The program of the other side.
const SESSION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/comparison/onnxruntime/session.py");
/// What is compared, as the other side calls it, and in words.
const KINDS: [(&str, &str); 2] =
    [("whole", "everything, from the numbers of both bodies"), ("kept", "what depends on the patch alone is kept")];
/// Largest difference of the two answers that times are taken for, relative to the largest displacement and never below that of the network's unit of 0.1 mm: rounding of
/// single precision over ten layers.
const SAME: f32 = 1e-4;
/// Micrometres in a millimetre.
const UM: f32 = 1e3;

/// The other side, running.
struct Session {
    child: Child,
    ask: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Session {
    fn start(python: &Path, folder: &Path) -> Result<Self, Error> {
        let mut child =
            Command::new(python).arg(SESSION).arg(folder).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let (Some(ask), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Error::other("no pipes"));
        };
        let mut session = Session { child, ask, answers: BufReader::new(answers) };
        session.line()?;
        Ok(session)
    }

    fn line(&mut self) -> Result<String, Error> {
        let mut line = String::new();
        match self.answers.read_line(&mut line)? {
            0 => Err(Error::other("session.py ended; is onnxruntime installed for that Python?")),
            _ => Ok(line),
        }
    }

    fn say(&mut self, what: &str, kind: &str) -> Result<String, Error> {
        writeln!(self.ask, "{what} {kind}")?;
        self.ask.flush()?;
        self.line()
    }

    fn end(self) -> Result<(), Error> {
        let Session { mut child, ask, .. } = self;
        // It ends where its input ends.
        drop(ask);
        child.wait().map(|_| ())
    }
}

fn bytes<T: Copy, const N: usize>(numbers: &[T], of: fn(T) -> [u8; N]) -> Vec<u8> {
    numbers.iter().flat_map(|&number| of(number)).collect()
}

/// Writes what the other side reads.
fn hand_over(folder: &Path, weights: &Path, soft: &[f32], rigid: &[f32]) -> Result<(), Error> {
    let pairs =
        |edges: &[(usize, usize)]| -> Vec<u32> { edges.iter().flat_map(|&(a, b)| [a as u32, b as u32]).collect() };
    let patch: Vec<(usize, usize)> = describe::graph().edges().collect();
    std::fs::create_dir_all(folder)?;
    std::fs::copy(weights, folder.join("weights.safetensors"))?;
    std::fs::write(folder.join("patch.u32"), bytes(&pairs(&patch), u32::to_le_bytes))?;
    std::fs::write(folder.join("tool.u32"), bytes(&pairs(&tool::edges()), u32::to_le_bytes))?;
    std::fs::write(folder.join("soft.f32"), bytes(soft, f32::to_le_bytes))?;
    std::fs::write(folder.join("rigid.f32"), bytes(rigid, f32::to_le_bytes))
}

/// How many times as fast the second is: by the medians, and by the tenth percent, which other work on the machine disturbs least.
fn faster(than: &Times, this: &Times) -> String {
    format!("{:.2}, {:.2}", than.median() / this.median(), than.quick() / this.quick())
}

/// The table of both, from samples of one patch with the travel to the first touch (mm), in so many turns.
///
/// # Errors
/// The other side's, or answers that differ.
pub fn compare(
    python: &Path,
    weights: &Path,
    paper: &mut Paper,
    samples: &[(Input, f32)],
    turns: usize,
) -> Result<String, Error> {
    let rest = samples.first().ok_or_else(|| Error::other("there are no samples"))?.0.rest_mm;
    let tools: Vec<Vec<f32>> = samples.iter().map(|(input, travel)| paper.tool(input, *travel).to_vec()).collect();
    let mut soft = Vec::new();
    features::soft(&rest, &mut soft);
    let folder: PathBuf = std::env::temp_dir().join(format!("retina-onnx-{}", std::process::id()));
    hand_over(&folder, weights, &soft, &tools.concat())?;
    let mut session = Session::start(python, &folder)?;
    let mut text = format!(
        "| {} samples, tool of {} nodes, {turns} turns, one thread | ONNX Runtime, ms: median (10–90 %) | core, ms: median (10–90 %) | times as fast: medians, 10 % | answers differ by at most, µm | largest displacement, µm |\n|---|---|---|---|---|---|\n",
        samples.len(),
        tool::TOOL_NODES
    );
    let mut sides = Vec::new();
    for (kind, words) in KINDS {
        let patch = paper.patch(&rest);
        session.say("answer", kind)?;
        let theirs = std::fs::read(folder.join(format!("{kind}.f32")))?;
        let theirs: Vec<f32> = theirs.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        let (mut off, mut largest) = (0.0_f32, 0.0_f32);
        for (tool, theirs) in tools.iter().zip(theirs.chunks_exact(3 * NODE_COUNT)) {
            let ours = paper.network.predict(&patch, tool, &mut paper.memory);
            for (ours, theirs) in ours.iter().zip(theirs.as_chunks::<3>().0) {
                off = off.max((ours - nalgebra::Vector3::from(*theirs)).norm());
                largest = largest.max(ours.norm());
            }
        }
        if !off.is_finite() || off > SAME * largest.max(UNIT_MM) {
            return Err(Error::other(format!("{kind}: the two answers are {} µm apart", off * UM)));
        }
        let (mut onnx, mut core) = (Times::default(), Times::default());
        for _ in 0..turns {
            let line = session.say("time", kind)?;
            onnx.ms.extend(line.split_whitespace().filter_map(|s| s.parse::<f64>().ok()).map(|s| 1e3 * s));
            for tool in &tools {
                let start = Instant::now();
                if kind == "whole" {
                    let patch = paper.patch(&rest);
                    std::hint::black_box(paper.network.predict(&patch, tool, &mut paper.memory));
                } else {
                    std::hint::black_box(paper.network.predict(&patch, tool, &mut paper.memory));
                }
                core.since(start);
            }
        }
        // A String takes whatever is written.
        let _ = writeln!(
            text,
            "| {words} | {} | {} | {} | {:.5} | {:.1} |",
            onnx.text(),
            core.text(),
            faster(&onnx, &core),
            off * UM,
            largest * UM
        );
        sides.push((onnx, core, off));
    }
    if let [(everything, ..), (_, kept, off)] = &sides[..] {
        let _ = writeln!(
            text,
            "| as published there, as core does here | {} | {} | {} | {:.5} | – |",
            everything.text(),
            kept.text(),
            faster(everything, kept),
            off * UM
        );
    }
    session.end()?;
    std::fs::remove_dir_all(&folder)?;
    Ok(text)
}
