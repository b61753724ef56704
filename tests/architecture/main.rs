//! Who may know whom, and the house rules that a reader relies on, read from manifests and sources.
//!
//! Contract: every rule names the file and line that breaks it. Not here: anything that runs the code.

use std::fs;
use std::path::{Path, PathBuf};

use retina_core::effects::EFFECT_NAMES;

/// What `retina-core` must not depend on: transport, clocks, text formats, recording.
const FORBIDDEN_IN_CORE: [&str; 8] = ["axum", "tokio", "hyper", "tower", "rerun", "serde", "serde_json", "tracing"];

/// What core's sources must not name: I/O, clocks, threads.
const FORBIDDEN_WORDS_IN_CORE: [&str; 11] = [
    "std::fs",
    "std::net",
    "std::thread",
    "std::process",
    "std::env",
    "Instant",
    "SystemTime",
    "println!",
    "print!(",
    "retina_server",
    "retina_tests",
];

/// Files or folders of `core/src`, and the modules that they must not name. The reading order of the design, one-way.
const ONE_WAY: [(&str, &[&str]); 18] = [
    (
        "range.rs",
        &["surface", "tissue", "needle", "scene", "effect", "effects", "mesh", "assemble", "solve", "predict"],
    ),
    ("surface", &["patch", "tissue", "needle", "scene", "effect", "effects", "mesh", "assemble", "solve", "predict"]),
    ("tissue", &["surface", "patch", "needle", "scene", "effect", "effects", "mesh", "assemble", "solve", "predict"]),
    ("needle", &["surface", "patch", "tissue", "scene", "effect", "effects", "mesh", "assemble", "solve", "predict"]),
    ("patch", &["tissue", "needle", "scene", "effect", "effects", "mesh", "assemble", "solve", "predict"]),
    ("scene.rs", &["effect", "effects", "mesh", "assemble", "solve", "equilibrium", "predict"]),
    (
        "effect.rs",
        &["surface", "patch", "tissue", "needle", "scene", "effects", "mesh", "solve", "equilibrium", "predict"],
    ),
    ("effects", &["surface", "patch", "tissue", "scene", "assemble", "solve", "equilibrium", "predict"]),
    (
        "layered",
        &["patch", "needle", "scene", "effect", "effects", "mesh", "assemble", "solve", "equilibrium", "predict"],
    ),
    ("mesh/element.rs", &["effect", "effects", "assemble", "solve", "equilibrium", "predict"]),
    ("mesh/disc.rs", &["effect", "effects", "assemble", "solve", "equilibrium", "predict"]),
    ("mesh", &["patch", "tissue", "needle", "scene", "equilibrium", "predict"]),
    (
        "assemble.rs",
        &["surface", "patch", "tissue", "needle", "scene", "effects", "mesh", "solve", "equilibrium", "predict"],
    ),
    ("solve", &["surface", "patch", "tissue", "needle", "scene", "effects", "mesh", "equilibrium", "predict"]),
    (
        "network",
        &["surface", "tissue", "scene", "effect", "effects", "mesh", "assemble", "solve", "equilibrium", "predict"],
    ),
    ("approach.rs", &["effect", "effects", "mesh", "assemble", "solve", "equilibrium", "predict"]),
    ("equilibrium", &["patch", "scene", "layered", "predict"]),
    ("predict", &["sequence"]),
];

/// Longest file without a reason, in lines.
const LONGEST: usize = 400;

/// Longer files, and why they are one file.
const LONG_FILES: [(&str, &str); 1] = [(
    "tests/verification/finite_element/block.rs",
    "mapped blocks, their loads and their solve, used together by every test",
)];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// Path below the root and text of every `.rs` file under `folder`, in order.
fn sources(folder: &str) -> Vec<(String, String)> {
    let (root, mut open, mut found) = (root(), vec![root().join(folder)], Vec::new());
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    assert!(!found.is_empty(), "no sources in {folder}");
    found.sort();
    found
}

/// Every source of the workspace.
fn all_sources() -> Vec<(String, String)> {
    ["core/src", "models/src", "models/tests", "server/src", "tests"]
        .iter()
        .flat_map(|folder| sources(folder))
        .collect()
}

/// The part of a line before a comment.
fn code(line: &str) -> &str {
    let trimmed = line.trim_start();
    if trimmed.starts_with("//") { "" } else { line.split(" // ").next().unwrap_or(line) }
}

/// `file:line: text` of every line of code that `breaks`.
fn breaches(sources: &[(String, String)], breaks: impl Fn(&str, &str) -> bool) -> Vec<String> {
    let lines =
        sources.iter().flat_map(|(name, text)| text.lines().enumerate().map(move |(at, line)| (name, at, line)));
    lines
        .filter(|(name, _, line)| breaks(name, code(line)))
        .map(|(name, at, line)| format!("{name}:{}: {}", at + 1, line.trim()))
        .collect()
}

/// Packages that `package` is built from, itself left out, development and build dependencies too for the package itself.
fn dependencies(package: &str) -> Vec<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let run = std::process::Command::new(cargo)
        .args(["tree", "--offline", "--locked", "--edges", "normal,build,dev", "--prefix", "none", "--format", "{p}"])
        .args(["--package", package])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let text = String::from_utf8(run.stdout).unwrap();
    let names: Vec<String> = text.lines().filter_map(|line| line.split(' ').next().map(str::to_owned)).collect();
    assert_eq!(names.first().map(String::as_str), Some(package));
    names[1..].to_vec()
}

#[test]
fn core_depends_on_no_transport_no_text_and_no_recorder() {
    let core = dependencies("retina-core");
    assert!(core.iter().any(|name| name == "nalgebra"), "the list is not what it seems: {core:?}");
    for forbidden in FORBIDDEN_IN_CORE {
        assert!(!core.iter().any(|name| name == forbidden), "retina-core depends on {forbidden}");
    }
    for package in ["retina-models", "retina-server", "retina-tests"] {
        assert!(!core.iter().any(|name| name == package), "retina-core depends on {package}");
    }
}

#[test]
fn nothing_that_ships_depends_on_the_tests() {
    let server = dependencies("retina-server");
    assert!(server.iter().any(|name| name == "retina-core") && !server.iter().any(|name| name == "retina-tests"));
}

#[test]
fn core_does_no_io_reads_no_clock_and_starts_no_thread() {
    let found =
        breaches(&sources("core/src"), |_, line| FORBIDDEN_WORDS_IN_CORE.iter().any(|word| line.contains(word)));
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn four_files_name_faer() {
    let sources = sources("core/src");
    // Sparse factors, their pattern and their numbers; dense factors; dense products of the networks.
    let four = [
        "core/src/solve/sparse.rs",
        "core/src/solve/sparse/numeric.rs",
        "core/src/solve/dense.rs",
        "core/src/network/dense.rs",
    ];
    let found = breaches(&sources, |name, line| line.contains("faer::") && !four.contains(&name));
    assert!(found.is_empty(), "{found:#?}");
    assert!(!breaches(&sources, |_, line| line.contains("faer::")).is_empty(), "the check sees nothing");
}

#[test]
fn the_recording_alone_names_rerun_and_one_file_of_it_logs() {
    let sources = sources("server/src");
    let found = breaches(&sources, |name, line| line.contains("rerun::") && !name.starts_with("server/src/recording/"));
    assert!(found.is_empty(), "{found:#?}");
    let logs = |line: &str| line.contains("stream.log(") || line.contains("stream.log_static(");
    let entities = "server/src/recording/entities.rs";
    let found = breaches(&sources, |name, line| logs(line) && name != entities);
    assert!(found.is_empty(), "{found:#?}");
    assert!(!breaches(&sources, |name, line| logs(line) && name == entities).is_empty(), "the check sees nothing");
}

#[test]
fn modules_of_core_know_only_those_before_them() {
    let sources = sources("core/src");
    for (place, forbidden) in ONE_WAY {
        let stem = place.trim_end_matches(".rs");
        let (file, folder) = (format!("core/src/{stem}.rs"), format!("core/src/{stem}/"));
        let is_in = |name: &str| name == file || (!place.ends_with(".rs") && name.starts_with(&folder));
        assert!(sources.iter().any(|(name, _)| is_in(name)), "no such module: {place}");
        let found =
            breaches(&sources, |name, line| is_in(name) && forbidden.iter().any(|module| names_module(line, module)));
        assert!(found.is_empty(), "{place} must not know {forbidden:?}: {found:#?}");
    }
}

/// Whether a line names `crate::module` and not just a module whose name begins like it.
fn names_module(line: &str, module: &str) -> bool {
    let path = format!("crate::{module}");
    line.match_indices(&path).any(|(at, _)| {
        let next = line[at + path.len()..].chars().next();
        !next.is_some_and(|c| c.is_alphanumeric() || c == '_')
    })
}

#[test]
fn the_module_check_tells_modules_apart() {
    assert!(names_module("use crate::effect::Local;", "effect"));
    assert!(!names_module("use crate::effects::contact;", "effect"));
    assert!(!names_module("use super::effect;", "effect"));
}

#[test]
fn every_effect_has_a_file_of_its_name() {
    for name in EFFECT_NAMES {
        let path = root().join(format!("core/src/effects/{name}.rs"));
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(text.starts_with(&format!("//! `{name}`: ")), "{} does not open with its name", path.display());
        assert!(text.contains(&format!("pub const NAME: &str = \"{name}\";")), "{}", path.display());
    }
}

#[test]
fn every_file_opens_with_what_it_is_for() {
    for (name, text) in all_sources() {
        let first = text.lines().next().unwrap_or_default();
        assert!(first.starts_with("//! ") && first.len() > 8, "{name} opens with {first:?}");
    }
}

#[test]
fn nothing_is_left_to_do() {
    // Joined here, so that this file does not find itself.
    let marks = [["TO", "DO"], ["FIX", "ME"], ["XX", "X"], ["dbg", "!"], ["todo", "!"], ["unimple", "mented!"]]
        .map(|m| m.concat());
    for (name, text) in all_sources() {
        for (at, line) in text.lines().enumerate() {
            for mark in &marks {
                assert!(!line.contains(mark.as_str()), "{name}:{}: {line}", at + 1);
            }
        }
    }
}

#[test]
fn files_are_short_or_say_why_not() {
    let sources = all_sources();
    for (name, text) in &sources {
        let lines = text.lines().count();
        let listed = LONG_FILES.iter().any(|(long, _)| long == name);
        assert!(lines <= LONGEST || listed, "{name} has {lines} lines, more than {LONGEST}, without a reason");
    }
    for (long, reason) in LONG_FILES {
        let found = sources.iter().find(|(name, _)| name == long);
        let lines = found.map_or(0, |(_, text)| text.lines().count());
        assert!(lines > LONGEST && reason.len() > 20, "{long} has {lines} lines and needs no reason");
    }
}
