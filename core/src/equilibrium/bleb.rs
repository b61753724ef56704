//! A bleb on a wall: which faces are detached, where its retina is expected, and the pressure to begin with.
//!
//! Expected is a thin plate, clamped around a disc of radius a: under a pressure p it rises by w = p a⁴/(64 D) (1 − r²/a²)² and encloses V = π a⁶ p/(192 D), D its bending stiffness (Timoshenko &
//! Woinowsky-Krieger, *Theory of Plates and Shells*, §16). Over a soft bed the fluid also presses the choroid down, p t/M over all of the disc, t and M its thickness and oedometric modulus.
//! That is a start: what is found is the equilibrium of the layers as they are.
//! Not here: the energy (`effects::bleb`), what holds the retina outside of the bleb (`effects::adhesion`).

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::Wall;
use crate::effect::{Effect, Local, Multiplier};
use crate::effects::bleb::{Fluid, Holds};
use crate::tissue::{Layer, Tissue};

/// Fluid under the retina.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bleb {
    /// Patch parameters of its centre.
    pub center: [f64; 2],
    /// Radius of the detached disc (mm).
    pub radius_mm: f64,
    /// Volume (mm³): what is held, or what is expected under the pressure that is.
    pub volume_mm3: f64,
    /// Pressure above that in the eye (kPa): what is held, or what is expected of the volume that is.
    pub pressure_kpa: f64,
    /// Whether the volume is held, and not the pressure.
    pub keeps_volume: bool,
}

/// Relative error of the volume in what is answered, at most.
pub const VOLUME_TOLERANCE: f64 = 1e-4;

/// Area of a disc (mm²).
fn disc_mm2(radius_mm: f64) -> f64 {
    PI * radius_mm * radius_mm
}

/// Volume per pressure of a flat bleb of this radius (mm³/kPa).
pub fn compliance(tissue: &Tissue, radius_mm: f64) -> f64 {
    let thickness = tissue.retina_thickness_mm();
    let bending =
        |layer: &Layer| layer.youngs_modulus_kpa * layer.thickness_mm / (12.0 * (1.0 - layer.poisson_ratio.powi(2)));
    let bending: f64 = tissue.retina.iter().map(bending).sum::<f64>() * thickness * thickness;
    let choroid = &tissue.choroid;
    let oedometric = choroid.first_lame_kpa() + 2.0 * choroid.shear_modulus_kpa();
    PI * radius_mm.powi(6) / (192.0 * bending) + disc_mm2(radius_mm) * choroid.thickness_mm / oedometric
}

/// How far the middle of a flat bleb is expected to rise (mm): the plate's profile with all of the volume under it.
pub fn middle_mm(volume_mm3: f64, radius_mm: f64) -> f64 {
    3.0 * volume_mm3 / disc_mm2(radius_mm)
}

impl Bleb {
    /// How far the retina is expected to rise at these patch parameters (mm).
    pub fn expected_rise_mm(&self, [x, y]: [f64; 2]) -> f64 {
        let share = (x - self.center[0]).hypot(y - self.center[1]) / self.radius_mm;
        if share < 1.0 { middle_mm(self.volume_mm3, self.radius_mm) * (1.0 - share * share).powi(2) } else { 0.0 }
    }

    /// Whether there is none of it: the disc is detached, and rests on what is below.
    pub fn is_empty(&self) -> bool {
        self.volume_mm3 == 0.0
    }

    /// What is held of it, in words.
    pub fn held(&self) -> String {
        match self.keeps_volume {
            true => format!("{} mm³ under a disc of {} mm radius", self.volume_mm3, self.radius_mm),
            false => format!("{} kPa under a disc of {} mm radius", self.pressure_kpa, self.radius_mm),
        }
    }

    /// What is held of the fluid in an eye whose own pressure has changed by `eye_kpa` since its surface was measured: pressures on the tissue count from then. The pressure that keeps a
    /// volume is sought from `start_kpa` (above that in the eye) on.
    pub fn holds(&self, start_kpa: f64, eye_kpa: f64) -> Holds {
        let force_mn = self.pressure_kpa * disc_mm2(self.radius_mm);
        match self.keeps_volume {
            true => Holds::Volume(Multiplier::new(start_kpa + eye_kpa, self.volume_mm3, force_mn)),
            false => Holds::Pressure(self.pressure_kpa + eye_kpa),
        }
    }

    /// Energy (mN/mm) that the bond around the disc would release for each unit of area that let go, at least, at this pressure (kPa) and volume (mm³): the mean rise times the pressure. A plate that
    /// bends releases 3/2 of that, one that shears 1, a stretched membrane 5/4: for p ∝ Vⁿ/aᵐ the energy p V/(n + 1) falls with the area at m p V/(2 π a² (n + 1)), (m, n) being (6, 1), (4, 1) and (10, 3).
    pub fn released_mn_per_mm(&self, pressure_kpa: f64, volume_mm3: f64) -> f64 {
        pressure_kpa * volume_mm3 / disc_mm2(self.radius_mm)
    }
}

impl Wall<'_> {
    /// Which faces of the interface lie inside of the bleb.
    pub fn detached(&self, bleb: &Bleb) -> Vec<bool> {
        let stencils = &self.topology.interface;
        let away_mm = |&vertex: &u32| {
            let [x, y] = self.geometry.parameters[self.topology.vertices[vertex as usize].0];
            (x - bleb.center[0]).hypot(y - bleb.center[1])
        };
        // The mean of distances, and not the distance of the mean, which lies inside of a long arc.
        let inside = |group: usize| {
            let nodes = stencils.group(group);
            nodes.iter().map(away_mm).sum::<f64>() < bleb.radius_mm * nodes.len() as f64
        };
        (0..stencils.len()).map(inside).collect()
    }

    /// Lets the retina begin raised along its columns by what is expected of the bleb.
    pub fn raise(&mut self, bleb: &Bleb, inward: impl Fn([f64; 2]) -> Vector3<f64>) {
        let mut positions = self.settled.take().unwrap_or_else(|| self.geometry.rest.clone());
        let below = self.topology.levels_below_interface();
        for (vertex, &(point, level)) in self.topology.vertices.iter().enumerate() {
            let parameter = self.geometry.parameters[point];
            let rise = bleb.expected_rise_mm(parameter);
            if level >= below && rise > 0.0 && self.topology.dofs.index(vertex, 0).is_some() {
                let moved = inward(parameter) * -rise;
                (0..3).for_each(|k| positions[3 * vertex + k] += moved[k]);
            }
        }
        self.settled = Some(positions);
    }

    /// Volume of the fluid at `positions` (mm³).
    pub fn fluid_volume_mm3(&self, fluid: &Fluid, positions: &[f64]) -> f64 {
        let stencils = &self.topology.interface;
        let mut current = vec![0.0; 3 * stencils.group_size];
        let volume = |group: usize| {
            stencils.gather(group, positions, &mut current);
            fluid.held(&Local { current: &current, group, predicted: &[] })
        };
        (0..stencils.len()).map(volume).sum()
    }
}
