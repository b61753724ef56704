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
//! Not here: friction, search for candidate faces beyond a bounding sphere.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::effect::{Effect, Local, Stencils};
use crate::mesh::element::{FACE_NODES, TOP_NODES, gauss_rule, shapes};
use crate::needle::Body;

/// Name of the effect.
pub const NAME: &str = "contact";

/// Surface faces at rest: interpolation and area at their quadrature points.
#[derive(Clone, Debug)]
pub struct ContactFaces {
    /// Shape function values, indexed (point, node).
    values: Vec<f64>,
    /// Quadrature weight × rest area (mm²), indexed (face, point).
    areas: Vec<f64>,
    /// Quadrature points per face.
    pub points: usize,
}

impl ContactFaces {
    /// Faces ζ = 1 of elements, whose nodes are the first vertices of each group of `stencils` (the
    /// last one is the needle), at the rest positions `rest`; `points_per_edge` Gauss points in each direction.
    pub fn new(stencils: &Stencils, rest: &[f64], points_per_edge: usize) -> Self {
        let top = &*TOP_NODES;
        let rule = gauss_rule(points_per_edge);
        let mut values = Vec::new();
        let mut slopes = Vec::new();
        for &(eta, w_eta) in &rule {
            for &(xi, w_xi) in &rule {
                let shape = shapes([xi, eta, 1.0]);
                values.extend(top.iter().map(|&a| shape[a].value));
                slopes.push((w_xi * w_eta, top.iter().map(|&a| shape[a].gradient).collect::<Vec<_>>()));
            }
        }
        let mut local = vec![0.0; 3 * stencils.group_size];
        let mut areas = Vec::with_capacity(stencils.len() * slopes.len());
        for face in 0..stencils.len() {
            stencils.gather(face, rest, &mut local);
            for (weight, gradients) in &slopes {
                let mut tangents = [Vector3::zeros(); 2];
                for (a, gradient) in gradients.iter().enumerate() {
                    let vertex = Vector3::from_fn(|k, _| local[k * stencils.group_size + a]);
                    tangents[0] += vertex * gradient[0];
                    tangents[1] += vertex * gradient[1];
                }
                areas.push(weight * tangents[0].cross(&tangents[1]).norm());
            }
        }
        ContactFaces { values, areas, points: slopes.len() }
    }

    /// Values of the face's shape functions at one quadrature point.
    pub fn values(&self, point: usize) -> &[f64] {
        &self.values[point * FACE_NODES..(point + 1) * FACE_NODES]
    }

    /// Weight × rest area of the quadrature points of one face (mm²).
    pub fn areas(&self, face: usize) -> &[f64] {
        &self.areas[face * self.points..(face + 1) * self.points]
    }
}

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
        let n = FACE_NODES + 1;
        Vector3::new(local.current[n - 1], local.current[2 * n - 1], local.current[3 * n - 1])
    }

    fn node(&self, local: &Local, a: usize) -> Vector3<f64> {
        let n = FACE_NODES + 1;
        Vector3::new(local.current[a], local.current[n + a], local.current[2 * n + a])
    }

    /// The quadrature point's position in needle coordinates.
    fn in_needle(&self, local: &Local, point: usize) -> Point3<f64> {
        let mut offset = -self.tip(local);
        for (a, value) in self.faces.values(point).iter().enumerate() {
            offset += self.node(local, a) * *value;
        }
        Point3::from(self.frame_from_needle.inverse_transform_vector(&offset))
    }

    /// Gap, pressure and position of every quadrature point of a face.
    pub fn contact_points<'b>(&'b self, local: &'b Local) -> impl Iterator<Item = ContactPoint> + 'b {
        self.faces.areas(local.group).iter().enumerate().map(move |(point, &area_mm2)| {
            let at = self.in_needle(local, point);
            let gap_mm = self.shape.distance(&at);
            let position = Point3::from(self.frame_from_needle * at.coords + self.tip(local));
            ContactPoint { gap_mm, pressure_kpa: -self.penalty(gap_mm).1, area_mm2, position }
        })
    }

    /// Calls `visit(weights, area, force, stiffness)` for each point in contact: `weights` are the interpolation weights of the
    /// group's vertices (the needle's is −1), `force` = φ′∇g and `stiffness` = ∂²φ/∂x², both per rest area.
    fn for_each_touching(&self, local: &Local, mut visit: impl FnMut(&[f64], f64, Vector3<f64>, Matrix3<f64>)) {
        let rotation = self.frame_from_needle.matrix();
        let mut weights = [-1.0; FACE_NODES + 1];
        for (point, &area) in self.faces.areas(local.group).iter().enumerate() {
            let at = self.in_needle(local, point);
            if self.shape.distance(&at) >= self.smoothing_mm {
                continue;
            }
            let distance = self.shape.signed_distance(&at);
            let (_, slope, curvature) = self.penalty(distance.value);
            let normal = rotation * distance.gradient;
            let bending = rotation * distance.hessian * rotation.transpose();
            weights[..FACE_NODES].copy_from_slice(self.faces.values(point));
            let bending_slope = local.predicted.get(point).copied().unwrap_or(slope);
            let stiffness = normal * normal.transpose() * curvature + bending * bending_slope;
            visit(&weights, area, normal * slope, stiffness);
        }
    }
}

impl Effect for Contact<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, local: &Local) -> bool {
        let n = FACE_NODES;
        let center = (0..n).map(|a| self.node(local, a)).sum::<Vector3<f64>>() / n as f64;
        let radius = (0..n).map(|a| (self.node(local, a) - center).norm()).fold(0.0, f64::max);
        let at = Point3::from(self.frame_from_needle.inverse_transform_vector(&(center - self.tip(local))));
        self.shape.distance(&at) < BOUNDING_MARGIN * radius + self.smoothing_mm
    }

    fn predicted_len(&self) -> usize {
        self.faces.points
    }

    fn predict_stress(&self, local: &Local, step: &[f64], out: &mut [f64]) {
        let n = FACE_NODES + 1;
        for (point, predicted) in out.iter_mut().enumerate() {
            let distance = self.shape.signed_distance(&self.in_needle(local, point));
            let (_, slope, curvature) = self.penalty(distance.value);
            let normal = self.frame_from_needle * distance.gradient;
            let values = self.faces.values(point).iter().chain(&[-1.0]);
            let closing: f64 = values
                .enumerate()
                .map(|(a, value)| value * (0..3).map(|k| normal[k] * step[k * n + a]).sum::<f64>())
                .sum();
            *predicted = (slope + curvature * closing).min(0.0);
        }
    }

    fn energy(&self, local: &Local) -> f64 {
        let areas = self.faces.areas(local.group).iter().enumerate();
        areas.map(|(point, area)| area * self.penalty(self.shape.distance(&self.in_needle(local, point))).0).sum()
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        let n = FACE_NODES + 1;
        self.for_each_touching(local, |weights, area, force, _| {
            for k in 0..3 {
                for (a, weight) in weights.iter().enumerate() {
                    out[k * n + a] += area * weight * force[k];
                }
            }
        });
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let n = FACE_NODES + 1;
        self.for_each_touching(local, |weights, area, _, stiffness| {
            for i in 0..3 {
                for (a, weight_a) in weights.iter().enumerate() {
                    for j in 0..=i {
                        let scale = area * weight_a * stiffness[(i, j)];
                        let row = &mut out[(i * n + a) * 3 * n + j * n..][..n];
                        for (entry, weight_b) in row.iter_mut().zip(weights) {
                            *entry += scale * weight_b;
                        }
                    }
                }
            }
        });
    }
}

/// A quadratic face may bulge beyond the sphere through its nodes, and bevel corners overstate distance by up to √2.
const BOUNDING_MARGIN: f64 = 2.0;
