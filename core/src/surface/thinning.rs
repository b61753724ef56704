//! How much a pit thins the retina under a point of the surface, and how that changes along the ball.
//!
//! With n the unit vector from the ball's centre to the point, at the distance r, and q = R n across the axis, the bell is `T = D exp(−|q|²/2σ²)`. Its
//! derivative by the point is `J ∂T/∂q` with `J = (R/r) (1 − n nᵀ)`, the second one `J ∂²T/∂q² J`, where the curvature of the ball itself (1/R) is left out
//! against that of the bell (1/σ).

use nalgebra::{Matrix3, Point3, Vector3};

use super::Surface;

/// How much thinner the retina is than the tissue says; zeros everywhere but in a pit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thinning {
    /// How much (mm).
    pub mm: f64,
    /// Derivative along the ball (mm per mm), patch frame.
    pub slope: Vector3<f64>,
    /// Second derivative along the ball (1/mm), patch frame.
    pub bend: Matrix3<f64>,
}

impl Thinning {
    /// Of a surface without a pit.
    pub fn none() -> Self {
        Thinning { mm: 0.0, slope: Vector3::zeros(), bend: Matrix3::zeros() }
    }
}

impl Surface {
    /// How the retina is thinned under a point on the surface or near it, patch frame.
    pub fn thinning(&self, at: &Point3<f64>) -> Thinning {
        let Self::FovealPit { radius_mm, depth_mm, sigma_mm } = self else { return Thinning::none() };
        let from_centre = at - Point3::new(0.0, 0.0, radius_mm + depth_mm);
        let distance_mm = from_centre.norm();
        let n = from_centre / distance_mm;
        let across = Vector3::new(n.x, n.y, 0.0) * *radius_mm;
        let variance = sigma_mm * sigma_mm;
        let mm = depth_mm * (-across.norm_squared() / (2.0 * variance)).exp();
        let along = (Matrix3::identity() - n * n.transpose()) * (radius_mm / distance_mm);
        let second = across * across.transpose() / variance - Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
        Thinning { mm, slope: along * across * (-mm / variance), bend: along * second * along * (mm / variance) }
    }
}
