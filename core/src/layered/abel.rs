//! Closed-form Abel transforms of piecewise linear functions: from the line of the punch equation to the surface and back.
//!
//! With p̂(k) = ∫ φ(t) cos(kt) dt and Poisson's integrals for J₀ and J₁,
//! ```text
//! v(r)   = (2/π) ∫₀^r W(x) / √(r² − x²) dx          W(x) = ∫ kC_z p̂ cos(kx) dk      (downward displacement)
//! u_r(r) = (2/πr) ∫₀^r x V(x) / √(r² − x²) dx       V(x) = ∫ kC_r p̂ sin(kx) dk
//! force beyond r = 2π Z(r),  Z(r) = ∫_r^a φ(t) t / √(t² − r²) dt
//! ```
//! A constant kC_r = c gives u_r = (c/r)(Z(0) − Z(r)). Source: Sneddon 1951, *Fourier Transforms*; Gradshteyn & Ryzhik 6.671.
//! Units: mm; results carry those of the integrand.

use std::f64::consts::FRAC_2_PI;

/// (2/π) ∫ W / √(r² − x²) dx over x in [x0, min(x1, r)], W linear from `w0` at `x0` to `w1` at `x1`; 0 ≤ x0 < r.
pub fn surface_from_line(r: f64, x0: f64, x1: f64, w0: f64, w1: f64) -> f64 {
    let slope = (w1 - w0) / (x1 - x0);
    let top = x1.min(r);
    let arc = (top / r).min(1.0).asin() - (x0 / r).asin();
    let root = cut_root(r, x0) - cut_root(r, top);
    FRAC_2_PI * ((w0 - slope * x0) * arc + slope * root)
}

/// (2/πr) ∫ x V / √(r² − x²) dx over x in [x0, min(x1, r)], V linear from `v0` at `x0` to `v1` at `x1`; 0 ≤ x0 < r.
pub fn radial_from_line(r: f64, x0: f64, x1: f64, v0: f64, v1: f64) -> f64 {
    let slope = (v1 - v0) / (x1 - x0);
    let top = x1.min(r);
    let root0 = cut_root(r, x0);
    let root1 = cut_root(r, top);
    let arc = (top / r).min(1.0).asin() - (x0 / r).asin();
    let square = 0.5 * (r * r * arc + x0 * root0 - top * root1);
    FRAC_2_PI / r * ((v0 - slope * x0) * (root0 - root1) + slope * square)
}

/// Part of Z(r) from t in [max(t0, r), t1], φ linear from `f0` at `t0` to `f1` at `t1`; 0 ≤ r < t1.
pub fn force_beyond(r: f64, t0: f64, t1: f64, f0: f64, f1: f64) -> f64 {
    let slope = (f1 - f0) / (t1 - t0);
    let low = t0.max(r);
    let root0 = cut_root(low, r);
    let root1 = cut_root(t1, r);
    let log = if r > 0.0 { ((t1 + root1) / (low + root0)).ln() } else { 0.0 };
    let square = 0.5 * (t1 * root1 - low * root0 + r * r * log);
    (f0 - slope * t0) * (root1 - root0) + slope * square
}

/// √(a² − b²), zero where a ≤ b.
pub fn cut_root(a: f64, b: f64) -> f64 {
    ((a - b) * (a + b)).max(0.0).sqrt()
}
