//! Two answers side by side: node errors and their statistics.
//!
//! Units: µm. Not here: which of the two is right.

use nalgebra::Point3;

/// The `share` quantile (0 to 1) of `values` by linear interpolation; NaN for none.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = share * last as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}

/// Distances between corresponding nodes (µm).
pub fn node_errors_um(a: &[Point3<f64>], b: &[Point3<f64>]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| (a - b).norm() * 1e3).collect()
}

/// How large node errors are; NaN for none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorStatistics {
    /// Mean (µm).
    pub mean_um: f64,
    /// 99 % of the nodes are no further off than this (µm).
    pub p99_um: f64,
    /// Largest (µm).
    pub max_um: f64,
}

impl ErrorStatistics {
    /// Of these node errors (µm).
    pub fn new(errors_um: &[f64]) -> Self {
        ErrorStatistics {
            mean_um: errors_um.iter().sum::<f64>() / errors_um.len() as f64,
            p99_um: quantile(errors_um, 0.99),
            max_um: quantile(errors_um, 1.0),
        }
    }
}
