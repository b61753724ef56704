//! What the bond between retina and choroid remembers from step to step: how far it has been opened. What has let go never heals.

use crate::effect::Local;
use crate::effects::adhesion::{Adhesion, Bond, Interface};
use crate::equilibrium::Wall;
use crate::mesh::wall::WallTopology;

/// The bond of one mesh.
#[derive(Clone, Debug)]
pub(super) struct BondMemory {
    interface: Interface,
    bond: Bond,
    /// Largest effective opening of the past at every quadrature point, face by face (mm).
    largest_mm: Vec<f64>,
}

impl BondMemory {
    /// A bond that has never been opened, on a mesh whose vertices are at `rest` (mm).
    pub fn intact(bond: Bond, topology: &WallTopology, rest: &[f64]) -> Self {
        let interface = Interface::new(&topology.interface, rest);
        let largest_mm = vec![0.0; interface.points() * topology.interface.len()];
        BondMemory { interface, bond, largest_mm }
    }

    /// The effect of the next step.
    pub fn effect(&self) -> Adhesion<'_> {
        Adhesion { interface: &self.interface, bond: self.bond, largest_mm: &self.largest_mm }
    }

    /// Remembers the openings at these positions (mm).
    pub fn commit(&mut self, wall: &Wall, positions: &[f64]) {
        let stencils = &wall.topology().interface;
        let mut current = vec![0.0; 3 * stencils.group_size];
        let mut largest_mm = Vec::with_capacity(self.largest_mm.len());
        for group in 0..stencils.len() {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            largest_mm.extend(self.effect().openings(&local));
        }
        self.largest_mm = largest_mm;
    }

    /// Largest share of the strength that is lost for good anywhere: 0 intact, 1 parted.
    pub fn damage(&self) -> f64 {
        self.bond.damage(self.largest_mm.iter().copied().fold(0.0, f64::max))
    }
}
