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
        of(0.00784, 0.05589, 720),
        of(0.02196, 0.07863, 391),
        of(0.05258, 0.15454, 1254),
        of(0.07953, 0.24009, 1472),
        of(0.09144, 0.26185, 1763),
        of(0.14086, 0.28468, 1542),
    ],
    [
        of(0.01529, 0.34918, 182),
        of(0.11698, 0.45453, 106),
        of(0.19133, 0.54223, 488),
        of(0.25725, 0.65853, 533),
        of(0.32642, 0.61539, 513),
        of(0.36513, 0.57298, 276),
    ],
    [
        of(0.02506, 0.26781, 159),
        of(0.05348, 0.41761, 89),
        of(0.13975, 0.57601, 187),
        of(0.19073, 0.62254, 315),
        of(0.27913, 0.69516, 381),
        of(0.28282, 0.62412, 313),
    ],
];

/// Level `coarse`: half balls, flat ends, bevels; by bin of strain.
#[rustfmt::skip]
pub const COARSE: [[Quantiles; BINS]; TIPS] = [
    [
        of(0.02372, 0.08178, 720),
        of(0.04013, 0.07800, 391),
        of(0.04628, 0.09444, 1254),
        of(0.05420, 0.12515, 1472),
        of(0.05143, 0.11320, 1763),
        of(0.04300, 0.08816, 1542),
    ],
    [
        of(0.02309, 0.27639, 182),
        of(0.10858, 0.32409, 106),
        of(0.15541, 0.35169, 488),
        of(0.17147, 0.31931, 533),
        of(0.15868, 0.29464, 513),
        of(0.14271, 0.25082, 276),
    ],
    [
        of(0.03160, 0.19522, 159),
        of(0.06953, 0.25870, 89),
        of(0.15414, 0.38735, 187),
        of(0.18040, 0.36373, 315),
        of(0.21425, 0.40491, 380),
        of(0.19270, 0.43423, 312),
    ],
];
