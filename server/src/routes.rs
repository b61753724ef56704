//! Every URL of the service, and what surrounds all of them.

use std::any::Any;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderName, Request, Response, header};
use axum::routing::get;
use axum::{Json, Router, middleware};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::trace::TraceLayer;
use tracing::{Span, field};
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::SwaggerUi;

use crate::access;
use crate::date;
use crate::handlers;
use crate::kserve;
use crate::log;
use crate::metrics;
use crate::page;
use crate::state::AppState;
use crate::wire::stream::{StreamCommand, StreamMessage};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Retina",
        description = "A needle at this pose pushes the retina with this force: what does the surface look like now?\n\n\
                   Units everywhere: mm, mN, kPa; errors in µm, times in µs. Patch frame: origin on the inner retinal surface, +z into the \
                   vitreous, so a needle pushes towards -z. Quaternions are x, y, z, w; a needle points along its own -z."
    ),
    components(schemas(StreamCommand, StreamMessage))
)]
struct Description;

/// The service: state in, router out.
pub fn app(state: AppState) -> Router {
    let (routes, api) = OpenApiRouter::with_openapi(Description::openapi())
        .routes(routes!(handlers::predict))
        .routes(routes!(handlers::batch))
        .routes(routes!(handlers::simulate))
        .routes(routes!(handlers::stream))
        .routes(routes!(handlers::scenes, handlers::store_scene))
        .routes(routes!(handlers::scene, handlers::delete_scene))
        .routes(routes!(handlers::levels))
        .routes(routes!(handlers::accuracy))
        .routes(routes!(handlers::gauges))
        .routes(routes!(handlers::about))
        .routes(routes!(handlers::metrics))
        .routes(routes!(handlers::health))
        .routes(routes!(handlers::ready))
        .routes(routes!(handlers::problem))
        .split_for_parts();
    let (access, metrics) = (state.access().clone(), Arc::clone(state.metrics()));
    let panics = metrics.panics.clone();
    let docs = utoipa_swagger_ui::Config::from("/openapi.json").validator_url("none");
    let trace = TraceLayer::new_for_http()
        .make_span_with(span)
        .on_request(())
        .on_response(|response: &Response<_>, latency: Duration, span: &Span| {
            let status = response.status().as_u16();
            span.record("status", status);
            tracing::debug!(status, latency_us = latency.as_micros(), "answered");
        })
        .on_failure(());
    let routes = routes
        .route("/", get(page::index))
        .route("/assets/{name}", get(page::asset))
        .route("/openapi.json", get(|| async { Json(api) }))
        .merge(kserve::handlers::routes())
        .merge(SwaggerUi::new("/docs").config(docs))
        .fallback(handlers::not_found)
        .method_not_allowed_fallback(handlers::method_not_allowed)
        .with_state(state)
        .layer(middleware::from_fn_with_state(access.clone(), access::check))
        .layer(CatchPanicLayer::custom(move |_panic: Box<dyn Any + Send>| handlers::panicked(&panics)))
        .layer(middleware::from_fn_with_state(metrics, metrics::count));
    let routes = if access.origins.is_empty() { routes } else { routes.layer(access.cors()) };
    routes
        .layer(SetResponseHeaderLayer::overriding(header::DATE, date::now))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(trace)
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
}

fn span<B>(request: &Request<B>) -> Span {
    let id = request.headers().get(REQUEST_ID).and_then(|id| id.to_str().ok()).unwrap_or_default();
    let path = request.uri().path();
    let span = tracing::info_span!("request", id, method = %request.method(), path, status = field::Empty, otel.kind = "server");
    log::continue_trace(&span, request.headers());
    span
}
