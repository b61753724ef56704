//! What the bond between retina and choroid remembers from step to step: how far it has been opened, and, where it holds more for the speed of opening, how
//! far it is open. What has let go never heals.

use crate::effect::Local;
use crate::effects::adhesion::rate::Opened;
use crate::effects::adhesion::{Adhesion, Bond, Interface};
use crate::equilibrium::Wall;
use crate::mesh::wall::WallTopology;
use crate::predict::bond::simulated_bond;
use crate::predict::held::{UNBREAKABLE, parted_mm};
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
    /// Which faces are detached, with fluid between their sides; none of them counts as damage.
    detached: Vec<bool>,
}

impl BondMemory {
    /// A bond that has never been opened but on the faces that are `detached` (empty: nowhere), on a mesh whose vertices are at `rest` (mm); `None` in place of the bond is
    /// one that does not part.
    pub fn intact(bond: Option<&RetinalBond>, topology: &WallTopology, rest: &[f64], detached: &[bool]) -> Self {
        let interface = Interface::new(&topology.interface, rest);
        let rate = bond.map_or((0.0, 1.0), |bond| (bond.rate_exponent, bond.reference_speed_mm_per_s));
        let bond = bond.map_or(UNBREAKABLE, simulated_bond);
        let faces = topology.interface.len();
        let detached = if detached.is_empty() { vec![false; faces] } else { detached.to_vec() };
        let largest_mm = parted_mm(&bond, &detached, interface.points());
        BondMemory { present_mm: vec![0.0; largest_mm.len()], interface, bond, largest_mm, rate, detached }
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
        let faces = self.largest_mm.chunks_exact(self.interface.points()).zip(&self.detached);
        let bonded = faces.filter(|(_, detached)| !**detached).flat_map(|(largest_mm, _)| largest_mm);
        self.bond.damage(bonded.copied().fold(0.0, f64::max))
    }
}
