//! What the levels `linear` and `coarse` err by, as quantiles: the source of `core/src/predict/calibration.rs`.
//!
//! In each bin (kind of tip, mean strain) the worst node's error over the linear depth is ranked. The samples of a path resemble each other, so a bin of samples from p
//! paths counts as p: its 95 % bound is the quantile at ⌈0.95 (p + 1)⌉ / p, which a sample of a new path stays below with at least that probability (split
//! conformal prediction), and it has none where p is too small for that. Errors are those against the truth of the samples; that truth's own is counted by the core.
//!
//! Not here: which bins there are (`retina_core::predict::expected_error`), whether the bounds hold on other samples (`evaluate`).

use std::collections::HashSet;
use std::fmt::Write as _;

use retina_core::comparison::quantile;
use retina_core::predict::Level;
use retina_core::predict::expected_error::{BINS, Quantiles, STRAIN_BINS, TIPS, bin};

use crate::dataset::report::distance_um;
use crate::sample::{Sample, Split};

/// Share of new samples below the upper bound.
const COVERAGE: f64 = 0.95;
/// Splits that the bounds come from. Test measures them.
const SPLITS: [Split; 2] = [Split::Train, Split::Validation];
/// Tables are written for these levels.
const LEVELS: [Level; 2] = [Level::Linear, Level::Coarse];

/// Mean strain of a sample: the linear depth over what yields under the contact.
pub fn strain(sample: &Sample) -> f64 {
    let [retina, choroid, _] = sample.tissue.thickness_mm;
    f64::from(sample.linear_depth_mm) / f64::from(retina + choroid)
}

/// Largest distance of a node to the truth (µm); `None` where the level has no answer or no table.
pub fn worst_um(sample: &Sample, level: Level) -> Option<f64> {
    let answer = match level {
        Level::Linear => &sample.linear,
        Level::Coarse => sample.coarse.as_ref()?,
        Level::Network | Level::Corrected | Level::Reference => return None,
    };
    Some(distance_um(&answer.displacement_mm, &sample.truth.displacement_mm))
}

/// A bin's quantiles from the error over the depth of each sample, with the path that it belongs to.
pub fn quantiles(ratios: &[(u32, f64)]) -> Quantiles {
    let paths = ratios.iter().map(|(path, _)| path).collect::<HashSet<_>>().len() as f64;
    let mut values: Vec<f64> = ratios.iter().map(|&(_, ratio)| ratio).collect();
    values.sort_by(f64::total_cmp);
    let share = (COVERAGE * (paths + 1.0)).ceil() / paths;
    let rank = (share * values.len() as f64).ceil() as usize;
    Quantiles {
        median: if values.is_empty() { 0.0 } else { quantile(&values, 0.5) },
        p95: values.get(rank.wrapping_sub(1)).copied().unwrap_or(f64::INFINITY),
        samples: values.len(),
    }
}

/// The text of `calibration.rs` from the samples of a data set with this hash.
pub fn source(samples: &[Sample], sha256: &str) -> String {
    let used: Vec<&Sample> = samples.iter().filter(|sample| SPLITS.contains(&sample.split)).collect();
    let ends = STRAIN_BINS.map(|end| end.to_string()).join(", ");
    let mut text = format!(
        "//! Quantiles of the worst node's error over the linear depth. Written by `retina-models calibrate`; not by hand.\n//!\n\
         //! From {} samples of a data set of SHA-256\n//! {sha256}.\n//! Bins of mean strain end at {ends}.\n\n\
         use super::expected_error::{{BINS, Quantiles, TIPS}};\n\n\
         const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {{\n    Quantiles {{ median, p95, samples }}\n}}\n",
        used.len()
    );
    for level in LEVELS {
        // A String takes whatever is written.
        let _ = writeln!(
            text,
            "\n/// Level `{}`: half balls, flat ends, bevels; by bin of strain.\n#[rustfmt::skip]\npub const {}: [[Quantiles; BINS]; TIPS] = [",
            level.name(),
            level.name().to_uppercase()
        );
        for tip in 0..TIPS {
            text.push_str("    [\n");
            for at in 0..BINS {
                let _ = writeln!(text, "        {},", entry(&quantiles(&ratios(&used, level, tip, at))));
            }
            text.push_str("    ],\n");
        }
        text.push_str("];\n");
    }
    text
}

fn ratios(samples: &[&Sample], level: Level, tip: usize, at: usize) -> Vec<(u32, f64)> {
    samples
        .iter()
        .filter(|sample| usize::from(sample.tip.kind) == tip && bin(strain(sample)) == at)
        .filter_map(|sample| Some((sample.path, worst_um(sample, level)? / (1e3 * f64::from(sample.linear_depth_mm)))))
        .collect()
}

/// A bin's quantiles as they stand in the core.
pub fn entry(Quantiles { median, p95, samples }: &Quantiles) -> String {
    let p95 = if p95.is_finite() { format!("{p95:.5}") } else { "f64::INFINITY".to_owned() };
    format!("of({median:.5}, {p95}, {samples})")
}
