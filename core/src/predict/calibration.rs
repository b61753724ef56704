//! Quantiles of the worst node's error over the linear depth. Written by `retina-models calibrate`; not by hand.
//!
//! From 10684 samples of a data set of SHA-256
//! 8e0a8f5b8ac6d3d842ec935f5f20dfc15983c388094e3f169bab7068371e1fa2.
//! Bins of mean strain end at 0.05, 0.1, 0.2, 0.3, 0.45.

use super::expected_error::{BINS, Quantiles, TIPS};

const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {
    Quantiles { median, p95, samples }
}

/// Level `linear`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const LINEAR: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.00387, 0.04059, 720),
        of(0.01590, 0.06533, 391),
        of(0.03982, 0.14112, 1254),
        of(0.06959, 0.22963, 1472),
        of(0.08462, 0.25347, 1763),
        of(0.13579, 0.27977, 1542),
    ],
    [
        of(0.00874, 0.33623, 182),
        of(0.09626, 0.42218, 106),
        of(0.16066, 0.50191, 488),
        of(0.22507, 0.61344, 533),
        of(0.29247, 0.57457, 513),
        of(0.33948, 0.54292, 276),
    ],
    [
        of(0.00611, 0.16190, 159),
        of(0.02319, 0.33016, 89),
        of(0.07740, 0.44033, 187),
        of(0.11699, 0.52148, 315),
        of(0.20955, 0.61854, 381),
        of(0.23371, 0.57739, 313),
    ],
];

/// Level `coarse`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const COARSE: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.01977, 0.06954, 720),
        of(0.03091, 0.06881, 391),
        of(0.03643, 0.08008, 1254),
        of(0.04382, 0.11553, 1472),
        of(0.04374, 0.10533, 1763),
        of(0.03787, 0.08252, 1542),
    ],
    [
        of(0.01791, 0.22745, 182),
        of(0.07848, 0.28545, 106),
        of(0.12690, 0.31703, 488),
        of(0.13307, 0.28907, 533),
        of(0.12444, 0.25636, 513),
        of(0.11567, 0.22807, 276),
    ],
    [
        of(0.01247, 0.08824, 159),
        of(0.03550, 0.17758, 89),
        of(0.08787, 0.26457, 187),
        of(0.10592, 0.29636, 315),
        of(0.14376, 0.33849, 380),
        of(0.14181, 0.38254, 312),
    ],
];
