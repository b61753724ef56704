//! What each route does. The URLs stand in `routes`; the work is done elsewhere.

mod stored;

use axum::Json;
use axum::body::Body;
use axum::extract::rejection::PathRejection;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, Method, Uri, header};
use axum::response::{IntoResponse, Response};

use prometheus_client::metrics::counter::Counter;

pub use stored::*;

use crate::catalog;
use crate::metrics;
use crate::problem::{Kind, MEDIA_TYPE, Problem, ProblemDocument};
use crate::state::AppState;
use crate::wire::{
    About, BatchRequest, BatchResponse, CostTable, GaugeList, LevelList, PredictRequest, PredictResponse, Readiness,
    SimulateLine, SimulateRequest,
};

/// How long an answer took (W3C *Server Timing*).
const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");

/// What the surface looks like when a needle at this pose pushes with this force.
#[utoipa::path(
    post,
    path = "/v1/predict",
    tag = "predict",
    request_body = PredictRequest,
    responses(
        (status = 200, description = "The deformed surface", body = PredictResponse<'static>),
        (status = 400, description = "Not JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 408, description = "The body did not arrive in time", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 413, description = "Larger than 8 MiB", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 415, description = "Not announced as JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 422, description = "A field is wrong, or there is no answer", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 500, description = "A fault of the server", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "Too much work is waiting, or it took too long", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn predict(State(app): State<AppState>, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let (answer, took) = app.answer(&headers, body).await?;
    let timing = format!("total;dur={:.3}", took.as_secs_f64() * 1e3);
    Ok(([(header::CONTENT_TYPE, "application/json".to_owned()), (SERVER_TIMING, timing)], answer).into_response())
}

/// What the surface looks like for each of many poses.
///
/// The answers come in order and each as soon as those before it are there; a pose that makes no sense has its problem in its place. Closing
/// the connection stops the work.
#[utoipa::path(
    post,
    path = "/v1/predict/batch",
    tag = "predict",
    request_body = BatchRequest,
    responses(
        (status = 200, description = "An answer or a problem for each pose", body = BatchResponse<'static>),
        (status = 400, description = "Not JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 408, description = "The body did not arrive in time", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 413, description = "Larger than 8 MiB", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 415, description = "Not announced as JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 422, description = "A field is wrong, or there are too many poses", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 500, description = "A fault of the server", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "Too much work is waiting", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn batch(State(app): State<AppState>, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let answers = app.batch(&headers, body).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], answers).into_response())
}

/// A timed list of needle poses and forces in, surfaces out: one JSON object a line, each as soon as it is computed.
///
/// The first line is `begin`, then one `step` each, and at last `end`; a step without an answer ends the list with `error`, which names step, time
/// and cause. Closing the connection stops the work.
#[utoipa::path(
    post,
    path = "/v1/simulate",
    tag = "simulate",
    request_body = SimulateRequest,
    responses(
        (status = 200, description = "One object a line", body = SimulateLine<'static>, content_type = "application/x-ndjson"),
        (status = 400, description = "Not JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 408, description = "The body did not arrive in time", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 413, description = "Larger than 8 MiB", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 415, description = "Not announced as JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 422, description = "A field is wrong, there are too many steps, or a step cannot be", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 500, description = "A fault of the server", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "Too much work is waiting", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn simulate(State(app): State<AppState>, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let lines = app.simulate(&headers, body).await?;
    Ok(([(header::CONTENT_TYPE, "application/x-ndjson")], lines).into_response())
}

/// Poses in, surfaces out, over one WebSocket.
///
/// Text messages are `StreamCommand` from the client and `StreamMessage` from the server. The first opens a session, whose answers are text or
/// binary. Of poses that come faster than they are answered the newest wins; the answer counts the others. What is wrong with a message is
/// said by a problem and the stream goes on.
#[utoipa::path(
    get,
    path = "/v1/stream",
    tag = "stream",
    responses(
        (status = 101, description = "The connection speaks WebSocket from here on"),
        (status = 403, description = "A browser's page of another origin", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 426, description = "Not a WebSocket handshake", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "Too many streams are open", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn stream(
    State(app): State<AppState>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Problem> {
    let upgrade = upgrade.map_err(|rejection| Problem::new(Kind::UpgradeRequired, rejection.body_text()))?;
    app.stream(&headers, upgrade)
}

/// The levels of accuracy, cheapest first.
#[utoipa::path(get, path = "/v1/levels", tag = "catalog", responses((status = 200, body = LevelList)))]
pub async fn levels() -> Json<LevelList> {
    Json(catalog::levels())
}

/// What accuracy costs in time: errors and times of the levels, as measured with this version on the machine that it names.
#[utoipa::path(get, path = "/v1/accuracy", tag = "catalog", responses((status = 200, body = CostTable)))]
pub async fn accuracy() -> Result<Json<CostTable>, Problem> {
    catalog::accuracy().map(Json).map_err(Problem::internal)
}

/// The needles that have a name.
#[utoipa::path(get, path = "/v1/gauges", tag = "catalog", responses((status = 200, body = GaugeList)))]
pub async fn gauges() -> Json<GaugeList> {
    Json(catalog::gauges())
}

/// What the service is: version, features, limits.
#[utoipa::path(get, path = "/v1/about", tag = "service", responses((status = 200, body = About)))]
pub async fn about(State(app): State<AppState>) -> Json<About> {
    Json(app.about().clone())
}

/// What the service has counted and timed, as OpenMetrics text that Prometheus reads.
#[utoipa::path(
    get,
    path = "/metrics",
    tag = "service",
    responses((status = 200, body = String, content_type = "application/openmetrics-text"))
)]
pub async fn metrics(State(app): State<AppState>) -> Result<Response, Problem> {
    let text = app.metrics().text().map_err(Problem::internal)?;
    Ok(([(header::CONTENT_TYPE, metrics::MEDIA_TYPE)], text).into_response())
}

/// Whether the service runs.
#[utoipa::path(get, path = "/healthz", tag = "service", responses((status = 200, body = Readiness)))]
pub async fn health() -> Json<Readiness> {
    Json(Readiness { status: "ok" })
}

/// Whether the built-in scenes are prepared, and the service does not stop.
#[utoipa::path(
    get,
    path = "/readyz",
    tag = "service",
    responses(
        (status = 200, body = Readiness),
        (status = 503, description = "Warming up", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn ready(State(app): State<AppState>) -> Result<Json<Readiness>, Problem> {
    app.ready()?;
    Ok(Json(Readiness { status: "ready" }))
}

/// What a kind of problem means.
#[utoipa::path(
    get,
    path = "/problems/{name}",
    tag = "service",
    params(("name" = String, Path, description = "The last part of a problem's `type`")),
    responses(
        (status = 200, body = String, content_type = "text/plain"),
        (status = 404, description = "No such problem", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn problem(name: Result<Path<String>, PathRejection>) -> Result<String, Problem> {
    // A name that is not UTF-8 is none of ours either.
    let name = name.map_or_else(|_| String::new(), |Path(name)| name);
    let kind = Kind::ALL.iter().find(|kind| kind.name() == name);
    let kind = kind.ok_or_else(|| {
        let known: Vec<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        Problem::new(Kind::NotFound, format!("There is no such problem; known are {}.", known.join(", ")))
    })?;
    Ok(format!("{} ({})\n\n{}\n", kind.title(), kind.status(), kind.explanation()))
}

/// For a URL that there is not.
pub async fn not_found(uri: Uri) -> Problem {
    Problem::new(Kind::NotFound, format!("There is no page {}.", uri.path()))
}

/// For a method that the URL does not take; axum adds the header that lists those it does.
pub async fn method_not_allowed(method: Method, uri: Uri) -> Problem {
    Problem::new(Kind::MethodNotAllowed, format!("{} does not take {method}.", uri.path()))
}

/// For a handler that panicked: it is counted, and nothing of the panic reaches the caller.
pub fn panicked(panics: &Counter) -> Response {
    panics.inc();
    Problem::internal("a handler panicked").into_response()
}
