//! Ranges of what holds between the tissue and its surroundings: friction on the needle, pressure of the eye.
//!
//! Contract: one named range a number, with its source. Units: kPa; the friction coefficient is a pure number.

use crate::range::ParameterRange;

/// One millimetre of mercury (kPa), the unit of clinical eye pressures.
pub const MMHG_KPA: f64 = 0.133_322;

/// Coulomb's coefficient between needle and retina.
pub const FRICTION_COEFFICIENT: ParameterRange = ParameterRange {
    name: "friction coefficient between needle and retina",
    unit: "1",
    default: 0.0,
    min: 0.0,
    max: 2.0,
    source: "[unverified] no measurement of steel on retina was found; fresh human cornea in liquid has 0.006-0.015 (Wilson 2015, \
             10.1097/ICO.0000000000000524), which moves less than the levels resolve, hence 0. The upper bound is this program's",
};

/// Pressure in the eye.
pub const EYE_PRESSURE: ParameterRange = ParameterRange {
    name: "pressure in the eye",
    unit: "kPa",
    default: 2.07,
    min: 0.0,
    max: 8.0,
    source: "mean 15.5 +/- 2.75 mmHg = 2.07 kPa, normal 10-21 mmHg; surgery 20-35 mmHg and for moments 60 mmHg = 8.0 kPa [unverified]",
};
