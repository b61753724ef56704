//! What the service counts and times, for `GET /metrics`: OpenMetrics text that Prometheus reads.
//!
//! Contract: labels take values from fixed lists (routes, statuses, levels, stages, kinds of problem), so the number of series is bounded
//! whatever is asked. Every service has its own registry.

use std::fmt::Error;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request, State};
use axum::middleware::Next;
use axum::response::Response;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::registry::{Registry, Unit};
use retina_core::predict::{Level, Prediction, PreparedScene, Request as Question};

use crate::audit::Audit;
use crate::audit::metrics::AuditMetrics;
use crate::pool::Load;
use crate::problem::Kind;

/// Media type of the text.
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Route of whatever has none.
const NO_ROUTE: &str = "other";

/// Upper bound of the fastest bucket (s), how far apart the bounds are, and how many there are: 20 µs to 42 s.
const BUCKETS: (f64, f64, u16) = (2e-5, 2.0, 22);

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Answered {
    route: String,
    status: u16,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Route {
    route: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Stage {
    level: &'static str,
    stage: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Problems {
    kind: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Poses {
    outcome: &'static str,
}

/// The counters and histograms of one service.
pub struct Metrics {
    registry: Registry,
    requests: Family<Answered, Counter>,
    latency: Family<Route, Histogram>,
    stages: Family<Stage, Histogram>,
    problems: Family<Problems, Counter>,
    poses: Family<Poses, Counter>,
    /// Streams that are open.
    pub streams: Gauge,
    /// Panics, contained.
    pub panics: Counter,
    /// What the audit counts.
    pub audit_metrics: AuditMetrics,
    /// What audits a sample of the answers, where anything does.
    pub audit: OnceLock<Audit>,
}

fn histogram() -> Histogram {
    let (first, factor, count) = BUCKETS;
    Histogram::new(exponential_buckets(first, factor, count))
}

impl Metrics {
    /// Nothing counted yet; `load` counts on by itself.
    pub fn new(load: &Load, threads: usize, queue: usize) -> Self {
        let mut registry = Registry::with_prefix("retina");
        let requests = Family::default();
        let latency = Family::new_with_constructor(histogram as fn() -> Histogram);
        let stages = Family::new_with_constructor(histogram as fn() -> Histogram);
        let (problems, poses, streams) = (Family::default(), Family::default(), Gauge::default());
        let constant = |value: usize| {
            let gauge = Gauge::<i64>::default();
            gauge.set(value as i64);
            gauge
        };
        registry.register("requests", "Requests answered, by route and status", requests.clone());
        registry.register_with_unit("request", "Arrival to head of the response", Unit::Seconds, latency.clone());
        registry.register_with_unit("stage", "Stages of predictions, by level", Unit::Seconds, stages.clone());
        registry.register("problems", "Problems told, by kind; busy and too-late are refusals", problems.clone());
        registry.register("stream_poses", "Poses of streams: answered, overtaken, refused", poses.clone());
        registry.register("streams", "Streams that are open", streams.clone());
        registry.register("queue_length", "Jobs that wait for a numerical thread", load.waiting.clone());
        registry.register("queue_places", "Jobs that may wait", constant(queue));
        registry.register("threads", "Numerical threads", constant(threads));
        registry.register("panics", "Panics, contained", load.panics.clone());
        let audit_metrics = AuditMetrics::register(&mut registry);
        let panics = load.panics.clone();
        let audit = OnceLock::new();
        Self { registry, requests, latency, stages, problems, poses, streams, panics, audit_metrics, audit }
    }

    /// A question about a scene was answered so, in these stages.
    pub fn predicted(
        &self,
        scene: &Arc<PreparedScene>,
        question: &Question,
        prediction: &Prediction,
        stages: &[(&'static str, Duration)],
    ) {
        self.computed(question.level, stages);
        if let Some(audit) = self.audit.get() {
            audit.offer(scene, question, prediction);
        }
    }

    /// A level computed in these stages.
    pub fn computed(&self, level: Level, stages: &[(&'static str, Duration)]) {
        for (stage, time) in stages {
            self.stages.get_or_create(&Stage { level: level.name(), stage }).observe(time.as_secs_f64());
        }
    }

    /// A pose of a stream was answered, and these before it were overtaken.
    pub fn pose_answered(&self, overtaken: u32) {
        self.poses.get_or_create(&Poses { outcome: "answered" }).inc();
        self.poses.get_or_create(&Poses { outcome: "overtaken" }).inc_by(overtaken.into());
    }

    /// A message of a stream was refused, and these poses before it were overtaken.
    pub fn pose_refused(&self, kind: Kind, overtaken: u32) {
        self.poses.get_or_create(&Poses { outcome: "refused" }).inc();
        self.poses.get_or_create(&Poses { outcome: "overtaken" }).inc_by(overtaken.into());
        self.problems.get_or_create(&Problems { kind: kind.name() }).inc();
    }

    /// The text.
    ///
    /// # Errors
    /// Never for these metrics: writing to a string does not fail.
    pub fn text(&self) -> Result<String, Error> {
        let mut text = String::new();
        encode(&mut text, &self.registry).map(|()| text)
    }
}

/// Counts and times every request.
pub async fn count(State(metrics): State<Arc<Metrics>>, request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map_or(NO_ROUTE, MatchedPath::as_str).to_owned();
    let arrived = Instant::now();
    let response = next.run(request).await;
    metrics.latency.get_or_create(&Route { route: route.clone() }).observe(arrived.elapsed().as_secs_f64());
    metrics.requests.get_or_create(&Answered { route, status: response.status().as_u16() }).inc();
    if let Some(kind) = response.extensions().get::<Kind>() {
        metrics.problems.get_or_create(&Problems { kind: kind.name() }).inc();
    }
    response
}
