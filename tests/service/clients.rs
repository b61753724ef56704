//! The clients of `clients/`, against a service on a socket.

use std::process::Command;

use crate::harness::Running;

/// What `press.py` prints; skipped, and said so, only where there is no Python.
fn press(arguments: &[&str]) -> Option<(bool, String)> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../clients/python/press.py");
    let python = if cfg!(windows) { "python" } else { "python3" };
    match Command::new(python).arg("-B").arg(script).args(arguments).env("PYTHONIOENCODING", "utf-8").output() {
        Ok(run) => {
            let text = [run.stdout, run.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
            Some((run.status.success(), text.replace("\r\n", "\n")))
        }
        Err(error) => {
            eprintln!("no {python}: {error}; the client is not tried");
            None
        }
    }
}

#[test]
fn the_python_client_presses_as_its_readme_says() {
    let service = Running::start(&["--threads", "2"]);
    let Some((success, text)) = press(&[&service.url("")]) else { return };
    assert!(success, "{text}");
    let readme = include_str!("../../clients/python/README.md");
    assert!(readme.contains(&format!("```\n{text}```")), "the README does not show what the program prints:\n{text}");
}

#[test]
fn the_python_client_brings_its_token_and_raises_what_is_refused() {
    let token = "a-token-of-the-test-0123456789";
    let service = Running::start(&["--threads", "2", "--token", token]);
    let Some((success, text)) = press(&[&service.url(""), token]) else { return };
    assert!(success, "{text}");
    let Some((success, text)) = press(&[&service.url(""), "not-the-token-of-the-test"]) else { return };
    assert!(!success && text.contains("retina_client.Problem"), "{text}");
}
