//! What a client is told: the opened session, the answer to a pose, a problem.

use axum::body::Bytes;
use nalgebra::Vector3;
use retina_core::predict::Prediction;

use super::axes::Axes;
use super::compose;
use super::frame::{Stamp, encode};
use super::unit::{MICROMETRE, MILLIMETRE, MILLINEWTON};
use crate::problem::{Kind, Problem};
use crate::stream::binary::Head;
use crate::stream::protocol::Form;
use crate::wire::igtl::{IgtlAnswer, IgtlMessage, IgtlOpened, IgtlProblem};
use crate::wire::pose::PoseAnswer;
use crate::wire::stream::MemoryOpened;
use crate::write::{Layout, write};

/// Device name of what is no part of an answer.
pub const SERVICE: &str = "Retina";

/// How a session writes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Answers {
    /// Axes of its world.
    pub axes: Axes,
    /// The version of what is not an answer to a message.
    pub stamp: Stamp,
}

/// What an answer repeats of its TRANSFORM.
#[derive(Clone, Copy, Debug)]
pub struct Tag {
    /// Its header.
    pub stamp: Stamp,
    /// Its rotation, world axes.
    pub columns: [[f64; 3]; 3],
}

impl Form for Answers {
    type Message = Bytes;
    type Tag = Tag;

    fn opened(&self, triangles: &[[usize; 3]], _memory: Option<MemoryOpened>) -> Result<Bytes, Problem> {
        let text = "A session is open: the needle as TRANSFORM (mm), the force as SENSOR (N) or STRING.";
        let mut bytes = encode(&self.stamp, "STATUS", SERVICE, &compose::status(compose::OK, 0, "OK", text));
        let opened = IgtlMessage::Opened(IgtlOpened { protocol: 1, axes: self.axes, triangles });
        bytes.extend(encode(&self.stamp, "STRING", "Session", &text_of(&opened)?));
        Ok(bytes.into())
    }

    fn answer(&self, head: &Head, tag: &Tag, prediction: &Prediction) -> Result<Bytes, Problem> {
        let turn = |vector: [f64; 3]| self.axes.turn(vector);
        let vertices: Vec<[f64; 3]> = prediction.vertices.iter().map(|vertex| turn(vertex.coords.into())).collect();
        let normals: Vec<[f64; 3]> =
            prediction.normals.iter().map(|normal: &Vector3<f64>| turn((*normal).into())).collect();
        let needle = &prediction.needle;
        let (tip_mm, reaction_mn) = (turn(needle.tip_mm.coords.into()), turn(needle.reaction_mn.into()));
        let displacement = ("Displacement_um", prediction.displacement_um.as_slice());
        let mut parts = vec![
            ("POINT", "Nodes", compose::points(&vertices)),
            ("POLYDATA", "Surface", compose::polydata(&vertices, &prediction.triangles, &normals, displacement)),
            ("TRANSFORM", "NeedleTip", compose::transform(&tag.columns, tip_mm)),
            ("SENSOR", "Reaction", compose::sensor(MILLINEWTON, &reaction_mn)),
            ("SENSOR", "Travel", compose::sensor(MILLIMETRE, &[needle.travel_mm])),
        ];
        let expected = [prediction.expected_error.median_um, prediction.expected_error.p95_um];
        if expected.iter().all(|um| um.is_finite()) {
            parts.push(("SENSOR", "ExpectedError", compose::sensor(MICROMETRE, &expected)));
        }
        let PoseAnswer { mut needle, contact, accuracy, effects, warnings, .. } = prediction.into();
        needle.tip_mm.0 = tip_mm;
        needle.reaction_mn.0 = reaction_mn;
        needle.deflection_mm.iter_mut().for_each(|deflection| deflection.0 = turn(deflection.0));
        let words = IgtlMessage::Answer(Box::new(IgtlAnswer {
            sequence: head.sequence,
            dropped: head.dropped,
            time_us: head.times,
            needle,
            contact,
            accuracy,
            effects,
            warnings,
        }));
        parts.push(("STRING", "Answer", text_of(&words)?));
        let messages = parts.into_iter().flat_map(|(kind, device, content)| encode(&tag.stamp, kind, device, &content));
        Ok(messages.collect())
    }
}

/// The content of a STRING.
fn text_of(message: &IgtlMessage) -> Result<Vec<u8>, Problem> {
    let bytes = write(message, Layout::Compact).map_err(Problem::internal)?;
    let text = String::from_utf8(bytes).map_err(Problem::internal)?;
    Ok(compose::string(&text))
}

/// The messages of a problem, that of a pose where it has a number: a STATUS with its cause, and its document as STRING.
pub fn problem(stamp: &Stamp, sequence: Option<u64>, dropped: u32, problem: &Problem) -> Bytes {
    let status = i64::from(problem.kind.status().as_u16());
    let content = compose::status(code(problem.kind), status, problem.kind.name(), &problem.detail);
    let mut bytes = encode(stamp, "STATUS", SERVICE, &content);
    let document = IgtlProblem { sequence, dropped, document: problem.document() };
    let text = serde_json::to_string(&document).unwrap_or_default();
    bytes.extend(encode(stamp, "STRING", "Problem", &compose::string(&text)));
    bytes.into()
}

/// The protocol's code of a kind of problem, from its list in `status.md`.
fn code(kind: Kind) -> u16 {
    match kind {
        Kind::Unauthorized | Kind::ForeignOrigin => 5,
        Kind::Busy | Kind::TooLate => 6,
        Kind::RequestTimeout | Kind::TookTooLong => 7,
        // What the needle or the tissue cannot do: overflow, cannot be reached.
        Kind::PointsAway | Kind::OutsidePatch | Kind::BeyondPuncture | Kind::TooDeep | Kind::OutOfRange => 8,
        Kind::Damaged => 9,
        Kind::NotPossible | Kind::InvalidMesh => 10,
        Kind::BodyTooLarge => 11,
        Kind::MalformedJson | Kind::InvalidRequest | Kind::UnknownName => 12,
        Kind::NotReady => 13,
        _ => 2,
    }
}
