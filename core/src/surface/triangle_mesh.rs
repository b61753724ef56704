//! A triangle mesh of the inner surface that is known to be sound.
//!
//! Contract: vertices are finite, distinct and near enough for micrometres; triangles refer to them, have an area and agree on which
//! side is out (counter-clockwise seen from the vitreous). Nothing is repaired silently: [`TriangleMesh::new`] refuses, and
//! [`TriangleMesh::welded`] is for files, whose writers split vertices. Units: mm, scene frame.
//!
//! Not here: reading files (`mesh_file`), picking nodes (`patch`), whether the triangles face the vitreous, which no mesh can tell.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use thiserror::Error;

/// Coordinates beyond this are refused, mm: a scene in metres keeps a nanometre in f64.
pub const COORDINATE_LIMIT_MM: f64 = 1000.0;

/// A triangle is without area when its height over the longest edge is below this fraction of that edge.
const LEAST_ASPECT: f64 = 1e-9;

/// Why vertices and triangles are not a mesh of a surface. Indices are those of the input.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshError {
    /// A coordinate is NaN, infinite or too far away.
    #[error(
        "vertex {vertex} at {position:?} mm is not finite or further than {COORDINATE_LIMIT_MM} mm from the origin"
    )]
    Vertex {
        /// Index of the vertex.
        vertex: usize,
        /// Its coordinates, mm.
        position: [f64; 3],
    },
    /// Two vertices have the same coordinates.
    #[error("vertices {first} and {second} are the same point: weld them")]
    DuplicateVertex {
        /// The lower index.
        first: usize,
        /// The higher index.
        second: usize,
    },
    /// A triangle refers to a vertex that is not there.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are {vertex_count} vertices")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex that it refers to.
        vertex: usize,
        /// How many there are.
        vertex_count: usize,
    },
    /// A triangle has no area.
    #[error("triangle {triangle} has no area")]
    NoArea {
        /// Index of the triangle.
        triangle: usize,
    },
    /// Two triangles run along an edge in the same direction: one of them is turned over, or more than two share the edge.
    #[error("triangles {first} and {second} run along the edge {edge:?} in the same direction: one is turned over")]
    InconsistentOrientation {
        /// The lower triangle.
        first: usize,
        /// The higher triangle.
        second: usize,
        /// The edge's vertices in that direction.
        edge: [usize; 2],
    },
}

/// A sound triangle mesh in the scene frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[usize; 3]>,
}

impl TriangleMesh {
    /// A mesh of exactly these vertices (mm) and triangles (counter-clockwise seen from the vitreous).
    ///
    /// Vertices without a triangle are kept and never used. Fails with the first [`MeshError`] found.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[usize; 3]>) -> Result<Self, MeshError> {
        check_vertices(&vertices)?;
        check_indices(&triangles, vertices.len())?;
        let mut seen = BTreeMap::new();
        for (second, vertex) in vertices.iter().enumerate() {
            if let Some(first) = seen.insert(key(vertex), second) {
                return Err(MeshError::DuplicateVertex { first, second });
            }
        }
        if let Some(triangle) = triangles.iter().position(|corners| !has_area(&vertices, corners)) {
            return Err(MeshError::NoArea { triangle });
        }
        check_orientation(&triangles)?;
        Ok(Self { vertices, triangles })
    }

    /// Like [`new`](Self::new), but merges vertices of equal coordinates into the first of them and drops triangles without area.
    ///
    /// Vertices keep their order and are renumbered where one before them was merged.
    pub fn welded(vertices: Vec<Point3<f64>>, triangles: Vec<[usize; 3]>) -> Result<Self, MeshError> {
        check_vertices(&vertices)?;
        check_indices(&triangles, vertices.len())?;
        let (mut seen, mut kept) = (BTreeMap::new(), Vec::new());
        let renumbered: Vec<usize> = vertices
            .into_iter()
            .map(|vertex| {
                *seen.entry(key(&vertex)).or_insert_with(|| {
                    kept.push(vertex);
                    kept.len() - 1
                })
            })
            .collect();
        let triangles = triangles.into_iter().map(|corners| corners.map(|corner| renumbered[corner]));
        let triangles = triangles.filter(|corners| has_area(&kept, corners)).collect();
        Self::new(kept, triangles)
    }

    /// Vertices, mm.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Triangles as indices of vertices, counter-clockwise seen from the vitreous.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }
}

/// Twice the area of a triangle times its unit normal, mm².
pub fn doubled_area_normal(vertices: &[Point3<f64>], corners: &[usize; 3]) -> Vector3<f64> {
    let [a, b, c] = corners.map(|corner| vertices[corner]);
    (b - a).cross(&(c - a))
}

fn check_vertices(vertices: &[Point3<f64>]) -> Result<(), MeshError> {
    let allowed = |vertex: &Point3<f64>| vertex.iter().all(|coordinate| coordinate.abs() <= COORDINATE_LIMIT_MM);
    match vertices.iter().position(|vertex| !allowed(vertex)) {
        Some(vertex) => Err(MeshError::Vertex { vertex, position: vertices[vertex].coords.into() }),
        None => Ok(()),
    }
}

fn check_indices(triangles: &[[usize; 3]], vertex_count: usize) -> Result<(), MeshError> {
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&corner| corner >= vertex_count) {
            return Err(MeshError::IndexOutOfRange { triangle, vertex, vertex_count });
        }
    }
    Ok(())
}

fn check_orientation(triangles: &[[usize; 3]]) -> Result<(), MeshError> {
    let mut directed: Vec<([usize; 2], usize)> = Vec::with_capacity(3 * triangles.len());
    for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
        directed.extend([[a, b], [b, c], [c, a]].map(|edge| (edge, triangle)));
    }
    directed.sort_unstable();
    match directed.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => {
            let (edge, first, second) = (pair[0].0, pair[0].1, pair[1].1);
            Err(MeshError::InconsistentOrientation { first, second, edge })
        }
        None => Ok(()),
    }
}

fn has_area(vertices: &[Point3<f64>], corners: &[usize; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| vertices[corner]);
    let longest_squared = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    doubled_area_normal(vertices, corners).norm() > LEAST_ASPECT * longest_squared
}

/// Coordinates as bits, so that equal points and no others have equal keys; adding zero makes −0 and 0 one.
fn key(vertex: &Point3<f64>) -> [u64; 3] {
    [vertex.x, vertex.y, vertex.z].map(|coordinate| (coordinate + 0.0).to_bits())
}
