//! Quantiles of the worst node's error over the linear depth. Written by `retina-models calibrate`; not by hand.
//!
//! From 4150 samples of a data set of SHA-256
//! 432d942087f62928c0d737cf5922b05d42ea27454cc4bfa85710766b0a163b65.
//! Bins of mean strain end at 0.05, 0.1, 0.2, 0.3, 0.45.

use super::expected_error::{BINS, Quantiles, TIPS};

const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {
    Quantiles { median, p95, samples }
}

/// Level `linear`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const LINEAR: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.00397, f64::INFINITY, 2),
        of(0.01606, 0.08790, 71),
        of(0.04183, 0.14418, 547),
        of(0.06968, 0.23716, 721),
        of(0.08486, 0.25446, 882),
        of(0.13585, 0.29334, 801),
    ],
    [
        of(0.00000, f64::INFINITY, 0),
        of(0.14408, f64::INFINITY, 21),
        of(0.16173, 0.57175, 156),
        of(0.20770, 0.60044, 183),
        of(0.30089, 0.57457, 172),
        of(0.35223, 0.52018, 102),
    ],
    [
        of(0.00000, f64::INFINITY, 0),
        of(0.15419, f64::INFINITY, 1),
        of(0.08550, 0.53113, 39),
        of(0.13177, 0.52148, 128),
        of(0.21272, 0.44331, 168),
        of(0.28078, 0.53676, 156),
    ],
];

/// Level `coarse`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const COARSE: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.01077, f64::INFINITY, 2),
        of(0.03571, 0.12194, 71),
        of(0.03694, 0.08600, 547),
        of(0.04407, 0.11620, 721),
        of(0.04302, 0.11021, 882),
        of(0.03712, 0.08252, 801),
    ],
    [
        of(0.00000, f64::INFINITY, 0),
        of(0.14374, f64::INFINITY, 21),
        of(0.13747, 0.32071, 156),
        of(0.14075, 0.26932, 183),
        of(0.11724, 0.25530, 172),
        of(0.11347, 0.25002, 102),
    ],
    [
        of(0.00000, f64::INFINITY, 0),
        of(0.05749, f64::INFINITY, 1),
        of(0.07407, 0.25896, 39),
        of(0.11230, 0.29458, 128),
        of(0.14508, 0.30637, 168),
        of(0.15324, 0.38673, 156),
    ],
];
