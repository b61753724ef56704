//! Messages on a byte stream: the header, its checks, and the extended header of version 2.
//!
//! Contract: all numbers are big-endian. A header has 58 bytes: version u16, type (12 characters), device name (20 characters), time stamp u64,
//! size of the body u64, CRC-64 of the body u64. In version 2 the body begins with an extended header: its size u16, sizes of the metadata's
//! index u16 and body u32, message number u32; the metadata end the body. Source: OpenIGTLink, `Documents/Protocol/header.md`, `v3_proposal.md`.
//!
//! No more than [`LONGEST_BODY`] of one message is held; a longer one is skipped as it comes.

use std::io;

use axum::body::Bytes;
use thiserror::Error;
use tokio_util::bytes::{Buf as _, BytesMut};
use tokio_util::codec::{Decoder, Encoder};

use super::crc::crc64;

/// Bytes of a header.
pub const HEADER_BYTES: usize = 58;

/// Longest body that is read, bytes: a text of 64 KiB with room for metadata.
pub const LONGEST_BODY: usize = 128 << 10;

/// Longest body that is skipped, bytes: no image is larger, so the stream is out of step.
pub const LONGEST_SKIPPED: u64 = 1 << 30;

/// Bytes of an extended header.
const EXTENDED_BYTES: usize = 12;

/// What a header says beside type and device; an answer repeats it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Version of the header: 1 or 2.
    pub version: u16,
    /// Time stamp, seconds with 32 bits after the point; 0 where there is none.
    pub time: u64,
    /// Message number; 0 in version 1.
    pub message_id: u32,
}

/// A message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// What the answer repeats.
    pub stamp: Stamp,
    /// Type, as `TRANSFORM`.
    pub kind: String,
    /// Device name.
    pub device: String,
    /// The body without extended header and metadata.
    pub content: Vec<u8>,
}

/// Why a message cannot be read; the next one can.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Damage {
    /// The body is not what its checksum says.
    #[error("the body of {kind} has the checksum {found:#018x}, and its header says {told:#018x}")]
    Checksum {
        /// Type of the message.
        kind: String,
        /// Checksum of the body.
        found: u64,
        /// Checksum in the header.
        told: u64,
    },
    /// The message is longer than any that is read.
    #[error("{kind} has a body of {bytes} bytes; at most {LONGEST_BODY} are read")]
    TooLong {
        /// Type of the message.
        kind: String,
        /// Bytes of its body.
        bytes: u64,
    },
    /// The sizes in the extended header do not fit the body.
    #[error("the extended header of {kind} does not fit its body of {bytes} bytes")]
    Extended {
        /// Type of the message.
        kind: String,
        /// Bytes of its body.
        bytes: usize,
    },
    /// Type or device name is not text.
    #[error("type or device name is not ASCII text")]
    NotText,
}

/// Why nothing more can be read.
#[derive(Debug, Error)]
pub enum Broken {
    /// The connection.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// What should be a header begins with another version.
    #[error("a header of version {0}; 1 and 2 are known")]
    Version(u16),
    /// What should be a header tells of an impossible body.
    #[error("a body of {0} bytes")]
    Size(u64),
}

/// Reads messages, writes bytes.
#[derive(Debug, Default)]
pub struct Codec {
    /// Bytes of a body that are still to be skipped.
    skip: u64,
}

/// `N` bytes from `at` on, which lie inside.
fn part<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|byte| bytes[at + byte])
}

/// Text that ends at its first zero.
fn text(bytes: &[u8]) -> Option<String> {
    let used = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    let text = std::str::from_utf8(used).ok()?;
    let plain = text.chars().all(|character| character.is_ascii_graphic() || character == ' ');
    plain.then(|| text.trim_end().to_owned())
}

impl Decoder for Codec {
    type Item = Result<Frame, Damage>;
    type Error = Broken;

    fn decode(&mut self, bytes: &mut BytesMut) -> Result<Option<Self::Item>, Broken> {
        let skipped = self.skip.min(bytes.len() as u64);
        bytes.advance(skipped as usize);
        self.skip -= skipped;
        if bytes.len() < HEADER_BYTES {
            return Ok(None);
        }
        let version = u16::from_be_bytes(part(bytes, 0));
        if !(1..=2).contains(&version) {
            return Err(Broken::Version(version));
        }
        let size = u64::from_be_bytes(part(bytes, 42));
        if size > LONGEST_SKIPPED {
            return Err(Broken::Size(size));
        }
        let names = text(&bytes[2..14]).zip(text(&bytes[14..34]));
        if size > LONGEST_BODY as u64 {
            bytes.advance(HEADER_BYTES);
            self.skip = size;
            let damage = names.map_or(Damage::NotText, |(kind, _)| Damage::TooLong { kind, bytes: size });
            return Ok(Some(Err(damage)));
        }
        let whole = HEADER_BYTES + size as usize;
        if bytes.len() < whole {
            bytes.reserve(whole - bytes.len());
            return Ok(None);
        }
        let message = bytes.split_to(whole);
        let (time, told) = (u64::from_be_bytes(part(&message, 34)), u64::from_be_bytes(part(&message, 50)));
        let Some((kind, device)) = names else { return Ok(Some(Err(Damage::NotText))) };
        let body = &message[HEADER_BYTES..];
        let found = crc64(body);
        Ok(Some(if found != told {
            Err(Damage::Checksum { kind, found, told })
        } else if version == 1 {
            let stamp = Stamp { version, time, message_id: 0 };
            Ok(Frame { stamp, kind, device, content: body.to_vec() })
        } else {
            match inner(body) {
                Some((message_id, content)) => {
                    let stamp = Stamp { version, time, message_id };
                    Ok(Frame { stamp, kind, device, content: content.to_vec() })
                }
                None => Err(Damage::Extended { kind, bytes: body.len() }),
            }
        }))
    }
}

/// Message number and content of a body of version 2, if its sizes fit.
fn inner(body: &[u8]) -> Option<(u32, &[u8])> {
    let head = body.get(..EXTENDED_BYTES)?;
    let begin = usize::from(u16::from_be_bytes(part(head, 0)));
    let metadata = usize::from(u16::from_be_bytes(part(head, 2))) + u32::from_be_bytes(part(head, 4)) as usize;
    let end = body.len().checked_sub(metadata)?;
    let content = (begin >= EXTENDED_BYTES).then(|| body.get(begin..end)).flatten()?;
    Some((u32::from_be_bytes(part(head, 8)), content))
}

impl Encoder<Bytes> for Codec {
    type Error = io::Error;

    fn encode(&mut self, message: Bytes, bytes: &mut BytesMut) -> io::Result<()> {
        bytes.extend_from_slice(&message);
        Ok(())
    }
}

/// The bytes of a message; names that are too long are cut.
pub fn encode(stamp: &Stamp, kind: &str, device: &str, content: &[u8]) -> Vec<u8> {
    let mut body = Vec::with_capacity(EXTENDED_BYTES + content.len() + 2);
    if stamp.version >= 2 {
        // An index of metadata that lists none has two bytes.
        [EXTENDED_BYTES as u16, 2, 0, 0].iter().for_each(|number| body.extend_from_slice(&number.to_be_bytes()));
        body.extend_from_slice(&stamp.message_id.to_be_bytes());
        body.extend_from_slice(content);
        body.extend_from_slice(&0u16.to_be_bytes());
    } else {
        body.extend_from_slice(content);
    }
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len());
    bytes.extend_from_slice(&stamp.version.max(1).to_be_bytes());
    bytes.extend_from_slice(&padded::<12>(kind));
    bytes.extend_from_slice(&padded::<20>(device));
    bytes.extend_from_slice(&stamp.time.to_be_bytes());
    bytes.extend_from_slice(&(body.len() as u64).to_be_bytes());
    bytes.extend_from_slice(&crc64(&body).to_be_bytes());
    bytes.extend_from_slice(&body);
    bytes
}

/// Text in a field of `N` bytes, zeros after it.
pub(super) fn padded<const N: usize>(text: &str) -> [u8; N] {
    let bytes = text.as_bytes();
    std::array::from_fn(|at| bytes.get(at).copied().unwrap_or_default())
}
