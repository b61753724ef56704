//! Builds the page of `web/` with npm and hands it to the compiler.
//!
//! Contract: the page goes to `OUT_DIR`, npm's packages to `web/node_modules`. Without Node, or when npm fails, the build succeeds with
//! a warning and the program carries the reason instead of the page. Nothing runs while the page's sources stay as they are.
//!
//! Not here: how the page is served (`src/page.rs`), how it is built (`web/package.json`).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// What the page is built from, below `web/`.
const SOURCES: [&str; 6] =
    ["src", "index.html", "package.json", "package-lock.json", "vite.config.ts", "tsconfig.json"];

/// Lines of npm's complaint that are passed on.
const COMPLAINT_LINES: usize = 12;

fn main() -> io::Result<()> {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    let (web, page) = (root.join("../web"), out.join("page"));
    for source in SOURCES {
        println!("cargo::rerun-if-changed={}", web.join(source).display());
    }
    println!("cargo::rerun-if-changed=build.rs");
    let embedded = match build(&web, &page) {
        Ok(()) => built(&page)?,
        Err(reason) => {
            for line in reason.lines() {
                println!("cargo::warning=the page is not embedded: {line}");
            }
            format!("Embedded {{ files: &[], missing: Some({reason:?}) }}")
        }
    };
    fs::write(out.join("embedded.rs"), embedded)
}

/// Builds the page into `page`; fails with the reason in words.
fn build(web: &Path, page: &Path) -> Result<(), String> {
    if !installed(web) {
        // A build without network must fail at once and not after minutes of retries.
        npm(web, page, &["ci", "--no-audit", "--no-fund", "--prefer-offline", "--fetch-retries=1"])?;
    }
    npm(web, page, &["run", "build"])
}

/// Whether npm's packages are those of the lock file: npm writes its hidden copy last.
fn installed(web: &Path) -> bool {
    let changed = |path: &str| fs::metadata(web.join(path)).and_then(|file| file.modified());
    match (changed("node_modules/.package-lock.json"), changed("package-lock.json")) {
        (Ok(installed), Ok(locked)) => installed >= locked,
        _ => false,
    }
}

fn npm(web: &Path, page: &Path, arguments: &[&str]) -> Result<(), String> {
    let program = if cfg!(windows) { "npm.cmd" } else { "npm" };
    let mut command = Command::new(program);
    let run = command.args(arguments).current_dir(web).env("RETINA_PAGE_OUT", page).output();
    let output = run.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => "npm was not found when this program was built".to_owned(),
        _ => format!("npm could not be started: {error}"),
    })?;
    if output.status.success() {
        return Ok(());
    }
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    let lines: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).collect();
    let last = &lines[lines.len().saturating_sub(COMPLAINT_LINES)..];
    Err(format!("`npm {}` failed when this program was built:\n{}", arguments.join(" "), last.join("\n")))
}

/// The expression with every file of the page.
fn built(page: &Path) -> io::Result<String> {
    let mut files = Vec::new();
    collect(page, page, &mut files)?;
    files.sort();
    let mut text = String::from("Embedded { missing: None, files: &[\n");
    for (name, path) in files {
        let path = path.canonicalize()?;
        // Writing to a string does not fail.
        let _ = writeln!(text, "    ({name:?}, include_bytes!({path:?})),");
    }
    text.push_str("] }\n");
    Ok(text)
}

/// Every file below `folder` with its path from `top`, parts joined by `/`.
fn collect(top: &Path, folder: &Path, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(top, &path, files)?;
        } else if let Ok(below) = path.strip_prefix(top) {
            let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
            files.push((parts.join("/"), path.clone()));
        }
    }
    Ok(())
}
