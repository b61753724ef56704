//! The texts of OpenIGTLink's STRING messages. Everything else that crosses is laid out in `igtl`.
//!
//! Contract: as in `stream`, an object with exactly one field, which says what it is.

use serde::{Deserialize, Serialize};

use super::fixed::Vector;
use super::object;
use super::request::{AccuracySpec, ControlName, EffectsSpec, SceneChoice};
use super::response::{AccuracyAnswer, ContactAnswer, NeedleAnswer};
use super::stream::{ShapeSpec, StreamTimes};
use crate::igtl::axes::Axes;
use crate::problem::ProblemDocument;

/// A text of the client: exactly one of the fields.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IgtlCommand {
    /// Begins a session in place of the one before.
    #[serde(default, deserialize_with = "object::optional")]
    pub open: Option<IgtlOpen>,
    /// The force of the poses after it, world axes, mN.
    pub force_mn: Option<Vector>,
    /// `pose`: the poses after it have no force, and hold the needle.
    pub control: Option<ControlName>,
    /// Shows a token of the service; the first message where one is needed.
    pub token: Option<String>,
}

/// What holds for every pose of a session, as in `wire::stream::OpenSpec`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IgtlOpen {
    /// A built-in scene by name, or a scene written out; `macula` when left out.
    pub scene: Option<SceneChoice>,
    /// The needle's shape; 25G with a hemispherical tip when left out.
    #[serde(default, deserialize_with = "object::optional")]
    pub needle: Option<ShapeSpec>,
    /// How accurate, and at what cost; level `coarse` when left out.
    #[serde(default, deserialize_with = "object::optional")]
    pub accuracy: Option<AccuracySpec>,
    /// Which effects to simulate.
    pub effects: Option<EffectsSpec>,
    /// Axes of the world; `ras` when left out.
    pub axes: Option<Axes>,
}

/// A text of the server.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
pub enum IgtlMessage<'a> {
    /// STRING `Session`.
    Opened(IgtlOpened<'a>),
    /// STRING `Answer`.
    Answer(Box<IgtlAnswer<'a>>),
}

/// A session has begun.
#[derive(Serialize)]
pub struct IgtlOpened<'a> {
    /// Version of the texts.
    pub protocol: u8,
    /// Axes of the world.
    pub axes: Axes,
    /// Triangles between the points of every `Nodes`; empty for a mesh.
    pub triangles: &'a [[usize; 3]],
}

/// STRING `Problem`: the problem's document (RFC 9457) with two members more.
#[derive(Serialize)]
pub struct IgtlProblem<'a> {
    /// Number of the TRANSFORM, where it was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequence: Option<u64>,
    /// Those since the last answer that were overtaken.
    pub dropped: u32,
    /// What it is.
    #[serde(flatten)]
    pub document: ProblemDocument<'a>,
}

/// What the numbers of an answer do not say.
#[derive(Serialize)]
pub struct IgtlAnswer<'a> {
    /// Number of the TRANSFORM, from 1.
    pub sequence: u64,
    /// Those since the last answer that were overtaken by a newer one and have none.
    pub dropped: u32,
    /// The server's times.
    pub time_us: StreamTimes,
    /// The needle at equilibrium, world axes.
    pub needle: NeedleAnswer,
    /// The contact.
    pub contact: ContactAnswer,
    /// How accurate the answer is.
    pub accuracy: AccuracyAnswer,
    /// Names of the effects that were simulated.
    pub effects: Vec<&'static str>,
    /// What the caller should know besides.
    pub warnings: &'a [String],
}
