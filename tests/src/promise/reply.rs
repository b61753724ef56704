//! What the service answered, held against the truth.

use std::net::SocketAddr;
use std::time::Instant;

use nalgebra::Point3;
use retina_core::comparison::node_errors_um;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::question::Asked;

/// How a broken promise is worded in the answer's warnings.
const BROKEN: &str = "asked for";

/// One answered request.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Audited {
    /// Its number.
    pub index: usize,
    /// What was asked for.
    pub asked: Asked,
    /// The level that answered.
    pub level: String,
    /// Whether the answer said beforehand that it does not keep what was asked for.
    pub warned: bool,
    /// Whether requests like it were measured.
    pub calibrated: bool,
    /// What 95 of 100 errors were promised to stay below (µm).
    pub p95_um: f64,
    /// The error of the worst node (µm).
    pub error_um: f64,
    /// From the arrival of the request to its answer, by the service's clock (ms).
    pub ms: f64,
    /// From sending to the whole answer, as the client sees it (ms).
    pub client_ms: f64,
}

/// An answer, and how long it took by the service's clock and by the client's (ms).
#[derive(Clone, Debug)]
pub struct Reply {
    /// The body.
    pub answer: Value,
    /// By the service's clock.
    pub ms: f64,
    /// By the client's.
    pub client_ms: f64,
}

/// Posts `body` and returns the answer with the times that it took.
///
/// # Errors
/// What the service or the connection said, in words.
pub fn post(agent: &ureq::Agent, address: SocketAddr, body: &Value) -> Result<Reply, String> {
    let text = body.to_string();
    let started = Instant::now();
    let post = agent.post(format!("http://{address}/v1/predict")).header("content-type", "application/json");
    let mut response = post.send(&text).map_err(|error| error.to_string())?;
    let status = response.status().as_u16();
    let timing = response.headers().get("server-timing").and_then(|timing| timing.to_str().ok());
    let service_ms = timing.and_then(|timing| timing.rsplit("dur=").next()?.parse().ok());
    let answer = response.body_mut().read_to_string().map_err(|error| error.to_string())?;
    let client_ms = started.elapsed().as_secs_f64() * 1e3;
    if status != 200 {
        return Err(format!("{status}: {answer}"));
    }
    let answer = serde_json::from_str(&answer).map_err(|error| error.to_string())?;
    Ok(Reply { answer, ms: service_ms.ok_or("an answer without Server-Timing")?, client_ms })
}

/// Holds an answer against the true vertices (mm); `None` for an answer that lacks what every answer has.
pub fn audited(index: usize, asked: Asked, reply: &Reply, truth: &[Point3<f64>]) -> Option<Audited> {
    let Reply { answer, ms, client_ms } = reply;
    let accuracy = &answer["accuracy"];
    let vertices: Vec<[f64; 3]> = serde_json::from_value(answer["surface"]["vertices_mm"].clone()).ok()?;
    let vertices: Vec<Point3<f64>> = vertices.into_iter().map(Point3::from).collect();
    let warned = answer["warnings"].as_array()?.iter().any(|said| said.as_str().is_some_and(|s| s.contains(BROKEN)));
    Some(Audited {
        index,
        asked,
        level: accuracy["level"].as_str()?.to_owned(),
        warned,
        calibrated: accuracy["calibrated"].as_bool()?,
        // A bound that was never measured is left out of the answer: it promises nothing.
        p95_um: accuracy["expected_error_um"]["p95"].as_f64().unwrap_or(f64::INFINITY),
        error_um: node_errors_um(&vertices, truth).into_iter().fold(0.0, f64::max),
        ms: *ms,
        client_ms: *client_ms,
    })
}
