//! `adhesion`: the bond between retina and pigment epithelium, which holds up to a strength and then lets go at the price of its fracture energy.
//!
//! Two faces that coincide at rest, the choroid's below and the retina's above, with the opening δ = x⁺ − x⁻ and the rest normal n out of the
//! choroid. The effective opening is λ = |⟨δₙ⟩ n + δ_t|, ⟨·⟩ the positive part: tearing off and shearing off cost the same. Bilinear law (Camanho, Dávila & de Moura,
//! *J. Compos. Mater.* 2003; Geubelle & Baylor 1998): traction K λ up to the strength σ at δ₀ = σ/K, then falling along a line to zero at δ_f = 2 G/σ, so that letting
//! go costs the fracture energy G. Damage is irreversible: with κ the largest effective opening of the past, the bond answers openings below κ along the line
//! from the origin to its present strength. For given κ the traction has the potential ψ(λ; κ), which is what is minimised over one step;
//! [`Adhesion::openings`] is the κ of the next.
//! Closing (δₙ < 0) meets the stiffness K whatever the damage: torn-off tissue rests on the choroid.
//!
//! K stands for nothing in the tissue; it is only so large that intact tissue does not feel it: [`STIFFNESS_KPA_PER_MM`] yields 0.3 µm under 30 kPa, the largest
//! pressure of a needle short of puncture, and leaves δ₀ far below δ_f. The normal does not turn with the surface: openings are small against the radius of whatever bends it.
//!
//! A bond may hold more the faster it is opened: [`rate`].
//!
//! Law: forces on the two faces are equal and opposite; a closed cycle of openings never gives energy back beyond what it took.
//! Not here: which vertices the faces have (`mesh::wall`), fluid between them.

pub mod rate;

use nalgebra::{Matrix3, Vector3};

use super::contact::ContactFaces;
use crate::effect::{Effect, Local, Stencils};
use crate::mesh::element::{FACE_NODES, face_shapes, gauss_rule};
use rate::Opened;

/// Name of the effect.
pub const NAME: &str = "adhesion";

/// Stiffness of the intact bond, and of one that is closed (kPa/mm).
pub const STIFFNESS_KPA_PER_MM: f64 = 1e5;

/// Vertices of a group: the lower face's, then the upper one's in the same order.
pub const GROUP: usize = 2 * FACE_NODES;

/// Gauss points along each edge of a face.
const POINTS_PER_EDGE: usize = 3;

/// How strong the bond is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bond {
    /// Largest traction (kPa).
    pub strength_kpa: f64,
    /// Fracture energy (mN/mm, the same number as N/m and J/m²).
    pub fracture_energy_mn_per_mm: f64,
    /// Stiffness while it is intact (kPa/mm).
    pub stiffness_kpa_per_mm: f64,
}

impl Bond {
    /// Opening at the strength (mm).
    pub fn onset_mm(&self) -> f64 {
        self.strength_kpa / self.stiffness_kpa_per_mm
    }

    /// Opening from which on nothing holds (mm).
    pub fn parted_mm(&self) -> f64 {
        2.0 * self.fracture_energy_mn_per_mm / self.strength_kpa
    }

    /// Traction after the onset (kPa) at the opening `o` (mm).
    fn softening(&self, o: f64) -> f64 {
        let (onset, parted) = (self.onset_mm(), self.parted_mm());
        self.strength_kpa * ((parted - o) / (parted - onset)).max(0.0)
    }

    /// ψ, ψ′ and ψ″ (µJ/mm², kPa, kPa/mm) at the effective opening `o` after the largest opening `largest` (mm).
    pub fn potential(&self, o: f64, largest: f64) -> (f64, f64, f64) {
        let (onset, parted) = (self.onset_mm(), self.parted_mm());
        let turn = largest.max(onset);
        let held = self.softening(turn);
        if o <= turn {
            return (0.5 * held / turn * o * o, held / turn * o, held / turn);
        }
        let traction = self.softening(o);
        // The area under the falling line between two openings.
        let fallen = 0.5 * (held + traction) * (o.min(parted) - turn.min(parted));
        let slope = if o < parted { -self.strength_kpa / (parted - onset) } else { 0.0 };
        (0.5 * held * turn + fallen, traction, slope)
    }

    /// Share of the strength that is lost for good after the largest opening `largest` (mm): 0 intact, 1 parted.
    pub fn damage(&self, largest: f64) -> f64 {
        if largest <= self.onset_mm() { 0.0 } else { 1.0 - self.softening(largest) / self.strength_kpa }
    }
}

/// The interface at rest.
#[derive(Clone, Debug)]
pub struct Interface {
    faces: ContactFaces,
    /// Unit normal out of the lower face at each quadrature point.
    normals: Vec<Vector3<f64>>,
}

impl Interface {
    /// The interface whose faces are the groups of `stencils`, at the rest positions `rest`.
    pub fn new(stencils: &Stencils, rest: &[f64]) -> Self {
        let rule = gauss_rule(POINTS_PER_EDGE);
        let slopes: Vec<_> = rule
            .iter()
            .flat_map(|&(eta, _)| rule.iter().map(move |&(xi, _)| face_shapes([xi, eta])))
            .map(|shapes| shapes.map(|shape| shape.gradient))
            .collect();
        let mut normals = Vec::with_capacity(stencils.len() * slopes.len());
        for face in 0..stencils.len() {
            let node = |a: usize| Vector3::from_row_slice(&rest[3 * stencils.group(face)[a] as usize..][..3]);
            for gradients in &slopes {
                let tangent = |k: usize| -> Vector3<f64> {
                    gradients.iter().enumerate().map(|(a, gradient)| node(a) * gradient[k]).sum()
                };
                normals.push(tangent(0).cross(&tangent(1)).normalize());
            }
        }
        Interface { faces: ContactFaces::new(stencils, rest, POINTS_PER_EDGE), normals }
    }

    /// Quadrature points of a face.
    pub fn points(&self) -> usize {
        self.faces.points
    }

    /// Rest area of the quadrature points of one face (mm²).
    pub fn areas(&self, face: usize) -> &[f64] {
        self.faces.areas(face)
    }
}

/// The effect on an interface.
pub struct Adhesion<'a> {
    /// The interface at rest.
    pub interface: &'a Interface,
    /// The bond.
    pub bond: Bond,
    /// Largest effective opening of the past at every quadrature point, face by face (mm).
    pub largest_mm: &'a [f64],
    /// How fast it is opened, where it holds more for that.
    pub opened: Option<Opened<'a>>,
}

/// The opening at one point, split.
struct Opening {
    /// Along the normal (mm).
    normal: f64,
    /// ⟨δₙ⟩ n + δ_t (mm).
    parting: Vector3<f64>,
}

impl Adhesion<'_> {
    fn opening(&self, local: &Local, point: usize) -> Opening {
        let row = |k: usize| &local.current[k * GROUP..(k + 1) * GROUP];
        let values = self.interface.faces.values(point);
        let apart = Vector3::from_fn(|k, _| {
            let (below, above) = row(k).split_at(FACE_NODES);
            values.iter().zip(above.iter().zip(below)).map(|(n, (above, below))| n * (above - below)).sum()
        });
        let n = self.interface.normals[self.at(local, point)];
        let normal = n.dot(&apart);
        Opening { normal, parting: if normal > 0.0 { apart } else { apart - n * normal } }
    }

    fn at(&self, local: &Local, point: usize) -> usize {
        local.group * self.interface.points() + point
    }

    /// ψ, ψ′ and ψ″ of one point at the effective opening `o` (mm).
    fn potential(&self, o: f64, at: usize) -> (f64, f64, f64) {
        match &self.opened {
            None => self.bond.potential(o, self.largest_mm[at]),
            Some(opened) => opened.potential(&self.bond, o, self.largest_mm[at], at),
        }
    }

    /// The present effective openings of a group (mm).
    pub fn present<'b>(&'b self, local: &'b Local) -> impl Iterator<Item = f64> + 'b {
        (0..self.interface.points()).map(move |point| self.opening(local, point).parting.norm())
    }

    /// The largest effective openings of a group once these positions are taken (mm): those of the past, or the present ones.
    pub fn openings<'b>(&'b self, local: &'b Local) -> impl Iterator<Item = f64> + 'b {
        (0..self.interface.points())
            .map(move |point| self.largest_mm[self.at(local, point)].max(self.opening(local, point).parting.norm()))
    }

    /// Calls `visit(shape values, force on the upper face, stiffness)` for every point, both times its area.
    fn for_each(&self, local: &Local, mut visit: impl FnMut(&[f64], Vector3<f64>, Matrix3<f64>)) {
        for (point, &area) in self.interface.areas(local.group).iter().enumerate() {
            let n = self.interface.normals[self.at(local, point)];
            let Opening { normal, parting } = self.opening(local, point);
            let o = parting.norm();
            let (_, slope, curvature) = self.potential(o, self.at(local, point));
            let along = parting.try_normalize(0.0).unwrap_or_default();
            let over = if o > 0.0 { slope / o } else { curvature };
            let across = n * n.transpose();
            let (closing, free) = if normal > 0.0 {
                (0.0, Matrix3::identity())
            } else {
                (self.bond.stiffness_kpa_per_mm, Matrix3::identity() - across)
            };
            let force = along * slope + n * (closing * normal);
            let stiffness = free * over + along * along.transpose() * (curvature - over) + across * closing;
            visit(self.interface.faces.values(point), force * area, stiffness * area);
        }
    }
}

impl Effect for Adhesion<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn energy(&self, local: &Local) -> f64 {
        let areas = self.interface.areas(local.group).iter().enumerate();
        areas
            .map(|(point, area)| {
                let Opening { normal, parting } = self.opening(local, point);
                let closed = 0.5 * self.bond.stiffness_kpa_per_mm * normal.min(0.0).powi(2);
                area * (self.potential(parting.norm(), self.at(local, point)).0 + closed)
            })
            .sum()
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        self.for_each(local, |values, force, _| {
            for k in 0..3 {
                for (a, value) in values.iter().enumerate() {
                    out[k * GROUP + FACE_NODES + a] += value * force[k];
                    out[k * GROUP + a] -= value * force[k];
                }
            }
        });
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let sign = |a: usize| if a < FACE_NODES { -1.0 } else { 1.0 };
        self.for_each(local, |values, _, stiffness| {
            for i in 0..3 {
                for a in 0..GROUP {
                    for j in 0..=i {
                        let scale = stiffness[(i, j)] * sign(a) * values[a % FACE_NODES];
                        let row = &mut out[(i * GROUP + a) * 3 * GROUP + j * GROUP..][..GROUP];
                        for (b, entry) in row.iter_mut().enumerate() {
                            *entry += scale * sign(b) * values[b % FACE_NODES];
                        }
                    }
                }
            }
        });
    }
}
