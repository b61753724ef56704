//! The solid of a needle in its own coordinates, as a signed distance with derivatives.
//!
//! Contract: the origin is the foremost point, the shaft runs along +z without end, the value is negative inside. All tips are one
//! formula. With `a` the distance outside the cylinder of the core, `b` the distance beyond its end plane and `r` the radius of the
//! edge,
//!
//! ```text
//! d = min(max(a, b), 0) + |(max(a, 0), max(b, 0))| - r
//! ```
//!
//! rolls a rounded edge around the core: half a ball where the core is the axis alone, a flat tip where the end plane stands across
//! the shaft, a bevel where it leans. For the first two `d` is the exact distance. On a bevel's rounded edge the normals of cylinder
//! and plane are not orthogonal, so there `d` is not the exact distance; its zero set is the needle's surface all the same, and `d`
//! stays convex. Being convex is what the searches along rays rely on. Units: mm.
//!
//! Not here: the underside as a profile (`underside`), poses (`needle`).

use nalgebra::{Matrix3, Point3, Unit, Vector3};
use pulp::Simd;

use super::shape::{NeedleShape, Tip};

/// Distances below this fraction of the needle's radius count as zero where a direction is undefined: on the axis, and at the
/// core's corner. It bounds the curvature there and moves the value by no more than this fraction, deep inside the needle.
const SMOOTHING_FRACTION: f64 = 1e-6;

/// A direction points back along the shaft, so that no point is foremost, when its part along −z is below this (pure number).
const LEAST_POINTING: f64 = 1e-9;

/// Two unit directions closer than this are the same one: a facet is met flat and its centre is its foremost point.
const FACET_TOLERANCE: f64 = 1e-12;

/// Signed distance to the needle's surface with its derivatives by the needle-local coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignedDistance {
    /// Distance, mm, negative inside.
    pub value: f64,
    /// First derivative, a pure number; length one wherever the distance is exact.
    pub gradient: Vector3<f64>,
    /// Second derivative, 1/mm; symmetric.
    pub hessian: Matrix3<f64>,
}

/// The solid of a needle in needle-local coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Radius of the shaft less that of the edge, mm.
    pub(super) core_radius: f64,
    /// Radius of the rounded edge, mm.
    pub(super) edge_radius: f64,
    /// Where the axis of the shaft meets the local x axis, mm; the axis is parallel to z.
    pub(super) axis_x: f64,
    /// A point of the core's end plane, in the plane y = 0, mm.
    corner: (f64, f64),
    /// Outward normal of the end plane: (x, z), with no part along y.
    pub(super) plane_normal: (f64, f64),
    /// Length below which directions count as undefined, mm.
    smoothing: f64,
}

/// The distances `a`, `b` of the formula above at a point, and the direction away from the axis.
struct Coordinates {
    outside_cylinder: f64,
    beyond_plane: f64,
    axis_distance: f64,
    radial: (f64, f64),
}

impl Body {
    pub(super) fn new(shape: &NeedleShape) -> Self {
        let edge_radius = shape.edge_radius_mm();
        let core_radius = shape.radius_mm - edge_radius;
        let smoothing = SMOOTHING_FRACTION * shape.radius_mm;
        let Tip::Bevelled { angle_deg, .. } = shape.tip else {
            return Self {
                core_radius,
                edge_radius,
                axis_x: 0.0,
                corner: (0.0, edge_radius),
                plane_normal: (0.0, -1.0),
                smoothing,
            };
        };
        let (sin, cos) = libm::sincos(angle_deg.to_radians());
        // The lowest point of a² + b² = r² over the sharp corner lies at the origin when the core's corner stands here.
        let length = (1.0 + cos * cos).sqrt();
        let corner = (-edge_radius * cos / length, edge_radius * length / sin);
        Self { core_radius, edge_radius, axis_x: corner.0 - core_radius, corner, plane_normal: (-cos, -sin), smoothing }
    }

    fn coordinates(&self, local: &Point3<f64>) -> Coordinates {
        let (x, y) = (local.x - self.axis_x, local.y);
        let axis_distance = (x * x + y * y + self.smoothing * self.smoothing).sqrt();
        Coordinates {
            outside_cylinder: axis_distance - self.core_radius,
            beyond_plane: self.plane_normal.0 * (local.x - self.corner.0)
                + self.plane_normal.1 * (local.z - self.corner.1),
            axis_distance,
            radial: (x / axis_distance, y / axis_distance),
        }
    }

    /// Where the axis of the shaft meets the local x axis (mm).
    pub fn axis_x_mm(&self) -> f64 {
        self.axis_x
    }

    /// Outward normal of the end face, needle-local: straight forwards for half a ball, which has no face.
    pub fn face_normal(&self) -> Unit<Vector3<f64>> {
        Unit::new_unchecked(Vector3::new(self.plane_normal.0, 0.0, self.plane_normal.1))
    }

    /// Radius of the shaft (mm).
    pub fn radius_mm(&self) -> f64 {
        self.core_radius + self.edge_radius
    }

    /// Signed distance to the needle's surface at a needle-local point, mm, negative inside.
    pub fn distance(&self, local: &Point3<f64>) -> f64 {
        let [distance] = self.distances(&[[local.x], [local.y], [local.z]]);
        distance
    }

    /// [`distance`](Self::distance) of several points, given component by component: one formula for all of them, so that loops over it become vector instructions.
    #[inline(always)]
    pub(crate) fn distances<const N: usize>(&self, [xs, ys, zs]: &[[f64; N]; 3]) -> [f64; N] {
        let mut distances = [0.0; N];
        for lane in 0..N {
            let (x, y) = (xs[lane] - self.axis_x, ys[lane]);
            let a = (x * x + y * y + self.smoothing * self.smoothing).sqrt() - self.core_radius;
            let b = self.plane_normal.0 * (xs[lane] - self.corner.0) + self.plane_normal.1 * (zs[lane] - self.corner.1);
            let beyond_both = (a * a + b * b).sqrt();
            let reach = if a > 0.0 && b > 0.0 { beyond_both } else { a.max(b) };
            distances[lane] = reach - self.edge_radius;
        }
        distances
    }

    /// [`distance`](Self::distance), mm, and its gradient: [`signed_distance`](Self::signed_distance) without the second derivative.
    pub(crate) fn distance_and_gradient(&self, local: &Point3<f64>) -> (f64, Vector3<f64>) {
        let (reach, gradient) = self.reach_and_gradient(&self.coordinates(local));
        (reach - self.edge_radius, gradient)
    }

    /// Distance to the core (mm), and its gradient.
    fn reach_and_gradient(&self, at: &Coordinates) -> (f64, Vector3<f64>) {
        let (a, b) = (at.outside_cylinder, at.beyond_plane);
        let (a_gradient, b_gradient) = self.coordinate_gradients(at.radial);
        if a > 0.0 && b > 0.0 {
            let reach = (a * a + b * b).sqrt().max(self.smoothing);
            (reach, (a_gradient * a + b_gradient * b) / reach)
        } else if a > b {
            (a, a_gradient)
        } else {
            (b, b_gradient)
        }
    }

    /// Gradients of the two coordinates that the distance is made of.
    fn coordinate_gradients(&self, radial: (f64, f64)) -> (Vector3<f64>, Vector3<f64>) {
        (Vector3::new(radial.0, radial.1, 0.0), Vector3::new(self.plane_normal.0, 0.0, self.plane_normal.1))
    }

    /// [`distance`](Self::distance) of a point in each lane, mm, and its slope along `direction` (needle-local, per unit of its length).
    #[inline(always)]
    pub(super) fn distances_along<S: Simd>(
        &self,
        simd: S,
        [x, y, z]: &[S::f64s; 3],
        direction: &[S::f64s; 3],
    ) -> (S::f64s, S::f64s) {
        let zero = simd.splat_f64s(0.0);
        let from_axis = simd.sub_f64s(*x, simd.splat_f64s(self.axis_x));
        let smoothed = simd.splat_f64s(self.smoothing * self.smoothing);
        let axis_distance = simd.sqrt_f64s(simd.add_f64s(products(simd, from_axis, from_axis, *y, *y), smoothed));
        let a = simd.sub_f64s(axis_distance, simd.splat_f64s(self.core_radius));
        let a_slope = simd.div_f64s(products(simd, from_axis, direction[0], *y, direction[1]), axis_distance);
        let (normal_x, normal_z) = (simd.splat_f64s(self.plane_normal.0), simd.splat_f64s(self.plane_normal.1));
        let past_x = simd.sub_f64s(*x, simd.splat_f64s(self.corner.0));
        let past_z = simd.sub_f64s(*z, simd.splat_f64s(self.corner.1));
        let b = products(simd, normal_x, past_x, normal_z, past_z);
        let b_slope = products(simd, normal_x, direction[0], normal_z, direction[2]);
        let beyond_both = simd.sqrt_f64s(products(simd, a, a, b, b));
        let beyond_both = simd.max_f64s(beyond_both, simd.splat_f64s(self.smoothing));
        let both_slope = simd.div_f64s(products(simd, a, a_slope, b, b_slope), beyond_both);
        let on_side = simd.less_than_f64s(b, a);
        let outside = simd.and_m64s(simd.less_than_f64s(zero, a), simd.less_than_f64s(zero, b));
        let reach = simd.select_f64s(outside, beyond_both, simd.select_f64s(on_side, a, b));
        let slope = simd.select_f64s(outside, both_slope, simd.select_f64s(on_side, a_slope, b_slope));
        (simd.sub_f64s(reach, simd.splat_f64s(self.edge_radius)), slope)
    }

    /// Signed distance with gradient and Hessian at a needle-local point; finite everywhere, the axis included.
    pub fn signed_distance(&self, local: &Point3<f64>) -> SignedDistance {
        let at = self.coordinates(local);
        let (a, b) = (at.outside_cylinder, at.beyond_plane);
        let (ex, ey) = at.radial;
        let (a_gradient, b_gradient) = self.coordinate_gradients(at.radial);
        // With the smoothed axis distance s, its Hessian is (I - e eᵀ)/s in the plane across the axis.
        let a_hessian = Matrix3::new(
            1.0 - ex * ex,
            -ex * ey,
            0.0, //
            -ex * ey,
            1.0 - ey * ey,
            0.0, //
            0.0,
            0.0,
            0.0,
        ) / at.axis_distance;
        let (reach, gradient) = self.reach_and_gradient(&at);
        let hessian = if a > 0.0 && b > 0.0 {
            let curvature = a_gradient * a_gradient.transpose() + b_gradient * b_gradient.transpose() + a_hessian * a
                - gradient * gradient.transpose();
            curvature / reach
        } else if a > b {
            a_hessian
        } else {
            Matrix3::zeros()
        };
        SignedDistance { value: reach - self.edge_radius, gradient, hessian }
    }

    /// Whether the tip has no edge: half a ball.
    pub fn is_round(&self) -> bool {
        self.core_radius == 0.0 && self.plane_normal.0 == 0.0
    }

    /// The point of the needle furthest along a needle-local direction, in needle-local coordinates, mm.
    ///
    /// `None` when the direction does not point forwards (its z part is not negative): along it the shaft has no end. Where the
    /// end plane stands exactly across the direction, all of the facet is foremost and the point on the axis is given; a flat
    /// tip's answer therefore jumps from there to the edge with the first tilt.
    pub fn foremost_along(&self, inward_local: &Unit<Vector3<f64>>) -> Option<Point3<f64>> {
        if inward_local.z > -LEAST_POINTING {
            return None;
        }
        // On the rounded edge the direction is a sum of the two normals, s e + t m, and (a, b) is parallel to (s, t).
        let (mx, mz) = self.plane_normal;
        let t = inward_local.z / mz;
        let (wx, wy) = (inward_local.x - t * mx, inward_local.y);
        let s = wx.hypot(wy);
        let (radial, axis_distance, b) = if s < FACET_TOLERANCE {
            ((0.0, 0.0), 0.0, self.edge_radius)
        } else {
            let scale = self.edge_radius / s.hypot(t);
            ((wx / s, wy / s), self.core_radius + scale * s, scale * t)
        };
        let x = self.axis_x + axis_distance * radial.0;
        let z = self.corner.1 + (b - mx * (x - self.corner.0)) / mz;
        Some(Point3::new(x, axis_distance * radial.1, z))
    }
}

/// `a b + c d`.
#[inline(always)]
fn products<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s, d: S::f64s) -> S::f64s {
    simd.add_f64s(simd.mul_f64s(a, b), simd.mul_f64s(c, d))
}
