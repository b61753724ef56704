//! Reads the deformed inner surface at points given by their patch parameters.

use super::element::{TOP_NODES, shapes};
use super::wall::{WallGeometry, WallTopology};
use nalgebra::{Matrix2, Vector2, Vector3};

/// Where a patch parameter lies on the mesh: vertices of the face and their weights.
#[derive(Clone, Debug)]
pub struct SurfaceSample {
    /// Vertices and interpolation weights.
    pub weights: Vec<(usize, f64)>,
}

/// Newton steps that invert a face's map (it is nearly affine, so a few suffice).
const INVERSION_STEPS: usize = 12;
/// How far outside a face's reference square a point may lie and still belong to it.
const EDGE_TOLERANCE: f64 = 1e-9;

/// Locates the point `at` (patch parameters) on the mesh's inner surface; `None` beyond the rim.
pub fn locate(topology: &WallTopology, geometry: &WallGeometry, at: [f64; 2]) -> Option<SurfaceSample> {
    topology.face_points.iter().find_map(|face| {
        let nodes: Vec<[f64; 2]> =
            face.iter().map(|&vertex| geometry.parameters[topology.vertices[vertex].0]).collect();
        let inside_box = (0..2).all(|k| {
            let (low, high) =
                nodes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), n| (l.min(n[k]), h.max(n[k])));
            let margin = 0.25 * (high - low);
            at[k] >= low - margin && at[k] <= high + margin
        });
        if !inside_box {
            return None;
        }
        let weights = invert(&nodes, at)?;
        Some(SurfaceSample { weights: face.iter().copied().zip(weights).collect() })
    })
}

/// Shape function values at the point of the face whose image is `at`, if it lies in the face.
fn invert(nodes: &[[f64; 2]], at: [f64; 2]) -> Option<Vec<f64>> {
    let top = &*TOP_NODES;
    let mut local = Vector2::zeros();
    for _ in 0..INVERSION_STEPS {
        let shapes = shapes([local[0], local[1], 1.0]);
        let on_face = || top.iter().map(|&a| &shapes[a]);
        let mut image = Vector2::zeros();
        let mut jacobian = Matrix2::zeros();
        for (shape, node) in on_face().zip(nodes) {
            for i in 0..2 {
                image[i] += shape.value * node[i];
                for k in 0..2 {
                    jacobian[(i, k)] += shape.gradient[k] * node[i];
                }
            }
        }
        let error = Vector2::new(at[0], at[1]) - image;
        let step = jacobian.try_inverse()? * error;
        local += step;
        if local.amax() > 3.0 {
            return None;
        }
        if step.amax() < 1e-13 {
            let inside = local.amax() <= 1.0 + EDGE_TOLERANCE;
            return inside.then(|| on_face().map(|s| s.value).collect());
        }
    }
    None
}

impl SurfaceSample {
    /// Interpolates a vertex field (x, y, z of each vertex).
    pub fn interpolate(&self, field: &[f64]) -> Vector3<f64> {
        self.weights
            .iter()
            .map(|&(vertex, weight)| {
                Vector3::new(field[3 * vertex], field[3 * vertex + 1], field[3 * vertex + 2]) * weight
            })
            .sum()
    }
}
