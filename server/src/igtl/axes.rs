//! The axes of a session's world, and from them to the scene's and back.
//!
//! Contract: the scene's axes are taken as right, anterior, superior (RAS), which 3D Slicer uses inside, so RAS coordinates are the scene's
//! unchanged. LPS (left, posterior, superior; DICOM, ITK, and the files that Slicer writes) is the same world with x and y the other way
//! round: a turn by 180° about z, its own inverse, so right-handed stays right-handed. The needle's own frame is the needle's in both: a rotation
//! is turned on the side of the world only. Units are mm in both.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// How far a matrix may be from a rotation, each entry of RᵀR: numbers of 32 bits, multiplied a few times on their way.
pub const ROTATION_TOLERANCE: f64 = 1e-3;

/// Axes of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axes {
    /// Right, anterior, superior: the scene's own.
    #[default]
    Ras,
    /// Left, posterior, superior.
    Lps,
}

impl Axes {
    /// A vector or point of the world in the scene's axes, and the other way round.
    pub fn turn(self, vector: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = vector;
        match self {
            Axes::Ras => vector,
            Axes::Lps => [-x, -y, z],
        }
    }

    /// The same rotation from the needle's frame, its columns told in the other axes.
    pub fn turn_columns(self, columns: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        columns.map(|column| self.turn(column))
    }
}

/// The quaternion (x, y, z, w) of the rotation with these columns, if it is one.
pub fn quaternion(columns: [[f64; 3]; 3]) -> Option<[f64; 4]> {
    let matrix = Matrix3::from_columns(&columns.map(Vector3::from));
    let is_orthonormal = (matrix.transpose() * matrix - Matrix3::identity()).amax() <= ROTATION_TOLERANCE;
    if !is_orthonormal || matrix.determinant() < 0.0 {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Some(rotation.into_inner().normalize().coords.into())
}
