//! How stiff a needle's shaft is across its axis, measured at the tip.
//!
//! Measured are vitrectors of three gauges (Bausch & Lomb: force for 1 mm at the tip, [`PUBLISHED`]); the same measurement 15 mm from the tip gives their free length L, for a uniform beam is
//! stiffer there by (L/(L − 15 mm))³: 29.5, 29.0 and 27.8 mm for 23G, 25G and 27G. Other radii, all (unverified):
//! - thicker than 23G: its stiffness times the fourth power of the radii's ratio, the same tube at another scale;
//! - between two measured ones: the power law through both;
//! - thinner than 27G: a steel cannula of [`CANNULA_MM`] at the end of a 25G shaft, together as long as a shaft. The tip of a beam whose end of length l has the stiffness B₂ and whose rest has B₁ yields
//!   by Castigliano's theorem ∫ x²/B dx = (L³ − l³)/(3 B₁) + l³/(3 B₂) for a unit force.
//!
//! Units: mm, mN; flexural stiffness B = E I in mN·mm².
//! Not here: what bending does to an answer (`effects::tool_flex`).

use std::f64::consts::PI;

use crate::range::ParameterRange;

/// Force for a deflection of the tip.
pub const STIFFNESS: ParameterRange = ParameterRange {
    name: "stiffness of the shaft at the tip",
    unit: "mN/mm",
    default: 67.0,
    min: 1.0,
    max: 1e6,
    source: "vitrectors of 23G, 25G, 27G: 78, 67, 32 mN/mm (iovs articleid=2782672; default 25G); other radii derived [unverified]; 1e6 is rigid",
};

/// Radii of 23G, 25G and 27G (mm) and their measured stiffness (mN/mm): 8.0, 6.8 and 3.3 gf for 1 mm (iovs articleid=2782672).
pub const PUBLISHED: [(f64, f64); 3] = [(0.3205, 78.0), (0.257, 67.0), (0.2065, 32.0)];

/// Free length of a shaft (mm), from the same measurement.
pub const FREE_LENGTH_MM: f64 = 29.0;
/// Length of a thin cannula at the end of a thicker shaft (mm) (unverified).
pub const CANNULA_MM: f64 = 5.0;
/// Young's modulus of stainless steel (kPa): 193 GPa.
pub const STEEL_KPA: f64 = 1.93e8;
/// Inner over outer radius of a cannula (unverified): 40 to 80 µm inside of 100 µm are published.
const BORE: f64 = 0.6;

/// Flexural stiffness E I (mN·mm²) of a tube of Young's modulus `youngs_modulus_kpa` and these radii (mm): I = π (rₒ⁴ − rᵢ⁴)/4.
pub fn tube(youngs_modulus_kpa: f64, outer_mm: f64, inner_mm: f64) -> f64 {
    youngs_modulus_kpa * 0.25 * PI * (outer_mm.powi(4) - inner_mm.powi(4))
}

/// Stiffness at the tip (mN/mm) of a cantilever whose last `end_mm` of `length_mm` have the flexural stiffness `end` and the rest `shaft` (mN·mm²).
pub fn cantilever(length_mm: f64, shaft: f64, end_mm: f64, end: f64) -> f64 {
    let [whole, part] = [length_mm, end_mm].map(|length| length.powi(3) / 3.0);
    1.0 / ((whole - part) / shaft + part / end)
}

/// Stiffness at the tip (mN/mm) of a needle of this radius (mm).
pub fn stiffness_mn_per_mm(radius_mm: f64) -> f64 {
    let [thick, middle, thin] = PUBLISHED;
    let between =
        |(r1, k1): (f64, f64), (r0, k0): (f64, f64)| k0 * (k1 / k0).powf((radius_mm / r0).ln() / (r1 / r0).ln());
    if radius_mm > thick.0 {
        thick.1 * (radius_mm / thick.0).powi(4)
    } else if radius_mm >= middle.0 {
        between(thick, middle)
    } else if radius_mm >= thin.0 {
        between(middle, thin)
    } else {
        let shaft = middle.1 * FREE_LENGTH_MM.powi(3) / 3.0;
        cantilever(FREE_LENGTH_MM, shaft, CANNULA_MM, tube(STEEL_KPA, radius_mm, BORE * radius_mm))
    }
}
