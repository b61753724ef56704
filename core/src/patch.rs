//! The patch: the 64 nodes that are reported, and the frame that they are reported in.
//!
//! Contract: nodes lie on the rest surface; the frame's origin is on the surface, +z points into the vitreous; triangles are
//! counter-clockwise seen from there. An analytic surface has a grid of nodes ([`Patch::grid`]), a mesh lends its own
//! ([`Patch::cut`], in `cut`). Units: mm.
//!
//! Not here: the tissue under the nodes, their displacement.

mod cut;

use nalgebra::{Isometry3, Point3, Vector3};

pub use cut::{CONTACT_DISTANCE_LIMIT_MM, PatchError, REGION_RADIUS_MM};

use crate::surface::Surface;
use crate::surface::triangle_mesh::doubled_area_normal;

/// Nodes along each side of the grid.
pub const NODES_PER_SIDE: usize = 8;

/// Nodes of every patch.
pub const NODE_COUNT: usize = NODES_PER_SIDE * NODES_PER_SIDE;

/// Distance between neighbours of the grid, mm: 2.1 mm square in all, wide enough to see a blunt tip on a soft bed.
pub const SPACING_MM: f64 = 0.3;

/// The reported nodes with the surface that they lie on.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Takes patch to scene coordinates, mm.
    pub scene_from_patch: Isometry3<f64>,
    /// The surface under and around the nodes, patch frame.
    pub surface: Surface,
    /// (x, y) of the column of each node, patch frame, mm; 64 of them.
    pub parameters: Vec<[f64; 2]>,
    /// The nodes at rest, patch frame, mm, in the order of `parameters`.
    pub vertices: Vec<Point3<f64>>,
    /// Triangles between nodes, counter-clockwise seen from +z.
    pub triangles: Vec<[usize; 3]>,
    /// For a patch cut from a mesh, the index of each node in that mesh, ascending; `None` for a grid.
    pub source_indices: Option<Vec<usize>>,
}

impl Patch {
    /// 8 × 8 nodes, 0.3 mm apart in x and y, row by row with x fastest from (−1.05, −1.05), and 98 triangles.
    ///
    /// On a curved surface the spacing is that of the columns' (x, y), not that along the surface.
    pub fn grid(surface: Surface, scene_from_patch: Isometry3<f64>) -> Self {
        let coordinate = |index: usize| SPACING_MM * (index as f64 - 0.5 * (NODES_PER_SIDE - 1) as f64);
        let parameters: Vec<[f64; 2]> = (0..NODE_COUNT)
            .map(|node| [coordinate(node % NODES_PER_SIDE), coordinate(node / NODES_PER_SIDE)])
            .collect();
        let vertices = parameters.iter().map(|&[x, y]| surface.column(x, y).surface).collect();
        let triangles = grid_triangles();
        Self { scene_from_patch, surface, parameters, vertices, triangles, source_indices: None }
    }
}

/// Two triangles for each square of the grid, split along the diagonal from its corner towards −x, −y to that towards +x, +y.
fn grid_triangles() -> Vec<[usize; 3]> {
    let squares = NODES_PER_SIDE - 1;
    (0..squares * squares)
        .flat_map(|square| {
            let corner = (square / squares) * NODES_PER_SIDE + square % squares;
            let above = corner + NODES_PER_SIDE;
            [[corner, corner + 1, above + 1], [corner, above + 1, above]]
        })
        .collect()
}

/// Unit normals at the vertices: the sum of the normals of the triangles around each, weighted with their areas.
///
/// Triangles refer to `vertices` by index. A vertex without a triangle, or whose triangles cancel, has +z.
pub fn vertex_normals(vertices: &[Point3<f64>], triangles: &[[usize; 3]]) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); vertices.len()];
    for corners in triangles {
        let normal = doubled_area_normal(vertices, corners);
        for &corner in corners {
            normals[corner] += normal;
        }
    }
    normals.iter().map(|normal| normal.try_normalize(0.0).unwrap_or(Vector3::z())).collect()
}
