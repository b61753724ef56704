//! A bed made ready for queries: the tables of the punches and of the stretches, and punches of radii between the prepared ones.
//!
//! Everything that depends on a punch's radius a is split into a part with the square root at its edge, in closed form
//! (that of a half-space with the punch's own edge pressure), and a smooth rest; a·(edge part) and the rest are interpolated
//! linearly in ln a between prepared punches. Below the first prepared radius both are constant, as the bed there is the top layer
//! plus a uniform sinking. Units: mm, mN, kPa.

use super::bed::LayeredBed;
use super::error::LayeredError;
use super::grid::{RadialGrid, STRETCHES, stretch_punches};
use super::punch::solve_punches;
use super::tables::{PunchTable, StretchTable, edge_shape_normal};

/// A layered bed prepared for contact queries.
#[derive(Debug, Clone)]
pub struct LinearBed {
    pub(super) grid: RadialGrid,
    pub(super) punches: Vec<PunchTable>,
    pub(super) stretches: Vec<StretchTable>,
}

/// A punch of any radius as a blend of prepared punch `lower` and the next, per unit force.
#[derive(Debug, Clone, Copy)]
pub(super) struct PunchBlend {
    /// Radius, mm.
    pub radius: f64,
    /// Index of the lower prepared punch.
    pub lower: usize,
    /// Weight of the upper one, 0..=1.
    pub weight: f64,
    /// Edge part of u_z, mm/mN.
    pub edge_normal: f64,
    /// Edge part of u_r, mm²/mN.
    pub edge_radial: f64,
    /// Depth, mm/mN.
    pub depth: f64,
}

impl PunchBlend {
    /// The prepared punches blended and their weights.
    pub fn weights(&self) -> [(usize, f64); 2] {
        [(self.lower, 1.0 - self.weight), (self.lower + 1, self.weight)]
    }
}

impl LinearBed {
    /// Solves the prepared punches of `bed`.
    ///
    /// # Errors
    /// Invalid layers or base, by index, field and value; [`LayeredError::NotPositiveDefinite`] beyond double precision.
    pub fn prepare(bed: &LayeredBed) -> Result<Self, LayeredError> {
        bed.validate()?;
        let grid = RadialGrid::standard();
        let punches = solve_punches(bed, &grid)?;
        let stretches = (0..STRETCHES)
            .map(|index| {
                let parts = stretch_punches(grid.samples_mm[index], grid.samples_mm[index + 1]);
                StretchTable::new(&punches[RadialGrid::punches_of(index)], &parts)
            })
            .collect();
        let punches = punches
            .into_iter()
            .enumerate()
            .map(|(index, punch)| PunchTable::new(grid.punch_radius_mm(index), &punch, &grid))
            .collect();
        Ok(Self { grid, punches, stretches })
    }

    /// Radii at which a tool's profile is sampled, mm, ascending from 0.
    pub fn sample_radii_mm(&self) -> &[f64] {
        &self.grid.samples_mm[..=STRETCHES]
    }

    /// Depth of each stretch of contact growth taken as a load, mm/mN; stretch i runs from sample radius i to i + 1.
    pub fn stretch_depths_mm_per_mn(&self) -> Vec<f64> {
        self.stretches.iter().map(|stretch| stretch.depth).collect()
    }

    /// Force of stretch `stretch` on each ring between consecutive sample radii, mN/mN.
    pub fn stretch_ring_forces(&self, stretch: usize) -> &[f64] {
        &self.stretches[stretch].ring_forces
    }

    /// The punch of radius `radius_mm` > 0.
    pub(super) fn blend(&self, radius_mm: f64) -> PunchBlend {
        let after = self.punches.partition_point(|table| table.radius <= radius_mm);
        let (lower, weight) = if after == 0 {
            (0, 0.0)
        } else if after == self.punches.len() {
            (after - 2, 1.0)
        } else {
            let (low, high) = (self.punches[after - 1].radius, self.punches[after].radius);
            (after - 1, (radius_mm / low).ln() / (high / low).ln())
        };
        let mix = |value: &dyn Fn(&PunchTable) -> f64| {
            (1.0 - weight) * value(&self.punches[lower]) + weight * value(&self.punches[lower + 1])
        };
        let edge_normal = mix(&|table| table.radius * table.edge_normal) / radius_mm;
        let edge_radial = mix(&|table| table.radius * table.edge_radial) / radius_mm;
        let depth = edge_normal + mix(&|table| table.depth - table.edge_normal);
        PunchBlend { radius: radius_mm, lower, weight, edge_normal, edge_radial, depth }
    }

    /// By how much 1 mN on the punch shrinks the gap at `r_mm`, mm/mN, at least zero.
    pub(super) fn closing_at(&self, punch: &PunchBlend, r_mm: f64) -> f64 {
        let at = self.grid.node_interval(r_mm);
        let (r0, r1) = (self.grid.nodes_mm[at], self.grid.nodes_mm[at + 1]);
        let fraction = (r_mm - r0) / (r1 - r0);
        let smooth =
            |table: &PunchTable| (1.0 - fraction) * table.smooth_nodes[at] + fraction * table.smooth_nodes[at + 1];
        let smooth = (1.0 - punch.weight) * smooth(&self.punches[punch.lower])
            + punch.weight * smooth(&self.punches[punch.lower + 1]);
        (punch.depth + smooth - punch.edge_normal * edge_shape_normal(punch.radius, r_mm)).max(0.0)
    }
}
