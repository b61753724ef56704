//! Files that were being written in a folder of scenes when their program was killed.
//!
//! Contract: only files that bear the mark of unfinished ones go (the name of a content, `#` and a number), and only those that nobody has written to
//! for a while: a younger one may be another server's at this moment. They are never listed or read, removed or not. A file of a time to come is as
//! old as one of that long ago: it was written before the clock was set back. A clock that is set while another server writes costs at most that write,
//! which is told to whoever sent it.

use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime};

use super::content::Id;

/// How long ago an unfinished file was last written to when it is taken for left behind.
const FORGOTTEN: Duration = Duration::from_secs(600);

/// Removes what was left behind in the folder.
pub fn remove(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let unfinished = name.to_str().is_some_and(is_unfinished);
        let written = entry.metadata().and_then(|metadata| metadata.modified()).ok();
        let forgotten = written.is_some_and(|written| apart(written, SystemTime::now()) > FORGOTTEN);
        if unfinished && forgotten && fs::remove_file(entry.path()).is_ok() {
            tracing::info!(file = %entry.path().display(), "removed a scene that was being written when its program ended");
        }
    }
}

/// How far apart two times are, whichever is the earlier one.
fn apart(one: SystemTime, other: SystemTime) -> Duration {
    one.duration_since(other).unwrap_or_else(|earlier| earlier.duration())
}

fn is_unfinished(name: &str) -> bool {
    let parts = name.split_once(".json#");
    parts.is_some_and(|(id, number)| Id::parse(id).is_some() && number.bytes().all(|digit| digit.is_ascii_digit()))
}
