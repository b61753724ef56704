//! Quantiles of the worst node's error over the linear depth. Written by `retina-models calibrate`; not by hand.
//!
//! From 14094 samples of a data set of SHA-256
//! 6caee95f16fc213fb08b66f6cfc1b834b5cc81a7601b2daa2bda8d4f0ca490bf.
//! Bins of mean strain end at 0.05, 0.1, 0.2, 0.3, 0.45.

use super::expected_error::{BINS, Quantiles, TIPS};

const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {
    Quantiles { median, p95, samples }
}

/// Level `linear`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const LINEAR: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.00387, 0.03424, 2313),
        of(0.01606, 0.05911, 861),
        of(0.03691, 0.13388, 1602),
        of(0.06969, 0.22897, 1485),
        of(0.08462, 0.25347, 1763),
        of(0.13579, 0.27977, 1542),
    ],
    [
        of(0.00743, 0.22358, 496),
        of(0.06212, 0.37882, 193),
        of(0.15282, 0.48889, 550),
        of(0.22318, 0.61344, 539),
        of(0.29257, 0.57557, 514),
        of(0.33958, 0.54292, 275),
    ],
    [
        of(0.00507, 0.11874, 456),
        of(0.01724, 0.28195, 206),
        of(0.06250, 0.40400, 291),
        of(0.11123, 0.52148, 328),
        of(0.20862, 0.61854, 372),
        of(0.23190, 0.53676, 308),
    ],
];

/// Level `coarse`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const COARSE: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.02068, 0.06750, 2313),
        of(0.03107, 0.06346, 861),
        of(0.03493, 0.07513, 1602),
        of(0.04350, 0.11456, 1485),
        of(0.04374, 0.10533, 1763),
        of(0.03787, 0.08252, 1542),
    ],
    [
        of(0.01587, 0.10840, 496),
        of(0.05838, 0.25582, 193),
        of(0.11838, 0.30478, 550),
        of(0.13307, 0.28907, 539),
        of(0.12438, 0.25801, 514),
        of(0.11560, 0.22807, 275),
    ],
    [
        of(0.01305, 0.07314, 456),
        of(0.03530, 0.15129, 206),
        of(0.07607, 0.25206, 291),
        of(0.10396, 0.29557, 328),
        of(0.14030, 0.33387, 371),
        of(0.14005, 0.36363, 307),
    ],
];
