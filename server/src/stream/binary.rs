//! The binary messages of a stream. This is the only place that knows the layout.
//!
//! All numbers are little-endian; `f32` and `f64` are IEEE 754. Units as everywhere: mm, mN, kPa; errors in µm, times in µs.
//!
//! Header of both messages, 24 bytes:
//!
//! | offset | type | what |
//! |---|---|---|
//! | 0 | 4 bytes | `RTNA` |
//! | 4 | u8 | version of the layout: 1 |
//! | 5 | u8 | kind: 1 a pose (client), 2 an answer (server) |
//! | 6 | u16 | flags, by kind; other bits are 0 |
//! | 8 | u64 | sequence number |
//! | 16 | f64 | the client's time, repeated by the answer |
//!
//! A pose, 64 bytes in all; flag 1: `force_mn` is given (else the needle is held and these three are 0). In a session with memory, flag 4: tip and orientation are left
//! out, so the needle is where the last pose left it (these seven are 0), flag 2: the pose has a time, and flag 8 or flag 16: it says how much fluid is on the scene's detached
//! disc. Each of the two adds 8 bytes, the time first:
//!
//! | offset | type | what |
//! |---|---|---|
//! | 24 | 3 × f32 | `tip_mm` |
//! | 36 | 4 × f32 | `orientation_xyzw` |
//! | 52 | 3 × f32 | `force_mn` |
//! | 64 | f64 | with flag 2: `time_s` |
//! | 64 or 72 | f64 | with flag 8: the fluid's `volume_mm3`; with flag 16: its `pressure_kpa` |
//!
//! An answer with `n` nodes, 116 + 28 `n` bytes; flag 1: the expected error was measured on requests like this one, flag 2: there are warnings
//! (a session in `json` has their words), flag 4: the patch is cut from a mesh and brings its triangles:
//!
//! | offset | type | what |
//! |---|---|---|
//! | 24 | u32 | poses overtaken since the last answer |
//! | 28 | u8 | level: 0 `linear`, 1 `coarse`, 2 `reference`, 3 `network`, 4 `corrected` |
//! | 29 | u8 | contact: 0 clear, 1 touching, 2 slipping, 3 punctured |
//! | 30 | u16 | `n` |
//! | 32 | f64 | when the pose arrived, on a clock that began with the connection |
//! | 40 | f32 | from then until work on it began |
//! | 44 | f32 | from then until the surface was there |
//! | 48 | 3 × f32 | `tip_mm` at equilibrium |
//! | 60 | f32 | `travel_mm` |
//! | 64 | 3 × f32 | `reaction_mn` |
//! | 76 | f32 | `area_mm2` |
//! | 80 | f32 | `max_strain` |
//! | 84 | f32 | `max_pressure_kpa` |
//! | 88 | f32 | `max_penetration_um` |
//! | 92 | f32 | expected error of the worst node, median; NaN where unknown |
//! | 96 | f32 | the same, 95 %; NaN where unknown |
//! | 100 | u32 | effects simulated: bit k is the k-th name of `GET /v1/about` |
//! | 104 | f64 | `time_s` of the pose in a session with memory, else 0 |
//! | 112 | u32 | 0, reserved |
//! | 116 | 3 `n` × f32 | `vertices_mm` |
//! | 116 + 12 `n` | 3 `n` × f32 | `normals` |
//! | 116 + 24 `n` | `n` × f32 | `displacement_um` |
//!
//! With flag 4 follow a u32 `t`, 3 `t` × u32 (triangles) and `n` × u32 (the mesh's index of each node).

use retina_core::effects::EFFECT_NAMES;
use retina_core::predict::{ContactState, Level, Prediction};
use serde_json::json;

use crate::problem::{Kind, Problem};
use crate::wire::fixed::{Quaternion, Vector};
use crate::wire::scene::FillingSpec;
use crate::wire::stream::{StreamPose, StreamTimes};

/// Version of the layout.
pub const VERSION: u8 = 1;

const MAGIC: [u8; 4] = *b"RTNA";
const POSE: u8 = 1;
const ANSWER: u8 = 2;
const POSE_BYTES: usize = 64;
const NUMBER_BYTES: usize = 8;
const ANSWER_BYTES: usize = 116;
const BYTES_PER_NODE: usize = 28;
const FORCE_GIVEN: u16 = 1;
const TIME_GIVEN: u16 = 2;
const NEEDLE_STAYS: u16 = 4;
const VOLUME_GIVEN: u16 = 8;
const PRESSURE_GIVEN: u16 = 16;
const CALIBRATED: u16 = 1;
const WARNED: u16 = 2;
const CUT: u16 = 4;

/// What an answer repeats of its pose, and what was lost before it.
#[derive(Clone, Copy, Debug)]
pub struct Head {
    /// The pose's number.
    pub sequence: u64,
    /// The client's number.
    pub client_time_us: Option<f64>,
    /// The pose's time in a session with memory (s).
    pub time_s: Option<f64>,
    /// Poses overtaken since the last answer.
    pub dropped: u32,
    /// The server's times.
    pub times: StreamTimes,
}

fn refused(what: &str, given: impl Into<serde_json::Value>, allowed: impl Into<String>) -> Problem {
    let allowed = allowed.into();
    let given = given.into();
    let detail = format!("the binary message's {what} is {given}, and must be {allowed}");
    Problem::field(Kind::InvalidRequest, format!("pose.{what}"), Some(given), allowed, detail)
}

/// The pose in a binary message.
///
/// # Errors
/// [`Kind::InvalidRequest`] naming the part of the layout that is not kept.
pub fn pose(bytes: &[u8]) -> Result<StreamPose, Problem> {
    let lengths = || {
        let allowed = format!(
            "{POSE_BYTES} bytes, {NUMBER_BYTES} more with a time (flag {TIME_GIVEN}) and with fluid (flag {VOLUME_GIVEN} or {PRESSURE_GIVEN})"
        );
        refused("length", bytes.len(), allowed)
    };
    let (message, rest) = bytes.split_first_chunk::<POSE_BYTES>().ok_or_else(lengths)?;
    if message[..4] != MAGIC {
        return Err(refused("magic", json!(message[..4]), "RTNA"));
    }
    if message[4] != VERSION {
        return Err(refused("version", message[4], VERSION.to_string()));
    }
    if message[5] != POSE {
        return Err(refused("kind", message[5], format!("{POSE} (a pose)")));
    }
    let flags = u16::from_le_bytes(part(message, 6));
    let all = FORCE_GIVEN | TIME_GIVEN | NEEDLE_STAYS | VOLUME_GIVEN | PRESSURE_GIVEN;
    let fluid = flags & (VOLUME_GIVEN | PRESSURE_GIVEN);
    if flags & !all != 0 || fluid == VOLUME_GIVEN | PRESSURE_GIVEN {
        return Err(refused("flags", flags, format!("0 to {all}, of {VOLUME_GIVEN} and {PRESSURE_GIVEN} one at most")));
    }
    let (numbers, []) = rest.as_chunks::<NUMBER_BYTES>() else { return Err(lengths()) };
    let mut numbers = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes));
    let mut next = |given: bool| given.then(|| numbers.next().ok_or_else(lengths)).transpose();
    let time_s = next(flags & TIME_GIVEN != 0)?;
    let filling = next(fluid != 0)?;
    if numbers.next().is_some() {
        return Err(lengths());
    }
    let given = flags & NEEDLE_STAYS == 0;
    let number = |at: usize| f64::from(f32::from_le_bytes(part(message, at)));
    let vector = |at: usize| [number(at), number(at + 4), number(at + 8)];
    let [x, y, z] = vector(36);
    let time_us = f64::from_le_bytes(part(message, 16));
    let pose = StreamPose {
        sequence: u64::from_le_bytes(part(message, 8)),
        client_time_us: Some(time_us),
        time_s,
        tip_mm: given.then(|| Vector(vector(24))),
        orientation_xyzw: given.then(|| Quaternion([x, y, z, number(48)])),
        direction: None,
        force_mn: (flags & FORCE_GIVEN != 0).then(|| Vector(vector(52))),
        bleb: filling.map(|filling| FillingSpec {
            volume_mm3: (fluid == VOLUME_GIVEN).then_some(filling),
            pressure_kpa: (fluid == PRESSURE_GIVEN).then_some(filling),
        }),
    };
    let finite = |name: &str, numbers: &[f64]| match numbers.iter().find(|number| !number.is_finite()) {
        Some(number) => Err(refused(name, number.to_string(), "finite numbers")),
        None => Ok(()),
    };
    finite("client_time_us", &[time_us])?;
    finite("time_s", &[time_s.unwrap_or_default()])?;
    finite("bleb", &[filling.unwrap_or_default()])?;
    finite("tip_mm", &vector(24))?;
    finite("orientation_xyzw", &[x, y, z, number(48)])?;
    finite("force_mn", &vector(52))?;
    Ok(pose)
}

/// `N` bytes from `at` on, which lie inside.
fn part<const N: usize>(message: &[u8; POSE_BYTES], at: usize) -> [u8; N] {
    std::array::from_fn(|byte| message[at + byte])
}

/// The binary message of an answer.
///
/// # Errors
/// [`Kind::Internal`] for a number that is not finite or a patch of more nodes than the layout counts.
pub fn answer(head: &Head, prediction: &Prediction) -> Result<Vec<u8>, Problem> {
    let count = prediction.vertices.len();
    let nodes = u16::try_from(count).map_err(Problem::internal)?;
    let expected = &prediction.expected_error;
    let mut flags = 0;
    for (holds, flag) in [
        (expected.calibrated, CALIBRATED),
        (!prediction.warnings.is_empty(), WARNED),
        (prediction.source_indices.is_some(), CUT),
    ] {
        flags |= if holds { flag } else { 0 };
    }
    let mut message = Writer { bytes: Vec::with_capacity(ANSWER_BYTES + BYTES_PER_NODE * count), finite: true };
    message.bytes.extend_from_slice(&MAGIC);
    message.bytes.extend_from_slice(&[VERSION, ANSWER]);
    message.bytes.extend_from_slice(&u16::to_le_bytes(flags));
    message.bytes.extend_from_slice(&head.sequence.to_le_bytes());
    message.bytes.extend_from_slice(&head.client_time_us.unwrap_or(0.0).to_le_bytes());
    message.whole(head.dropped);
    message.bytes.push(level(prediction.level));
    message.bytes.push(match prediction.contact.state {
        ContactState::Clear => 0,
        ContactState::Touching => 1,
        ContactState::Slipping => 2,
        ContactState::Punctured => 3,
    });
    message.bytes.extend_from_slice(&nodes.to_le_bytes());
    message.bytes.extend_from_slice(&head.times.received.to_le_bytes());
    let (needle, contact) = (&prediction.needle, &prediction.contact);
    message.numbers(&[head.times.waited, head.times.computed]);
    message.numbers(needle.tip_mm.coords.as_slice());
    message.numbers(&[needle.travel_mm]);
    message.numbers(needle.reaction_mn.as_slice());
    message.numbers(&[
        contact.area_mm2,
        contact.max_strain,
        contact.max_pressure_kpa,
        contact.max_penetration_mm * 1e3,
    ]);
    for um in [expected.median_um, expected.p95_um] {
        let known = um.is_finite() && expected.p95_um.is_finite();
        message.bytes.extend_from_slice(&if known { um as f32 } else { f32::NAN }.to_le_bytes());
    }
    message.whole(effects(prediction));
    message.bytes.extend_from_slice(&head.time_s.unwrap_or(0.0).to_le_bytes());
    message.whole(0);
    prediction.vertices.iter().for_each(|vertex| message.numbers(vertex.coords.as_slice()));
    prediction.normals.iter().for_each(|normal| message.numbers(normal.as_slice()));
    message.numbers(&prediction.displacement_um);
    if let Some(source) = &prediction.source_indices {
        let indices = prediction.triangles.iter().flatten().chain(source);
        message.whole(prediction.triangles.len() as u32);
        indices.for_each(|index| message.whole(*index as u32));
    }
    match message.finite {
        true => Ok(message.bytes),
        false => Err(Problem::internal("a number of the answer is not finite")),
    }
}

/// Number of a level in the layout.
fn level(level: Level) -> u8 {
    match level {
        Level::Linear => 0,
        Level::Coarse => 1,
        Level::Reference => 2,
        Level::Network => 3,
        Level::Corrected => 4,
    }
}

/// The effects simulated, one bit each.
fn effects(prediction: &Prediction) -> u32 {
    let bit = |name: &str| EFFECT_NAMES.iter().position(|known| *known == name).map_or(0, |at| 1 << at);
    let simulated = prediction.effects.iter().filter(|effect| effect.simulated);
    simulated.map(|effect| bit(effect.name)).fold(0, |all, one| all | one)
}

/// A message as far as it is written.
struct Writer {
    bytes: Vec<u8>,
    /// Whether every number so far was finite.
    finite: bool,
}

impl Writer {
    fn whole(&mut self, number: u32) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    fn numbers(&mut self, numbers: &[f64]) {
        for number in numbers {
            let short = *number as f32;
            self.finite &= short.is_finite();
            self.bytes.extend_from_slice(&short.to_le_bytes());
        }
    }
}
