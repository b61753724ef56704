//! What is in the messages of a client.
//!
//! Contract: a content of another length, a number that is not finite or a text that is not one is refused by name.

use serde_json::json;

use crate::problem::{Kind, Problem};

/// IANA numbers of the encodings that a text may have: US-ASCII and UTF-8.
pub const ENCODINGS: [u16; 2] = [3, 106];

/// A TRANSFORM.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Columns of the rotation.
    pub columns: [[f64; 3]; 3],
    /// Translation, mm.
    pub translation_mm: [f64; 3],
}

/// A SENSOR.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Unit, see [`super::unit`].
    pub unit: u64,
    /// The numbers.
    pub values: Vec<f64>,
}

fn refused(field: &str, given: impl Into<serde_json::Value>, allowed: &str) -> Problem {
    let given = given.into();
    let detail = format!("{field} is {given}, and must be {allowed}");
    Problem::field(Kind::InvalidRequest, field, Some(given), allowed, detail)
}

/// Twelve f32: three columns of the rotation, then the translation.
///
/// # Errors
/// [`Kind::InvalidRequest`].
pub fn transform(content: &[u8]) -> Result<Transform, Problem> {
    const BYTES: usize = 48;
    if content.len() != BYTES {
        return Err(refused("TRANSFORM.length", content.len(), "48 bytes"));
    }
    let mut numbers = [0.0; BYTES / 4];
    for (number, bytes) in numbers.iter_mut().zip(content.as_chunks::<4>().0) {
        let single = f32::from_be_bytes(*bytes);
        if !single.is_finite() {
            return Err(refused("TRANSFORM.matrix", single.to_string(), "finite numbers"));
        }
        *number = f64::from(single);
    }
    let triple = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
    Ok(Transform { columns: [triple(0), triple(3), triple(6)], translation_mm: triple(9) })
}

/// A count, a status that is reserved, a unit of 64 bits, and so many f64.
///
/// # Errors
/// [`Kind::InvalidRequest`].
pub fn sensor(content: &[u8]) -> Result<Sensor, Problem> {
    const HEAD: usize = 10;
    let expected = content.first().map_or(HEAD, |count| HEAD + 8 * usize::from(*count));
    if content.len() != expected {
        return Err(refused("SENSOR.length", content.len(), "10 bytes and 8 for each number that it counts"));
    }
    let unit = u64::from_be_bytes(std::array::from_fn(|byte| content[2 + byte]));
    let values: Vec<f64> = content[HEAD..].as_chunks::<8>().0.iter().map(|bytes| f64::from_be_bytes(*bytes)).collect();
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(refused("SENSOR.data", value.to_string(), "finite numbers")),
        None => Ok(Sensor { unit, values }),
    }
}

/// An encoding, a length, and so many bytes.
///
/// # Errors
/// [`Kind::InvalidRequest`].
pub fn string(content: &[u8]) -> Result<&str, Problem> {
    let (Some((encoding, rest)), true) = (content.split_first_chunk::<2>(), content.len() >= 4) else {
        return Err(refused("STRING.length", content.len(), "4 bytes and its text"));
    };
    let encoding = u16::from_be_bytes(*encoding);
    if !ENCODINGS.contains(&encoding) {
        return Err(refused("STRING.encoding", encoding, "3 (US-ASCII) or 106 (UTF-8)"));
    }
    let told = usize::from(u16::from_be_bytes([rest[0], rest[1]]));
    let bytes = &rest[2..];
    if bytes.len() != told {
        return Err(refused("STRING.length", json!(told), "the number of bytes that follow"));
    }
    std::str::from_utf8(bytes).map_err(|_| refused("STRING.text", "not UTF-8", "text"))
}
