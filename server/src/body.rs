//! The bytes of a request, within bounds of size and time.
//!
//! Contract: never more than [`LIMIT_BYTES`] of one body in memory, and never more than [`LARGE_AT_ONCE`] large bodies. A body beyond that is
//! read on and thrown away up to [`DISCARD_BYTES`], because a client that is cut off while it writes does not get to read why.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt as _;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use crate::problem::{Kind, Problem};

/// Largest body, bytes: 8 MiB, a mesh of about a hundred thousand vertices.
pub const LIMIT_BYTES: usize = 8 << 20;

/// How much of a larger body is thrown away before its connection is closed, bytes.
const DISCARD_BYTES: usize = 256 << 20;

/// Bodies from this size on are large, bytes. Those below are bounded by the queue that they wait in.
const LARGE_BYTES: usize = 256 << 10;

/// Large bodies that may be held at once, in arrival, waiting or at work; one more is answered with 503.
pub const LARGE_AT_ONCE: usize = 12;

/// What bounds the bodies of a service.
pub struct Bodies {
    /// A permit for each large body that may be held.
    large: Arc<Semaphore>,
    /// How long one may take to arrive.
    patience: Duration,
}

/// A body that has arrived. It counts as held until it is dropped.
pub struct Received {
    bytes: Bytes,
    _large: Option<OwnedSemaphorePermit>,
}

impl Received {
    /// The bytes by themselves, cheap to share.
    pub fn bytes(&self) -> Bytes {
        self.bytes.clone()
    }
}

impl AsRef<[u8]> for Received {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Bodies {
    /// None held; each may take this long.
    pub fn new(patience: Duration) -> Self {
        Self { large: Arc::new(Semaphore::new(LARGE_AT_ONCE)), patience }
    }

    /// The body of a request that announces JSON.
    ///
    /// # Errors
    /// [`Kind::UnsupportedMediaType`], and those of [`Bodies::of_type`].
    pub async fn json(&self, headers: &HeaderMap, body: Body) -> Result<Received, Problem> {
        self.of_type(headers, body, is_json, "application/json").await
    }

    /// The body of a request that announces what `fits`; `wanted` says it in words.
    ///
    /// # Errors
    /// [`Kind::UnsupportedMediaType`], [`Kind::BodyTooLarge`], [`Kind::RequestTimeout`], [`Kind::Busy`] for a large body too many, or
    /// [`Kind::MalformedJson`] for one that breaks off.
    pub async fn of_type(
        &self,
        headers: &HeaderMap,
        body: Body,
        fits: fn(&str) -> bool,
        wanted: &str,
    ) -> Result<Received, Problem> {
        let given = headers.get(header::CONTENT_TYPE);
        if !given.is_some_and(|value| value.to_str().is_ok_and(fits)) {
            let given = given.map_or("none".into(), |value| String::from_utf8_lossy(value.as_bytes()));
            let detail = format!("The request's Content-Type is {given}; it must be {wanted}.");
            return Err(Problem::new(Kind::UnsupportedMediaType, detail));
        }
        self.any(body).await
    }

    /// The body of a request, whatever it announces.
    ///
    /// # Errors
    /// As [`Bodies::json`], but for the media type.
    pub async fn any(&self, body: Body) -> Result<Received, Problem> {
        match timeout(self.patience, collect(body, &self.large)).await {
            Ok(result) => result,
            Err(_) => Err(Problem::new(
                Kind::RequestTimeout,
                format!("The body did not arrive within {} seconds.", self.patience.as_secs_f64()),
            )),
        }
    }
}

/// `application/json` or `application/…+json`, with or without parameters.
pub fn is_json(media_type: &str) -> bool {
    let essence = media_type.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    essence == "application/json" || (essence.starts_with("application/") && essence.ends_with("+json"))
}

async fn collect(mut body: Body, large: &Arc<Semaphore>) -> Result<Received, Problem> {
    let mut first = Bytes::new();
    let mut joined = Vec::new();
    let mut length = 0;
    let mut permit = None;
    let mut one_too_many = false;
    while let Some(frame) = body.frame().await {
        let frame =
            frame.map_err(|error| Problem::new(Kind::MalformedJson, format!("The body breaks off: {error}.")))?;
        let Ok(data) = frame.into_data() else {
            continue;
        };
        length += data.len();
        if length > DISCARD_BYTES {
            break;
        }
        if length >= LARGE_BYTES && permit.is_none() && !one_too_many {
            permit = Arc::clone(large).try_acquire_owned().ok();
            one_too_many = permit.is_none();
        }
        if one_too_many || length > LIMIT_BYTES {
            (first, joined) = (Bytes::new(), Vec::new());
        } else if length == data.len() {
            // Most bodies come in one piece, which is used as it is.
            first = data;
        } else {
            if joined.is_empty() {
                joined.extend_from_slice(&first);
            }
            joined.extend_from_slice(&data);
        }
    }
    if one_too_many {
        return Err(Problem::new(Kind::Busy, "Too many large bodies are at work; try again in a second."));
    }
    if length > LIMIT_BYTES {
        let detail = format!("The body has more than {LIMIT_BYTES} bytes.");
        return Err(Problem::new(Kind::BodyTooLarge, detail));
    }
    Ok(Received { bytes: if joined.is_empty() { first } else { joined.into() }, _large: permit })
}
