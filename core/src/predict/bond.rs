//! The retina's bond as it is simulated, and what an equilibrium leaves of it.

use crate::effect::Local;
use crate::effects::adhesion::{Adhesion, Bond, STIFFNESS_KPA_PER_MM};
use crate::mesh::wall::WallTopology;
use crate::tissue::RetinalBond;

/// The bond of the tissue as it is simulated.
pub(crate) fn simulated_bond(bond: &RetinalBond) -> Bond {
    Bond {
        strength_kpa: bond.strength_kpa,
        fracture_energy_mn_per_mm: bond.fracture_energy_mn_per_mm,
        stiffness_kpa_per_mm: STIFFNESS_KPA_PER_MM,
    }
}

/// The largest damage of the bond at `positions`.
pub(super) fn damage(adhesion: &Adhesion, topology: &WallTopology, positions: &[f64]) -> f64 {
    let mut current = vec![0.0; 3 * topology.interface.group_size];
    let mut largest: f64 = 0.0;
    for group in 0..topology.interface.len() {
        topology.interface.gather(group, positions, &mut current);
        let local = Local { current: &current, group, predicted: &[] };
        largest = adhesion.openings(&local).fold(largest, f64::max);
    }
    adhesion.bond.damage(largest)
}
