//! Quantiles of the worst node's error over the linear depth. Written by `retina-models calibrate`; not by hand.
//!
//! From 9886 samples of a data set of SHA-256
//! 46aa4518698c78fa7b9ecd14b9037b6816d06fbc09a21d09dc7c7232b9e3564e.
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
        of(0.00855, 0.32975, 180),
        of(0.08411, 0.42218, 89),
        of(0.16481, 0.48786, 335),
        of(0.23049, 0.64885, 368),
        of(0.30707, 0.58722, 332),
        of(0.35062, 0.52482, 193),
    ],
    [
        of(0.00611, 0.16190, 159),
        of(0.02171, 0.33016, 81),
        of(0.08221, 0.40400, 143),
        of(0.12010, 0.49275, 267),
        of(0.21035, 0.54094, 327),
        of(0.24879, 0.51834, 270),
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
        of(0.01769, 0.12067, 180),
        of(0.07382, 0.27790, 89),
        of(0.12789, 0.27958, 335),
        of(0.13800, 0.29341, 368),
        of(0.12053, 0.25530, 332),
        of(0.11718, 0.24017, 193),
    ],
    [
        of(0.01247, 0.08824, 159),
        of(0.03509, 0.16898, 81),
        of(0.08842, 0.27561, 143),
        of(0.10742, 0.31288, 267),
        of(0.14596, 0.33336, 327),
        of(0.13938, 0.35607, 269),
    ],
];
