//! What holds the retina on the choroid, and the fluid between them: the pieces of a solve that has an interface.

use super::bond::simulated_bond;
use super::finite_element::Problem;
use super::types::BlebReport;
use crate::effect::Local;
use crate::effects::adhesion::{Adhesion, Bond, Interface, STIFFNESS_KPA_PER_MM};
use crate::effects::bleb::Fluid;
use crate::equilibrium::Wall;

/// Strength of a bond that is not simulated to part (kPa): the retina holds outside of a bleb.
const UNBREAKABLE_KPA: f64 = 1e6;
/// Such a bond; its energy is twice what it takes to open it to its strength, so that the law stays a law.
pub(crate) const UNBREAKABLE: Bond = Bond {
    strength_kpa: UNBREAKABLE_KPA,
    fracture_energy_mn_per_mm: UNBREAKABLE_KPA * UNBREAKABLE_KPA / STIFFNESS_KPA_PER_MM,
    stiffness_kpa_per_mm: STIFFNESS_KPA_PER_MM,
};

/// Largest openings of the past of a bond that is whole but on the faces that are `detached`, for each of their `points`: beyond parting there (mm).
pub(crate) fn parted_mm(bond: &Bond, detached: &[bool], points: usize) -> Vec<f64> {
    let largest = |&apart: &bool| std::iter::repeat_n(if apart { 2.0 * bond.parted_mm() } else { 0.0 }, points);
    detached.iter().flat_map(largest).collect()
}

/// The interface of one solve.
pub(crate) struct Held {
    interface: Interface,
    bond: Bond,
    /// Largest openings of the past: none, or beyond parting inside of a bleb (mm).
    largest_mm: Vec<f64>,
    /// Whether each face is inside of the bleb.
    detached: Vec<bool>,
}

impl Held {
    /// What holds the retina of `problem` on `wall`; `None` where it cannot part.
    pub fn new(problem: &Problem, wall: &Wall) -> Option<Self> {
        if problem.bond.is_none() && problem.bleb.is_none() {
            return None;
        }
        let stencils = &wall.topology().interface;
        let interface = Interface::new(stencils, &wall.geometry.rest);
        let bond = problem.bond.as_ref().map_or(UNBREAKABLE, simulated_bond);
        let detached = match &problem.bleb {
            Some(bleb) => wall.detached(bleb),
            None => vec![false; stencils.len()],
        };
        let largest_mm = parted_mm(&bond, &detached, interface.points());
        Some(Held { interface, bond, largest_mm, detached })
    }

    /// The bond.
    pub fn adhesion(&self) -> Adhesion<'_> {
        Adhesion { interface: &self.interface, bond: self.bond, largest_mm: &self.largest_mm, opened: None }
    }

    /// The fluid of `problem`, if it has any.
    pub fn fluid(&self, problem: &Problem) -> Option<Fluid<'_>> {
        problem.fluid(&self.detached, None)
    }

    /// The largest damage of the bond at `positions`, outside of a bleb.
    pub fn damage(&self, wall: &Wall, positions: &[f64]) -> f64 {
        let stencils = &wall.topology().interface;
        let (adhesion, mut current) = (self.adhesion(), vec![0.0; 3 * stencils.group_size]);
        let mut largest: f64 = 0.0;
        for group in (0..stencils.len()).filter(|&group| !self.detached[group]) {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            largest = adhesion.openings(&local).fold(largest, f64::max);
        }
        self.bond.damage(largest)
    }
}

impl Problem<'_> {
    /// Its fluid, on these faces of the interface, after a step that left it at the pressure `before_kpa` above that in the eye; `None` where there is none of it.
    pub(crate) fn fluid<'a>(&self, detached: &'a [bool], before_kpa: Option<f64>) -> Option<Fluid<'a>> {
        let bleb = self.bleb.filter(|bleb| !bleb.is_empty())?;
        let start_kpa = before_kpa.unwrap_or(bleb.pressure_kpa);
        Some(Fluid { detached, holds: bleb.holds(start_kpa, self.pressure_kpa.unwrap_or_default()) })
    }

    /// What the answer tells of the fluid at `positions`: its pressure counts from that in the eye.
    pub(crate) fn told_of(&self, fluid: &Fluid, wall: &Wall, positions: &[f64]) -> BlebReport {
        BlebReport {
            pressure_kpa: fluid.pressure_kpa() - self.pressure_kpa.unwrap_or_default(),
            volume_mm3: wall.fluid_volume_mm3(fluid, positions),
        }
    }
}
