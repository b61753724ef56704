//! An OpenIGTLink client for tests, written from the protocol's description and sharing nothing with the server: it checks what it reads.

use std::collections::BTreeMap;
use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// A message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Version of the header.
    pub version: u16,
    /// Type.
    pub kind: String,
    /// Device name.
    pub device: String,
    /// Time stamp.
    pub time: u64,
    /// Message number, in version 2.
    pub message_id: u32,
    /// The body, less what version 2 puts around it.
    pub content: Vec<u8>,
}

/// CRC-64 of ECMA-182, bit by bit.
pub fn crc64(bytes: &[u8]) -> u64 {
    let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| u64::from(byte >> bit & 1)));
    bits.fold(0, |rest, bit| {
        let carried = rest >> 63 ^ bit;
        (rest << 1) ^ (carried * 0x42f0_e1eb_a9ea_3693)
    })
}

/// The bytes of a message.
pub fn encode(message: &Message) -> Vec<u8> {
    let field = |text: &str, length: usize| {
        let mut field = text.as_bytes().to_vec();
        field.resize(length, 0);
        field
    };
    let mut body = Vec::new();
    if message.version == 2 {
        body.extend([0, 12, 0, 2, 0, 0, 0, 0]);
        body.extend(message.message_id.to_be_bytes());
    }
    body.extend(&message.content);
    if message.version == 2 {
        body.extend([0, 0]);
    }
    let mut bytes = message.version.to_be_bytes().to_vec();
    bytes.extend(field(&message.kind, 12));
    bytes.extend(field(&message.device, 20));
    bytes.extend(message.time.to_be_bytes());
    bytes.extend((body.len() as u64).to_be_bytes());
    bytes.extend(crc64(&body).to_be_bytes());
    bytes.extend(body);
    bytes
}

/// A message of version 1 without a time stamp.
pub fn message(kind: &str, device: &str, content: Vec<u8>) -> Message {
    Message { version: 1, kind: kind.to_owned(), device: device.to_owned(), time: 0, message_id: 0, content }
}

/// A TRANSFORM: columns of the rotation, translation.
pub fn transform(columns: [[f32; 3]; 3], translation_mm: [f32; 3]) -> Message {
    let numbers = columns.iter().flatten().chain(&translation_mm);
    message("TRANSFORM", "Needle", numbers.flat_map(|number| number.to_be_bytes()).collect())
}

/// The rotation of a needle that points along −z.
pub const UPRIGHT: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A STRING.
pub fn string(text: &str) -> Message {
    let mut content = 3u16.to_be_bytes().to_vec();
    content.extend((text.len() as u16).to_be_bytes());
    content.extend(text.as_bytes());
    message("STRING", "Command", content)
}

/// A SENSOR.
pub fn sensor(unit: u64, values: &[f64]) -> Message {
    let mut content = vec![values.len() as u8, 0];
    content.extend(unit.to_be_bytes());
    content.extend(values.iter().flat_map(|value| value.to_be_bytes()));
    message("SENSOR", "Force", content)
}

/// A connection.
pub struct IgtlClient {
    socket: TcpStream,
}

impl IgtlClient {
    /// Connects; a message that does not come within ten seconds is an error.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn connect(address: SocketAddr) -> io::Result<Self> {
        let socket = TcpStream::connect(address)?;
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(Duration::from_secs(10)))?;
        Ok(Self { socket })
    }

    /// Sends a message.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn send(&mut self, message: &Message) -> io::Result<()> {
        self.send_bytes(&encode(message))
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.socket.write_all(bytes)
    }

    /// The next message; `None` where the server has closed.
    ///
    /// # Errors
    /// Those of the socket, and a checksum or a size that is wrong.
    pub fn receive(&mut self) -> io::Result<Option<Message>> {
        let mut header = [0; 58];
        match self.socket.read_exact(&mut header) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
            result => result?,
        }
        let number = |from: usize| u64::from_be_bytes(std::array::from_fn(|byte| header[from + byte]));
        let text = |from: usize, to: usize| {
            let bytes: Vec<u8> = header[from..to].iter().copied().take_while(|byte| *byte != 0).collect();
            String::from_utf8(bytes).map_err(io::Error::other)
        };
        let mut content = vec![0; number(42) as usize];
        self.socket.read_exact(&mut content)?;
        if crc64(&content) != number(50) {
            return Err(io::Error::other("a wrong checksum"));
        }
        let version = u16::from_be_bytes([header[0], header[1]]);
        let mut message_id = 0;
        if version == 2 {
            let inner = content.len().checked_sub(14).ok_or_else(|| io::Error::other("no extended header"))?;
            if content[..8] != [0, 12, 0, 2, 0, 0, 0, 0] {
                return Err(io::Error::other("another extended header"));
            }
            message_id = u32::from_be_bytes(std::array::from_fn(|byte| content[8 + byte]));
            content = content[12..12 + inner].to_vec();
        }
        let (kind, device) = (text(2, 14)?, text(14, 34)?);
        Ok(Some(Message { version, kind, device, time: number(34), message_id, content }))
    }

    /// The messages up to the STRING of that device name, that one included, by device name.
    ///
    /// # Errors
    /// As [`IgtlClient::receive`], and a connection that is closed before.
    pub fn until(&mut self, device: &str) -> io::Result<BTreeMap<String, Message>> {
        let mut found = BTreeMap::new();
        loop {
            let message = self.receive()?.ok_or_else(|| io::Error::other("closed"))?;
            let is_last = message.device == device;
            found.insert(message.device.clone(), message);
            if is_last {
                return Ok(found);
            }
        }
    }
}

impl Message {
    /// The text of a STRING.
    pub fn text(&self) -> String {
        let length = usize::from(u16::from_be_bytes([self.content[2], self.content[3]]));
        assert_eq!((self.kind.as_str(), self.content.len()), ("STRING", 4 + length));
        String::from_utf8(self.content[4..].to_vec()).expect("text")
    }

    /// Code, code of the server's own, name and text of a STATUS.
    pub fn status(&self) -> (u16, i64, String, String) {
        assert_eq!(self.kind, "STATUS");
        let name: Vec<u8> = self.content[10..30].iter().copied().take_while(|byte| *byte != 0).collect();
        let own = i64::from_be_bytes(std::array::from_fn(|byte| self.content[2 + byte]));
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
        (u16::from_be_bytes([self.content[0], self.content[1]]), own, text(&name), text(&self.content[30..]))
    }

    /// Unit and numbers of a SENSOR.
    pub fn sensor(&self) -> (u64, Vec<f64>) {
        assert_eq!((self.kind.as_str(), self.content.len()), ("SENSOR", 10 + 8 * usize::from(self.content[0])));
        let numbers = self.content[10..].as_chunks::<8>().0.iter().map(|bytes| f64::from_be_bytes(*bytes));
        (u64::from_be_bytes(std::array::from_fn(|byte| self.content[2 + byte])), numbers.collect())
    }

    /// The numbers of 32 bits from `from` to `to`.
    pub fn floats(&self, from: usize, to: usize) -> Vec<f32> {
        self.content[from..to].as_chunks::<4>().0.iter().map(|bytes| f32::from_be_bytes(*bytes)).collect()
    }

    /// The whole numbers of 32 bits from `from` to `to`.
    pub fn counts(&self, from: usize, to: usize) -> Vec<u32> {
        self.content[from..to].as_chunks::<4>().0.iter().map(|bytes| u32::from_be_bytes(*bytes)).collect()
    }

    /// Names and positions of a POINT.
    pub fn points(&self) -> Vec<(String, [f32; 3])> {
        assert_eq!((self.kind.as_str(), self.content.len() % 136), ("POINT", 0));
        let point = |at: usize| {
            let name: Vec<u8> = self.content[at..at + 64].iter().copied().take_while(|byte| *byte != 0).collect();
            let position = self.floats(at + 100, at + 112);
            (String::from_utf8(name).expect("text"), [position[0], position[1], position[2]])
        };
        (0..self.content.len()).step_by(136).map(point).collect()
    }
}
