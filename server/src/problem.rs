//! What went wrong, as RFC 9457 problem documents.
//!
//! Contract: every response that is not a success is a [`Problem`]; it names the field at fault, its value and what is allowed. A
//! caller's fault is not logged as an error; the server's own is logged once, where it is found, and its cause stays in the log.

mod kind;
mod pool;
mod predict;
mod sequence;
mod stream;

use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

pub use kind::Kind;
pub use predict::{from_out_of_range, from_predict};
pub use sequence::from_sequence;
pub use stream::{of_pose, of_rehearsal, of_step};

/// Media type of a problem document.
pub const MEDIA_TYPE: &str = "application/problem+json";

/// Seconds after which a caller that found the queue full may try again.
const RETRY_AFTER_S: u32 = 1;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// What kind of problem it is.
    pub kind: Kind,
    /// What happened this time.
    pub detail: String,
    /// The fields at fault.
    pub errors: Vec<FieldError>,
    /// Seconds after which to try again, where that is known.
    pub retry_after_s: Option<u32>,
}

/// A field at fault.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct FieldError {
    /// Path of the field in the request; empty for the whole body.
    pub field: String,
    /// The value that was refused, as far as it is a number, a word or something short.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Value>)]
    pub value: Option<Value>,
    /// What is allowed in its place.
    pub allowed: String,
}

/// A problem document, RFC 9457.
#[derive(Serialize, ToSchema)]
#[schema(example = json!({
    "type": "/problems/out-of-range",
    "title": "A number is outside its range",
    "status": 422,
    "detail": "needle.radius_mm = -1 mm is outside the allowed range 0.01 to 0.5 mm",
    "errors": [{"field": "needle.radius_mm", "value": -1.0, "allowed": "0.01 to 0.5 mm"}]
}))]
pub struct ProblemDocument<'a> {
    /// Address of a page that explains the kind of problem.
    #[serde(rename = "type")]
    pub kind: String,
    /// What it is, in a few words that never change.
    pub title: &'a str,
    /// The status of the response.
    pub status: u16,
    /// What happened this time.
    pub detail: &'a str,
    /// The fields at fault.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    #[schema(value_type = Vec<FieldError>)]
    pub errors: &'a [FieldError],
}

impl Problem {
    /// A problem that no field is at fault for.
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self { kind, detail: detail.into(), errors: Vec::new(), retry_after_s: None }
    }

    /// A problem with one field.
    pub fn field(
        kind: Kind,
        field: impl Into<String>,
        value: Option<Value>,
        allowed: impl Into<String>,
        detail: impl Into<String>,
    ) -> Self {
        let error = FieldError { field: field.into(), value, allowed: allowed.into() };
        Self { kind, detail: detail.into(), errors: vec![error], retry_after_s: None }
    }

    /// The same problem, with the seconds after which to try again.
    pub fn retry_after(mut self, seconds: u32) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }

    /// A fault of the server: logs the cause and keeps it from the caller.
    pub fn internal(cause: impl std::fmt::Display) -> Self {
        tracing::error!(%cause, "request failed");
        Self::new(Kind::Internal, "The server failed to answer; its log says why.")
    }

    /// The same problem of an object that stands at `parent`: the fields at fault are told from there.
    pub fn within(mut self, parent: &str) -> Self {
        for error in &mut self.errors {
            error.field = match error.field.as_str() {
                "" => parent.to_owned(),
                field => format!("{parent}.{field}"),
            };
        }
        self
    }

    /// The document that crosses the wire.
    pub fn document(&self) -> ProblemDocument<'_> {
        ProblemDocument {
            kind: format!("/problems/{}", self.kind.name()),
            title: self.kind.title(),
            status: self.kind.status().as_u16(),
            detail: &self.detail,
            errors: &self.errors,
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let body = serde_json::to_vec(&self.document()).unwrap_or_default();
        let mut response = (self.kind.status(), body).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
        if matches!(self.kind, Kind::Busy | Kind::NotReady | Kind::TooLate | Kind::StoreUnavailable) {
            headers.insert(header::RETRY_AFTER, self.retry_after_s.unwrap_or(RETRY_AFTER_S).into());
        }
        if self.kind == Kind::Unauthorized {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response.extensions_mut().insert(self.kind);
        response
    }
}
