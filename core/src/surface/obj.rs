//! Vertices and faces of a Wavefront OBJ file.
//!
//! Contract: `v` and `f` statements in f64, vertices numbered as in the file; negative indices count back from the vertices so far.
//! All other statements are skipped. Units: those of the file, taken as mm.
//!
//! Not here: free-form curves, line continuations, materials. Written out because no crate keeps what errors and results name, the file's own
//! numbers, of every file: tobj 4.0 (f64 by a feature) numbers vertices by their first use, once more in each group, drops those without a face
//! and says no line; wavefront_obj 11.0 (f64, in order) refuses colours and a fourth coordinate, negative indices and faces with vertices from
//! before their object, and panics at the smallest index; obj-rs 0.7 reads f32 and panics at statements that it does not know.

use nalgebra::Point3;

use super::mesh_file::{MeshFileError, MeshFormat, Polygons};

pub(super) fn read(bytes: &[u8]) -> Result<Polygons, MeshFileError> {
    let text = std::str::from_utf8(bytes).map_err(|error| malformed(error.to_string()))?;
    let mut polygons = Polygons::default();
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        let at_line = |reason: String| malformed(format!("line {number}: {reason}"));
        match words.next() {
            Some("v") => polygons.push_vertex(vertex(words).map_err(at_line)?)?,
            Some("f") => {
                let corners: Result<Vec<usize>, String> =
                    words.map(|word| corner(word, polygons.vertices.len())).collect();
                let corners = corners.map_err(at_line)?;
                if corners.len() < 3 {
                    return Err(at_line(format!("a face of {} corners", corners.len())));
                }
                polygons.push_polygon(&corners)?;
            }
            _ => {}
        }
    }
    Ok(polygons)
}

fn malformed(reason: String) -> MeshFileError {
    MeshFileError::Malformed { format: MeshFormat::Obj, reason }
}

/// Three coordinates; a fourth, and colours after it, are ignored.
fn vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<Point3<f64>, String> {
    let mut vertex = Point3::origin();
    for coordinate in vertex.iter_mut() {
        let word = words.next().ok_or("a vertex has three coordinates")?;
        *coordinate = word.parse().map_err(|_| format!("{word:?} is not a coordinate"))?;
    }
    Ok(vertex)
}

/// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from zero.
fn corner(word: &str, vertex_count: usize) -> Result<usize, String> {
    let index = word.split('/').next().unwrap_or(word);
    let number: i64 = index.parse().map_err(|_| format!("{word:?} is not a corner"))?;
    let vertex = match usize::try_from(number.unsigned_abs()) {
        Ok(magnitude) if number > 0 => Some(magnitude - 1),
        Ok(magnitude) if number < 0 => vertex_count.checked_sub(magnitude),
        _ => None,
    };
    vertex.ok_or_else(|| format!("there is no vertex {number} among the {vertex_count} so far"))
}
