//! The text messages of `GET /v1/stream`. Its binary messages are laid out in `stream::binary`.
//!
//! Contract: every message is an object with exactly one field, which says what it is: `open` and `pose` from the client; `opened`, `answer`
//! and `problem` from the server.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::fixed::{Quaternion, Triangle, Vector};
use super::object;
use super::pose::PoseAnswer;
use super::request::{AccuracySpec, EffectsSpec, SceneChoice, TipSpec};
use super::response::EffectAnswer;
use super::scene::FillingSpec;
use super::sequence::StepSpec;
use crate::problem::ProblemDocument;

/// A message of the client: exactly one of the fields.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"open": {"scene": "macula", "needle": {"gauge": "25G"}, "accuracy": {"level": "linear"}, "format": "json"}}))]
pub struct StreamCommand {
    /// Begins a session, or a new one in place of the one before.
    #[serde(default, deserialize_with = "object::optional")]
    pub open: Option<OpenSpec>,
    /// Where the needle is now. One that comes while another waits takes its place.
    #[serde(default, deserialize_with = "object::optional")]
    pub pose: Option<StreamPose>,
}

/// What holds for every pose of a session.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenSpec {
    /// A built-in scene by name, or a scene written out; `macula` when left out.
    pub scene: Option<SceneChoice>,
    /// The needle's shape; 25G with a hemispherical tip when left out.
    #[serde(default, deserialize_with = "object::optional")]
    pub needle: Option<ShapeSpec>,
    /// How accurate, and at what cost; level `coarse` when left out.
    #[serde(default, deserialize_with = "object::optional")]
    pub accuracy: Option<AccuracySpec>,
    /// Which effects to simulate, as in a prediction. Those of time (`viscoelasticity`, `inertia`) need `memory`.
    pub effects: Option<EffectsSpec>,
    /// Makes every pose the next step of one motion, with what the tissue remembers of those before. Left out: each is answered as if it were the first.
    #[serde(default, deserialize_with = "object::optional")]
    pub memory: Option<MemorySpec>,
    /// Form of the answers; `json` when left out.
    #[serde(default)]
    pub format: Format,
}

/// What a session that remembers is planned from, since it does not know the next pose.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MemorySpec {
    /// Steps that span what the session will do: the deepest press, the farthest reach, the fastest change. They are planned like those of
    /// `POST /v1/simulate` (which effects, one mesh around all contacts) and not simulated. The first has a `tip_mm`: there the needle is at time 0.
    #[serde(deserialize_with = "object::list")]
    pub rehearsal: Vec<StepSpec>,
}

/// A needle without its place.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeSpec {
    /// Size by name, see `GET /v1/gauges`; `25G` when neither this nor `radius_mm` is given.
    pub gauge: Option<String>,
    /// Radius of the shaft in place of a gauge, mm.
    pub radius_mm: Option<f64>,
    /// How the needle ends; `hemispherical` when left out.
    pub tip: Option<TipSpec>,
}

/// Form of a session's answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// Text messages.
    #[default]
    Json,
    /// Binary messages of 32-bit numbers; problems stay text.
    Binary,
}

/// Where the needle is, and how it pushes.
#[derive(Clone, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StreamPose {
    /// Number of the pose, larger than that of the one before; the answer repeats it.
    pub sequence: u64,
    /// The client's clock, µs, or any other number that the answer is to repeat.
    pub client_time_us: Option<f64>,
    /// In a session with memory: when the load of this pose is reached, s after the tissue was at rest, 1e-6 to 1000 after the last pose answered; the time since
    /// the session was asked for when left out. Not in a session without memory.
    pub time_s: Option<f64>,
    /// Foremost point of the needle before it moves, scene frame, mm. Only in a session with memory it may be left out: the needle is where the last pose left it.
    pub tip_mm: Option<Vector>,
    /// Rotation from the needle's frame to the scene's, as x, y, z, w. Not together with `direction`.
    pub orientation_xyzw: Option<Quaternion>,
    /// The way the needle points, scene frame. When neither this nor `orientation_xyzw` is given: `[0, 0, -1]`, and in a session with memory as the last pose left it.
    pub direction: Option<Vector>,
    /// Force along which the needle advances until the tissue's reaction along it equals it, scene frame, mN. Left out: the needle stays
    /// where it is, and the reaction is the answer.
    pub force_mn: Option<Vector>,
    /// In a session with memory: fluid that is on the detached disc of the scene's `bleb` now; as much as at the last pose when left out. Not in a session without memory.
    #[serde(default, deserialize_with = "object::optional")]
    pub bleb: Option<FillingSpec>,
}

/// A message of the server.
#[derive(Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StreamMessage<'a> {
    /// The session has begun.
    Opened(OpenedMessage<'a>),
    /// The answer to a pose.
    Answer(Box<AnswerMessage<'a>>),
    /// What is wrong with a message. The stream goes on.
    Problem(ProblemMessage<'a>),
}

/// The session has begun.
#[derive(Serialize, ToSchema)]
pub struct OpenedMessage<'a> {
    /// Version of the messages.
    pub protocol: u8,
    /// Form of the answers.
    pub format: Format,
    /// Triangles between the nodes of every surface, counter-clockwise seen from the vitreous; empty for a mesh, whose answers bring their own.
    #[schema(value_type = Vec<Triangle>)]
    pub triangles: &'a [[usize; 3]],
    /// What was planned, in a session with memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<MemoryOpened<'a>>,
}

/// What holds for all poses of a session with memory.
#[derive(Serialize, ToSchema)]
pub struct MemoryOpened<'a> {
    /// The level that answers.
    pub level: &'static str,
    /// Every effect, simulated or not, and why.
    pub effects: Vec<EffectAnswer<'a>>,
}

/// The answer to a pose.
#[derive(Serialize, ToSchema)]
pub struct AnswerMessage<'a> {
    /// The pose's number.
    pub sequence: u64,
    /// The client's number, as it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub client_time_us: Option<f64>,
    /// The pose's time, in a session with memory, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Poses since the last answer that were overtaken by a newer one and have none.
    pub dropped: u32,
    /// The server's times.
    pub time_us: StreamTimes,
    /// What the surface looks like.
    pub prediction: PoseAnswer<'a>,
}

/// The server's times of an answer, µs.
#[derive(Clone, Copy, Debug, Default, Serialize, ToSchema)]
pub struct StreamTimes {
    /// When the pose arrived, on a clock that began with the connection.
    pub received: f64,
    /// From then until work on it began.
    pub waited: f64,
    /// From then until the surface was there.
    pub computed: f64,
}

/// What is wrong with a message.
#[derive(Serialize, ToSchema)]
pub struct ProblemMessage<'a> {
    /// Number of the pose, where the message was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequence: Option<u64>,
    /// The client's number, as it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub client_time_us: Option<f64>,
    /// Poses since the last answer that were overtaken.
    pub dropped: u32,
    /// What it is.
    pub problem: ProblemDocument<'a>,
}
