//! The contents of the messages of the server. All numbers are big-endian; coordinates are f32.
//! Source: OpenIGTLink, `Documents/Protocol/{transform,point,polydata,sensordata,string,status,capability}.md`.

use super::content::ENCODINGS;
use super::frame::padded;

/// Status of a client that is in order.
pub const OK: u16 = 1;

/// Attribute of POLYDATA: of the points, scalars (type 0) of one component. The type comes first and the count second, as the reference library
/// has it in `igtl_polydata.h` and its test data; the text of the protocol can be read the other way round.
const POINT_SCALARS: [u8; 2] = [0x00, 1];

/// Attribute of POLYDATA: of the points, normals (type 2) of three components.
const POINT_NORMALS: [u8; 2] = [0x02, 3];

/// Colour of the nodes: opaque yellow.
const RGBA: [u8; 4] = [255, 255, 0, 255];

/// Texts are cut here, bytes: their length has 16 bits.
const LONGEST_TEXT: usize = u16::MAX as usize;

fn push(content: &mut Vec<u8>, numbers: &[f64]) {
    numbers.iter().for_each(|number| content.extend_from_slice(&(*number as f32).to_be_bytes()));
}

fn count(content: &mut Vec<u8>, number: usize) {
    content.extend_from_slice(&(number as u32).to_be_bytes());
}

/// TRANSFORM: columns of a rotation, then a translation (mm).
pub fn transform(columns: &[[f64; 3]; 3], translation_mm: [f64; 3]) -> Vec<u8> {
    let mut content = Vec::with_capacity(48);
    columns.iter().for_each(|column| push(&mut content, column));
    push(&mut content, &translation_mm);
    content
}

/// POINT: points (mm) that are named by their number.
pub fn points(points_mm: &[[f64; 3]]) -> Vec<u8> {
    const BYTES: usize = 136;
    let mut content = Vec::with_capacity(BYTES * points_mm.len());
    for (number, point_mm) in points_mm.iter().enumerate() {
        content.extend_from_slice(&padded::<64>(&number.to_string()));
        content.extend_from_slice(&padded::<32>("Retina"));
        content.extend_from_slice(&RGBA);
        push(&mut content, point_mm);
        // No diameter and no owner.
        push(&mut content, &[0.0]);
        content.extend_from_slice(&[0; 20]);
    }
    content
}

/// POLYDATA: triangles between points (mm) with normals and one scalar a point of the name given.
pub fn polydata(
    points_mm: &[[f64; 3]],
    triangles: &[[usize; 3]],
    normals: &[[f64; 3]],
    (scalar_name, scalars): (&str, &[f64]),
) -> Vec<u8> {
    let names = [scalar_name, "Normals"].map(|name| [name.as_bytes(), &[0]].concat()).concat();
    let mut content = Vec::with_capacity(64 + names.len() + 28 * points_mm.len() + 16 * triangles.len());
    count(&mut content, points_mm.len());
    // Vertices, lines: none, of no size.
    (0..4).for_each(|_| count(&mut content, 0));
    count(&mut content, triangles.len());
    // Each with its count of corners; the size is in bytes.
    count(&mut content, 16 * triangles.len());
    // Strips: none. Attributes: two.
    [0, 0, 2].into_iter().for_each(|number| count(&mut content, number));
    points_mm.iter().for_each(|point| push(&mut content, point));
    for triangle in triangles {
        count(&mut content, 3);
        triangle.iter().for_each(|corner| count(&mut content, *corner));
    }
    for (kind, length) in [(POINT_SCALARS, scalars.len()), (POINT_NORMALS, normals.len())] {
        content.extend_from_slice(&kind);
        count(&mut content, length);
    }
    content.extend_from_slice(&names);
    if names.len() % 2 == 1 {
        content.push(0);
    }
    push(&mut content, scalars);
    normals.iter().for_each(|normal| push(&mut content, normal));
    content
}

/// SENSOR: up to 255 numbers of one unit.
pub fn sensor(unit: u64, values: &[f64]) -> Vec<u8> {
    let values = &values[..values.len().min(255)];
    let mut content = vec![values.len() as u8, 0];
    content.extend_from_slice(&unit.to_be_bytes());
    values.iter().for_each(|value| content.extend_from_slice(&value.to_be_bytes()));
    content
}

/// STRING: a text, UTF-8.
pub fn string(text: &str) -> Vec<u8> {
    let text = &text[..text.floor_char_boundary(LONGEST_TEXT)];
    let mut content = Vec::with_capacity(4 + text.len());
    // pyigtl and old readers know US-ASCII best.
    let encoding = if text.is_ascii() { ENCODINGS[0] } else { ENCODINGS[1] };
    content.extend_from_slice(&encoding.to_be_bytes());
    content.extend_from_slice(&(text.len() as u16).to_be_bytes());
    content.extend_from_slice(text.as_bytes());
    content
}

/// STATUS: a code, a code of the server's own, a name and what happened.
pub fn status(code: u16, own: i64, name: &str, text: &str) -> Vec<u8> {
    let mut content = Vec::with_capacity(30 + text.len());
    content.extend_from_slice(&code.to_be_bytes());
    content.extend_from_slice(&own.to_be_bytes());
    content.extend_from_slice(&padded::<20>(name));
    content.extend_from_slice(text.as_bytes());
    content
}

/// CAPABILITY: names of types.
pub fn capability(kinds: &[&str]) -> Vec<u8> {
    kinds.iter().flat_map(|kind| padded::<12>(kind)).collect()
}
