//! A patch cut from a mesh: the 64 vertices around a contact, in a frame that moves with the mesh.
//!
//! Contract: the answer depends on the shape around the contact and not on how the mesh lies or is numbered: the frame is made of
//! the surface alone, and of two vertices equally near to the contact the one with the smaller coordinates is taken. Where the mesh
//! is symmetric about the contact no rule can tell two nodes apart after a motion; there the choice may change with it. Units: mm.
//!
//! Not here: checking the mesh (`surface::triangle_mesh`), looking at it beyond [`REGION_RADIUS_MM`] from the contact.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use thiserror::Error;

use super::{NODE_COUNT, Patch};
use crate::surface::triangle_mesh::doubled_area_normal;
use crate::surface::{Folded, HeightField, Surface, TriangleMesh};

/// Triangles with a corner this near to the contact make up the surface around the patch, mm: twice the patch's half-diagonal.
pub const REGION_RADIUS_MM: f64 = 3.0;

/// A contact further than this from the surface is refused, mm: it is more than any indentation of a 0.25 mm retina.
pub const CONTACT_DISTANCE_LIMIT_MM: f64 = 1.0;

/// Mean normal over the sum of areas below which the triangles face all ways and have no common side (pure number).
const LEAST_COMMON_NORMAL: f64 = 1e-3;

/// Lateral lengths below this fraction of the nodes' spread give no direction.
const LEAST_LATERAL: f64 = 1e-4;

/// Why no patch can be cut at a contact.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PatchError {
    /// The contact is not a point.
    #[error("the contact {contact:?} is not finite")]
    ContactNotFinite {
        /// The contact, scene frame, mm.
        contact: [f64; 3],
    },
    /// The contact is not at the surface.
    #[error("the contact is {distance_mm} mm from the surface, more than the limit of {CONTACT_DISTANCE_LIMIT_MM} mm")]
    ContactTooFar {
        /// Distance to the nearest triangle that has a corner within the region; infinite where there is none, mm.
        distance_mm: f64,
    },
    /// The mesh is too small or too coarse.
    #[error("{found} vertices within reach of the contact, {NODE_COUNT} are needed")]
    TooFewVertices {
        /// Vertices of triangles that are connected to the contact and have a corner within [`REGION_RADIUS_MM`] of it.
        found: usize,
    },
    /// The triangles between the nodes have no common side, or there are none.
    #[error("the triangles between the nodes have no common outward side")]
    NoCommonNormal,
    /// The surface has more than one height over a point of the patch frame.
    #[error("triangle {triangle} of the mesh faces away from the patch: the surface is folded over itself")]
    Folded {
        /// Index of the triangle in the mesh.
        triangle: usize,
    },
}

impl Patch {
    /// The 64 vertices of the mesh nearest to a contact in scene coordinates (mm), with the triangles between them.
    ///
    /// Only the part of the surface that is connected to the contact within [`REGION_RADIUS_MM`] counts. Nodes keep the order of
    /// the mesh, triangles their order and first corner. The frame's origin is the surface point nearest to the contact, z the
    /// area-weighted mean normal of the triangles, x the way to the centroid of the nodes. Fails with [`PatchError`].
    pub fn cut(mesh: &TriangleMesh, contact: &Point3<f64>) -> Result<Self, PatchError> {
        if contact.iter().any(|coordinate| !coordinate.is_finite()) {
            return Err(PatchError::ContactNotFinite { contact: contact.coords.into() });
        }
        let region = Region::around(mesh, contact)?;
        let nodes = nearest_nodes(mesh, &region.vertices, contact)?;
        let node_of = |vertex: usize| nodes.binary_search(&vertex).ok();
        let triangles: Vec<[usize; 3]> = region
            .triangles
            .iter()
            .filter_map(|&triangle| {
                let [a, b, c] = mesh.triangles()[triangle].map(node_of);
                Some([a?, b?, c?])
            })
            .collect();
        let points: Vec<Point3<f64>> = nodes.iter().map(|&vertex| mesh.vertices()[vertex]).collect();
        let scene_from_patch = frame(&points, &triangles, &region.origin)?;
        let vertices: Vec<Point3<f64>> =
            points.iter().map(|point| scene_from_patch.inverse_transform_point(point)).collect();
        Ok(Self {
            surface: Surface::Mesh(region.height_field(mesh, &scene_from_patch)?),
            scene_from_patch,
            parameters: vertices.iter().map(|vertex| [vertex.x, vertex.y]).collect(),
            vertices,
            triangles,
            source_indices: Some(nodes),
        })
    }
}

/// The part of a mesh around a contact: indices of triangles and of their vertices, ascending, and the point of it nearest by.
struct Region {
    triangles: Vec<usize>,
    vertices: Vec<usize>,
    origin: Point3<f64>,
}

impl Region {
    fn around(mesh: &TriangleMesh, contact: &Point3<f64>) -> Result<Self, PatchError> {
        let near = |&vertex: &usize| (mesh.vertices()[vertex] - contact).norm() <= REGION_RADIUS_MM;
        let triangles: Vec<usize> =
            (0..mesh.triangles().len()).filter(|&triangle| mesh.triangles()[triangle].iter().any(near)).collect();
        let mut nearest = (f64::INFINITY, Point3::origin(), 0);
        for &triangle in &triangles {
            let point = nearest_point(mesh.triangles()[triangle].map(|corner| mesh.vertices()[corner]), contact);
            let distance = (point - contact).norm();
            if distance < nearest.0 {
                nearest = (distance, point, triangle);
            }
        }
        let (distance_mm, origin, start) = nearest;
        if distance_mm > CONTACT_DISTANCE_LIMIT_MM {
            return Err(PatchError::ContactTooFar { distance_mm });
        }
        let triangles = connected(mesh, triangles, start);
        let mut vertices: Vec<usize> = triangles.iter().flat_map(|&triangle| mesh.triangles()[triangle]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        Ok(Self { triangles, vertices, origin })
    }

    fn height_field(&self, mesh: &TriangleMesh, scene_from_patch: &Isometry3<f64>) -> Result<HeightField, PatchError> {
        let to_patch = |&vertex: &usize| scene_from_patch.inverse_transform_point(&mesh.vertices()[vertex]);
        // Every corner is among the region's vertices, so the partition point is its index.
        let renumber = |corner: usize| self.vertices.partition_point(|&vertex| vertex < corner);
        let vertices = self.vertices.iter().map(to_patch).collect();
        let triangles = self.triangles.iter().map(|&triangle| mesh.triangles()[triangle].map(renumber)).collect();
        HeightField::new(vertices, triangles)
            .map_err(|Folded { triangle }| PatchError::Folded { triangle: self.triangles[triangle] })
    }
}

/// The triangles that can be reached from `start` over shared vertices, ascending: another sheet of the mesh is none of them.
fn connected(mesh: &TriangleMesh, triangles: Vec<usize>, start: usize) -> Vec<usize> {
    let corners_of = |triangle: usize| mesh.triangles()[triangle];
    let mut around: Vec<(usize, usize)> =
        triangles.iter().flat_map(|&triangle| corners_of(triangle).map(|corner| (corner, triangle))).collect();
    around.sort_unstable();
    let mut reached = vec![false; triangles.len()];
    let mut waiting = vec![start];
    while let Some(triangle) = waiting.pop() {
        let place = triangles.partition_point(|&other| other < triangle);
        if std::mem::replace(&mut reached[place], true) {
            continue;
        }
        for corner in corners_of(triangle) {
            let first = around.partition_point(|&(vertex, _)| vertex < corner);
            let same = around[first..].iter().take_while(|&&(vertex, _)| vertex == corner);
            waiting.extend(same.map(|&(_, neighbour)| neighbour));
        }
    }
    triangles.into_iter().zip(reached).filter_map(|(triangle, reached)| reached.then_some(triangle)).collect()
}

/// The 64 of the vertices nearest to the contact, ascending.
fn nearest_nodes(mesh: &TriangleMesh, vertices: &[usize], contact: &Point3<f64>) -> Result<Vec<usize>, PatchError> {
    if vertices.len() < NODE_COUNT {
        return Err(PatchError::TooFewVertices { found: vertices.len() });
    }
    let key = |vertex: usize| {
        let point = mesh.vertices()[vertex];
        [(point - contact).norm_squared(), point.x, point.y, point.z]
    };
    let mut sorted: Vec<([f64; 4], usize)> = vertices.iter().map(|&vertex| (key(vertex), vertex)).collect();
    sorted.sort_by(|(one, _), (other, _)| {
        let by_number = one.iter().zip(other).map(|(a, b)| a.total_cmp(b));
        by_number.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    });
    let mut nodes: Vec<usize> = sorted[..NODE_COUNT].iter().map(|&(_, vertex)| vertex).collect();
    nodes.sort_unstable();
    Ok(nodes)
}

/// The patch frame of nodes in the scene, from their shape alone.
fn frame(points: &[Point3<f64>], triangles: &[[usize; 3]], origin: &Point3<f64>) -> Result<Isometry3<f64>, PatchError> {
    let normals: Vec<Vector3<f64>> = triangles.iter().map(|corners| doubled_area_normal(points, corners)).collect();
    let (sum, area): (Vector3<f64>, f64) = (normals.iter().sum(), normals.iter().map(Vector3::norm).sum());
    let z = Unit::try_new(sum, LEAST_COMMON_NORMAL * area).ok_or(PatchError::NoCommonNormal)?;
    let lateral = |point: &Point3<f64>| {
        let away = point - origin;
        away - z.into_inner() * z.dot(&away)
    };
    let laterals: Vec<Vector3<f64>> = points.iter().map(lateral).collect();
    let spread = laterals.iter().map(Vector3::norm).fold(0.0, f64::max);
    let to_centroid = laterals.iter().sum::<Vector3<f64>>() / points.len() as f64;
    // Nodes that balance around the contact: the way to the furthest, of equals the one with the smallest coordinates.
    let to_furthest = || {
        let furthest = points.iter().zip(&laterals).filter(|(_, way)| way.norm() >= spread * (1.0 - LEAST_LATERAL));
        let smaller = |a: &Point3<f64>, b: &Point3<f64>| a.coords.as_slice() < b.coords.as_slice();
        furthest.reduce(|one, other| if smaller(other.0, one.0) { other } else { one }).map(|(_, way)| *way)
    };
    let towards = if to_centroid.norm() > LEAST_LATERAL * spread { Some(to_centroid) } else { to_furthest() };
    let x = towards.and_then(|way| way.try_normalize(0.0)).ok_or(PatchError::NoCommonNormal)?;
    let axes = Matrix3::from_columns(&[x, z.cross(&x), z.into_inner()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Ok(Isometry3::from_parts(Translation3::from(*origin), rotation))
}

/// The point of a triangle nearest to `p`: inside, or on the nearest edge.
fn nearest_point([a, b, c]: [Point3<f64>; 3], p: &Point3<f64>) -> Point3<f64> {
    let normal = (b - a).cross(&(c - a));
    let weight =
        |from: Point3<f64>, to: Point3<f64>| normal.dot(&(to - from).cross(&(p - from))) / normal.norm_squared();
    let (weight_a, weight_b, weight_c) = (weight(b, c), weight(c, a), weight(a, b));
    if weight_a.min(weight_b).min(weight_c) >= 0.0 {
        return Point3::from(a.coords * weight_a + b.coords * weight_b + c.coords * weight_c);
    }
    let on_edge = |from: Point3<f64>, to: Point3<f64>| {
        let along = to - from;
        from + along * (along.dot(&(p - from)) / along.norm_squared()).clamp(0.0, 1.0)
    };
    let distance = |q: &Point3<f64>| (q - p).norm_squared();
    let nearer = |one, other| {
        if distance(&other) < distance(&one) { other } else { one }
    };
    nearer(nearer(on_edge(a, b), on_edge(b, c)), on_edge(c, a))
}
