//! Triangle meshes from the bytes of PLY, OBJ and STL files.
//!
//! Contract: positions in mm, polygons as fans of triangles around their first corner; equal vertices are merged and triangles
//! without area dropped, as in [`TriangleMesh::welded`]. Normals, colours and textures are ignored. Every malformed input is an error,
//! and memory stays in proportion to the bytes given. Units: mm.
//!
//! Not here: opening files, other formats, units other than mm.

use nalgebra::Point3;
use thiserror::Error;

use super::triangle_mesh::{MeshError, TriangleMesh};
use super::{obj, ply, stl};

/// Vertices that a file may have, before merging.
pub const VERTEX_LIMIT: usize = 2_000_000;

/// Triangles that a file may have: twice the vertices, as in a closed surface.
pub const TRIANGLE_LIMIT: usize = 4_000_000;

/// The formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// Polygon file format, text or binary.
    Ply,
    /// Wavefront text.
    Obj,
    /// Stereolithography, text or binary.
    Stl,
}

impl MeshFormat {
    /// Every format with the ending of its file names.
    pub const ENDINGS: [(&'static str, MeshFormat); 3] =
        [("ply", MeshFormat::Ply), ("obj", MeshFormat::Obj), ("stl", MeshFormat::Stl)];

    /// The format of a file of this name, by its ending in small or capital letters; `None` for any other.
    pub fn of_name(name: &str) -> Option<Self> {
        let (_, ending) = name.rsplit_once('.')?;
        let named = Self::ENDINGS.iter().find(|(known, _)| known.eq_ignore_ascii_case(ending));
        named.map(|(_, format)| *format)
    }
}

/// Why bytes are not a mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshFileError {
    /// The bytes do not follow the format.
    #[error("malformed {format:?} file: {reason}")]
    Malformed {
        /// The format that was expected.
        format: MeshFormat,
        /// What is wrong and, where known, in which line.
        reason: String,
    },
    /// The file holds more than is read.
    #[error("{count} {what} are more than the limit of {limit}")]
    TooLarge {
        /// What there are too many of.
        what: &'static str,
        /// How many the file holds or announces.
        count: usize,
        /// How many are read.
        limit: usize,
    },
    /// The file has no triangles.
    #[error("the file has no triangles")]
    Empty,
    /// The triangles are not a surface. Vertices and triangles are numbered from 0 in the order of the file with polygons split;
    /// for a triangle that is turned over, after merging and dropping.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Vertices and polygons as a file lists them.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    pub(super) vertices: Vec<Point3<f64>>,
    pub(super) triangles: Vec<[usize; 3]>,
}

impl Polygons {
    pub(super) fn push_vertex(&mut self, vertex: Point3<f64>) -> Result<(), MeshFileError> {
        self.vertices.push(vertex);
        within("vertices", self.vertices.len(), VERTEX_LIMIT)
    }

    /// Splits a polygon of at least three corners into a fan.
    pub(super) fn push_polygon(&mut self, corners: &[usize]) -> Result<(), MeshFileError> {
        within("triangles", self.triangles.len() + corners.len().saturating_sub(2), TRIANGLE_LIMIT)?;
        if let [first, rest @ ..] = corners {
            self.triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
        Ok(())
    }
}

/// Fails with [`MeshFileError::TooLarge`] above the limit.
pub(super) fn within(what: &'static str, count: usize, limit: usize) -> Result<(), MeshFileError> {
    if count > limit {
        return Err(MeshFileError::TooLarge { what, count, limit });
    }
    Ok(())
}

/// Reads a mesh in mm from the bytes of a file. Fails with [`MeshFileError`] and never panics.
pub fn read_mesh(bytes: &[u8], format: MeshFormat) -> Result<TriangleMesh, MeshFileError> {
    let Polygons { vertices, triangles } = match format {
        MeshFormat::Ply => ply::read(bytes)?,
        MeshFormat::Obj => obj::read(bytes)?,
        MeshFormat::Stl => stl::read(bytes)?,
    };
    let mesh = TriangleMesh::welded(vertices, triangles)?;
    if mesh.triangles().is_empty() {
        return Err(MeshFileError::Empty);
    }
    Ok(mesh)
}
