//! What of the tissue depends on time: relaxation of the retina, mass, and the vitreous that the surface drags along.
//!
//! Contract: the moduli of a [`Layer`](super::Layer) are those of a load that lasts; a Prony series raises the shear modulus of what is faster.
//! Each term's `share` is its share of the instantaneous modulus, so that the shares of all terms leave the lasting one. Units: s, kg, mm, kPa.
//!
//! Not here: the energies (`effects`). No relaxation was found for choroid and sclera, so only the retina relaxes.

use crate::range::{OutOfRange, ParameterRange};

/// One term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PronyTerm {
    /// Relaxation time τ, s.
    pub relaxation_time_s: f64,
    /// Share g of the instantaneous shear modulus that relaxes with it.
    pub share: f64,
}

/// What of the tissue depends on time.
#[derive(Debug, Clone, PartialEq)]
pub struct RateProperties {
    /// Relaxation of the retina's shear modulus; no term: the retina is elastic.
    pub retina_relaxation: Vec<PronyTerm>,
    /// Density of every layer, kg/mm³.
    pub density_kg_per_mm3: f64,
    /// Pressure of the vitreous on the surface for its velocity, kPa·s/mm.
    pub vitreous_drag_kpa_s_per_mm: f64,
}

const FIT: &str = "fit to tan delta = 0.238 of mouse retina over 1-100 Hz (Soft Matter 2026, d5sm01060h); the series holds 0.224-0.252 there and \
                   extrapolates outside. No Prony series of the retina is published [unverified]";

/// Relaxation time of a term.
pub const RELAXATION_TIME: ParameterRange =
    ParameterRange { name: "relaxation time", unit: "s", default: 1.0, min: 1e-6, max: 1e4, source: FIT };

/// Share of a term in the instantaneous shear modulus; also bounds the sum of all shares.
pub const RELAXATION_SHARE: ParameterRange = ParameterRange {
    name: "share of the instantaneous shear modulus",
    unit: "1",
    default: 0.0738,
    min: 0.0,
    max: 0.99,
    source: FIT,
};

/// Number of terms. The bound is this program's: each is remembered at every quadrature point.
pub const RELAXATION_TERMS: ParameterRange = ParameterRange {
    name: "number of relaxation terms",
    unit: "terms",
    default: 7.0,
    min: 0.0,
    max: 16.0,
    source: "bound of this program: a term a decade covers sixteen decades",
};

/// Density of the tissue.
pub const DENSITY: ParameterRange = ParameterRange {
    name: "density",
    unit: "kg/mm3",
    default: 1.05e-6,
    min: 0.9e-6,
    max: 1.2e-6,
    source: "[unverified] soft tissue has 1000-1100 kg/m3; measured for the retina, but not published as numbers (PMC4425732)",
};

/// Drag of the vitreous.
pub const VITREOUS_DRAG: ParameterRange = ParameterRange {
    name: "drag of the vitreous",
    unit: "kPa s/mm",
    default: 2.7e-3,
    min: 0.0,
    max: 0.1,
    source: "derived: viscosity (2.10 - 0.50) Pa / 1.20 per s = 1.3 Pa s of porcine vitreous (livrepository 3111968) over the 0.5 mm \
             across which a needle moves the surface; 2e-6 for saline after vitrectomy",
};

/// Relaxation times (s) and shares of the default series.
const DEFAULT_SERIES: [(f64, f64); 7] =
    [(1e-4, 0.2905), (1e-3, 0.2062), (1e-2, 0.1464), (1e-1, 0.1040), (1.0, 0.0738), (1e1, 0.0524), (1e2, 0.0372)];

impl Default for RateProperties {
    fn default() -> Self {
        let term = |(relaxation_time_s, share)| PronyTerm { relaxation_time_s, share };
        Self {
            retina_relaxation: DEFAULT_SERIES.map(term).to_vec(),
            density_kg_per_mm3: DENSITY.default,
            vitreous_drag_kpa_s_per_mm: VITREOUS_DRAG.default,
        }
    }
}

impl RateProperties {
    /// Share of the instantaneous shear modulus that lasts.
    pub fn lasting_share(&self) -> f64 {
        1.0 - self.retina_relaxation.iter().map(|term| term.share).sum::<f64>()
    }

    /// Holds every number against its range; fails with the first that is outside.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        let path = "tissue.rate.retina_relaxation";
        RELAXATION_TERMS.check(path, self.retina_relaxation.len() as f64)?;
        for (index, term) in self.retina_relaxation.iter().enumerate() {
            RELAXATION_TIME.check(&format!("{path}[{index}].relaxation_time_s"), term.relaxation_time_s)?;
            RELAXATION_SHARE.check(&format!("{path}[{index}].share"), term.share)?;
        }
        RELAXATION_SHARE.check(&format!("{path}.share"), 1.0 - self.lasting_share())?;
        DENSITY.check("tissue.rate.density_kg_per_mm3", self.density_kg_per_mm3)?;
        VITREOUS_DRAG.check("tissue.rate.vitreous_drag_kpa_s_per_mm", self.vitreous_drag_kpa_s_per_mm)
    }
}
