//! The elements of an input, from JSON or from binary data.
//!
//! Contract: as many as its shape says; JSON may nest them or not; binary is little-endian, texts with their length (u32) before them.

use serde_json::Value;

use super::models::Tensor;
use super::refusal::{Refusal, refused};
use super::request::InputSpec;

/// An input that was read.
pub struct Input {
    /// The batch.
    pub rows: usize,
    /// Its elements, row by row.
    pub elements: Elements,
}

/// The elements of a tensor.
pub enum Elements {
    /// FP32 or FP64.
    Numbers(Vec<f64>),
    /// BYTES.
    Texts(Vec<String>),
}

/// Reads an input that stands in JSON (`binary` is `None`) or in these bytes.
pub fn input(known: &Tensor, spec: &InputSpec, binary: Option<&[u8]>, most_rows: usize) -> Result<Input, Refusal> {
    let name = known.name;
    let width: usize = known.row.iter().product();
    let fits = match spec.shape.split_first() {
        Some((_, [])) => width == 1,
        Some((_, rest)) => rest == known.row,
        None => false,
    };
    let rows = spec.shape.first().copied().unwrap_or_default();
    if !fits || rows == 0 || rows > most_rows {
        let expected: Vec<String> = known.row.iter().map(ToString::to_string).collect();
        let expected = expected.join(", ");
        return Err(refused(format!(
            "input {name} has the shape {:?}; it must be [N, {expected}] with N from 1 to {most_rows}",
            spec.shape
        )));
    }
    let count = rows * width;
    let elements = match (known.datatype, spec.datatype.as_str(), binary) {
        ("BYTES", "BYTES", None) => Elements::Texts(texts_of_json(name, spec.data.as_ref(), count)?),
        ("BYTES", "BYTES", Some(bytes)) => Elements::Texts(texts_of_binary(name, bytes, count)?),
        // As the same numbers in binary would be.
        ("FP32", "FP32", None) => {
            let numbers = numbers_of_json(name, spec.data.as_ref(), count)?;
            Elements::Numbers(numbers.into_iter().map(|number| f64::from(number as f32)).collect())
        }
        ("FP32", "FP64", None) => Elements::Numbers(numbers_of_json(name, spec.data.as_ref(), count)?),
        ("FP32", "FP32", Some(bytes)) => {
            let (numbers, rest) = bytes.as_chunks::<4>();
            exact(name, numbers.len(), rest, count)?;
            Elements::Numbers(numbers.iter().map(|bytes| f32::from_le_bytes(*bytes).into()).collect())
        }
        ("FP32", "FP64", Some(bytes)) => {
            let (numbers, rest) = bytes.as_chunks::<8>();
            exact(name, numbers.len(), rest, count)?;
            Elements::Numbers(numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
        }
        (datatype, given, _) => {
            let allowed = if datatype == "BYTES" { "BYTES" } else { "FP32 or FP64" };
            return Err(refused(format!("input {name} has the datatype {given}; it must be {allowed}")));
        }
    };
    if let Elements::Numbers(numbers) = &elements
        && let Some(at) = numbers.iter().position(|number| !number.is_finite())
    {
        return Err(refused(format!("input {name} has {} at row {}; numbers must be finite", numbers[at], at / width)));
    }
    Ok(Input { rows, elements })
}

fn exact(name: &str, found: usize, rest: &[u8], count: usize) -> Result<(), Refusal> {
    match found == count && rest.is_empty() {
        true => Ok(()),
        false => Err(refused(format!("input {name} has {found} elements of binary data; its shape says {count}"))),
    }
}

/// The leaves of nested lists, in order.
fn leaves<'a>(value: &'a Value, to: &mut Vec<&'a Value>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| leaves(item, to)),
        leaf => to.push(leaf),
    }
}

fn elements<'a, T>(
    name: &str,
    data: Option<&'a Value>,
    count: usize,
    (what, read): (&str, impl Fn(&'a Value) -> Option<T>),
) -> Result<Vec<T>, Refusal> {
    let data = data.ok_or_else(|| refused(format!("input {name} has neither data nor binary_data_size")))?;
    let mut all = Vec::with_capacity(count);
    leaves(data, &mut all);
    if all.len() != count {
        return Err(refused(format!("input {name} has {} elements; its shape says {count}", all.len())));
    }
    let one = |value: &'a Value| {
        read(value).ok_or_else(|| {
            let shown: String = value.to_string().chars().take(60).collect();
            refused(format!("input {name} has {shown} among its data; {what} are expected"))
        })
    };
    all.into_iter().map(one).collect()
}

fn numbers_of_json(name: &str, data: Option<&Value>, count: usize) -> Result<Vec<f64>, Refusal> {
    elements(name, data, count, ("numbers", Value::as_f64))
}

fn texts_of_json(name: &str, data: Option<&Value>, count: usize) -> Result<Vec<String>, Refusal> {
    elements(name, data, count, ("texts", |value: &Value| value.as_str().map(str::to_owned)))
}

fn texts_of_binary(name: &str, mut bytes: &[u8], count: usize) -> Result<Vec<String>, Refusal> {
    let broken = || refused(format!("the binary data of input {name} are not {count} texts with their lengths"));
    let mut texts = Vec::new();
    while let Some((length, rest)) = bytes.split_first_chunk::<4>() {
        let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(broken)?;
        texts.push(String::from_utf8(text.to_vec()).map_err(|_| broken())?);
        bytes = rest;
    }
    match bytes.is_empty() && texts.len() == count {
        true => Ok(texts),
        false => Err(broken()),
    }
}
