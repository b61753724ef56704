//! Which blocks of a data set one of several runs computes: every so-many-th, so that all parts take about as long.

use std::str::FromStr;

/// One of `of` parts, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    index: u32,
    of: u32,
}

impl Part {
    /// Whether the part has that block. Each block is in one part.
    pub fn has(self, block: u32) -> bool {
        block % self.of == self.index
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((index, of)) if index < of => Ok(Self { index, of }),
            _ => Err(format!("{text:?} is no part; the third of eight is 2/8")),
        }
    }
}
