//! The program's log on standard error, and its spans to an OpenTelemetry collector.
//!
//! Contract: the log is for people or one JSON object a line, and names the request that a line belongs to. Exporting never holds up an answer: spans wait in
//! a bounded queue for a thread of their own, and what that cannot keep up with, or finds no collector for, is dropped.

#[cfg(feature = "otlp")]
mod otlp;

use std::io::{self, IsTerminal as _};

use axum::http::HeaderMap;
use thiserror::Error;
use tracing::Span;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer as _};

use crate::config::LogForm;

/// Why spans cannot be exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The program was built without.
    #[error("built without the cargo feature `otlp`: spans cannot be exported")]
    #[cfg(not(feature = "otlp"))]
    NotBuilt,
    /// The collector's address is none, or there is no thread.
    #[error("no spans to {endpoint}: {cause}")]
    Unusable {
        /// The address that was given.
        endpoint: String,
        /// What is wrong.
        cause: String,
    },
}

/// Keeps the export going; what is in its queue is sent when it is dropped.
#[derive(Default)]
pub struct Export {
    #[cfg(feature = "otlp")]
    _provider: Option<otlp::Provider>,
}

/// Starts the log in that form, and the export of spans where there is an endpoint, as `http://127.0.0.1:4318`.
///
/// # Errors
/// [`ExportError`]; the log is started all the same.
pub fn start(form: LogForm, endpoint: Option<&str>) -> Result<Export, ExportError> {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    let log = tracing_subscriber::fmt::layer().with_writer(io::stderr);
    let log = match form {
        LogForm::Pretty => log.with_ansi(io::stderr().is_terminal()).boxed(),
        LogForm::Json => log.json().boxed(),
    };
    let registry = tracing_subscriber::registry().with(filter).with(log);
    #[cfg(feature = "otlp")]
    {
        match endpoint.map(otlp::provider).transpose() {
            Ok(provider) => {
                registry.with(provider.as_ref().map(otlp::layer)).init();
                Ok(Export { _provider: provider.map(otlp::Provider) })
            }
            Err(error) => {
                registry.init();
                Err(error)
            }
        }
    }
    #[cfg(not(feature = "otlp"))]
    {
        registry.init();
        if endpoint.is_some() { Err(ExportError::NotBuilt) } else { Ok(Export::default()) }
    }
}

/// Makes the span of a request a child of the caller's, where the header `traceparent` names one.
pub fn continue_trace(span: &Span, headers: &HeaderMap) {
    #[cfg(feature = "otlp")]
    otlp::continue_trace(span, headers);
    #[cfg(not(feature = "otlp"))]
    let _ = (span, headers);
}
