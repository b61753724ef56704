//! Quantiles of the worst node's error over the linear depth. Written by
//! `cargo run --release -p retina-tests --bin calibrate -- 100 77`; not by hand.
//!
//! 92 of 100 requests answered at every level. Bins of mean strain end at 0.1.

use super::expected_error::{BINS, Quantiles};

const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {
    Quantiles { median, p95, samples }
}

/// Level `linear`: round tips, then edged ones; by bin of strain.
#[rustfmt::skip]
pub const LINEAR: [[Quantiles; BINS]; 2] = [
    [of(0.01141, 0.03252, 21), of(0.04956, 0.55673, 35)],
    [of(0.01794, f64::INFINITY, 13), of(0.14746, 0.47716, 23)],
];

/// Level `coarse`: round tips, then edged ones; by bin of strain.
#[rustfmt::skip]
pub const COARSE: [[Quantiles; BINS]; 2] = [
    [of(0.02786, 0.06722, 21), of(0.03713, 0.10789, 35)],
    [of(0.04579, f64::INFINITY, 13), of(0.10630, 0.29006, 23)],
];
