//! The header of a safetensors file: eight bytes of length, then a JSON object of tensors, then their bytes.
//!
//! Only what such a header may hold is read: objects, strings without escapes beyond `\"` and `\\`, arrays of whole numbers. This crate knows no
//! JSON beside it.

use std::collections::BTreeMap;

/// One tensor, as the header tells of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) dtype: String,
    pub(super) shape: Vec<usize>,
    pub(super) offsets: Vec<usize>,
}

/// A whole header.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) tensors: BTreeMap<String, Entry>,
    pub(super) metadata: BTreeMap<String, String>,
}

/// Name of the header's own entry.
const METADATA: &str = "__metadata__";
/// Bytes of the header's length.
const LENGTH_BYTES: usize = 8;

/// Splits a file into its header and the bytes of its tensors; `None` where it is not safetensors.
pub(super) fn split(file: &[u8]) -> Option<(Header, &[u8])> {
    let (length, rest) = file.split_first_chunk::<LENGTH_BYTES>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (text, data) = rest.split_at_checked(length)?;
    let mut reader = Reader { text: std::str::from_utf8(text).ok()? };
    let header = reader.header()?;
    reader.text.trim().is_empty().then_some((header, data))
}

/// What is left to read.
struct Reader<'a> {
    text: &'a str,
}

impl Reader<'_> {
    /// Whether `mark` comes next; it is passed if so.
    fn next_is(&mut self, mark: char) -> bool {
        let text = self.text.trim_start();
        match text.strip_prefix(mark) {
            Some(rest) => {
                self.text = rest;
                true
            }
            None => false,
        }
    }

    fn expect(&mut self, mark: char) -> Option<()> {
        self.next_is(mark).then_some(())
    }

    fn string(&mut self) -> Option<String> {
        self.expect('"')?;
        let mut read = String::new();
        let mut characters = self.text.char_indices();
        loop {
            match characters.next()? {
                (at, '"') => {
                    self.text = &self.text[at + 1..];
                    return Some(read);
                }
                (_, '\\') => match characters.next()?.1 {
                    kept @ ('"' | '\\' | '/') => read.push(kept),
                    'n' => read.push('\n'),
                    _ => return None,
                },
                (_, character) => read.push(character),
            }
        }
    }

    fn numbers(&mut self) -> Option<Vec<usize>> {
        self.expect('[')?;
        let (inside, rest) = self.text.split_once(']')?;
        self.text = rest;
        if inside.trim().is_empty() {
            return Some(Vec::new());
        }
        inside.split(',').map(|number| number.trim().parse().ok()).collect()
    }

    /// Calls `value` after each key of an object.
    fn object(&mut self, mut value: impl FnMut(&mut Self, String) -> Option<()>) -> Option<()> {
        self.expect('{')?;
        if self.next_is('}') {
            return Some(());
        }
        loop {
            let key = self.string()?;
            self.expect(':')?;
            value(self, key)?;
            if self.next_is('}') {
                return Some(());
            }
            self.expect(',')?;
        }
    }

    fn header(&mut self) -> Option<Header> {
        let mut header = Header::default();
        self.object(|reader, name| {
            if name == METADATA {
                return reader.object(|reader, key| {
                    let value = reader.string()?;
                    header.metadata.insert(key, value);
                    Some(())
                });
            }
            let mut entry = Entry::default();
            reader.object(|reader, key| {
                match key.as_str() {
                    "dtype" => entry.dtype = reader.string()?,
                    "shape" => entry.shape = reader.numbers()?,
                    "data_offsets" => entry.offsets = reader.numbers()?,
                    _ => return None,
                }
                Some(())
            })?;
            header.tensors.insert(name, entry);
            Some(())
        })?;
        Some(header)
    }
}
