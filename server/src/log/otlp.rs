//! Spans to an OpenTelemetry collector: OTLP over HTTP, protobuf. The only place that knows OpenTelemetry.

use std::time::Duration;

use axum::body::Bytes;
use axum::http::{HeaderMap, Request, Response};
use opentelemetry::propagation::TextMapPropagator as _;
use opentelemetry::trace::{TraceContextExt as _, TracerProvider as _};
use opentelemetry_http::{HeaderExtractor, HttpClient, HttpError};
use opentelemetry_otlp::{SpanExporter, WithExportConfig as _, WithHttpConfig as _};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::propagation::TraceContextPropagator;
use opentelemetry_sdk::trace::SdkTracerProvider;
use tracing::{Span, Subscriber};
use tracing_opentelemetry::{OpenTelemetryLayer, OpenTelemetrySpanExt as _};
use tracing_subscriber::registry::LookupSpan;

use super::ExportError;

/// Where a collector takes spans, below its address.
const PATH: &str = "/v1/traces";

/// How long the collector may take for a batch.
const PATIENCE: Duration = Duration::from_secs(5);

/// Ends the export when dropped: what is in the queue is sent.
pub struct Provider(pub SdkTracerProvider);

impl Drop for Provider {
    fn drop(&mut self) {
        if let Err(error) = self.0.shutdown() {
            tracing::warn!(%error, "the last spans were not exported");
        }
    }
}

/// The client of the thread that exports, which may wait.
#[derive(Debug)]
struct Client(ureq::Agent);

#[async_trait::async_trait]
impl HttpClient for Client {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let (parts, body) = request.into_parts();
        let response = self.0.run(Request::from_parts(parts, body.to_vec()))?;
        let (parts, mut body) = response.into_parts();
        Ok(Response::from_parts(parts, body.read_to_vec()?.into()))
    }
}

/// What takes spans to the collector at `endpoint`.
///
/// # Errors
/// [`ExportError::Unusable`].
pub fn provider(endpoint: &str) -> Result<SdkTracerProvider, ExportError> {
    let unusable = |cause: String| ExportError::Unusable { endpoint: endpoint.to_owned(), cause };
    if !endpoint.starts_with("http://") {
        return Err(unusable(
            "an address is http:// and a host, perhaps a port; TLS is the work of a local collector".to_owned(),
        ));
    }
    let agent = ureq::Agent::config_builder().http_status_as_error(false).timeout_global(Some(PATIENCE)).build();
    let exporter = SpanExporter::builder()
        .with_http()
        .with_http_client(Client(agent.into()))
        .with_endpoint(format!("{}{PATH}", endpoint.trim_end_matches('/')))
        .with_timeout(PATIENCE)
        .build();
    let exporter = exporter.map_err(|error| unusable(error.to_string()))?;
    let resource = Resource::builder().with_service_name(env!("CARGO_PKG_NAME")).build();
    Ok(SdkTracerProvider::builder().with_batch_exporter(exporter).with_resource(resource).build())
}

/// What hands spans over to be exported.
pub fn layer<S>(provider: &SdkTracerProvider) -> OpenTelemetryLayer<S, opentelemetry_sdk::trace::SdkTracer>
where
    S: Subscriber + for<'span> LookupSpan<'span>,
{
    OpenTelemetryLayer::new(provider.tracer(env!("CARGO_PKG_NAME")))
}

/// Makes the span a child of the one that `traceparent` names.
pub fn continue_trace(span: &Span, headers: &HeaderMap) {
    let parent = TraceContextPropagator::new().extract(&HeaderExtractor(headers));
    if parent.span().span_context().is_valid() {
        // Refused where nobody exports, which is in order.
        let _ = span.set_parent(parent);
    }
}
