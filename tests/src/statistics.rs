//! Order statistics and error measures of the measuring programs.

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
