//! What the messages of one client ask for.

use axum::body::Bytes;
use serde_json::json;

use super::answer::{Answers, SERVICE, Tag, problem};
use super::axes::{Axes, quaternion};
use super::compose;
use super::content;
use super::frame::{Broken, Damage, Frame, Stamp, encode};
use super::unit::in_millinewtons;
use crate::access::Access;
use crate::problem::{Kind, Problem};
use crate::read::read;
use crate::stream::protocol::{Farewell, Opening, Protocol, Taken};
use crate::wire::fixed::{Quaternion, Vector};
use crate::wire::igtl::{IgtlCommand, IgtlOpen};
use crate::wire::request::ControlName;
use crate::wire::stream::{Format, OpenSpec, StreamPose};

/// Types that are read.
const READ: [&str; 5] = ["TRANSFORM", "SENSOR", "STRING", "GET_STATUS", "GET_CAPABIL"];

/// Protocol's codes of the last message: time out, exiting, version not known.
const TIMED_OUT: u16 = 7;
const EXITING: u16 = 19;
const UNKNOWN_VERSION: u16 = 17;

/// One client.
pub struct Conversation {
    access: Access,
    /// Whether it has shown its token, or needs none.
    admitted: bool,
    axes: Axes,
    /// Of the last message.
    stamp: Stamp,
    /// Device name of the TRANSFORM that is the needle.
    needle: Option<String>,
    /// World axes, mN.
    force_mn: Option<[f64; 3]>,
    /// Poses so far.
    count: u64,
}

impl Conversation {
    /// With a client that has said nothing yet.
    pub fn new(access: Access) -> Self {
        Self {
            admitted: access.tokens.is_empty(),
            access,
            axes: Axes::default(),
            stamp: Stamp { version: 1, time: 0, message_id: 0 },
            needle: None,
            force_mn: None,
            count: 0,
        }
    }

    /// The header of what is not an answer to a pose: no time.
    fn remark(&self) -> Stamp {
        Stamp { time: 0, ..self.stamp }
    }

    fn say(&self, kind: &str, content: &[u8]) -> Taken<Answers> {
        Taken::Say(encode(&self.remark(), kind, SERVICE, content).into())
    }

    fn understand(&mut self, frame: &Frame) -> Result<Taken<Answers>, Problem> {
        self.stamp = frame.stamp;
        match frame.kind.as_str() {
            "GET_STATUS" => return Ok(self.say("STATUS", &compose::status(compose::OK, 0, "OK", "The service runs."))),
            "GET_CAPABIL" => return Ok(self.say("CAPABILITY", &compose::capability(&READ))),
            // An answer to them would be answered in turn.
            "STATUS" | "CAPABILITY" => return Ok(Taken::Nothing),
            kind if kind.starts_with("RTS_") => return Ok(Taken::Nothing),
            "STRING" => {}
            _ if !self.admitted => {
                let detail = "Send the STRING {\"token\": \"…\"} with a token of this server first.";
                return Err(Problem::new(Kind::Unauthorized, detail));
            }
            _ => {}
        }
        match frame.kind.as_str() {
            "TRANSFORM" => self.pose(frame),
            "SENSOR" => self.force(&frame.content).map(|()| Taken::Nothing),
            "STRING" => self.command(content::string(&frame.content)?),
            kind => {
                let allowed = READ.join(", ");
                let detail = format!("{kind} is not read here; {allowed} are");
                Err(Problem::field(Kind::UnknownName, "type", Some(json!(kind)), allowed, detail))
            }
        }
    }

    fn pose(&mut self, frame: &Frame) -> Result<Taken<Answers>, Problem> {
        let needle = self.needle.get_or_insert_with(|| frame.device.clone());
        if *needle != frame.device {
            let detail = format!("the needle of this session is {needle:?}, and this TRANSFORM is {:?}", frame.device);
            return Err(Problem::field(
                Kind::UnknownName,
                "device",
                Some(json!(frame.device)),
                needle.as_str(),
                detail,
            ));
        }
        let transform = content::transform(&frame.content)?;
        let orientation = quaternion(self.axes.turn_columns(transform.columns)).ok_or_else(|| {
            let allowed = "a rotation: columns of length 1 across each other, right-handed";
            let detail = format!("the matrix of this TRANSFORM is not {allowed}");
            Problem::field(Kind::OutOfRange, "TRANSFORM.matrix", Some(json!(transform.columns)), allowed, detail)
        })?;
        self.count += 1;
        let pose = StreamPose {
            sequence: self.count,
            client_time_us: None,
            time_s: None,
            tip_mm: Some(Vector(self.axes.turn(transform.translation_mm))),
            orientation_xyzw: Some(Quaternion(orientation)),
            direction: None,
            force_mn: self.force_mn.map(|force| Vector(self.axes.turn(force))),
            bleb: None,
        };
        Ok(Taken::Pose(pose, Tag { stamp: frame.stamp, columns: transform.columns }))
    }

    fn force(&mut self, content: &[u8]) -> Result<(), Problem> {
        let sensor = content::sensor(content)?;
        let scale = in_millinewtons(sensor.unit).ok_or_else(|| {
            let given = format!("{:#018x}", sensor.unit);
            let allowed = "newtons, with or without a prefix: 0xb2c4000000000000 is mN";
            let detail = format!("the unit of this SENSOR is {given}, and must be {allowed}");
            Problem::field(Kind::InvalidRequest, "SENSOR.unit", Some(json!(given)), allowed, detail)
        })?;
        let force: [f64; 3] = sensor.values.as_slice().try_into().map_err(|_| {
            let count = sensor.values.len();
            let detail = format!("this SENSOR has {count} numbers, and a force has 3");
            Problem::field(Kind::InvalidRequest, "SENSOR.data", Some(json!(count)), "3 numbers", detail)
        })?;
        self.force_mn = Some(force.map(|component| component * scale));
        Ok(())
    }

    fn command(&mut self, text: &str) -> Result<Taken<Answers>, Problem> {
        let command: IgtlCommand = read(text.as_bytes())?;
        if let IgtlCommand { token: Some(token), open: None, force_mn: None, control: None } = &command {
            self.admitted = self.access.knows(token);
            return match self.admitted {
                true => Ok(self.say("STATUS", &compose::status(compose::OK, 0, "OK", "The token is known."))),
                false => Err(Problem::new(Kind::Unauthorized, "The token is none of this server.")),
            };
        }
        if !self.admitted {
            let detail = "Send the STRING {\"token\": \"…\"} with a token of this server first.";
            return Err(Problem::new(Kind::Unauthorized, detail));
        }
        match command {
            IgtlCommand { open: Some(open), force_mn: None, control: None, token: None } => {
                (self.axes, self.needle, self.force_mn) = (open.axes.unwrap_or_default(), None, None);
                Ok(Taken::Open(self.opening(open)))
            }
            IgtlCommand { force_mn: Some(Vector(force)), control: None, open: None, token: None } => {
                self.force_mn = Some(force);
                Ok(Taken::Nothing)
            }
            IgtlCommand { control: Some(ControlName::Pose), force_mn: None, open: None, token: None } => {
                self.force_mn = None;
                Ok(Taken::Nothing)
            }
            _ => {
                let allowed = "exactly one of open, force_mn, control (\"pose\"), token";
                let detail = format!("a STRING has {allowed}");
                Err(Problem::field(Kind::InvalidRequest, "", None, allowed, detail))
            }
        }
    }

    fn opening(&self, open: IgtlOpen) -> Opening<Answers> {
        let answers = Answers { axes: self.axes, stamp: self.remark() };
        let IgtlOpen { scene, needle, accuracy, effects, axes: _ } = open;
        let spec = OpenSpec { scene, needle, accuracy, effects, memory: None, format: Format::Binary };
        Box::new(move || Ok((spec, answers)))
    }
}

impl Protocol for Conversation {
    type Form = Answers;
    type Incoming = Result<Frame, Damage>;
    type Fault = Broken;

    fn begin(&mut self) -> Option<Opening<Answers>> {
        Some(self.opening(IgtlOpen::default()))
    }

    fn take(&mut self, message: Result<Frame, Damage>) -> Taken<Answers> {
        let taken = message.map_err(refusal).and_then(|frame| self.understand(&frame));
        taken.unwrap_or_else(Taken::Refused)
    }

    fn problem(&self, about: Option<(&StreamPose, &Tag)>, dropped: u32, told: &Problem) -> Bytes {
        let stamp = about.map_or(self.remark(), |(_, tag)| tag.stamp);
        problem(&stamp, about.map(|(pose, _)| pose.sequence), dropped, told)
    }

    fn knock(&self) -> Option<Bytes> {
        None
    }

    fn farewell(&self, why: Farewell<Broken>) -> Option<Bytes> {
        let (code, text) = match why {
            Farewell::Stopping => (EXITING, "The service stops.".to_owned()),
            Farewell::Silent => {
                (TIMED_OUT, "Nothing came for the idle time; GET_STATUS shows that a client is there.".to_owned())
            }
            Farewell::Broken(Broken::Io(_)) => return None,
            Farewell::Broken(error) => (UNKNOWN_VERSION, format!("What comes cannot be told apart: {error}.")),
        };
        Some(encode(&self.remark(), "STATUS", SERVICE, &compose::status(code, 0, "Farewell", &text)).into())
    }
}

fn refusal(damage: Damage) -> Problem {
    let kind = match damage {
        Damage::TooLong { .. } => Kind::BodyTooLarge,
        Damage::Checksum { .. } | Damage::Extended { .. } | Damage::NotText => Kind::Damaged,
    };
    Problem::new(kind, format!("The message is damaged: {damage}."))
}
