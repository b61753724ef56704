//! The program as a process of its own, to be told to end, or to be killed at any moment.

use std::io::{self, BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;

/// A running program that serves; killed when dropped.
pub struct Spawned {
    /// The process.
    pub child: Child,
    /// Host and port that it listens on.
    pub address: String,
}

impl Spawned {
    /// Starts `program` with these arguments on a free port, and waits until it listens.
    ///
    /// # Errors
    /// If it cannot be started, or ends before it listens; then its last line is in the error.
    pub fn start(program: &Path, arguments: &[&str]) -> io::Result<Self> {
        Self::start_among(&[], program, arguments)
    }

    /// As [`Spawned::start`], with these variables in the environment.
    ///
    /// # Errors
    /// As [`Spawned::start`].
    pub fn start_among(variables: &[(&str, &str)], program: &Path, arguments: &[&str]) -> io::Result<Self> {
        let mut child = Command::new(program)
            .envs(variables.iter().copied())
            .args(["--listen", "127.0.0.1:0", "--log", "json"])
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()?;
        let log = child.stderr.take().ok_or_else(|| io::Error::other("no log"))?;
        let (mut log, mut line) = (BufReader::new(log), String::new());
        while !line.contains("listening on http://") {
            let last = std::mem::take(&mut line);
            if log.read_line(&mut line)? == 0 {
                return Err(io::Error::other(format!("the program ended: {last}")));
            }
        }
        // Read on, or the program would wait for room in the pipe.
        thread::spawn(move || io::copy(&mut log, &mut io::sink()));
        let address = line.split("http://").nth(1).and_then(|rest| rest.split(',').next()).unwrap_or_default();
        Ok(Self { child, address: address.to_owned() })
    }

    /// The URL of a path.
    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Ends it at once, as `kill -9` does.
    ///
    /// # Errors
    /// If the system does not.
    pub fn kill(mut self) -> io::Result<()> {
        self.child.kill()?;
        self.child.wait().map(|_| ())
    }
}

impl Drop for Spawned {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
