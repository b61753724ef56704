//! The core's surfaces, needles and forces as rerun's meshes, lines and arrows, with their looks.
//!
//! Contract: coordinates stay the scene's, in mm; nothing is exaggerated but where `entities` says so in a name.

use nalgebra::{Point3, Vector3};
use rerun::datatypes::Quaternion;
use rerun::{Arrows3D, Color, LineStrips3D, Mesh3D, Transform3D};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::Prediction;

use super::colours::Scale;
use super::entities::{ARROW_MM_PER_MN, ERROR_MAGNIFICATION};
use super::needle_mesh::NeedleMesh;

const EDGE_RADIUS_MM: f32 = 0.003;
const ARROW_RADIUS_MM: f32 = 0.02;
const ERROR_ARROW_RADIUS_MM: f32 = 0.012;
/// Edges of a deformed surface.
pub const EDGE: Color = Color(rerun::datatypes::Rgba32(0x0a0a_0aff));
/// Edges of a surface at rest.
pub const REST_EDGE: Color = Color(rerun::datatypes::Rgba32(0x9aa3_ad60));
const STEEL: [u8; 4] = [190, 198, 208, 70];
/// Force of the needle.
pub const FORCE: Color = Color(rerun::datatypes::Rgba32(0xffb0_20ff));
/// Force of the tissue.
pub const REACTION: Color = Color(rerun::datatypes::Rgba32(0x3fd0_ffff));

fn point(point: &Point3<f64>) -> [f32; 3] {
    [point.x as f32, point.y as f32, point.z as f32]
}

fn vector(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

/// The patch as a lit mesh, coloured by `values_um`.
pub fn surface(prediction: &Prediction, values_um: &[f64], scale: &Scale) -> Mesh3D {
    Mesh3D::new(prediction.vertices.iter().map(point))
        .with_triangle_indices(prediction.triangles.iter().map(|corners| corners.map(|corner| corner as u32)))
        .with_vertex_normals(prediction.normals.iter().map(vector))
        .with_vertex_colors(scale.colours(values_um))
}

/// Every edge of the triangles once.
pub fn edges(vertices: &[Point3<f64>], triangles: &[[usize; 3]], colour: Color) -> LineStrips3D {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut ends: Vec<[usize; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    ends.sort_unstable();
    ends.dedup();
    let strips = ends.into_iter().map(|ends| ends.map(|end| point(&vertices[end])));
    LineStrips3D::new(strips).with_radii([EDGE_RADIUS_MM]).with_colors([colour])
}

/// A needle in its own coordinates.
pub fn needle(shape: &NeedleShape) -> Mesh3D {
    let NeedleMesh { vertices, normals, triangles } = NeedleMesh::new(shape);
    Mesh3D::new(vertices.iter().map(point))
        .with_triangle_indices(triangles)
        .with_vertex_normals(normals.iter().map(vector))
        .with_albedo_factor(STEEL)
}

/// Takes the needle from its own coordinates to where it ended up, foremost point at `tip_mm`.
pub fn pose(needle: &Needle, tip_mm: &Point3<f64>) -> Transform3D {
    let quaternion: [f64; 4] = needle.orientation.coords.into();
    let quaternion = Quaternion::from_xyzw(quaternion.map(|part| part as f32));
    Transform3D::from_translation(point(tip_mm)).with_quaternion(quaternion)
}

/// A force from `origin` (mm), with its length in words.
pub fn arrow(origin: &Point3<f64>, force_mn: &Vector3<f64>, name: &str, colour: Color) -> Arrows3D {
    Arrows3D::from_vectors([vector(&(force_mn * ARROW_MM_PER_MN))])
        .with_origins([point(origin)])
        .with_radii([ARROW_RADIUS_MM])
        .with_colors([colour])
        .with_labels([format!("{name} {:.3} mN", force_mn.norm())])
}

/// From each true node towards the predicted one, magnified.
pub fn error_arrows(predicted: &Prediction, truth: &Prediction, errors_um: &[f64], scale: &Scale) -> Arrows3D {
    let off = predicted.vertices.iter().zip(&truth.vertices);
    Arrows3D::from_vectors(off.map(|(from, to)| vector(&((from - to) * ERROR_MAGNIFICATION))))
        .with_origins(truth.vertices.iter().map(point))
        .with_radii([ERROR_ARROW_RADIUS_MM])
        .with_colors(scale.colours(errors_um))
}
