//! What a long run has found, line by line in a file as it comes: the same command goes on where it was interrupted, and a longer run adds to a shorter one.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Findings by number.
pub struct Journal<T> {
    known: HashMap<u64, T>,
    file: File,
}

impl<T: Serialize + DeserializeOwned> Journal<T> {
    /// With what earlier runs left at `path`.
    ///
    /// # Errors
    /// If the file cannot be read or opened for more.
    pub fn open(path: &Path) -> io::Result<Self> {
        let text = match fs::read(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            other => other?,
        };
        // A line cut short by an interruption is found anew.
        let lines = text.split(|byte| *byte == b'\n');
        let known = lines.filter_map(|line| serde_json::from_slice(line).ok()).collect();
        Ok(Journal { known, file: OpenOptions::new().create(true).append(true).open(path)? })
    }

    /// Takes out what is known of `index`, or what `find` finds now, which is written down first.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn take_or_find(&mut self, index: u64, find: impl FnOnce() -> T) -> io::Result<T> {
        if let Some(found) = self.known.remove(&index) {
            return Ok(found);
        }
        let found = find();
        // A line of its own even after one cut short.
        writeln!(self.file, "\n{}", serde_json::to_string(&(index, &found))?)?;
        Ok(found)
    }
}
