//! The fixed radial grid: sample radii of the tool's profile, punch radii between them, and the surface beyond.
//!
//! The samples t are geometric, as contacts from a few µm to a mm must be equally well resolved. Growth of the contact from one sample
//! to the next is a *stretch*; two flat punches stand for it (one for the first stretch, which starts at a point). The nodes are
//! the axis, and then for each stretch its punches and its end; the same pattern runs on to the end of the response tables. Summed up,
//! the surface is tabulated at the samples only, where it is exact in the contact: between them it has the ripple of the punches.
//! Units: mm.

use std::f64::consts::FRAC_1_SQRT_2;

/// Number of stretches, hence of load functions.
pub const STRETCHES: usize = 64;
/// Number of flat punches.
pub const PUNCHES: usize = 2 * STRETCHES - 1;
/// Smallest sampled contact radius off the axis, mm: below what any needle tip or optical coherence tomogram resolves.
pub const FIRST_SAMPLE_MM: f64 = 0.002;
/// Largest contact radius, mm: more than twice that of a 20G shaft.
pub const LAST_SAMPLE_MM: f64 = 1.2;
/// The response tables reach at least to this radius, mm; beyond, see [`super::response`].
pub const RESPONSE_END_MM: f64 = 4.0;
/// Punch of the first stretch over its end. For a paraboloid on a half-space, contact at t under one punch a gives the exact
/// ratio of depth to profile height, 2, when acos(a/t) = π/4.
const POINT_FRACTION: f64 = FRAC_1_SQRT_2;
/// The two punches of a stretch stand at its middle ± this part of its length. A gap at t closes like √(t − a); sums over punches in
/// place of integrals over contact radii then err by ζ(−1/2, ½ − x) + ζ(−1/2, ½ + x) in the order (step)^1.5, which vanishes at this x
/// (Hurwitz zeta; the generalised Euler–Maclaurin formula of Navot 1961). What is left is of second order.
const PAIR_OFFSET: f64 = 0.305_972;

/// The radial nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct RadialGrid {
    /// All nodes, ascending from 0, mm.
    pub nodes_mm: Vec<f64>,
    /// The samples among the nodes, on to the end of the grid, mm.
    pub samples_mm: Vec<f64>,
    log_ratio: f64,
}

impl RadialGrid {
    /// The grid that every bed uses.
    pub fn standard() -> Self {
        let log_ratio = (LAST_SAMPLE_MM / FIRST_SAMPLE_MM).ln() / (STRETCHES as f64 - 1.0);
        let mut nodes_mm = vec![0.0, POINT_FRACTION * FIRST_SAMPLE_MM, FIRST_SAMPLE_MM];
        let (mut low, mut step) = (FIRST_SAMPLE_MM, 1.0);
        while low < RESPONSE_END_MM {
            let high = FIRST_SAMPLE_MM * f64::exp(log_ratio * step);
            nodes_mm.extend(stretch_punches(low, high).iter().map(|&(radius, _)| radius));
            nodes_mm.push(high);
            (low, step) = (high, step + 1.0);
        }
        let samples_mm = (0..=nodes_mm.len() / 3).map(|sample| nodes_mm[Self::sample_node(sample)]).collect();
        Self { nodes_mm, samples_mm, log_ratio }
    }

    /// Node of punch `punch`.
    pub fn punch_node(punch: usize) -> usize {
        if punch == 0 { 1 } else { 3 + 3 * ((punch - 1) / 2) + (punch - 1) % 2 }
    }

    /// Node of profile sample `sample`; sample 0 is the axis, stretch i runs from sample i to i + 1.
    pub fn sample_node(sample: usize) -> usize {
        if sample == 0 { 0 } else { 3 * sample - 1 }
    }

    /// Indices of the punches of stretch `stretch`.
    pub fn punches_of(stretch: usize) -> std::ops::Range<usize> {
        if stretch == 0 { 0..1 } else { 2 * stretch - 1..2 * stretch + 1 }
    }

    /// Radius of punch `punch`, mm.
    pub fn punch_radius_mm(&self, punch: usize) -> f64 {
        self.nodes_mm[Self::punch_node(punch)]
    }

    /// Last radius of the grid, mm.
    pub fn end_mm(&self) -> f64 {
        self.nodes_mm[self.nodes_mm.len() - 1]
    }

    /// Index i of the interval `samples[i] ≤ r ≤ samples[i + 1]` that holds `r_mm`, which must lie within the grid.
    pub fn sample_interval(&self, r_mm: f64) -> usize {
        let samples = &self.samples_mm;
        if r_mm < samples[1] {
            return 0;
        }
        let index = (1 + ((r_mm / samples[1]).ln() / self.log_ratio) as usize).min(samples.len() - 2);
        // The logarithm may round across a sample.
        if r_mm < samples[index] {
            index - 1
        } else if r_mm > samples[index + 1] {
            index + 1
        } else {
            index
        }
    }

    /// Index i of the interval `nodes[i] ≤ r ≤ nodes[i + 1]` that holds `r_mm`, which must lie within the grid.
    pub fn node_interval(&self, r_mm: f64) -> usize {
        let mut index = Self::sample_node(self.sample_interval(r_mm));
        while index + 2 < self.nodes_mm.len() && r_mm >= self.nodes_mm[index + 1] {
            index += 1;
        }
        index
    }
}

/// Radii (mm) and parts of the force (sum 1) of the punches that stand for growth from contact radius `start` to `end`. Force grows
/// about as a² da: exactly so for a paraboloid on a half-space.
pub fn stretch_punches(start: f64, end: f64) -> [(f64, f64); 2] {
    if start <= 0.0 {
        return [(POINT_FRACTION * end, 1.0), (POINT_FRACTION * end, 0.0)];
    }
    let [low, high] = [0.5 - PAIR_OFFSET, 0.5 + PAIR_OFFSET].map(|part| start + part * (end - start));
    let sum = low * low + high * high;
    [(low, low * low / sum), (high, high * high / sum)]
}
