//! Vertices and faces of a PLY file, text or binary.
//!
//! Contract: element `vertex` with `x`, `y`, `z` and element `face` with `vertex_indices` or `vertex_index`, of any number types.
//! Other elements and properties are skipped. Units: those of the file, taken as mm.
//!
//! Not here: triangle strips. A header may announce any number of elements at no cost to its writer, so the numbers are held against
//! the limits and against the bytes that are there before anything is read.

use nalgebra::Point3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use super::mesh_file::{MeshFileError, MeshFormat, Polygons, TRIANGLE_LIMIT, VERTEX_LIMIT, within};

/// A vertex, a face or an element to skip.
#[derive(Debug, Default)]
struct Element {
    position: [Option<f64>; 3],
    corners: Option<Vec<i64>>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "x" => self.position[0] = scalar(&property),
            "y" => self.position[1] = scalar(&property),
            "z" => self.position[2] = scalar(&property),
            "vertex_indices" | "vertex_index" => self.corners = indices(property),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Polygons, MeshFileError> {
    let mut reader = Reader::new(bytes);
    let parser = Parser::<Element>::new();
    let header = parser.read_header(&mut reader).map_err(|error| malformed(error.to_string()))?;
    let mut polygons = Polygons::default();
    for (name, definition) in &header.elements {
        let (what, limit) = match name.as_str() {
            "vertex" => ("vertices", VERTEX_LIMIT),
            "face" => ("faces", TRIANGLE_LIMIT),
            _ => ("elements to skip", TRIANGLE_LIMIT),
        };
        within(what, definition.count, limit)?;
        // No element with a property takes less than a byte, and one without would be read for ever from nothing.
        if definition.count > bytes.len() || definition.properties.is_empty() {
            return Err(malformed(format!("{} {what} do not fit into {} bytes", definition.count, bytes.len())));
        }
        let elements = parser
            .read_payload_for_element(&mut reader, definition, &header)
            .map_err(|error| malformed(error.to_string()))?;
        for (index, element) in elements.into_iter().enumerate() {
            match name.as_str() {
                "vertex" => polygons.push_vertex(vertex(index, &element)?)?,
                "face" => polygons.push_polygon(&face(index, &element)?)?,
                _ => {}
            }
        }
    }
    Ok(polygons)
}

fn malformed(reason: String) -> MeshFileError {
    MeshFileError::Malformed { format: MeshFormat::Ply, reason }
}

fn vertex(index: usize, element: &Element) -> Result<Point3<f64>, MeshFileError> {
    match element.position {
        [Some(x), Some(y), Some(z)] => Ok(Point3::new(x, y, z)),
        _ => Err(malformed(format!("vertex {index} lacks x, y or z"))),
    }
}

fn face(index: usize, element: &Element) -> Result<Vec<usize>, MeshFileError> {
    let corners = element.corners.as_ref();
    let corners = corners.ok_or_else(|| malformed(format!("face {index} lacks vertex_indices")))?;
    if corners.len() < 3 {
        return Err(malformed(format!("face {index} has {} corners", corners.len())));
    }
    let vertex = |&corner: &i64| {
        usize::try_from(corner).map_err(|_| malformed(format!("face {index} refers to vertex {corner}")))
    };
    corners.iter().map(vertex).collect()
}

fn scalar(property: &Property) -> Option<f64> {
    Some(match property {
        Property::Char(value) => f64::from(*value),
        Property::UChar(value) => f64::from(*value),
        Property::Short(value) => f64::from(*value),
        Property::UShort(value) => f64::from(*value),
        Property::Int(value) => f64::from(*value),
        Property::UInt(value) => f64::from(*value),
        Property::Float(value) => f64::from(*value),
        Property::Double(value) => *value,
        _ => return None,
    })
}

fn indices(property: Property) -> Option<Vec<i64>> {
    Some(match property {
        Property::ListChar(values) => values.into_iter().map(i64::from).collect(),
        Property::ListUChar(values) => values.into_iter().map(i64::from).collect(),
        Property::ListShort(values) => values.into_iter().map(i64::from).collect(),
        Property::ListUShort(values) => values.into_iter().map(i64::from).collect(),
        Property::ListInt(values) => values.into_iter().map(i64::from).collect(),
        Property::ListUInt(values) => values.into_iter().map(i64::from).collect(),
        _ => return None,
    })
}
