//! The protocol's URLs.

use axum::body::Body;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use retina_core::predict::Level;
use serde_json::json;

use super::infer::infer;
use super::models::{level, metadata, names};
use super::refusal::{Refusal, refused, unknown_model};
use super::respond::Written;
use crate::problem::{Kind, Problem};
use crate::state::AppState;

/// How much of a body is JSON where binary data follow.
const JSON_BYTES: &str = "inference-header-content-length";

/// The protocol's routes. They stand in its own specification and not in `/openapi.json`.
pub fn routes() -> Router<AppState> {
    Router::new()
        .route("/v2", get(server))
        .route("/v2/health/live", get(live))
        .route("/v2/health/ready", get(ready))
        .route("/v2/models/{model}", get(model))
        .route("/v2/models/{model}/ready", get(model_ready))
        .route("/v2/models/{model}/infer", post(inference))
}

async fn server() -> Response {
    let (name, version) = (env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"));
    Json(json!({"name": name, "version": version, "extensions": ["binary_tensor_data"]})).into_response()
}

async fn live() -> Response {
    Json(json!({"live": true})).into_response()
}

fn readiness(app: &AppState, mut told: serde_json::Value) -> Response {
    let is_ready = app.ready().is_ok();
    told["ready"] = is_ready.into();
    let status = if is_ready { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    (status, Json(told)).into_response()
}

async fn ready(State(app): State<AppState>) -> Response {
    readiness(&app, json!({}))
}

fn known(model: &str) -> Result<Level, Refusal> {
    level(model).ok_or_else(|| {
        let shown: String = model.chars().take(60).collect();
        unknown_model(format!("there is no model {shown:?}; known are {}", names().join(", ")))
    })
}

/// A name that is not UTF-8 is none of ours either.
fn named(model: Result<Path<String>, PathRejection>) -> String {
    model.map_or_else(|_| String::new(), |Path(model)| model)
}

async fn model(model: Result<Path<String>, PathRejection>) -> Result<Response, Refusal> {
    let model = named(model);
    known(&model)?;
    Ok(Json(metadata(&model)).into_response())
}

async fn model_ready(
    State(app): State<AppState>,
    model: Result<Path<String>, PathRejection>,
) -> Result<Response, Refusal> {
    let model = named(model);
    known(&model)?;
    Ok(readiness(&app, json!({"name": model})))
}

async fn inference(
    State(app): State<AppState>,
    model: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Refusal> {
    let model = named(model);
    let level = known(&model)?;
    if let Some(coding) = headers.get(header::CONTENT_ENCODING).filter(|coding| *coding != "identity") {
        let coding = String::from_utf8_lossy(coding.as_bytes()).into_owned();
        return Err(Problem::new(
            Kind::UnsupportedMediaType,
            format!("the body is {coding}, and must not be compressed"),
        )
        .into());
    }
    let json_bytes = match headers.get(JSON_BYTES) {
        None => None,
        Some(given) => {
            let number = given.to_str().ok().and_then(|text| text.parse().ok());
            Some(number.ok_or_else(|| refused("Inference-Header-Content-Length is not a number of bytes"))?)
        }
    };
    let body = app.bodies.any(body).await?;
    let Written { body, json_bytes } = infer(&app, (&model, level), body, json_bytes).await?;
    let media_type = if json_bytes.is_some() { "application/octet-stream" } else { "application/json" };
    let mut response = ([(header::CONTENT_TYPE, media_type)], body).into_response();
    if let Some(bytes) = json_bytes {
        response.headers_mut().insert(JSON_BYTES, HeaderValue::from(bytes));
    }
    Ok(response)
}
