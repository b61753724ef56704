//! A client of `GET /v1/stream`, for the service tier and the load program: it sends poses and decodes what comes, the binary messages by
//! the layout that `retina_server::stream::binary` documents, byte by byte and not by its code.

use std::net::SocketAddr;

use futures_util::{SinkExt as _, StreamExt as _};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream};

/// A connection.
pub struct StreamClient {
    /// The socket, for what the methods do not do.
    pub socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
}

/// A message of the server.
#[derive(Clone, Debug)]
pub enum Received {
    /// Text: JSON.
    Text(Value),
    /// Binary: an answer.
    Answer(Box<BinaryAnswer>),
    /// The connection is closed, with code and reason where there was one.
    Closed(Option<(u16, String)>),
}

/// A binary answer, decoded.
#[derive(Clone, Debug)]
pub struct BinaryAnswer {
    /// Flags of the layout.
    pub flags: u16,
    /// The pose's number.
    pub sequence: u64,
    /// The client's number.
    pub client_time_us: f64,
    /// Poses overtaken since the last answer.
    pub dropped: u32,
    /// 0 `linear`, 1 `coarse`, 2 `reference`.
    pub level: u8,
    /// 0 clear, 1 touching, 2 slipping, 3 punctured.
    pub contact: u8,
    /// When the pose arrived, on the server's clock (µs).
    pub received_us: f64,
    /// From then until work began (µs).
    pub waited_us: f32,
    /// From then until the surface was there (µs).
    pub computed_us: f32,
    /// Foremost point at equilibrium (mm).
    pub tip_mm: [f32; 3],
    /// Advance (mm).
    pub travel_mm: f32,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: [f32; 3],
    /// Contact area (mm²).
    pub area_mm2: f32,
    /// Largest strain.
    pub max_strain: f32,
    /// Largest contact pressure (kPa).
    pub max_pressure_kpa: f32,
    /// Deepest penetration (µm).
    pub max_penetration_um: f32,
    /// Expected error, median (µm); NaN where unknown.
    pub median_um: f32,
    /// Expected error, 95 % (µm); NaN where unknown.
    pub p95_um: f32,
    /// Effects simulated, one bit each.
    pub effects: u32,
    /// The pose's time in a session with memory (s).
    pub time_s: f64,
    /// Deformed nodes (mm).
    pub vertices_mm: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Lengths of displacement (µm).
    pub displacement_um: Vec<f32>,
    /// Triangles of a cut patch.
    pub triangles: Vec<[u32; 3]>,
    /// The mesh's index of each node of a cut patch.
    pub source_indices: Vec<u32>,
}

impl StreamClient {
    /// Connects.
    ///
    /// # Errors
    /// If the handshake fails.
    pub async fn connect(address: SocketAddr) -> Result<Self, Error> {
        let url = format!("ws://{address}/v1/stream");
        let (socket, _) = tokio_tungstenite::connect_async_with_config(url, None, true).await?;
        Ok(Self { socket })
    }

    /// Sends JSON.
    ///
    /// # Errors
    /// If the connection is gone.
    pub async fn send(&mut self, message: &Value) -> Result<(), Error> {
        self.socket.send(Message::text(message.to_string())).await
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// If the connection is gone.
    pub async fn send_bytes(&mut self, bytes: Vec<u8>) -> Result<(), Error> {
        self.socket.send(Message::binary(bytes)).await
    }

    /// Opens a session and waits until it is open.
    ///
    /// # Errors
    /// What came instead.
    pub async fn open(&mut self, session: Value) -> Result<Value, String> {
        self.send(&json!({"open": session})).await.map_err(|error| error.to_string())?;
        match self.receive().await {
            Received::Text(message) if message.get("opened").is_some() => Ok(message["opened"].clone()),
            other => Err(format!("{other:?}")),
        }
    }

    /// The next message that is not of the protocol's own housekeeping.
    pub async fn receive(&mut self) -> Received {
        loop {
            match self.socket.next().await {
                Some(Ok(Message::Text(text))) => {
                    return Received::Text(serde_json::from_str(&text).unwrap_or(Value::String(text.to_string())));
                }
                Some(Ok(Message::Binary(bytes))) => match decode(&bytes) {
                    Some(answer) => return Received::Answer(Box::new(answer)),
                    None => return Received::Text(json!({"undecodable": bytes.len()})),
                },
                Some(Ok(Message::Close(frame))) => {
                    return Received::Closed(frame.map(|frame| (frame.code.into(), frame.reason.to_string())));
                }
                Some(Ok(_)) => {}
                Some(Err(_)) | None => return Received::Closed(None),
            }
        }
    }
}

/// A binary pose: header of 24 bytes, then tip, orientation and force.
pub fn encode_pose(
    sequence: u64,
    client_time_us: f64,
    tip_mm: [f32; 3],
    orientation_xyzw: [f32; 4],
    force_mn: Option<[f32; 3]>,
) -> Vec<u8> {
    let mut bytes = b"RTNA\x01\x01".to_vec();
    bytes.extend(u16::from(force_mn.is_some()).to_le_bytes());
    bytes.extend(sequence.to_le_bytes());
    bytes.extend(client_time_us.to_le_bytes());
    let numbers = tip_mm.into_iter().chain(orientation_xyzw).chain(force_mn.unwrap_or_default());
    numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

/// The same pose at a time, in a session with memory.
pub fn at_time(mut pose: Vec<u8>, time_s: f64) -> Vec<u8> {
    pose[6] |= 2;
    pose.extend(time_s.to_le_bytes());
    pose
}

/// The same pose with this volume of fluid (mm³), or this pressure of it (kPa), in a session with memory.
pub fn with_fluid(mut pose: Vec<u8>, fluid: Fluid) -> Vec<u8> {
    let (flag, number) = match fluid {
        Fluid::VolumeMm3(number) => (8, number),
        Fluid::PressureKpa(number) => (16, number),
    };
    pose[6] |= flag;
    pose.extend(number.to_le_bytes());
    pose
}

/// How much fluid there is.
#[derive(Clone, Copy, Debug)]
pub enum Fluid {
    /// Its volume.
    VolumeMm3(f64),
    /// Its pressure above that in the eye.
    PressureKpa(f64),
}

/// The same pose of a needle that is where the last pose left it.
pub fn where_it_is(mut pose: Vec<u8>) -> Vec<u8> {
    pose[6] |= 4;
    pose
}

/// Reads numbers one after the other.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    fn vector(&mut self) -> Option<[f32; 3]> {
        Some([self.f32()?, self.f32()?, self.f32()?])
    }
}

/// The answer in a binary message; `None` where the message does not keep the layout to the last byte.
pub fn decode(bytes: &[u8]) -> Option<BinaryAnswer> {
    let mut reader = Reader(bytes);
    if reader.take::<6>()? != *b"RTNA\x01\x02" {
        return None;
    }
    let flags = u16::from_le_bytes(reader.take()?);
    let sequence = u64::from_le_bytes(reader.take()?);
    let client_time_us = f64::from_le_bytes(reader.take()?);
    let dropped = reader.u32()?;
    let [level, contact] = reader.take()?;
    let nodes = usize::from(u16::from_le_bytes(reader.take()?));
    let mut answer = BinaryAnswer {
        flags,
        sequence,
        client_time_us,
        dropped,
        level,
        contact,
        received_us: f64::from_le_bytes(reader.take()?),
        waited_us: reader.f32()?,
        computed_us: reader.f32()?,
        tip_mm: reader.vector()?,
        travel_mm: reader.f32()?,
        reaction_mn: reader.vector()?,
        area_mm2: reader.f32()?,
        max_strain: reader.f32()?,
        max_pressure_kpa: reader.f32()?,
        max_penetration_um: reader.f32()?,
        median_um: reader.f32()?,
        p95_um: reader.f32()?,
        effects: reader.u32()?,
        time_s: f64::from_le_bytes(reader.take()?),
        vertices_mm: Vec::new(),
        normals: Vec::new(),
        displacement_um: Vec::new(),
        triangles: Vec::new(),
        source_indices: Vec::new(),
    };
    if reader.take::<4>()? != [0; 4] {
        return None;
    }
    answer.vertices_mm = (0..nodes).map(|_| reader.vector()).collect::<Option<_>>()?;
    answer.normals = (0..nodes).map(|_| reader.vector()).collect::<Option<_>>()?;
    answer.displacement_um = (0..nodes).map(|_| reader.f32()).collect::<Option<_>>()?;
    if flags & 4 != 0 {
        let triangles = reader.u32()?;
        answer.triangles =
            (0..triangles).map(|_| Some([reader.u32()?, reader.u32()?, reader.u32()?])).collect::<Option<_>>()?;
        answer.source_indices = (0..nodes).map(|_| reader.u32()).collect::<Option<_>>()?;
    }
    reader.0.is_empty().then_some(answer)
}
