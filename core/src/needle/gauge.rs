//! Needles by the name they are sold under.
//!
//! Contract: a name stands for one outer diameter. Units: mm.
//!
//! Not here: the shape of the tip, which the name does not say.

use thiserror::Error;

const CHART: &str = "hypodermic needle gauge chart";
const CANNULA: &str = "[unverified] small-gauge subretinal cannula";

/// A needle size sold under a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge {
    /// The name, for example `25G`.
    pub name: &'static str,
    /// Outer diameter, mm.
    pub outer_diameter_mm: f64,
    /// Where the diameter comes from.
    pub source: &'static str,
}

/// Every known gauge, from thin to thick.
pub const GAUGES: [Gauge; 6] = [
    Gauge { name: "41G", outer_diameter_mm: 0.10, source: CANNULA },
    Gauge { name: "38G", outer_diameter_mm: 0.12, source: CANNULA },
    Gauge { name: "30G", outer_diameter_mm: 0.311, source: CHART },
    Gauge { name: "27G", outer_diameter_mm: 0.413, source: CHART },
    Gauge { name: "25G", outer_diameter_mm: 0.514, source: CHART },
    Gauge { name: "23G", outer_diameter_mm: 0.641, source: CHART },
];

/// A name that stands for no gauge.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("unknown gauge {name:?}; known are {}", allowed.join(", "))]
pub struct UnknownGauge {
    /// The name that was asked for.
    pub name: String,
    /// The names that are known, from thin to thick.
    pub allowed: Vec<&'static str>,
}

impl Gauge {
    /// The gauge of that exact name. Fails with [`UnknownGauge`], which lists the known names.
    pub fn from_name(name: &str) -> Result<Self, UnknownGauge> {
        GAUGES
            .into_iter()
            .find(|gauge| gauge.name == name)
            .ok_or_else(|| UnknownGauge { name: name.to_owned(), allowed: GAUGES.map(|gauge| gauge.name).to_vec() })
    }

    /// Outer radius, mm.
    pub fn radius_mm(&self) -> f64 {
        0.5 * self.outer_diameter_mm
    }
}
