//! How finely the finite-element levels compute: their meshes and the numerical parameters of their contact.

use crate::equilibrium::ContactSettings;
use crate::mesh::wall::WallDivision;
use crate::tissue::{LayerKind, Tissue};

/// How finely a level computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Cells along each edge of the mesh's core.
    pub core_cells: usize,
    /// Rings around it.
    pub rings: usize,
    /// Elements through the retina (shared among its sublayers, at least one each).
    pub retina_elements: usize,
    /// Elements through the choroid.
    pub choroid_elements: usize,
    /// Elements through the sclera; 0 leaves it out as rigid.
    pub sclera_elements: usize,
    /// Radius of the mesh's core in estimated contact radii.
    pub core_per_contact: f64,
    /// Distance from the contact's edge to the fixed rim (mm).
    pub rim_mm: f64,
    /// How the rings widen outwards: the logarithm of ring i's radius grows as the share of rings within it to this power. 1: all by one ratio; above: fine
    /// rings at the contact's edge, wide ones at the rim.
    pub ring_grading: f64,
    /// The contact's numerical parameters.
    pub contact: ContactSettings,
}

/// Residual relative to the force scale at which Newton's method stops at both levels: far below what a mesh can feel, and the chord steps that reach it
/// cost little.
const TOLERANCE: f64 = 1e-7;

/// Level `coarse`.
pub const COARSE: Resolution = Resolution {
    core_cells: 1,
    rings: 4,
    retina_elements: 1,
    choroid_elements: 1,
    sclera_elements: 0,
    core_per_contact: 0.8,
    rim_mm: 1.5,
    ring_grading: 1.0,
    contact: ContactSettings {
        stiffness_kpa_per_mm: 4e4,
        smoothing_mm: 2e-3,
        points_per_edge: 5,
        softening: 1.0,
        tolerance: TOLERANCE,
    },
};

/// Level `reference`.
pub const REFERENCE: Resolution = Resolution {
    core_cells: 3,
    rings: 8,
    retina_elements: 3,
    choroid_elements: 1,
    sclera_elements: 1,
    core_per_contact: 1.0,
    rim_mm: 2.0,
    ring_grading: 1.25,
    contact: ContactSettings {
        stiffness_kpa_per_mm: 3e5,
        smoothing_mm: 2e-4,
        points_per_edge: 4,
        softening: 10.0,
        tolerance: TOLERANCE,
    },
};

impl Resolution {
    /// Every edge of the mesh divided `factor` times as finely.
    pub fn refined(&self, factor: f64) -> Resolution {
        let finer = |count: usize| (count as f64 * factor).round() as usize;
        Resolution {
            core_cells: finer(self.core_cells),
            rings: finer(self.rings),
            retina_elements: finer(self.retina_elements),
            choroid_elements: finer(self.choroid_elements),
            sclera_elements: finer(self.sclera_elements),
            ..*self
        }
    }

    /// As fine as a detached disc needs: half as many rings again, for half of them end at its edge and the others begin there.
    pub fn over_fluid(&self) -> Resolution {
        Resolution { rings: self.rings + self.rings / 2, ..*self }
    }

    /// The mesh division for `tissue`; with an interface under the retina if it is `parting`.
    pub fn division(&self, tissue: &Tissue, parting: bool) -> WallDivision {
        let sublayers = tissue.retina.len();
        let elements_per_layer = tissue
            .layers()
            .iter()
            .map(|named| match named.kind {
                LayerKind::InnerLimitingMembrane => 1,
                LayerKind::Retina(_) => self.retina_elements.div_ceil(sublayers),
                LayerKind::Choroid => self.choroid_elements,
                LayerKind::Sclera => self.sclera_elements,
            })
            .collect();
        let above = tissue.layers().iter().take_while(|named| named.kind < LayerKind::Choroid).count();
        WallDivision {
            core_cells: self.core_cells,
            rings: self.rings,
            elements_per_layer,
            layers_above_interface: parting.then_some(above),
        }
    }
}
