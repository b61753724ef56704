//! Requests that nobody should send, from a seed: JSON with a wrong value somewhere, damaged bytes, wrong headers, messages of streams, and
//! bytes that are no HTTP.
//!
//! Contract: the n-th of a seed is always the same, so a failure is found again by seed and number. Some are in order by chance; what must
//! hold for all is that none is answered by a fault of the server.

use fastrand::Rng;
use serde_json::{Value, json};

/// A request that may be wrong anywhere.
#[derive(Clone, Debug)]
pub struct Malformed {
    /// Method.
    pub method: &'static str,
    /// Path.
    pub path: &'static str,
    /// `Content-Type`, if there is one.
    pub content_type: Option<&'static str>,
    /// Body.
    pub body: Vec<u8>,
}

/// The requests of a seed.
pub struct Generator {
    rng: Rng,
}

const WORDS: [&str; 22] = [
    "",
    "macula",
    "fovea",
    "flat",
    "mesh",
    "sphere",
    "foveal_pit",
    "pose",
    "force",
    "25G",
    "41G",
    "all",
    "auto",
    "linear",
    "coarse",
    "bevelled",
    "viscoelasticity",
    "NaN",
    "\u{0}",
    "\u{202e}",
    "v 0 0 0\nf 1 1 1",
    "../../etc/passwd",
];
const KEYS: [&str; 16] = [
    "kind",
    "radius_mm",
    "tip_mm",
    "retina",
    "flat",
    "thickness_mm",
    "level",
    "steps",
    "poses",
    "time_s",
    "force_mn",
    "scene",
    "needle",
    "effects",
    "open",
    "zzz",
];
const TOKENS: [&str; 10] = ["NaN", "Infinity", "1e999", "-1e999", "00", "0x10", "'a'", "nul", "\"\\ud800\"", "1.2.3"];

impl Generator {
    /// The generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self { rng: Rng::with_seed(seed) }
    }

    /// The next request.
    pub fn request(&mut self) -> Malformed {
        let (path, message) = self.message();
        let method = match self.rng.u8(..) {
            0..=247 => "POST",
            248..=251 => "PUT",
            _ => "PATCH",
        };
        let content_type = match self.rng.u8(..) {
            0..=239 => Some("application/json"),
            240..=247 => Some("text/plain"),
            248..=251 => Some("application/json; charset=\"utf-16"),
            _ => None,
        };
        Malformed { method, path, content_type, body: self.damaged(&message) }
    }

    /// The next text of a stream.
    pub fn text(&mut self) -> String {
        let open = json!({"open": {"scene": "macula", "needle": {"gauge": "25G", "tip": "flat"}, "accuracy": {"level": "linear"},
            "effects": "auto", "format": "json"}});
        let pose = json!({"pose": {"sequence": self.rng.u32(..), "client_time_us": 1.0, "tip_mm": [0.1, 0.0, 0.0],
            "direction": [0.0, 0.0, -1.0], "force_mn": [0.0, 0.0, -0.3]}});
        let message = if self.rng.bool() { self.mutated(open) } else { self.mutated(pose) };
        String::from_utf8_lossy(&self.damaged(&message)).into_owned()
    }

    /// Some bytes that begin like HTTP and do not go on like it.
    pub fn bytes(&mut self) -> Vec<u8> {
        let starts: [&str; 8] = [
            "POST /v1/predict HTTP/1.1\r\nhost: a\r\ncontent-type: application/json\r\ncontent-length: 99999999999999999999\r\n\r\n",
            "POST /v1/predict HTTP/1.1\r\nhost: a\r\ncontent-type: application/json\r\ntransfer-encoding: chunked\r\n\r\nZZ\r\n",
            "POST /v1/predict HTTP/1.1\r\nhost: a\r\ncontent-length: 5\r\ncontent-length: 6\r\n\r\nhello",
            "GET /v1/stream HTTP/1.1\r\nhost: a\r\nconnection: upgrade\r\nupgrade: websocket\r\nsec-websocket-version: 13\r\nsec-websocket-key: x\r\n\r\n",
            "GET /%00/../v1/about HTTP/1.1\r\nhost: \u{1}\r\n\r\n",
            "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
            "GET  / HTTP/9.9\r\n\r\n",
            "\u{16}\u{3}\u{1}",
        ];
        let mut bytes = self.rng.choice(starts).unwrap_or_default().as_bytes().to_vec();
        for _ in 0..self.rng.usize(0..200) {
            bytes.push(self.rng.u8(..));
        }
        bytes
    }

    /// A message of a route with something wrong in it.
    fn message(&mut self) -> (&'static str, Value) {
        let needle = json!({"tip_mm": [0.1, -0.05, 0.0], "gauge": "25G"});
        let scene = json!({"surface": {"kind": "foveal_pit", "radius_mm": 11.0, "depth_mm": 0.1},
            "tissue": {"retina": [{"thickness_mm": 0.1}, {"thickness_mm": 0.15}], "choroid": {"youngs_modulus_kpa": 5.0}}});
        let accuracy = json!({"level": "linear"});
        let (path, message) = match self.rng.u8(0..5) {
            0 => (
                "/v1/predict/batch",
                json!({"poses": [{"needle": needle, "force_mn": [0, 0, -0.3]}, {"needle": needle, "control": "pose"}],
                    "scene": "macula", "accuracy": accuracy}),
            ),
            1 => (
                "/v1/simulate",
                json!({"needle": needle, "steps": [{"time_s": 0.5, "force_mn": [0, 0, -0.2]}], "effects": ["contact"]}),
            ),
            2 => (
                "/v1/predict",
                json!({"needle": needle, "force_mn": [0, 0, -0.3], "scene": scene, "accuracy": accuracy}),
            ),
            3 => ("/v1/scenes", scene),
            _ => (
                "/v1/predict",
                json!({"needle": needle, "force_mn": [0, 0.1, -0.3], "scene": "fovea", "accuracy": accuracy, "effects": "auto"}),
            ),
        };
        (path, self.mutated(message))
    }

    /// The message with one to three values replaced, or keys added.
    fn mutated(&mut self, mut message: Value) -> Value {
        for _ in 0..self.rng.usize(1..4) {
            let mut pointers = Vec::new();
            places(&message, String::new(), &mut pointers);
            let at = self.rng.choice(&pointers).cloned().unwrap_or_default();
            let value = self.value(3);
            match message.pointer_mut(&at) {
                Some(Value::Object(fields)) if self.rng.bool() => {
                    fields.insert(self.rng.choice(KEYS).unwrap_or_default().to_owned(), value);
                }
                Some(place) => *place = value,
                None => {}
            }
        }
        message
    }

    fn value(&mut self, depth: u32) -> Value {
        match self.rng.u8(0..if depth == 0 { 8 } else { 10 }) {
            0 => Value::Null,
            1 => self.rng.bool().into(),
            2 => json!(f64::from_bits(self.rng.u64(..))),
            3 => json!(self.rng.f64() * 4.0 - 2.0),
            4 => json!(self.rng.i64(..)),
            5 => json!([0.0, -0.0, 1e308, 5e-324, 1e-9, 0.4999][self.rng.usize(0..6)]),
            6 => self.rng.choice(WORDS).unwrap_or_default().into(),
            7 => "x".repeat(self.rng.usize(0..3000)).into(),
            8 => (0..self.rng.usize(0..5)).map(|_| self.value(depth - 1)).collect(),
            _ => {
                let count = self.rng.usize(0..3);
                let field = |generator: &mut Self| {
                    let key = generator.rng.choice(KEYS).unwrap_or_default();
                    (key.to_owned(), generator.value(depth - 1))
                };
                Value::Object((0..count).map(|_| field(self)).collect())
            }
        }
    }

    /// The text of a message, one time in three no longer as it should be.
    fn damaged(&mut self, message: &Value) -> Vec<u8> {
        let mut bytes = message.to_string().into_bytes();
        match self.rng.u8(0..24) {
            0 => bytes.truncate(self.rng.usize(0..=bytes.len())),
            1 => {
                let at = self.rng.usize(0..bytes.len());
                bytes[at] = self.rng.u8(..);
            }
            2 => {
                let at = self.rng.usize(0..=bytes.len());
                let token = self.rng.choice(TOKENS).unwrap_or_default();
                bytes.splice(at..at, token.bytes());
            }
            3 => {
                let (from, length) = (self.rng.usize(0..bytes.len()), self.rng.usize(0..40));
                let piece = bytes[from..bytes.len().min(from + length)].to_vec();
                bytes.splice(from..from, piece);
            }
            4 => bytes = [b"[".repeat(self.rng.usize(0..5000)), bytes].concat(),
            5 => bytes.extend_from_slice(b"\xff\xfe{}"),
            6 => bytes = (0..self.rng.usize(0..300)).map(|_| self.rng.u8(..)).collect(),
            7 => bytes = [b"\xef\xbb\xbf".to_vec(), bytes].concat(),
            _ => {}
        }
        bytes
    }
}

/// Pointers to every value.
fn places(value: &Value, at: String, found: &mut Vec<String>) {
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(index, item)| places(item, format!("{at}/{index}"), found));
        }
        Value::Object(fields) => fields.iter().for_each(|(key, field)| places(field, format!("{at}/{key}"), found)),
        _ => {}
    }
    found.push(at);
}
