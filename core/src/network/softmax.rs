//! The softmax of an attention, many numbers at a time.
//!
//! `eˣ = 2ⁿ eʳ` with `n = round(x / ln 2)` and `r = x − n ln 2`, so that |r| ≤ ln 2 / 2; of the series for `eʳ` it takes the terms to r⁷/7!, which leaves
//! out less than r⁸/8! = 5.2e-9. A weight below e^[`LEAST`] of the largest is zero: a sum of such weights lies below the last digit of an `f32`, and they are close
//! to the subnormal numbers, each of which costs a processor a hundred ordinary ones.

use std::f32::consts::LOG2_E;

use crate::kernel::{Kernel, run_kernel};

/// Smallest exponent that has a weight; e⁻⁸⁷ is the smallest normal number.
pub const LEAST: f32 = -80.0;
/// 1.5 · 2²³: added to a number of less than 2²² it leaves the nearest whole number in the last bits.
const WHOLE: f32 = 12_582_912.0;
/// ln 2 in nine bits, so that `n` times it is exact.
const LN_2_HIGH: f32 = 355.0 / 512.0;
/// What is missing from it to ln 2.
const LN_2_LOW: f32 = -2.121_944_4e-4;
/// 1/7 to 1/1: the terms of the series, from the last to the first.
const INVERSES: [f32; 7] = [1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0, 1.0];
/// Bits behind the point of an `f32`.
const MANTISSA: u32 = 23;
/// Numbers that are compared or added side by side.
const LANES: usize = 8;

/// `eˣ` for x ≤ 0: to two units of the last digit, zero below [`LEAST`]. What is no number stays none.
#[inline(always)]
pub fn exp_of_negative(x: f32) -> f32 {
    let bounded = if x < LEAST { LEAST } else { x };
    let shifted = bounded * LOG2_E + WHOLE;
    let n = shifted - WHOLE;
    let r = (bounded - n * LN_2_HIGH) - n * LN_2_LOW;
    let mut series = 1.0;
    for inverse in INVERSES {
        series = 1.0 + r * series * inverse;
    }
    let power = f32::from_bits((shifted.to_bits() << MANTISSA).wrapping_add(1.0_f32.to_bits()));
    // A choice between two numbers would be a jump, and jumps keep the loops from vector instructions.
    let kept = u32::from(x < LEAST).wrapping_sub(1);
    f32::from_bits((series * power).to_bits() & kept)
}

/// Every row of `columns` numbers becomes positive and adds up to one.
pub fn softmax(rows: &mut [f32], columns: usize) {
    run_kernel(Softmax(rows, columns));
}

struct Softmax<'a>(&'a mut [f32], usize);

impl Kernel for Softmax<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for row in self.0.chunks_exact_mut(self.1) {
            let largest = folded(
                row,
                f32::NEG_INFINITY,
                #[inline(always)]
                |a, b| if b > a { b } else { a },
            );
            for x in row.iter_mut() {
                *x = exp_of_negative(*x - largest);
            }
            let share = 1.0
                / folded(
                    row,
                    0.0,
                    #[inline(always)]
                    |a, b| a + b,
                );
            for x in row.iter_mut() {
                *x *= share;
            }
        }
    }
}

/// `fold` over all numbers of a row in eight strands, which are joined at the end.
#[inline(always)]
fn folded(row: &[f32], start: f32, fold: impl Fn(f32, f32) -> f32) -> f32 {
    let (whole, rest) = row.as_chunks::<LANES>();
    let mut strands = [start; LANES];
    for numbers in whole {
        for (strand, &x) in strands.iter_mut().zip(numbers) {
            *strand = fold(*strand, x);
        }
    }
    rest.iter().chain(&strands).fold(start, |a, &b| fold(a, b))
}
