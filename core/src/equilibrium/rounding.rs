//! How well the balance of forces can be known.
//!
//! Positions are known to the rounding of their coordinates, and what that leaves of the tissue's forces is its stiffness times that: more, the thinner
//! and stiffer a layer is. A residual below cannot be asked for. How large it is depends on where the stiff layers lie and how they are curved, so it is
//! measured: by moving every coordinate of a balance by its own rounding.

use super::Wall;
use crate::assemble::{Scratch, gradient};
use crate::effect::Term;
use crate::solve::sparse::norm;

/// Rounding of the tissue's forces over stiffness (λ + 2µ) times squared width of the mesh: stretches are known to a few times 1e-16, and a stress
/// acts on a piece of the mesh.
const ROUNDING: f64 = 1e-15;
/// What an iteration leaves over what is measured: its sums round on top.
const MORE_THAN_MEASURED: f64 = 2.0;
/// Largest share of the force that may be left out of balance for rounding's sake.
const LARGEST_SHARE: f64 = 1e-3;
/// An odd multiplier, whose products' first bits are as good as drawn (Knuth's, from the golden ratio).
const SCATTER: usize = 0x9e37_79b9_7f4a_7c15;

impl Wall<'_> {
    /// The least force that the tissue's stiffness lets be balanced to all digits of a residual (mN): forces below count as this one.
    pub(super) fn rounding_mn(&self) -> f64 {
        let stiffest_kpa = self.materials.iter().map(|lame| lame.lambda + 2.0 * lame.mu).fold(0.0, f64::max);
        ROUNDING * stiffest_kpa * self.rim_mm * self.rim_mm
    }

    /// Upper bound of what rounding leaves of the tissue's forces, but no more than may be lost of `force_mn` (mN).
    pub(super) fn lost_at_most_mn(&self, force_mn: f64) -> f64 {
        (ROUNDING * self.stiffest_kpa_per_mm * self.rim_mm.powi(3)).min(LARGEST_SHARE * force_mn)
    }

    /// What rounding leaves of the forces of `terms` at `positions` (mN).
    pub(super) fn lost_mn(&self, terms: &[Term], positions: &[f64]) -> f64 {
        let dofs = &self.topology.dofs;
        let forces_at = |positions: &[f64]| {
            let mut forces = vec![0.0; dofs.free + 3];
            gradient(terms, positions, dofs, &mut Scratch::default(), &mut forces);
            forces
        };
        let rounded = |(at, coordinate): (usize, &f64)| {
            let up = at.wrapping_mul(SCATTER).leading_zeros() == 0;
            coordinate * if up { 1.0 + f64::EPSILON } else { 1.0 - f64::EPSILON }
        };
        let moved = forces_at(&positions.iter().enumerate().map(rounded).collect::<Vec<f64>>());
        let lost: Vec<f64> = forces_at(positions).iter().zip(moved).map(|(still, moved)| moved - still).collect();
        MORE_THAN_MEASURED * norm(&lost)
    }
}
