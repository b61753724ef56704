//! The contact that a request's numbers are told from: lengths to measure in, and the directions that break its symmetry.
//!
//! All vectors turn and mirror with the request. There is no second tangent to complete a frame with: it would tell left from right.

use nalgebra::Vector3;

use super::input::Input;
use crate::needle::Tip;

/// Smallest contact radius that lengths are measured in, in needle radii.
const SMALLEST_CONTACT: f32 = 0.05;

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFrame {
    /// Centre of the contact (mm).
    pub center: Vector3<f32>,
    /// Unit inward normal.
    pub inward: Vector3<f32>,
    /// The way that the needle points.
    pub points: Vector3<f32>,
    /// Its part along the surface.
    pub tilt: Vector3<f32>,
    /// The part of the driving direction along the surface.
    pub drive: Vector3<f32>,
    /// The side of a bevel's sharp point; zero for other tips.
    pub bevel: Vector3<f32>,
    /// Its part along the surface.
    pub bevel_tangent: Vector3<f32>,
    /// Outward normal of a bevel's face; the way that other needles point.
    pub face: Vector3<f32>,
    /// How the retina thickens along the surface; zero where there is no pit.
    pub slope: Vector3<f32>,
    /// Contact radius (mm).
    pub contact_mm: f32,
    /// Needle radius (mm).
    pub radius_mm: f32,
    /// Thickness of retina and choroid (mm).
    pub yielding_mm: f32,
    /// Depth of the linear answer (mm).
    pub depth_mm: f32,
}

impl ContactFrame {
    /// The frame of `input`.
    pub fn new(input: &Input) -> Self {
        let inward = input.inward;
        let along = |v: Vector3<f32>| v - inward * v.dot(&inward);
        let turn = input.patch_from_needle.rotation.cast::<f32>();
        let points = turn * -Vector3::z();
        let (bevel, face) = match input.shape.tip {
            Tip::Bevelled { angle_deg, .. } => {
                let (sin, cos) = (angle_deg as f32).to_radians().sin_cos();
                (turn * Vector3::x(), points * sin - turn * Vector3::x() * cos)
            }
            Tip::Hemispherical | Tip::Flat { .. } => (Vector3::zeros(), points),
        };
        let radius_mm = input.shape.radius_mm as f32;
        let [retina, choroid, _] = input.tissue.thickness_mm;
        ContactFrame {
            center: input.center_mm,
            inward,
            points,
            tilt: along(points),
            drive: along(input.direction),
            bevel,
            bevel_tangent: along(bevel),
            face,
            slope: along(input.relief.slope),
            contact_mm: input.contact_radius_mm.max(SMALLEST_CONTACT * radius_mm),
            radius_mm,
            yielding_mm: retina + choroid,
            depth_mm: input.depth_mm,
        }
    }

    /// The part of `v` along the surface at the contact.
    pub fn tangent(&self, v: &Vector3<f32>) -> Vector3<f32> {
        v - self.inward * v.dot(&self.inward)
    }
}
