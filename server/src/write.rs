//! From an answer to the bytes of its JSON.
//!
//! Contract: a number that is not finite is an error. JSON has no such numbers, and serde would write `null` in silence; an answer has
//! no `null`, so writing one is refused.

use std::io::{Error, Result, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;

/// Bytes that an answer of 64 nodes takes, about.
const USUAL_BYTES: usize = 16 * 1024;

/// How the JSON is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// For programs: no spaces.
    Compact,
    /// For people: a line for each field, lists in one line.
    Indented,
}

struct Finite {
    layout: Layout,
    depth: usize,
}

/// The JSON of `answer`.
///
/// # Errors
/// For a number that is not finite.
pub fn write(answer: &impl Serialize, layout: Layout) -> serde_json::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(USUAL_BYTES);
    answer.serialize(&mut Serializer::with_formatter(&mut bytes, Finite { layout, depth: 0 }))?;
    Ok(bytes)
}

impl Finite {
    fn line<W: ?Sized + Write>(&self, writer: &mut W) -> Result<()> {
        match self.layout {
            Layout::Compact => Ok(()),
            Layout::Indented => write!(writer, "\n{:1$}", "", 2 * self.depth),
        }
    }
}

impl Formatter for Finite {
    fn write_null<W: ?Sized + Write>(&mut self, _writer: &mut W) -> Result<()> {
        Err(Error::other("a number of the answer is not finite"))
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        self.depth += 1;
        writer.write_all(b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        self.depth -= 1;
        self.line(writer)?;
        writer.write_all(b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> Result<()> {
        if !first {
            writer.write_all(b",")?;
        }
        self.line(writer)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        match self.layout {
            Layout::Compact => writer.write_all(b":"),
            Layout::Indented => writer.write_all(b": "),
        }
    }
}
