//! `pressure`: the change of the intraocular pressure since the rest surface was measured, as a load that follows the surface.
//!
//! A pressure p on the inner surface pushes every piece of it into the tissue with p times its present area, along its present normal. Its
//! potential is p V, with V the volume on the tissue's side of the surface: with x(ξ, η) the surface and its normal x_ξ × x_η out of the tissue,
//! V = ⅓ ∫ x · (x_ξ × x_η) dξ dη, one such integral a face (Bonet & Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, section 8.5). The integrand is a
//! polynomial of degree five in each of ξ and η for faces of eight nodes, so three Gauss points integrate it exactly, and the second derivative is symmetric.
//! A face by itself also pulls on its outline; these forces cancel between neighbours and rest on the fixed rim of the mesh, where nothing moves.
//!
//! The pressure acts under the needle too: a film of liquid transmits it, and contact pressures and reactions count from it, as a force sensor does that
//! was set to zero inside the eye. The block is fixed at the outer face of the sclera: the patch frame moves with the eye's coat as that stretches.
//!
//! Law: on a closed surface the forces balance; the work of a displacement is −p times the volume it adds to the tissue's side.
//! Not here: how far the wall sinks away from the needle (`equilibrium::settled`).

use std::sync::LazyLock;

use nalgebra::{Matrix3, Vector3};

use crate::effect::{Effect, Local};
use crate::mesh::element::{FACE_NODES, face_shapes, gauss_rule};

/// Name of the effect.
pub const NAME: &str = "pressure";

/// Gauss points along each edge of a face: exact for the volume.
const POINTS_PER_EDGE: usize = 3;

/// Value and two slopes of every node's shape function at one point of the reference face, and the point's weight.
pub(super) struct FacePoint {
    pub(super) weight: f64,
    pub(super) values: [[f64; FACE_NODES]; 3],
}

pub(super) static FACE_POINTS: LazyLock<Vec<FacePoint>> = LazyLock::new(|| {
    let rule = gauss_rule(POINTS_PER_EDGE);
    let pairs = rule.iter().flat_map(|&(eta, w_eta)| rule.iter().map(move |&(xi, w_xi)| (xi, eta, w_xi * w_eta)));
    let point = |(xi, eta, weight): (f64, f64, f64)| {
        let shapes = face_shapes([xi, eta]);
        let values = [
            shapes.map(|shape| shape.value),
            shapes.map(|shape| shape.gradient[0]),
            shapes.map(|shape| shape.gradient[1]),
        ];
        FacePoint { weight, values }
    };
    pairs.map(point).collect()
});

/// The effect on faces whose nodes are the first vertices of each group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressure {
    /// Pressure on the surface (kPa); negative where it draws.
    pub pressure_kpa: f64,
}

impl FacePoint {
    /// The surface point and its two tangents.
    fn frame(&self, local: &Local) -> [Vector3<f64>; 3] {
        let n = local.current.len() / 3;
        let node = |a: usize| Vector3::new(local.current[a], local.current[n + a], local.current[2 * n + a]);
        self.values.map(|values| values.iter().enumerate().map(|(a, value)| node(a) * *value).sum())
    }
}

impl Effect for Pressure {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, _local: &Local) -> bool {
        self.pressure_kpa != 0.0
    }

    fn energy(&self, local: &Local) -> f64 {
        let volume = |point: &FacePoint| {
            let [x, along, across] = point.frame(local);
            point.weight * x.dot(&along.cross(&across)) / 3.0
        };
        self.pressure_kpa * FACE_POINTS.iter().map(volume).sum::<f64>()
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        let n = local.current.len() / 3;
        for point in FACE_POINTS.iter() {
            let [x, along, across] = point.frame(local);
            let scale = self.pressure_kpa * point.weight / 3.0;
            let slopes = [along.cross(&across), across.cross(&x), x.cross(&along)];
            for a in 0..FACE_NODES {
                let force: Vector3<f64> =
                    slopes.iter().zip(&point.values).map(|(slope, values)| slope * (scale * values[a])).sum();
                for k in 0..3 {
                    out[k * n + a] += force[k];
                }
            }
        }
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let n = local.current.len() / 3;
        for point in FACE_POINTS.iter() {
            let scale = self.pressure_kpa * point.weight / 3.0;
            // The volume is trilinear in x and its tangents: its second derivatives are the matrices of cross products.
            let [x, along, across] = point.frame(local).map(|v| v.cross_matrix() * scale);
            let [value, xi, eta] = &point.values;
            for a in 0..FACE_NODES {
                for b in 0..FACE_NODES {
                    let block: Matrix3<f64> = across * (xi[a] * value[b] - value[a] * xi[b])
                        + along * (value[a] * eta[b] - eta[a] * value[b])
                        + x * (eta[a] * xi[b] - xi[a] * eta[b]);
                    for i in 0..3 {
                        for j in 0..=i {
                            out[(i * n + a) * 3 * n + j * n + b] += block[(i, j)];
                        }
                    }
                }
            }
        }
    }
}
