//! Where a needle that moves along a line first meets the rest surface.
//!
//! The needle's foremost point along the inward normal and the surface point on its way are iterated until they agree: the surface is
//! gently curved on the needle's scale, so this contracts. The result aims a mesh; the exact gap is measured on that mesh.
//! Not here: deformation, forces.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::needle::Body;
use crate::surface::Surface;

/// First touch of needle and rest surface, patch frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Signed way of the needle along its direction until it touches (mm); negative if it starts inside the tissue.
    pub travel_mm: f64,
    /// Patch parameters of the surface point.
    pub parameter: [f64; 2],
    /// Inward normal of the surface there.
    pub inward: Unit<Vector3<f64>>,
}

/// Iterations of foremost point against surface point.
const MAX_ITERATIONS: usize = 40;
/// Iterations of the ray against the surface.
const RAY_ITERATIONS: usize = 30;
/// Share of the way to the next touch point that a tip with an edge goes: it jumps from rim to rim otherwise.
const EDGED_SHARE: f64 = 0.5;
/// Change of the touch point below which it is settled (mm).
const SETTLED_MM: f64 = 1e-7;
/// Steepest direction against the surface normal for which a ray is followed (cosine of 89°).
const SMALLEST_COSINE: f64 = 0.0175;

/// First touch of `body` at the pose `patch_from_needle` moving along `direction`; `None` if the direction does not lead into the
/// tissue or the shaft would touch before the tip.
pub fn first_touch(
    surface: &Surface,
    body: &Body,
    patch_from_needle: &Isometry3<f64>,
    direction: &Unit<Vector3<f64>>,
) -> Option<Touch> {
    let mut parameter = [patch_from_needle.translation.x, patch_from_needle.translation.y];
    let mut touch = None;
    let share = if body.is_round() { 1.0 } else { EDGED_SHARE };
    for _ in 0..MAX_ITERATIONS {
        let inward = -surface.normal(parameter[0], parameter[1]);
        let inward_in_needle = patch_from_needle.inverse_transform_unit_vector(&inward);
        let foremost = patch_from_needle * body.foremost_along(&inward_in_needle)?;
        let (travel_mm, hit) = follow_ray(surface, &foremost, direction)?;
        let moved = (hit[0] - parameter[0]).hypot(hit[1] - parameter[1]);
        parameter = [0, 1].map(|k| parameter[k] + share * (hit[k] - parameter[k]));
        touch = Some(Touch { travel_mm, parameter: hit, inward });
        if moved < SETTLED_MM {
            break;
        }
    }
    touch
}

/// Way along `direction` from `origin` to the surface, and the patch parameters there.
fn follow_ray(surface: &Surface, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<(f64, [f64; 2])> {
    let mut travel = 0.0;
    let mut parameter = [origin.x, origin.y];
    for _ in 0..RAY_ITERATIONS {
        let at = origin + direction.into_inner() * travel;
        let column = surface.column(parameter[0], parameter[1]);
        // The column's surface point need not lie at (x, y) = parameter: shift the parameter by what it misses.
        parameter = [parameter[0] + at.x - column.surface.x, parameter[1] + at.y - column.surface.y];
        let outward = surface.normal(parameter[0], parameter[1]);
        let closing = -outward.dot(direction);
        if closing < SMALLEST_COSINE {
            return None;
        }
        let column = surface.column(parameter[0], parameter[1]);
        let step = outward.dot(&(at - column.surface)) / closing;
        travel += step;
        if step.abs() < SETTLED_MM {
            break;
        }
    }
    travel.is_finite().then_some((travel, parameter))
}
