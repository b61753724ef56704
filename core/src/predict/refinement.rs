//! Quantiles of what refining the mesh of level `reference` changes at the worst node. Written by `retina-models reference-error`; not by hand.
//!
//! Every edge divided 1.33 times as finely, 107 random requests of seed 5 and 113 without an answer on one of the two meshes.

use super::expected_error::{Quantiles, TIPS};

const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {
    Quantiles { median, p95, samples }
}

/// In units of `refinement_unit_um`: half balls, flat ends, bevels.
#[rustfmt::skip]
pub const REFERENCE: [Quantiles; TIPS] = [
    of(0.27473, 0.80510, 40),
    of(2.28235, 7.26968, 40),
    of(1.36117, 16.18454, 27),
];
