//! The integrals that all punches of one bed share, as weights on the values of piecewise linear functions at the grid's nodes.
//!
//! Kernels of [`super::line`] are integrated over an element with four Gauss points where they are smooth, else by their exact
//! integrals, so that a membrane far thinner than an element is still weighed exactly. Units: mm, kPa.

use nalgebra::DMatrix;

use super::abel::{force_beyond, radial_from_line, surface_from_line};
use super::bed::LayeredBed;
use super::grid::{PUNCHES, RadialGrid};
use super::line::{LineKernel, line_kernels};

/// Gauss–Legendre points and weights on [0, 1].
pub(super) const GAUSS_4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
/// An interval is integrated with four Gauss points where it is shorter than this part of the kernel's local scale
/// (the distance to s = 0, or the top layer's thickness if larger), else by the kernel's exact integrals.
const SMOOTH_PART: f64 = 0.5;

/// What a piecewise linear function's values at both ends of each element add to an integral, for each of many points: one column
/// a point, one row an element.
pub(super) struct ElementWeights {
    /// Weights of the elements' left ends.
    pub left: DMatrix<f64>,
    /// Weights of the elements' right ends.
    pub right: DMatrix<f64>,
}

impl ElementWeights {
    fn new(points: usize, elements: usize, weights: impl Fn(usize, usize) -> (f64, f64)) -> Self {
        let mut left = DMatrix::zeros(elements, points);
        let mut right = DMatrix::zeros(elements, points);
        for point in 0..points {
            for element in 0..elements {
                (left[(element, point)], right[(element, point)]) = weights(point, element);
            }
        }
        Self { left, right }
    }

    /// The integral at `point` over the elements from `first` on whose end values are `values`.
    pub fn apply(&self, point: usize, first: usize, values: &[f64]) -> f64 {
        let rows = self.left.nrows();
        let column = point * rows + first..(point + 1) * rows;
        let (left, right) = (&self.left.as_slice()[column.clone()], &self.right.as_slice()[column]);
        left.iter().zip(right).zip(values.windows(2)).map(|((l, r), value)| l * value[0] + r * value[1]).sum()
    }
}

/// Everything that the punches of one bed share.
pub(super) struct Operators {
    /// ½ ∫ [K(x − t) + K(x + t)] φ dt at the Gauss points of the elements.
    pub inside: ElementWeights,
    /// The same at the nodes.
    pub line: ElementWeights,
    /// ½ ∫ [Q(x + t) + Q(x − t)] φ dt at the nodes.
    pub sine: ElementWeights,
    /// From W to the downward displacement at the nodes.
    pub surface: ElementWeights,
    /// From V to u_r at the nodes.
    pub radial: ElementWeights,
    /// From φ to Z at the nodes.
    pub force: ElementWeights,
}

impl Operators {
    /// Tabulates the bed's kernels and integrates them.
    pub fn new(bed: &LayeredBed, grid: &RadialGrid) -> Self {
        let nodes = &grid.nodes_mm;
        let elements = RadialGrid::punch_node(PUNCHES - 1);
        let (normal, radial) = line_kernels(bed, grid.end_mm() + nodes[elements]);
        let gauss: Vec<f64> =
            (0..elements).flat_map(|e| GAUSS_4.map(|(x, _)| nodes[e] + x * (nodes[e + 1] - nodes[e]))).collect();
        let kernel = |kernel: &LineKernel, points: &[f64]| {
            ElementWeights::new(points.len(), elements, |point, e| {
                cosine_moments(kernel, points[point], nodes[e], nodes[e + 1])
            })
        };
        let abel = |elements: usize, inner: bool, transform: fn(f64, f64, f64, f64, f64) -> f64| {
            ElementWeights::new(nodes.len(), elements, |point, e| {
                let (r, x0, x1) = (nodes[point], nodes[e], nodes[e + 1]);
                if (inner && x0 >= r) || (!inner && x1 <= r) {
                    (0.0, 0.0)
                } else {
                    (transform(r, x0, x1, 1.0, 0.0), transform(r, x0, x1, 0.0, 1.0))
                }
            })
        };
        Self {
            inside: kernel(&normal, &gauss),
            line: kernel(&normal, nodes),
            sine: kernel(&radial, nodes),
            surface: abel(nodes.len() - 1, true, surface_from_line),
            radial: abel(nodes.len() - 1, true, radial_from_line),
            force: abel(elements, false, force_beyond),
        }
    }
}

/// ½ ∫ [g(x − t) + g(x + t)] times the linear functions that are 1 at `t0` and at `t1`: the kernel of cos(kx) cos(kt) for an even g,
/// of sin(kx) cos(kt) for an odd one.
fn cosine_moments(kernel: &LineKernel, x: f64, t0: f64, t1: f64) -> (f64, f64) {
    let minus = linear_moments(kernel, x, -1.0, t0, t1);
    let plus = linear_moments(kernel, x, 1.0, t0, t1);
    (0.5 * (minus.0 + plus.0), 0.5 * (minus.1 + plus.1))
}

/// ∫ g(x + σt) times the linear functions that are 1 at `t0` and at `t1`, over [t0, t1].
fn linear_moments(kernel: &LineKernel, x: f64, sigma: f64, t0: f64, t1: f64) -> (f64, f64) {
    let width = t1 - t0;
    let (s0, s1) = (x + sigma * t0, x + sigma * t1);
    let distance = if s0 * s1 <= 0.0 { 0.0 } else { s0.abs().min(s1.abs()) };
    if width <= SMOOTH_PART * kernel.smooth_mm.max(distance) {
        return GAUSS_4.iter().fold((0.0, 0.0), |(left, right), &(at, weight)| {
            let value = weight * width * kernel.value(x + sigma * (t0 + at * width));
            (left + (1.0 - at) * value, right + at * value)
        });
    }
    let (first0, second0) = kernel.integrals(s0);
    let (first1, second1) = kernel.integrals(s1);
    let total = sigma * (first1 - first0);
    let rising = sigma * first1 - (second1 - second0) / width;
    (total - rising, rising)
}
