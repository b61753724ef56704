//! Errors as the protocol has them: a status and `{"error": "…"}`.

use axum::Json;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;

use crate::pool::PoolError;
use crate::problem::{Kind, Problem};

/// A problem, told in the words of the protocol.
pub struct Refusal(Problem);

/// What does not follow the protocol.
pub fn refused(detail: impl Into<String>) -> Refusal {
    Refusal(Problem::new(Kind::InvalidRequest, detail))
}

/// A model that there is not.
pub fn unknown_model(detail: impl Into<String>) -> Refusal {
    Refusal(Problem::new(Kind::NotFound, detail))
}

impl From<Problem> for Refusal {
    fn from(problem: Problem) -> Self {
        Self(problem)
    }
}

impl From<PoolError> for Refusal {
    fn from(error: PoolError) -> Self {
        Self(error.into())
    }
}

impl Refusal {
    /// The same about a row of the batch.
    pub fn of_row(mut self, row: usize) -> Self {
        self.0.detail = format!("row {row}: {}", self.0.detail);
        self
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        // The protocol has 400 for whatever is wrong with a request.
        let status = match self.0.kind.status() {
            StatusCode::UNPROCESSABLE_ENTITY => StatusCode::BAD_REQUEST,
            other => other,
        };
        let mut response = (status, Json(json!({"error": self.0.detail}))).into_response();
        if status == StatusCode::SERVICE_UNAVAILABLE {
            let seconds = self.0.retry_after_s.map_or(HeaderValue::from_static("1"), HeaderValue::from);
            response.headers_mut().insert(header::RETRY_AFTER, seconds);
        }
        response.extensions_mut().insert(self.0.kind);
        response
    }
}
