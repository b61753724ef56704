//! The layered part of the punch equation's kernels on the line, as tables with their integrals.
//!
//! With D = kC − (its half-space limit), the punch equation needs
//! ```text
//! K(s) = ∫₀^∞ D_z(k) cos(ks) dk  (even)        Q(s) = ∫₀^∞ D_r(k) sin(ks) dk  (odd)
//! ```
//! and their first and second integrals from 0. D is analytic and decays in a sector about the real axis, so the path of
//! ∫ D e^{iks} dk is turned by 15°, where the integrand decays instead of oscillating for every s; the trapezoidal rule in ln k then
//! converges exponentially with one set of wave numbers for all s, from a membrane of 1 µm to the whole bed. The poles of D known
//! to be nearest (stiff plate on a thin bonded incompressible layer, k⁶ = −1) lie at 30°, so the strip of analyticity
//! is at least 15° to each side. Units: 1/mm, mm, 1/kPa.

use super::bed::LayeredBed;
use super::kernel::{C64, surface_compliance};

/// Turn of the integration path, rad (15°): half-way between the real axis and the nearest poles.
const TURN: f64 = std::f64::consts::PI / 12.0;
/// Step in ln k: the trapezoidal error e^{−2π · 0.26/0.07} is 6e-11.
const LOG_STEP: f64 = 0.07;
/// Smallest |k|, 1/mm: what lies below moves nothing by more than 1e-7 of a half-space at 10 mm.
const SMALLEST_K: f64 = 1e-8;
/// Largest |k| times the top layer's thickness: e^{−2 · 16 cos 15°} is below 1e-13, times (kh)².
const LARGEST_KH: f64 = 16.0;
/// First tabulated s, mm, far below the smallest allowed scale of the kernel.
const FIRST_S_MM: f64 = 1e-5;
/// Step of the tables in ln s: cubic Hermite interpolation errs by 0.04⁴/384 < 1e-8.
const TABLE_LOG_STEP: f64 = 0.04;

/// A kernel function g(s) for s ≥ 0 with its derivative and its integrals from 0.
#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    derivative: f64,
    value: f64,
    first: f64,
    second: f64,
}

/// A tabulated kernel of the line, even or odd in s.
#[derive(Debug, Clone)]
pub struct LineKernel {
    samples: Vec<Sample>,
    parity: f64,
    /// Length below which the kernel is smooth, mm: the top layer's thickness.
    pub smooth_mm: f64,
}

/// Tabulates K and Q (1/(kPa·mm)) of a valid bed for 0 ≤ s ≤ `end_mm`.
pub fn line_kernels(bed: &LayeredBed, end_mm: f64) -> (LineKernel, LineKernel) {
    let top = bed.layers[0];
    let turn = C64::from_polar(1.0, TURN);
    let largest = LARGEST_KH / top.thickness_mm;
    let count = ((largest / SMALLEST_K).ln() / LOG_STEP).ceil() as usize;
    let weighted: Vec<(C64, C64, C64)> = (0..=count)
        .map(|i| {
            let k = turn * (SMALLEST_K * f64::exp(LOG_STEP * i as f64));
            let compliance = surface_compliance(bed, k);
            let weight = k * LOG_STEP;
            (
                k,
                (compliance.normal - top.half_space_normal()) * weight,
                (compliance.radial - top.half_space_radial()) * weight,
            )
        })
        .collect();
    let points = ((end_mm / FIRST_S_MM).ln() / TABLE_LOG_STEP).ceil() as usize + 2;
    let mut normal = Vec::with_capacity(points);
    let mut radial = Vec::with_capacity(points);
    for point in 0..points {
        let s = if point == 0 { 0.0 } else { FIRST_S_MM * f64::exp(TABLE_LOG_STEP * (point as f64 - 1.0)) };
        let (mut even, mut odd) = (Sample::default(), Sample::default());
        for &(k, normal_weight, radial_weight) in &weighted {
            let [wave, first, second] = wave_integrals(C64::new(0.0, s) * k);
            let (first, second) = (first / k, second / (k * k));
            even.derivative -= (normal_weight * k * wave).im;
            even.value += (normal_weight * wave).re;
            even.first += (normal_weight * first).im;
            even.second -= (normal_weight * second).re;
            odd.derivative += (radial_weight * k * wave).re;
            odd.value += (radial_weight * wave).im;
            odd.first -= (radial_weight * first).re;
            odd.second -= (radial_weight * second).im;
        }
        normal.push(even);
        radial.push(odd);
    }
    let kernel = |samples, parity| LineKernel { samples, parity, smooth_mm: top.thickness_mm };
    (kernel(normal, 1.0), kernel(radial, -1.0))
}

/// e^w, e^w − 1 and e^w − 1 − w without cancellation for small |w|.
fn wave_integrals(w: C64) -> [C64; 3] {
    if w.norm() > 0.3 {
        let wave = w.exp();
        return [wave, wave - 1.0, wave - 1.0 - w];
    }
    let mut tail = C64::new(0.0, 0.0);
    for n in (2..=12).rev() {
        tail = (tail + 1.0) * w / f64::from(n);
    }
    let second = tail * w;
    [second + w + 1.0, second + w, second]
}

impl LineKernel {
    /// g(s), 1/(kPa·mm).
    pub fn value(&self, s: f64) -> f64 {
        let (i, fraction, step) = self.locate(s.abs());
        let (a, b) = (&self.samples[i], &self.samples[i + 1]);
        self.sign(s, false) * hermite(fraction, step, a.value, a.derivative, b.value, b.derivative)
    }

    /// ∫₀^s g and ∫₀^s ∫ g, 1/kPa and mm/kPa.
    pub fn integrals(&self, s: f64) -> (f64, f64) {
        let (i, fraction, step) = self.locate(s.abs());
        let (a, b) = (&self.samples[i], &self.samples[i + 1]);
        let first = hermite(fraction, step, a.first, a.value, b.first, b.value);
        let second = hermite(fraction, step, a.second, a.first, b.second, b.first);
        (self.sign(s, true) * first, self.sign(s, false) * second)
    }

    /// The sign that parity gives to g (or, `swapped`, to its first integral) at a negative s.
    fn sign(&self, s: f64, swapped: bool) -> f64 {
        if s >= 0.0 {
            1.0
        } else if swapped {
            -self.parity
        } else {
            self.parity
        }
    }

    /// Interval index, position in it from 0 to 1 and its length, for s ≥ 0.
    fn locate(&self, s: f64) -> (usize, f64, f64) {
        if s < FIRST_S_MM {
            return (0, s / FIRST_S_MM, FIRST_S_MM);
        }
        let i = (((s / FIRST_S_MM).ln() / TABLE_LOG_STEP) as usize).min(self.samples.len() - 3);
        let low = FIRST_S_MM * f64::exp(TABLE_LOG_STEP * i as f64);
        let step = low * TABLE_LOG_STEP.exp_m1();
        (i + 1, (s - low) / step, step)
    }
}

/// Cubic Hermite interpolation on an interval of length `step`.
fn hermite(x: f64, step: f64, value0: f64, slope0: f64, value1: f64, slope1: f64) -> f64 {
    let y = 1.0 - x;
    y * y * ((1.0 + 2.0 * x) * value0 + x * step * slope0) + x * x * ((1.0 + 2.0 * y) * value1 - y * step * slope1)
}
