//! A needle: its shape, its pose in the scene, and how stiff its shaft is.
//!
//! Contract: the shaft runs along local +z from the tip, the needle points along local −z, and `tip_mm` is the foremost point of the
//! needle: the apex on the axis, or for a bevel the sharp point, which lies towards local +x. Units: mm, degrees.
//!
//! Not here: what the needle does to the tissue (`effect`), what bending does (`effect`), triangles to draw it.

pub mod body;
pub mod gauge;
mod rays;
pub mod shaft;
pub mod shape;
mod underside;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

pub use body::{Body, SignedDistance};
pub use gauge::{GAUGES, Gauge, UnknownGauge};
use shaft::STIFFNESS;
pub use shape::{NeedleShape, Tip};

use crate::range::{OutOfRange, ParameterRange};

/// A coordinate of the tip in the scene.
pub const TIP_COORDINATE: ParameterRange = ParameterRange {
    name: "tip coordinate",
    unit: "mm",
    default: 0.0,
    min: -1000.0,
    max: 1000.0,
    source: "bound of this program: a scene frame may be the robot's, and f64 keeps a nanometre at a metre",
};

/// Length of the quaternion of an orientation, a pure number.
pub const ORIENTATION_NORM: ParameterRange = ParameterRange {
    name: "orientation norm",
    unit: "1",
    default: 1.0,
    min: 1.0 - 1e-6,
    max: 1.0 + 1e-6,
    source: "bound of this program: a rotation written with single precision",
};

/// A needle in the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needle {
    /// Radius and tip.
    pub shape: NeedleShape,
    /// The foremost point in scene coordinates, mm.
    pub tip_mm: Point3<f64>,
    /// Rotation from needle-local to scene coordinates.
    pub orientation: UnitQuaternion<f64>,
    /// Force for a deflection of the tip across the shaft, mN/mm; `None`: the shaft is rigid.
    pub stiffness_mn_per_mm: Option<f64>,
}

impl Needle {
    /// A needle with a rigid shaft that points along `direction` (scene coordinates), turned by [`orientation_pointing`].
    pub fn pointing(shape: NeedleShape, tip_mm: Point3<f64>, direction: &Unit<Vector3<f64>>) -> Self {
        Self { shape, tip_mm, orientation: orientation_pointing(direction), stiffness_mn_per_mm: None }
    }

    /// The direction in which the needle points, in scene coordinates.
    pub fn direction(&self) -> Unit<Vector3<f64>> {
        self.orientation * -Vector3::z_axis()
    }

    /// Takes needle-local coordinates to scene coordinates, mm.
    pub fn scene_from_needle(&self) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(self.tip_mm), self.orientation)
    }

    /// Holds shape, tip coordinates and orientation against their ranges; fails with the first that is outside.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        self.shape.validate()?;
        for (index, &coordinate) in self.tip_mm.coords.iter().enumerate() {
            TIP_COORDINATE.check(&format!("needle.tip_mm[{index}]"), coordinate)?;
        }
        if let Some(stiffness) = self.stiffness_mn_per_mm {
            STIFFNESS.check("needle.stiffness_mn_per_mm", stiffness)?;
        }
        ORIENTATION_NORM.check("needle.orientation_xyzw", self.orientation.quaternion().norm())
    }
}

/// The shortest rotation that takes local −z, the way a needle points, to `direction`.
///
/// The shortest rotation turns about an axis across local z, so it fixes the roll of a bevel: none is added to what the tilt brings.
/// A needle that is to point along +z has no shortest rotation; it is turned half around about its local x.
pub fn orientation_pointing(direction: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    // Half-angle form (1 + cos, sin * axis) with axis = -z x direction. Near +z the scalar part 1 - z cancels, so it is formed from
    // the lateral part instead.
    let (x, y, z) = (direction.x, direction.y, direction.z);
    let lateral_squared = x * x + y * y;
    if z > 0.0 && lateral_squared == 0.0 {
        return UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    }
    let scalar = if z > 0.0 { lateral_squared / (1.0 + z) } else { 1.0 - z };
    UnitQuaternion::from_quaternion(Quaternion::new(scalar, y, -x, 0.0))
}
