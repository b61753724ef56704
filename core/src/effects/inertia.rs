//! `inertia`: mass of the tissue and drag of the vitreous on its surface, by backward Euler as an incremental potential.
//!
//! A step h from positions xₙ and velocities vₙ ends where ½ (x − x̃)ᵀ M (x − x̃)/h² plus all other energies is stationary, with x̃ = xₙ + h vₙ the place
//! to which nothing but inertia would lead, and v = (x − xₙ)/h (Martin et al., *ACM Trans. Graph.* 30, 2011, among many). M is the consistent
//! mass matrix at the elements' own quadrature points. Vitreous that resists the surface with the traction −c v adds ½ c/h |x − xₙ|² per rest area.
//!
//! Backward Euler and not BDF2, Newmark or generalised α: for a convex potential its total energy never rises, for any sequence of steps;
//! BDF2 loses stability where a step is more than 1 + √2 times the one before (Grigorieff 1983), and the energy-keeping schemes ring at contacts.
//! What it costs is damping: a vibration of angular frequency ω loses the factor (1 + ω²h²)^(−1/2) of its amplitude each step, while its
//! period is long by only (ωh)²/3. The tissue's slowest period is near a millisecond, so what a needle does is slow against it.
//!
//! Law: momentum changes only by forces; the kinetic energy that the scheme loses is ½ (v − vₙ)ᵀ M (v − vₙ) ≥ 0.
//! Limits: the needle has no mass (its guide moves it); drag is that of a surface that moves alone, without a flow of its own.

use crate::effect::{Effect, Local, Stencils, add_isotropic};
use crate::effects::contact::{ContactFaces, GROUP};
use crate::effects::solid::SolidGeometry;
use crate::mesh::element::{FACE_NODES, NODES, QUADRATURE};

/// Name of the effect.
pub const NAME: &str = "inertia";

/// Positions and velocities of every vertex at the last commit.
#[derive(Clone, Debug)]
pub struct Momentum {
    /// Positions (mm).
    positions: Vec<f64>,
    /// Velocities (mm/s).
    velocities: Vec<f64>,
}

impl Momentum {
    /// Nothing moves; the vertices are at `positions` (mm).
    pub fn at_rest(positions: Vec<f64>) -> Self {
        let velocities = vec![0.0; positions.len()];
        Momentum { positions, velocities }
    }

    /// Positions at the last commit (mm).
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Where every vertex would be after `step_s` (s) without a force (mm).
    pub fn coasting(&self, step_s: f64) -> Vec<f64> {
        self.positions.iter().zip(&self.velocities).map(|(x, v)| x + step_s * v).collect()
    }

    /// Remembers the end of a step of `step_s` (s) at `positions` (mm).
    pub fn commit(&mut self, positions: &[f64], step_s: f64) {
        for ((velocity, old), new) in self.velocities.iter_mut().zip(&self.positions).zip(positions) {
            *velocity = (new - old) / step_s;
        }
        self.positions.copy_from_slice(positions);
    }

    /// Kinetic energy (µJ).
    pub fn kinetic_energy_uj(&self, geometry: &SolidGeometry, stencils: &Stencils, density_kg_per_mm3: &[f64]) -> f64 {
        let still = vec![0.0; self.velocities.len()];
        let inertia = Inertia { geometry, stencils, density_kg_per_mm3, coasting: &still, step_s: 1.0 };
        let mut local = vec![0.0; 3 * stencils.group_size];
        (0..stencils.len())
            .map(|group| {
                stencils.gather(group, &self.velocities, &mut local);
                inertia.energy(&Local { current: &local, group, predicted: &[] })
            })
            .sum()
    }
}

/// Inertia of the elements during one step.
pub struct Inertia<'a> {
    /// Rest geometry of the elements.
    pub geometry: &'a SolidGeometry,
    /// The elements.
    pub stencils: &'a Stencils,
    /// Density of each element (kg/mm³).
    pub density_kg_per_mm3: &'a [f64],
    /// Where every vertex would be at the end of the step without a force ([`Momentum::coasting`]) (mm).
    pub coasting: &'a [f64],
    /// The step (s).
    pub step_s: f64,
}

impl Inertia<'_> {
    /// The element's vertices relative to where they would coast to.
    fn offset(&self, local: &Local) -> [f64; 3 * NODES] {
        let mut offset = [0.0; 3 * NODES];
        self.stencils.gather(local.group, self.coasting, &mut offset);
        for (offset, current) in offset.iter_mut().zip(local.current) {
            *offset = current - *offset;
        }
        offset
    }

    /// Calls `visit(shape function values, weight × density / h²)` for each quadrature point.
    fn for_each_point(&self, element: usize, mut visit: impl FnMut(&[f64; NODES], f64)) {
        let scale = self.density_kg_per_mm3[element] / (self.step_s * self.step_s);
        for (point, weight) in QUADRATURE.iter().zip(self.geometry.weights(element)) {
            visit(&point.shapes.map(|shape| shape.value), weight * scale);
        }
    }
}

fn interpolate(values: &[f64], component: &[f64]) -> f64 {
    values.iter().zip(component).map(|(value, x)| value * x).sum()
}

impl Effect for Inertia<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn energy(&self, local: &Local) -> f64 {
        let offset = self.offset(local);
        let mut energy = 0.0;
        self.for_each_point(local.group, |values, scale| {
            let squared: f64 = offset.chunks(NODES).map(|component| interpolate(values, component).powi(2)).sum();
            energy += 0.5 * scale * squared;
        });
        energy
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        let offset = self.offset(local);
        self.for_each_point(local.group, |values, scale| {
            for (component, out) in offset.chunks(NODES).zip(out.chunks_mut(NODES)) {
                let moved = scale * interpolate(values, component);
                for (out, value) in out.iter_mut().zip(values) {
                    *out += value * moved;
                }
            }
        });
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let mut mass = [[0.0; NODES]; NODES];
        self.for_each_point(local.group, |values, scale| {
            for (row, value) in mass.iter_mut().zip(values) {
                for (entry, other) in row.iter_mut().zip(values) {
                    *entry += scale * value * other;
                }
            }
        });
        add_isotropic(&mass, out);
    }
}

/// Drag of the vitreous on the inner surface during one step. The last vertex of each group, the needle, feels nothing.
pub struct VitreousDrag<'a> {
    /// The faces at rest.
    pub faces: &'a ContactFaces,
    /// The faces' vertices.
    pub stencils: &'a Stencils,
    /// Positions at the start of the step (mm).
    pub start: &'a [f64],
    /// Traction for velocity c (kPa·s/mm).
    pub drag_kpa_s_per_mm: f64,
    /// The step (s).
    pub step_s: f64,
}

impl VitreousDrag<'_> {
    fn moved(&self, local: &Local) -> [f64; 3 * GROUP] {
        let mut moved = [0.0; 3 * GROUP];
        self.stencils.gather(local.group, self.start, &mut moved);
        for (moved, current) in moved.iter_mut().zip(local.current) {
            *moved = current - *moved;
        }
        moved
    }

    /// Calls `visit(weights of the group's vertices, area × c / h)` for each quadrature point.
    fn for_each_point(&self, face: usize, mut visit: impl FnMut(&[f64; GROUP], f64)) {
        let mut weights = [0.0; GROUP];
        for (point, area) in self.faces.areas(face).iter().enumerate() {
            weights[..FACE_NODES].copy_from_slice(self.faces.values(point));
            visit(&weights, area * self.drag_kpa_s_per_mm / self.step_s);
        }
    }
}

impl Effect for VitreousDrag<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn energy(&self, local: &Local) -> f64 {
        let moved = self.moved(local);
        let mut energy = 0.0;
        self.for_each_point(local.group, |weights, scale| {
            let squared: f64 = moved.chunks(GROUP).map(|component| interpolate(weights, component).powi(2)).sum();
            energy += 0.5 * scale * squared;
        });
        energy
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        let moved = self.moved(local);
        self.for_each_point(local.group, |weights, scale| {
            for (component, out) in moved.chunks(GROUP).zip(out.chunks_mut(GROUP)) {
                let traction = scale * interpolate(weights, component);
                for (out, weight) in out.iter_mut().zip(weights) {
                    *out += weight * traction;
                }
            }
        });
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let mut drag = [[0.0; GROUP]; GROUP];
        self.for_each_point(local.group, |weights, scale| {
            for (row, weight) in drag.iter_mut().zip(weights) {
                for (entry, other) in row.iter_mut().zip(weights) {
                    *entry += scale * weight * other;
                }
            }
        });
        add_isotropic(&drag, out);
    }
}
