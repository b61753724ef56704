//! What the bond between retina and choroid remembers from step to step: how far it has been opened, and, where it holds more for the speed of opening, how
//! far it is open. What has let go never heals.

use crate::effect::Local;
use crate::effects::adhesion::rate::Opened;
use crate::effects::adhesion::{Adhesion, Bond, Interface};
use crate::equilibrium::Wall;
use crate::mesh::wall::WallTopology;
use crate::predict::bond::simulated_bond;
use crate::tissue::RetinalBond;

/// The bond of one mesh.
#[derive(Clone, Debug)]
pub(super) struct BondMemory {
    interface: Interface,
    bond: Bond,
    /// Largest effective opening of the past at every quadrature point, face by face (mm).
    largest_mm: Vec<f64>,
    /// Effective opening at every quadrature point at the last commit, face by face (mm).
    present_mm: Vec<f64>,
    /// Power of the speed, and its reference (mm/s).
    rate: (f64, f64),
}

impl BondMemory {
    /// A bond that has never been opened, on a mesh whose vertices are at `rest` (mm).
    pub fn intact(bond: &RetinalBond, topology: &WallTopology, rest: &[f64]) -> Self {
        let interface = Interface::new(&topology.interface, rest);
        let largest_mm = vec![0.0; interface.points() * topology.interface.len()];
        let rate = (bond.rate_exponent, bond.reference_speed_mm_per_s);
        BondMemory { interface, bond: simulated_bond(bond), present_mm: largest_mm.clone(), largest_mm, rate }
    }

    /// The effect of the next step, which takes `step_s` (s); infinite where nothing is fast.
    pub fn effect(&self, step_s: f64) -> Adhesion<'_> {
        let (exponent, reference_mm_per_s) = self.rate;
        let opened = Opened { exponent, reference_mm: reference_mm_per_s * step_s, start_mm: &self.present_mm };
        Adhesion {
            interface: &self.interface,
            bond: self.bond,
            largest_mm: &self.largest_mm,
            opened: (exponent > 0.0 && step_s.is_finite()).then_some(opened),
        }
    }

    /// Remembers the openings at these positions (mm).
    pub fn commit(&mut self, wall: &Wall, positions: &[f64]) {
        let stencils = &wall.topology().interface;
        let mut current = vec![0.0; 3 * stencils.group_size];
        let (mut largest_mm, mut present_mm) = (Vec::new(), Vec::new());
        let effect = self.effect(f64::INFINITY);
        for group in 0..stencils.len() {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            largest_mm.extend(effect.openings(&local));
            present_mm.extend(effect.present(&local));
        }
        (self.largest_mm, self.present_mm) = (largest_mm, present_mm);
    }

    /// Largest share of the strength that is lost for good anywhere: 0 intact, 1 parted.
    pub fn damage(&self) -> f64 {
        self.bond.damage(self.largest_mm.iter().copied().fold(0.0, f64::max))
    }
}
