//! The clients of `clients/`, against a service on a socket.

mod ros2;
mod unity;

use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::harness::{Running, get};

/// Folder of the clients.
const CLIENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../clients");

/// What a Python program of the clients prints that is given `input`; `None`, and said so, only where there is no Python.
fn python(script: &str, arguments: &[&str], input: &str) -> Option<(bool, String)> {
    let python = if cfg!(windows) { "python" } else { "python3" };
    let mut command = Command::new(python);
    command.arg("-B").arg(format!("{CLIENTS}/{script}")).args(arguments);
    command.env("PYTHONIOENCODING", "utf-8").env("PYTHONPATH", format!("{CLIENTS}/python/src"));
    match command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn() {
        Ok(mut child) => {
            // A program that reads nothing may have closed it.
            let _ = child.stdin.take().expect("piped").write_all(input.as_bytes());
            let run = child.wait_with_output().expect("output");
            let text = [run.stdout, run.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
            Some((run.status.success(), text.replace("\r\n", "\n")))
        }
        Err(error) => {
            eprintln!("no {python}: {error}; {script} is not tried");
            None
        }
    }
}

/// What `press.py` prints.
fn press(arguments: &[&str]) -> Option<(bool, String)> {
    python("python/press.py", arguments, "")
}

#[test]
fn the_python_types_are_those_of_the_openapi_document() {
    let document = get("/openapi.json").body.to_string();
    let Some((success, text)) = python("python/generate_messages.py", &["-"], &document) else { return };
    assert!(success, "{text}");
    let committed = include_str!("../../clients/python/src/retina_client/messages.py").replace("\r\n", "\n");
    assert!(
        committed == text,
        "clients/python/src/retina_client/messages.py is stale: start the service, then `python3 clients/python/generate_messages.py`"
    );
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
