//! Triangles of an STL file, text or binary.
//!
//! Contract: each triangle has three vertices of its own, in f32 as the format has them; the normals of the file are ignored, the order of the corners
//! says which side is out. A file is binary when its length is what its count of triangles takes, whatever its first word is: many programs
//! begin binary files with `solid`, too. Units: those of the file, taken as mm.
//!
//! Not here: several solids in one file, which are refused; colours.

use std::io::Cursor;

use nalgebra::Point3;

use super::mesh_file::{MeshFileError, MeshFormat, Polygons, TRIANGLE_LIMIT, within};

/// First word of a text.
const SOLID: &[u8] = b"solid";

/// Bytes before the count of triangles in a binary file.
const HEADER_BYTES: usize = 80;

/// Bytes of that count.
const COUNT_BYTES: usize = 4;

/// Bytes of a triangle: normal and three corners in f32, and an attribute.
const TRIANGLE_BYTES: u64 = 50;

pub(super) fn read(bytes: &[u8]) -> Result<Polygons, MeshFileError> {
    let announced = announced(bytes);
    let wanted = announced.map(|count| (HEADER_BYTES + COUNT_BYTES) as u64 + TRIANGLE_BYTES * u64::from(count));
    if wanted == Some(bytes.len() as u64) {
        // The reader goes by the first word, which must not be that of a text.
        let mut file = bytes.to_vec();
        file[..SOLID.len()].fill(0);
        return triangles(file, announced);
    }
    if let Some(text) = bytes.strip_prefix(SOLID) {
        // A text without a name may end its first line at once; the reader wants a space.
        return triangles([SOLID, b" ", text].concat(), None);
    }
    let length = bytes.len();
    Err(malformed(match (announced, wanted) {
        (Some(count), Some(wanted)) => format!("{count} triangles take {wanted} bytes, and there are {length}"),
        _ => format!("{length} bytes are neither a text that begins with `solid` nor a binary file"),
    }))
}

/// The triangles that a binary file announces; `None` for what is too short for one.
fn announced(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER_BYTES..HEADER_BYTES + COUNT_BYTES)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn triangles(file: Vec<u8>, announced: Option<u32>) -> Result<Polygons, MeshFileError> {
    within("triangles", announced.unwrap_or_default() as usize, TRIANGLE_LIMIT)?;
    let solids = if announced.is_none() { count_solids(&file) } else { 1 };
    if solids > 1 {
        return Err(malformed(format!("there are {solids} solids; the surface is one")));
    }
    let mut file = Cursor::new(file);
    let reader = stl_io::create_stl_reader(&mut file).map_err(|error| malformed(error.to_string()))?;
    let mut polygons = Polygons::default();
    for (index, triangle) in reader.enumerate() {
        let triangle = triangle.map_err(|error| malformed(format!("triangle {index}: {error}")))?;
        let first = polygons.vertices.len();
        for corner in triangle.vertices {
            let [x, y, z] = [corner[0], corner[1], corner[2]].map(f64::from);
            polygons.push_vertex(Point3::new(x, y, z))?;
        }
        polygons.push_polygon(&[first, first + 1, first + 2])?;
    }
    Ok(polygons)
}

/// Lines of a text that begin a solid.
fn count_solids(text: &[u8]) -> usize {
    text.split(|byte| *byte == b'\n').filter(|line| line.trim_ascii_start().starts_with(SOLID)).count()
}

fn malformed(reason: String) -> MeshFileError {
    MeshFileError::Malformed { format: MeshFormat::Stl, reason }
}
