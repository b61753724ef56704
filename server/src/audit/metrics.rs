//! What the audit counts: measured errors beside promised ones, by level.

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::registry::Registry;
use retina_core::predict::Level;

use super::Audited;

/// Upper bound of the bucket of the smallest errors (µm), how far apart the bounds are, and how many there are: 0.1 µm to 0.8 mm.
const BUCKETS: (f64, f64, u16) = (0.1, 2.0, 14);

/// What became of an audit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The worst node was no further off than promised for 95 of 100.
    Within,
    /// It was further off.
    Beyond,
    /// The answer's accuracy had not been measured for requests like it, and it said so.
    Uncalibrated,
    /// Level `reference` has no answer.
    NoReference,
    /// A job came; it is begun again.
    Interrupted,
    /// Newer answers took its place.
    Overtaken,
}

impl Outcome {
    fn name(self) -> &'static str {
        match self {
            Self::Within => "within",
            Self::Beyond => "beyond",
            Self::Uncalibrated => "uncalibrated",
            Self::NoReference => "no-reference",
            Self::Interrupted => "interrupted",
            Self::Overtaken => "overtaken",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Ended {
    level: &'static str,
    outcome: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfLevel {
    level: &'static str,
}

/// The counters of the audit; copies count together.
#[derive(Clone)]
pub struct AuditMetrics {
    ended: Family<Ended, Counter>,
    measured: Family<OfLevel, Histogram>,
    promised: Family<OfLevel, Histogram>,
}

fn histogram() -> Histogram {
    let (first, factor, count) = BUCKETS;
    Histogram::new(exponential_buckets(first, factor, count))
}

impl AuditMetrics {
    /// Nothing counted yet, among the series of `registry`.
    pub fn register(registry: &mut Registry) -> Self {
        let of_level = || Family::new_with_constructor(histogram as fn() -> Histogram);
        let (ended, measured, promised) = (Family::default(), of_level(), of_level());
        registry.register("audits", "Answers computed again at level reference, by outcome", ended.clone());
        registry.register("audit_measured_um", "Error of the worst node of an audited answer", measured.clone());
        registry.register("audit_promised_um", "95 % bound that an audited answer promised", promised.clone());
        Self { ended, measured, promised }
    }

    /// An audit ended without a number.
    pub fn ended(&self, level: Level, outcome: Outcome) {
        self.ended.get_or_create(&Ended { level: level.name(), outcome: outcome.name() }).inc();
    }

    /// An answer was computed again.
    pub fn audited(&self, audited: &Audited) {
        let level = OfLevel { level: audited.level.name() };
        self.measured.get_or_create(&level).observe(audited.measured_um);
        self.promised.get_or_create(&level).observe(audited.promised.p95_um);
        let outcome = match audited.promised {
            promised if !promised.calibrated => Outcome::Uncalibrated,
            promised if audited.measured_um <= promised.p95_um => Outcome::Within,
            _ => Outcome::Beyond,
        };
        self.ended(audited.level, outcome);
    }
}
