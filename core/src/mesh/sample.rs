//! Reads the deformed inner surface at points given by their patch parameters.

use super::element::{FACE_NODES, face_shapes};
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
/// How far a face's curved edges may bulge beyond its nodes, as a share of its size.
const BULGE: f64 = 0.25;
/// How far outside a face's reference square a point may lie and still belong to it.
const EDGE_TOLERANCE: f64 = 1e-9;

/// Finds points on the inner surface of one mesh.
pub struct SurfaceLocator<'a> {
    topology: &'a WallTopology,
    faces: Vec<Face>,
}

/// A face in the plane of the patch parameters.
struct Face {
    nodes: [[f64; 2]; FACE_NODES],
    /// Bounds within which its points lie.
    bounds: [(f64, f64); 2],
}

impl<'a> SurfaceLocator<'a> {
    /// For the inner surface of this mesh.
    pub fn new(topology: &'a WallTopology, geometry: &WallGeometry) -> Self {
        let face = |vertices: &Vec<usize>| {
            let nodes = std::array::from_fn(|a| geometry.parameters[topology.vertices[vertices[a]].0]);
            let bounds = [0, 1].map(|k| {
                let (low, high) = nodes
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), n: &[f64; 2]| (l.min(n[k]), h.max(n[k])));
                let margin = BULGE * (high - low);
                (low - margin, high + margin)
            });
            Face { nodes, bounds }
        };
        SurfaceLocator { topology, faces: topology.face_points.iter().map(face).collect() }
    }

    /// Locates the point `at` (patch parameters); `None` beyond the rim.
    pub fn locate(&self, at: [f64; 2]) -> Option<SurfaceSample> {
        self.topology.face_points.iter().zip(&self.faces).find_map(|(vertices, face)| {
            let is_near = (0..2).all(|k| (face.bounds[k].0..=face.bounds[k].1).contains(&at[k]));
            let weights = is_near.then(|| invert(&face.nodes, at))??;
            Some(SurfaceSample { weights: vertices.iter().copied().zip(weights).collect() })
        })
    }
}

/// Shape function values at the point of the face whose image is `at`, if it lies in the face.
fn invert(nodes: &[[f64; 2]; FACE_NODES], at: [f64; 2]) -> Option<[f64; FACE_NODES]> {
    let mut local = Vector2::zeros();
    for _ in 0..INVERSION_STEPS {
        let shapes = face_shapes(local.into());
        let mut image = Vector2::zeros();
        let mut jacobian = Matrix2::zeros();
        for (shape, node) in shapes.iter().zip(nodes) {
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
            return inside.then(|| shapes.map(|shape| shape.value));
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
