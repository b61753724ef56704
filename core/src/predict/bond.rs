//! The retina's bond as it is simulated.

use crate::effects::adhesion::{Bond, STIFFNESS_KPA_PER_MM};
use crate::tissue::RetinalBond;

/// The bond of the tissue as it is simulated.
pub(crate) fn simulated_bond(bond: &RetinalBond) -> Bond {
    Bond {
        strength_kpa: bond.strength_kpa,
        fracture_energy_mn_per_mm: bond.fracture_energy_mn_per_mm,
        stiffness_kpa_per_mm: STIFFNESS_KPA_PER_MM,
    }
}
