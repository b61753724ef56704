//! What the tissue of one mesh remembers from step to step, and the effects that it acts through.
//!
//! Before the first step the tissue has been at rest for ever under the pressure of its eye: its networks have relaxed there ([`History::settle`]), so a change
//! of the pressure since the surface was measured is no load that begins at 0 s, and nothing of it creeps.

use super::bond::BondMemory;
use super::rates::{Rates, networks};
use crate::effects::adhesion::Adhesion;
use crate::effects::inertia::{Inertia, Momentum, VitreousDrag};
use crate::effects::viscoelasticity::Networks;
use crate::equilibrium::grip::Grip;
use crate::equilibrium::{Addition, Wall};
use crate::mesh::wall::{Place, WallTopology};
use crate::predict::choice::Decision;
use crate::tissue::{LayerKind, Tissue};

/// The memory of every effect that is simulated.
#[derive(Clone, Debug)]
pub(super) struct History {
    networks: Option<Networks>,
    momentum: Option<Momentum>,
    density_kg_per_mm3: Vec<f64>,
    drag_kpa_s_per_mm: f64,
    bond: Option<BondMemory>,
    /// Where the needle holds the tissue by friction.
    pub grip: Grip,
}

impl History {
    /// Tissue that has been at rest for long, its retina detached on these faces of the interface.
    pub fn at_rest(
        rates: Rates,
        decision: &Decision,
        tissue: &Tissue,
        topology: &WallTopology,
        rest: &[f64],
        detached: &[bool],
    ) -> Self {
        let bond = decision.adhesion.then_some(&tissue.bond);
        let layers = tissue.layers();
        let shear = |&layer: &usize| match layers[layer].kind {
            LayerKind::Retina(_) => layers[layer].layer.shear_modulus_kpa(),
            _ => 0.0,
        };
        let shear_kpa = || topology.element_layer.iter().map(shear).collect();
        History {
            networks: rates.viscoelasticity.then(|| Networks::at_rest(shear_kpa(), networks(tissue))),
            momentum: rates.inertia.then(|| Momentum::at_rest(rest.to_vec())),
            density_kg_per_mm3: vec![tissue.rate.density_kg_per_mm3; topology.elements.len()],
            drag_kpa_s_per_mm: tissue.rate.vitreous_drag_kpa_s_per_mm,
            bond: decision.parts().then(|| BondMemory::intact(bond, topology, rest, detached)),
            grip: Grip::default(),
        }
    }

    /// Takes these positions (mm) for those at which the tissue has been at rest for ever.
    pub fn settle(&mut self, wall: &Wall, positions: &[f64]) {
        if let Some(networks) = &mut self.networks {
            networks.settle(&wall.geometry.solid, &wall.topology().elements, positions);
        }
        if let Some(momentum) = &mut self.momentum {
            *momentum = Momentum::at_rest(positions.to_vec());
        }
        if let Some(bond) = &mut self.bond {
            bond.commit(wall, positions);
        }
        self.grip = Grip::free(positions.to_vec());
    }

    /// Calls `visit` with the effects of a step of `step_s` (s), those of `others` first.
    pub fn with_additions<T>(
        &self,
        wall: &Wall,
        step_s: f64,
        others: &[Addition],
        visit: impl FnOnce(&[Addition]) -> T,
    ) -> T {
        let topology = wall.topology();
        let viscous = self.networks.as_ref().map(|networks| networks.step(&wall.geometry.solid, step_s));
        let coasting = self.momentum.as_ref().map(|momentum| momentum.coasting(step_s));
        let inertia = coasting.as_ref().map(|coasting| Inertia {
            geometry: &wall.geometry.solid,
            stencils: &topology.elements,
            density_kg_per_mm3: &self.density_kg_per_mm3,
            coasting,
            step_s,
        });
        let drag = self.momentum.as_ref().map(|momentum| VitreousDrag {
            faces: wall.faces(),
            stencils: &topology.faces,
            start: momentum.positions(),
            drag_kpa_s_per_mm: self.drag_kpa_s_per_mm,
            step_s,
        });
        let adhesion = self.bond(step_s);
        let mut additions = others.to_vec();
        additions.extend(viscous.as_ref().map(|effect| Addition { effect, place: Place::Elements }));
        additions.extend(inertia.as_ref().map(|effect| Addition { effect, place: Place::Elements }));
        additions.extend(drag.as_ref().map(|effect| Addition { effect, place: Place::Faces }));
        additions.extend(adhesion.as_ref().map(|effect| Addition { effect, place: Place::Interface }));
        visit(&additions)
    }

    /// Remembers the end of a step of `step_s` (s) at these positions (mm) with this grip of the needle.
    pub fn commit(&mut self, wall: &Wall, positions: &[f64], grip: Grip, step_s: f64) {
        if let Some(networks) = &mut self.networks {
            networks.commit(&wall.geometry.solid, &wall.topology().elements, positions, step_s);
        }
        if let Some(momentum) = &mut self.momentum {
            momentum.commit(positions, step_s);
        }
        if let Some(bond) = &mut self.bond {
            bond.commit(wall, positions);
        }
        self.grip = grip;
    }

    /// The bond during a step of `step_s` (s), if it can part.
    pub fn bond(&self, step_s: f64) -> Option<Adhesion<'_>> {
        self.bond.as_ref().map(|bond| bond.effect(step_s))
    }

    /// Largest damage of the bond, if it can part.
    pub fn damage(&self) -> Option<f64> {
        self.bond.as_ref().map(BondMemory::damage)
    }
}
