//! The activation: `a(x) = x (1 + x / √(1 + x²)) / 2`, smooth, with neither exponentials nor branches.
//!
//! It is to SiLU what `x / √(1 + x²)` is to the hyperbolic tangent: 0 far below zero, x far above it. Its derivative is
//! `(1 + s)/2 + x s'/2` with `s = x / √(1 + x²)` and `s' = 1 / (1 + x²)^{3/2}`. Example: a(0) = 0, a(1) = (1 + 1/√2)/2 = 0.854.

use crate::kernel::{Kernel, run_kernel};

/// `a(x)`.
#[inline(always)]
pub fn activate(x: f32) -> f32 {
    0.5 * x * (1.0 + x / (1.0 + x * x).sqrt())
}

/// `a'(x)`.
#[inline(always)]
pub fn slope(x: f32) -> f32 {
    let inverse = 1.0 / (1.0 + x * x).sqrt();
    let s = x * inverse;
    0.5 * (1.0 + s + s * inverse * inverse)
}

/// `out = a(x)`.
pub fn activate_all(out: &mut [f32], x: &[f32]) {
    run_kernel(Activate(out, x));
}

/// `out += a(x)`.
pub fn add_activated(out: &mut [f32], x: &[f32]) {
    run_kernel(AddActivated(out, x));
}

/// `gradient *= a'(x)`.
pub fn times_slope(gradient: &mut [f32], x: &[f32]) {
    run_kernel(TimesSlope(gradient, x));
}

struct Activate<'a>(&'a mut [f32], &'a [f32]);

impl Kernel for Activate<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (out, &x) in self.0.iter_mut().zip(self.1) {
            *out = activate(x);
        }
    }
}

struct AddActivated<'a>(&'a mut [f32], &'a [f32]);

impl Kernel for AddActivated<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (out, &x) in self.0.iter_mut().zip(self.1) {
            *out += activate(x);
        }
    }
}

struct TimesSlope<'a>(&'a mut [f32], &'a [f32]);

impl Kernel for TimesSlope<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (gradient, &x) in self.0.iter_mut().zip(self.1) {
            *gradient *= slope(x);
        }
    }
}
