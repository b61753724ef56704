//! `contact`: frictionless contact between the inner retinal surface and the needle's real shape.
//!
//! At every quadrature point of a surface face the gap is the needle's signed distance g at the deformed point, and the energy
//! per rest area is a penalty that is exactly zero from the smoothing distance s on and quadratic once the point is inside:
//! φ(g) = 0 for g ≥ s; k (s − g)³/(12 s) for |g| < s; k (g²/2 + s²/6) for g ≤ −s. Its pressure −φ′ is continuous with a
//! continuous slope, so Newton's method sees no kink at the contact edge. The needle is one more vertex of the group (the last):
//! the gradient with respect to it is the force that holds the needle, so reactions need no code of their own.
//!
//! Law: the forces on tissue and needle are equal and opposite, along the needle's surface normal; no force acts beyond s.
//! The penetration at pressure p is p/k: [`Contact::stiffness_kpa_per_mm`] is chosen where the mesh is known.
//! Not here: friction, search for candidate faces beyond a bound for each.

mod face_rule;
mod gaps;

use std::sync::Arc;

use nalgebra::{Point3, Rotation3, Vector3};

use crate::effect::{Effect, Local, Stencils};
use crate::mesh::element::FACE_NODES;
use crate::needle::Body;
use face_rule::FaceRule;
pub use face_rule::{FaceStiffness, GROUP};
use gaps::Gaps;

/// Name of the effect.
pub const NAME: &str = "contact";

/// Surface faces at rest: interpolation and area at their quadrature points.
#[derive(Clone, Debug)]
pub struct ContactFaces {
    rule: Arc<FaceRule>,
    /// Quadrature weight × rest area (mm²), indexed (face, point).
    areas: Vec<f64>,
    /// Quadrature points per face.
    pub points: usize,
}

impl ContactFaces {
    /// Faces ζ = 1 of elements, whose nodes are the first vertices of each group of `stencils` (the
    /// last one is the needle), at the rest positions `rest`; `points_per_edge` Gauss points in each direction.
    pub fn new(stencils: &Stencils, rest: &[f64], points_per_edge: usize) -> Self {
        let rule = FaceRule::shared(points_per_edge);
        let mut local = vec![0.0; 3 * stencils.group_size];
        let mut areas = Vec::with_capacity(stencils.len() * rule.slopes.len());
        for face in 0..stencils.len() {
            stencils.gather(face, rest, &mut local);
            for (weight, gradients) in &rule.slopes {
                let mut tangents = [Vector3::zeros(); 2];
                for (a, gradient) in gradients.iter().enumerate() {
                    let vertex = Vector3::from_fn(|k, _| local[k * stencils.group_size + a]);
                    tangents[0] += vertex * gradient[0];
                    tangents[1] += vertex * gradient[1];
                }
                areas.push(weight * tangents[0].cross(&tangents[1]).norm());
            }
        }
        ContactFaces { areas, points: rule.slopes.len(), rule }
    }

    /// Values of the face's shape functions at one quadrature point.
    pub fn values(&self, point: usize) -> &[f64] {
        &self.rule.weights[point][..FACE_NODES]
    }

    /// What the offset of one quadrature point from the needle is made of: weights of the face's nodes, and −1 for the needle.
    pub fn weights(&self, point: usize) -> &[f64; GROUP] {
        &self.rule.weights[point]
    }

    /// Weight × rest area of the quadrature points of one face (mm²).
    pub fn areas(&self, face: usize) -> &[f64] {
        &self.areas[face * self.points..(face + 1) * self.points]
    }

    /// The Hessian of one face, to be summed over its points.
    pub fn stiffness(&self) -> FaceStiffness<'_> {
        FaceStiffness::new(&self.rule)
    }
}

/// Corners of a face among its nodes.
const CORNERS: [usize; 4] = [0, 2, 5, 7];
/// Its edges, each with its middle node, in opposite pairs.
const OPPOSITE_EDGES: [[[usize; 3]; 2]; 2] = [[[0, 1, 2], [5, 6, 7]], [[0, 3, 5], [2, 4, 7]]];

/// The effect on a set of faces. The last vertex of each group is the needle's tip.
pub struct Contact<'a> {
    /// The faces at rest.
    pub faces: &'a ContactFaces,
    /// The needle's shape.
    pub shape: &'a Body,
    /// The needle's orientation in the frame of the positions.
    pub frame_from_needle: Rotation3<f64>,
    /// Penalty stiffness k (kPa/mm).
    pub stiffness_kpa_per_mm: f64,
    /// Smoothing distance s (mm).
    pub smoothing_mm: f64,
}

/// State of one quadrature point in contact.
#[derive(Clone, Copy, Debug)]
pub struct ContactPoint {
    /// Signed distance to the needle (mm), negative inside.
    pub gap_mm: f64,
    /// Contact pressure per rest area (kPa).
    pub pressure_kpa: f64,
    /// Rest area of the point (mm²).
    pub area_mm2: f64,
    /// Deformed position (mm).
    pub position: Point3<f64>,
}

impl Contact<'_> {
    /// φ, φ′ and φ″ (kPa·mm, kPa, kPa/mm) at gap `g` (mm).
    fn penalty(&self, g: f64) -> (f64, f64, f64) {
        let (k, s) = (self.stiffness_kpa_per_mm, self.smoothing_mm);
        if g >= s {
            (0.0, 0.0, 0.0)
        } else if g > -s {
            let d = s - g;
            (k * d.powi(3) / (12.0 * s), -k * d * d / (4.0 * s), k * d / (2.0 * s))
        } else {
            (k * (0.5 * g * g + s * s / 6.0), k * g, k)
        }
    }

    fn tip(&self, local: &Local) -> Vector3<f64> {
        vertex(local, FACE_NODES)
    }

    /// A face's nodes in needle coordinates.
    fn nodes_in_needle(&self, local: &Local) -> [Vector3<f64>; FACE_NODES] {
        let (tip, needle_from_frame) = (self.tip(local), self.frame_from_needle.inverse());
        std::array::from_fn(|a| needle_from_frame * (vertex(local, a) - tip))
    }

    /// Where the quadrature points of a face are.
    fn gaps(&self, local: &Local) -> Gaps {
        Gaps::new(&self.faces.rule, &self.nodes_in_needle(local), self.shape)
    }

    /// Gap, pressure and position of every quadrature point of a face.
    pub fn contact_points<'b>(&'b self, local: &'b Local) -> impl Iterator<Item = ContactPoint> + 'b {
        let gaps = self.gaps(local);
        self.faces.areas(local.group).iter().enumerate().map(move |(point, &area_mm2)| {
            let gap_mm = gaps.mm(point);
            let position = Point3::from(self.frame_from_needle * gaps.at(point).coords + self.tip(local));
            ContactPoint { gap_mm, pressure_kpa: -self.penalty(gap_mm).1, area_mm2, position }
        })
    }

    /// The points of a face that press, each with its force (mN) and the needle's outward normal in the frame of the positions.
    pub fn pressing<'b>(&'b self, local: &'b Local) -> impl Iterator<Item = (usize, f64, Vector3<f64>)> + 'b {
        let gaps = self.gaps(local);
        let points = self.faces.areas(local.group).iter().enumerate();
        points.filter_map(move |(point, area)| {
            let pressure_kpa = -self.penalty(gaps.mm(point)).1;
            let normal = || (self.frame_from_needle * self.shape.distance_and_gradient(&gaps.at(point)).1).normalize();
            (pressure_kpa > 0.0).then(|| (point, pressure_kpa * area, normal()))
        })
    }

    /// A distance (mm) that no point of the face falls short of, from its nodes in needle coordinates: the needle's signed distance is convex, so it lies above its
    /// tangent at the middle of the corners; along this a face reaches no further than its corners and the bulges of its edges.
    fn nearest_bound_mm(&self, nodes: &[Vector3<f64>; FACE_NODES]) -> f64 {
        let middle = CORNERS.map(|corner| nodes[corner]).iter().sum::<Vector3<f64>>() / CORNERS.len() as f64;
        let (at_middle_mm, gradient) = self.shape.distance_and_gradient(&Point3::from(middle));
        let along = nodes.map(|node| gradient.dot(&(node - middle)));
        let corner = CORNERS.map(|corner| along[corner]).into_iter().fold(f64::INFINITY, f64::min);
        // Of two opposite edges the shape functions of the middle nodes add up to one at most.
        let bulges = OPPOSITE_EDGES.map(|pair| {
            let bulge = |[from, middle, to]: [usize; 3]| along[middle] - 0.5 * (along[from] + along[to]);
            pair.map(bulge).into_iter().fold(0.0, f64::min)
        });
        at_middle_mm + corner + bulges.iter().sum::<f64>()
    }

    /// The points of the face in contact: each with its area (mm²) and its position in needle coordinates.
    fn touching<'b>(&'b self, local: &Local) -> impl Iterator<Item = (usize, f64, Point3<f64>)> + 'b {
        let gaps = self.gaps(local);
        let points = self.faces.areas(local.group).iter().enumerate();
        points.filter_map(move |(point, &area)| match gaps.mm(point) < self.smoothing_mm {
            true => Some((point, area, gaps.at(point))),
            false => None,
        })
    }
}

/// Position of one vertex of a group.
fn vertex(local: &Local, a: usize) -> Vector3<f64> {
    Vector3::new(local.current[a], local.current[GROUP + a], local.current[2 * GROUP + a])
}

impl Effect for Contact<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, local: &Local) -> bool {
        self.nearest_bound_mm(&self.nodes_in_needle(local)) < self.smoothing_mm
    }

    fn predicted_len(&self) -> usize {
        self.faces.points
    }

    fn predict_stress(&self, local: &Local, step: &[f64], out: &mut [f64]) {
        let gaps = self.gaps(local);
        for (point, predicted) in out.iter_mut().enumerate() {
            let (gap_mm, gradient) = self.shape.distance_and_gradient(&gaps.at(point));
            let (_, slope, curvature) = self.penalty(gap_mm);
            let normal = self.frame_from_needle * gradient;
            let closing: f64 = self
                .faces
                .weights(point)
                .iter()
                .enumerate()
                .map(|(a, value)| value * (0..3).map(|k| normal[k] * step[k * GROUP + a]).sum::<f64>())
                .sum();
            *predicted = (slope + curvature * closing).min(0.0);
        }
    }

    fn energy(&self, local: &Local) -> f64 {
        let gaps = self.gaps(local);
        let areas = self.faces.areas(local.group).iter().enumerate();
        areas.map(|(point, area)| area * self.penalty(gaps.mm(point)).0).sum()
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        for (point, area, at) in self.touching(local) {
            let (gap_mm, gradient) = self.shape.distance_and_gradient(&at);
            let force = self.frame_from_needle * gradient * (area * self.penalty(gap_mm).1);
            for (k, out) in out.as_chunks_mut::<GROUP>().0.iter_mut().enumerate() {
                for (out, weight) in out.iter_mut().zip(self.faces.weights(point)) {
                    *out += weight * force[k];
                }
            }
        }
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let rotation = self.frame_from_needle.matrix();
        let mut stiffness = self.faces.stiffness();
        for (point, area, at) in self.touching(local) {
            let distance = self.shape.signed_distance(&at);
            let (_, slope, curvature) = self.penalty(distance.value);
            let normal = distance.gradient;
            let bending_slope = local.predicted.get(point).copied().unwrap_or(slope);
            let of_point = normal * normal.transpose() * curvature + distance.hessian * bending_slope;
            stiffness.add(point, &(rotation * (of_point * area) * rotation.transpose()));
        }
        stiffness.add_to(out);
    }
}
