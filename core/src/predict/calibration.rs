//! Quantiles of the worst node's error over the linear depth. Written by `cargo run --release -p retina-tests --bin calibrate`; not by hand.
//!
//! 0 requests, seed 0.

use super::expected_error::{BINS, Quantiles};

const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {
    Quantiles { median, p95, samples }
}

/// Level `linear`: round tips, then edged ones; by bin of strain.
pub const LINEAR: [[Quantiles; BINS]; 2] = [[of(0.0, f64::INFINITY, 0); BINS]; 2];

/// Level `coarse`: round tips, then edged ones; by bin of strain.
pub const COARSE: [[Quantiles; BINS]; 2] = [[of(0.0, f64::INFINITY, 0); BINS]; 2];
