//! The protocol of `GET /v1/stream`: text messages of `wire::stream`, binary ones of [`binary`].

use axum::extract::ws::{CloseFrame, Message, close_code};
use retina_core::predict::Prediction;

use super::binary::{self, Head};
use super::protocol::{Farewell, Form, Opening, Protocol, Taken};
use crate::problem::{Kind, Problem};
use crate::read::read;
use crate::wire::stream::{
    AnswerMessage, Format, MemoryOpened, OpenSpec, OpenedMessage, ProblemMessage, StreamCommand, StreamMessage,
    StreamPose,
};
use crate::write::{Layout, write};

/// Longest message, bytes: a mesh of about ten thousand vertices.
pub const LONGEST_MESSAGE: usize = 1 << 20;

/// Texts up to this long are read by the thread that talks, bytes; longer ones can only open a session.
const SHORT: usize = 4 << 10;

/// One client of `GET /v1/stream`.
pub struct WebSockets;

impl Form for Format {
    type Message = Message;
    type Tag = ();

    fn opened(&self, triangles: &[[usize; 3]], memory: Option<MemoryOpened>) -> Result<Message, Problem> {
        text(&StreamMessage::Opened(OpenedMessage { protocol: binary::VERSION, format: *self, triangles, memory }))
    }

    fn answer(&self, head: &Head, _tag: &(), prediction: &Prediction) -> Result<Message, Problem> {
        match self {
            Format::Json => text(&StreamMessage::Answer(Box::new(AnswerMessage {
                sequence: head.sequence,
                client_time_us: head.client_time_us,
                time_s: head.time_s,
                dropped: head.dropped,
                time_us: head.times,
                prediction: prediction.into(),
            }))),
            Format::Binary => binary::answer(head, prediction).map(|bytes| Message::Binary(bytes.into())),
        }
    }
}

impl Protocol for WebSockets {
    type Form = Format;
    type Incoming = Message;
    type Fault = axum::Error;

    fn begin(&mut self) -> Option<Opening<Format>> {
        None
    }

    fn take(&mut self, message: Message) -> Taken<Format> {
        let command = match message {
            Message::Text(text) if text.len() > SHORT => {
                return Taken::Open(Box::new(move || match read(text.as_bytes())? {
                    StreamCommand { open: Some(spec), pose: None } => Ok(with_format(spec)),
                    _ => Err(Problem::new(Kind::BodyTooLarge, "Only a message that opens a session may be so long.")),
                }));
            }
            Message::Text(text) => read::<StreamCommand>(text.as_bytes()),
            Message::Binary(bytes) => binary::pose(&bytes).map(|pose| StreamCommand { open: None, pose: Some(pose) }),
            Message::Ping(_) | Message::Pong(_) => return Taken::Nothing,
            Message::Close(_) => return Taken::Leave,
        };
        match command {
            Ok(StreamCommand { open: Some(spec), pose: None }) => Taken::Open(Box::new(|| Ok(with_format(spec)))),
            Ok(StreamCommand { open: None, pose: Some(pose) }) => Taken::Pose(pose, ()),
            Ok(_) => {
                let allowed = "exactly one of open, pose";
                let detail = "a message has exactly one of the fields open and pose";
                Taken::Refused(Problem::field(Kind::InvalidRequest, "", None, allowed, detail))
            }
            Err(problem) => Taken::Refused(problem),
        }
    }

    fn problem(&self, about: Option<(&StreamPose, &())>, dropped: u32, problem: &Problem) -> Message {
        let message = StreamMessage::Problem(ProblemMessage {
            sequence: about.map(|(pose, ())| pose.sequence),
            client_time_us: about.and_then(|(pose, ())| pose.client_time_us),
            dropped,
            problem: problem.document(),
        });
        // It may repeat a `null` that the client wrote, which an answer never has.
        Message::Text(serde_json::to_string(&message).unwrap_or_default().into())
    }

    fn knock(&self) -> Option<Message> {
        Some(Message::Ping(Default::default()))
    }

    fn farewell(&self, why: Farewell<axum::Error>) -> Option<Message> {
        let (code, reason) = match why {
            Farewell::Stopping => (close_code::AWAY, "the service stops"),
            Farewell::Broken(error) if is_too_long(&error) => (close_code::SIZE, "a message may have 1 MiB"),
            // One that broke off hears none.
            Farewell::Broken(_) | Farewell::Silent => return None,
        };
        Some(Message::Close(Some(CloseFrame { code, reason: reason.into() })))
    }
}

fn with_format(spec: OpenSpec) -> (OpenSpec, Format) {
    let format = spec.format;
    (spec, format)
}

fn is_too_long(error: &axum::Error) -> bool {
    error.to_string().to_ascii_lowercase().contains("too long")
}

/// The text message that says this.
fn text(message: &StreamMessage) -> Result<Message, Problem> {
    let bytes = write(message, Layout::Compact).map_err(Problem::internal)?;
    let text = String::from_utf8(bytes).map_err(Problem::internal)?;
    Ok(Message::Text(text.into()))
}
