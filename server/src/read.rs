//! From the bytes of a body to a message, or to a problem that names the field at fault.
//!
//! Contract: what is not JSON is `malformed-json`; JSON that is not the message is `invalid-request` with the field's path, its value
//! and what belongs there; a number that f64 cannot hold is `out-of-range`.
//!
//! Not here: whether the values make sense (`understand`). Bodies that are in order are read once, without the bookkeeping of paths.

use serde::de::DeserializeOwned;
use serde_json::error::Category;
use serde_json::{Value, json};

use crate::problem::{Kind, Problem};
use crate::wire::object::Object;

/// Values longer than this, as JSON, are not repeated in a problem, and paths and reasons are cut after so many characters.
const LONGEST_ECHO: usize = 120;

/// Reads a message from a body that holds one JSON object and nothing else.
///
/// # Errors
/// [`Kind::MalformedJson`], [`Kind::InvalidRequest`], [`Kind::OutOfRange`].
pub fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    match serde_json::from_slice::<Object<T>>(body) {
        Ok(message) => Ok(message.0),
        Err(error) => Err(explain::<T>(body, error)),
    }
}

/// Reads again, now with paths, to say what `error` is about.
fn explain<T: DeserializeOwned>(body: &[u8], error: serde_json::Error) -> Problem {
    if body.iter().all(u8::is_ascii_whitespace) {
        return Problem::new(Kind::MalformedJson, "The body is empty; it must be a JSON object.");
    }
    let mut deserializer = serde_json::Deserializer::from_slice(body);
    let (path, error) = match serde_path_to_error::deserialize::<_, Object<T>>(&mut deserializer) {
        Err(error) => (error.path().to_string(), error.into_inner()),
        // The object is in order, so the fault is in what follows it.
        Ok(_) => (String::new(), error),
    };
    let path = if path == "." { String::new() } else { shortened(&path) };
    let text = error.to_string();
    let position = format!("line {} column {}", error.line(), error.column());
    let reason = text.strip_suffix(&format!(" at {position}")).unwrap_or(&text);
    match error.classify() {
        Category::Data => data(body, path, reason),
        Category::Eof => Problem::new(Kind::MalformedJson, format!("The body ends early: {text}.")),
        Category::Syntax | Category::Io if reason == "number out of range" => {
            let token = number_before(body, error.line(), error.column());
            let allowed = "a number of magnitude up to 1.8e308";
            let detail = format!("{path} = {token} is too large for a 64-bit floating-point number ({position})");
            Problem::field(Kind::OutOfRange, path, Some(json!(token)), allowed, detail)
        }
        Category::Syntax | Category::Io if path.is_empty() => {
            Problem::new(Kind::MalformedJson, format!("The body is not JSON: {text}."))
        }
        Category::Syntax | Category::Io => {
            let detail = format!("The body is not JSON at {path}: {text}.");
            let allowed = "JSON; it has no NaN and no infinity";
            Problem::field(Kind::MalformedJson, path, None, allowed, detail)
        }
    }
}

/// The problem of JSON that is not the message. serde's reasons are sentences of a fixed form, which say what was expected.
fn data(body: &[u8], path: String, reason: &str) -> Problem {
    let quoted = reason.split('`').nth(1).unwrap_or_default();
    let inside = |parent: &str| match parent {
        "" => quoted.to_owned(),
        parent => format!("{parent}.{quoted}"),
    };
    if reason.starts_with("missing field") {
        let field = inside(&path);
        let detail = format!("{field} is missing");
        return Problem::field(Kind::InvalidRequest, field, None, "required", detail);
    }
    if reason.starts_with("duplicate field") {
        let field = inside(&path);
        let detail = format!("{field} is given more than once");
        return Problem::field(Kind::InvalidRequest, field, None, "given once", detail);
    }
    let (found, expected) = reason.rsplit_once(", expected ").unwrap_or((reason, "what /openapi.json says"));
    let allowed = match expected {
        "f64" => "a number".to_owned(),
        "usize" => "a whole number from 0".to_owned(),
        _ => expected.replace('`', ""),
    };
    let place = if path.is_empty() { "the body" } else { &path };
    let kind = if reason.starts_with("unknown variant") { Kind::UnknownName } else { Kind::InvalidRequest };
    let detail = format!("{place}: {}, expected {allowed}", shortened(found));
    let value = value_at(body, &path);
    Problem::field(kind, path, value, allowed, detail)
}

fn shortened(text: &str) -> String {
    text.chars().take(LONGEST_ECHO).collect()
}

/// The value at a path such as `needle.tip_mm[0]`, if the body is JSON and the value is short.
fn value_at(body: &[u8], path: &str) -> Option<Value> {
    let document: Value = serde_json::from_slice(body).ok()?;
    let mut value = &document;
    for part in path.split(['.', '[']).filter(|part| !part.is_empty()) {
        value = match part.strip_suffix(']') {
            Some(index) => value.get(index.parse::<usize>().ok()?)?,
            None => value.get(part)?,
        };
    }
    (value.to_string().len() <= LONGEST_ECHO).then(|| value.clone())
}

/// The number that ends at or around a position, as it is written.
fn number_before(body: &[u8], line: usize, column: usize) -> String {
    let line = body.split(|&byte| byte == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let at = column.saturating_sub(1).min(line.len());
    let start = at - line[..at].iter().rev().take_while(|byte| is_part(byte)).count();
    let token: Vec<u8> = line[start..].iter().copied().take_while(is_part).take(LONGEST_ECHO).collect();
    String::from_utf8_lossy(&token).into_owned()
}
