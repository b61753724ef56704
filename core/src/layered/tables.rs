//! Tables of one punch and of one stretch of contact growth, per unit force.
//!
//! A punch's part with the square root at its edge is that of a half-space with the punch's own edge pressure; what is left is smooth and
//! is what the tables hold where punches are to be blended. Units: mm, mN.

use std::f64::consts::FRAC_2_PI;

use super::abel::cut_root;
use super::grid::{RadialGrid, STRETCHES};
use super::punch::Punch;

/// One prepared punch, per unit force.
#[derive(Debug, Clone)]
pub(super) struct PunchTable {
    /// Radius, mm.
    pub radius: f64,
    /// Depth, mm/mN.
    pub depth: f64,
    /// Edge part of u_z, mm/mN.
    pub edge_normal: f64,
    /// Edge part of u_r, mm²/mN.
    pub edge_radial: f64,
    /// u_z without the edge part, at the nodes, mm/mN.
    pub smooth_nodes: Vec<f64>,
    /// u_z without the edge part, at the samples, mm/mN.
    pub smooth_normal: Vec<f64>,
    /// u_r without the edge part, at the samples, mm/mN.
    pub smooth_radial: Vec<f64>,
    /// Force on each ring between consecutive sample radii, mN/mN.
    pub ring_forces: Vec<f64>,
}

/// One stretch of contact growth as one load, per unit force.
#[derive(Debug, Clone)]
pub(super) struct StretchTable {
    /// Depth, mm/mN.
    pub depth: f64,
    /// By how much the gap at each node shrinks, mm/mN; zero up to the stretch's start.
    pub closing_nodes: Vec<f64>,
    /// By how much the gap at each sample shrinks, mm/mN.
    pub closing: Vec<f64>,
    /// u_z at the samples, mm/mN.
    pub normal: Vec<f64>,
    /// u_r at the samples, mm/mN.
    pub radial: Vec<f64>,
    /// Force on each ring between consecutive sample radii, mN/mN.
    pub ring_forces: Vec<f64>,
}

impl PunchTable {
    /// Splits and samples the solution.
    pub fn new(radius: f64, punch: &Punch, grid: &RadialGrid) -> Self {
        let nodes = grid.nodes_mm.iter();
        let smooth_nodes: Vec<f64> =
            nodes.zip(&punch.normal).map(|(&r, u)| u + punch.edge_normal * edge_shape_normal(radius, r)).collect();
        let samples = grid.samples_mm.iter();
        let smooth_radial = samples
            .zip(at_samples(&punch.radial))
            .map(|(&r, u)| u - punch.edge_radial * edge_shape_radial(radius, r))
            .collect();
        Self {
            radius,
            depth: punch.depth,
            edge_normal: punch.edge_normal,
            edge_radial: punch.edge_radial,
            smooth_normal: at_samples(&smooth_nodes),
            smooth_nodes,
            smooth_radial,
            ring_forces: ring_forces(&punch.force_beyond),
        }
    }
}

impl StretchTable {
    /// Adds up the stretch's punches by their parts of the force.
    pub fn new(punches: &[Punch], parts: &[(f64, f64)]) -> Self {
        let mix = |values: fn(&Punch) -> &[f64]| -> Vec<f64> {
            let mut sum = vec![0.0; values(&punches[0]).len()];
            for (punch, (_, part)) in punches.iter().zip(parts) {
                sum.iter_mut().zip(values(punch)).for_each(|(sum, value)| *sum += part * value);
            }
            sum
        };
        let depth: f64 = punches.iter().zip(parts).map(|(punch, (_, part))| part * punch.depth).sum();
        let normal = mix(|punch| &punch.normal);
        let closing_nodes: Vec<f64> = normal.iter().map(|u| (depth + u).max(0.0)).collect();
        Self {
            depth,
            closing: at_samples(&closing_nodes),
            closing_nodes,
            normal: at_samples(&normal),
            radial: at_samples(&mix(|punch| &punch.radial)),
            ring_forces: ring_forces(&mix(|punch| &punch.force_beyond)),
        }
    }
}

/// The values at all samples out of those at the grid's nodes.
fn at_samples(nodes: &[f64]) -> Vec<f64> {
    (0..=nodes.len() / 3).map(|sample| nodes[RadialGrid::sample_node(sample)]).collect()
}

/// Forces on the rings between the profile's samples from the forces beyond the nodes.
fn ring_forces(beyond: &[f64]) -> Vec<f64> {
    at_samples(beyond)[..=STRETCHES].windows(2).map(|pair| pair[0] - pair[1]).collect()
}

/// Shape (2/π) asin(min(1, a/r)) of u_z under a punch on a half-space.
pub(super) fn edge_shape_normal(a: f64, r: f64) -> f64 {
    if r <= a { 1.0 } else { FRAC_2_PI * (a / r).asin() }
}

/// Shape (a − √(a² − r²))/r of u_r under a punch on a half-space.
pub(super) fn edge_shape_radial(a: f64, r: f64) -> f64 {
    if r <= 0.0 { 0.0 } else { (a - cut_root(a, r)) / r }
}
