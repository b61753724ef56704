//! `friction`: smoothed Coulomb friction between the inner retinal surface and the needle.
//!
//! Slip. The anchor of a point of the tissue is the point of the needle's surface that its rest position meets first when the needle
//! moves along its given direction through tissue that stands still. With x the deformed point, t the tip, R the needle's rotation, a the
//! anchor (needle frame) and n̂ the needle's surface normal, the slip is g = (1 − n̂ n̂ᵀ)(x − t − R a): how far the tissue has come along the needle's surface
//! from where the needle would have caught it. Tissue that sticks stays at its anchor. What a neighbourhood moves a point sideways before the needle
//! reaches it counts as slip; in nearly incompressible tissue that is little. The load is one monotonic motion, so slip has one direction and the
//! friction a potential (deformation theory); a motion in several parts is a sequence of such problems, each from the anchors that the last one left ([`Friction::dragged`]).
//!
//! Energy per rest area: µ p̂ f₀(|g|), with f₀ the C² approximation of |g| of Li et al. (*Incremental Potential Contact*, ACM Trans. Graph. 2020, section
//! 5.2; here of slip and not of velocity): f₀′(y) = f₁(y) = 2y/ε − y²/ε² for y < ε, 1 beyond. The pressure p̂ and the normal n̂ are those of an
//! earlier equilibrium (lagged): Coulomb friction has no potential otherwise, and this one is convex. Equilibrium is found again with new p̂ and n̂ until they
//! settle (`equilibrium::friction`); or the same traction is used with the pressure of each position (`coupled`), which has no potential but is nearer.
//!
//! Law: the traction lies in the needle's tangent plane, opposes the slip and is at most µ p̂; it reaches µ p̂ at the slip ε and beyond, so what sticks creeps by less than ε.
//! Not here: the pressure (`contact`), the repetition.

mod coupled;

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::contact::{ContactFaces, GROUP};
use crate::effect::{Effect, Local};
use crate::mesh::element::FACE_NODES;
use crate::needle::Body;
pub use coupled::CoupledFriction;

/// Name of the effect.
pub const NAME: &str = "friction";

/// One quadrature point that may rub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RubbingPoint {
    /// Which quadrature point of its face.
    pub point: usize,
    /// Largest friction force: coefficient × pressure × rest area (mN).
    pub limit_mn: f64,
    /// Normal of the needle's surface, in the frame of the positions.
    pub normal: Vector3<f64>,
    /// Anchor from the tip, in the frame of the positions (mm).
    pub anchor: Vector3<f64>,
}

/// The effect on a set of faces. The last vertex of each group is the needle's tip.
pub struct Friction<'a> {
    /// The faces at rest.
    pub faces: &'a ContactFaces,
    /// The points that rub, face by face.
    pub points: Vec<Vec<RubbingPoint>>,
    /// Slip ε from which on friction is at its limit (mm).
    pub full_slip_mm: f64,
}

/// Where the needle's surface first meets a point in its way, in needle coordinates (mm).
///
/// The needle moves along `direction` (needle frame), so the point moves against it. A point that the needle passes beside has the nearest
/// point of the needle's surface at the closest approach.
pub fn anchor(shape: &Body, point: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Point3<f64> {
    // The distance is convex along the way: from before the contact, Newton's method approaches the first zero from one side.
    let mut at = *point;
    let before = shape.distance(&at).abs() + 2.0 * shape.radius_mm();
    at += direction.into_inner() * before;
    for _ in 0..ANCHOR_ITERATIONS {
        let (distance_mm, gradient) = shape.distance_and_gradient(&at);
        let closing = gradient.dot(direction);
        if closing < LEAST_CLOSING {
            return nearest(shape, at);
        }
        let step = distance_mm / closing;
        at -= direction.into_inner() * step;
        if step.abs() < ANCHOR_TOLERANCE * shape.radius_mm() {
            break;
        }
    }
    at
}

/// The point of the needle's surface that one comes to by going straight down the distance.
fn nearest(shape: &Body, mut at: Point3<f64>) -> Point3<f64> {
    for _ in 0..ANCHOR_ITERATIONS {
        let (distance_mm, gradient) = shape.distance_and_gradient(&at);
        at -= gradient * (distance_mm / gradient.norm_squared());
        if distance_mm.abs() < ANCHOR_TOLERANCE * shape.radius_mm() {
            break;
        }
    }
    at
}

/// Share of the slip ε that is left where a slip ends.
const AT_REST: f64 = 0.99;
/// Iterations of the way to the anchor.
const ANCHOR_ITERATIONS: usize = 60;
/// Precision of the anchor, in needle radii.
const ANCHOR_TOLERANCE: f64 = 1e-12;
/// Least cosine between motion and surface normal at which a point is met and not passed.
const LEAST_CLOSING: f64 = 1e-3;

/// The law at given points of one face.
struct Law<'a> {
    faces: &'a ContactFaces,
    points: &'a [RubbingPoint],
    full_slip_mm: f64,
}

impl Law<'_> {
    /// Slip of a point (mm).
    fn slip(&self, local: &Local, rubbing: &RubbingPoint) -> Vector3<f64> {
        let offset = self.offset(local, rubbing);
        offset - rubbing.normal * rubbing.normal.dot(&offset)
    }

    /// From a point's anchor to where it is (mm).
    fn offset(&self, local: &Local, rubbing: &RubbingPoint) -> Vector3<f64> {
        let n = GROUP;
        let mut offset = -rubbing.anchor;
        for k in 0..3 {
            let row = &local.current[k * n..(k + 1) * n];
            let values = self.faces.values(rubbing.point);
            offset[k] += values.iter().zip(row).map(|(value, x)| value * x).sum::<f64>() - row[FACE_NODES];
        }
        offset
    }

    /// f₀, f₁(y)/y and f₁′ (mm, 1/mm, 1/mm) at the slip y (mm).
    fn smoothed(&self, y: f64) -> (f64, f64, f64) {
        let e = self.full_slip_mm;
        if y >= e {
            (y, 1.0 / y, 0.0)
        } else {
            (y * y / e - y.powi(3) / (3.0 * e * e) + e / 3.0, 2.0 / e - y / (e * e), 2.0 / e - 2.0 * y / (e * e))
        }
    }

    fn energy(&self, local: &Local) -> f64 {
        let energy = |r: &RubbingPoint| r.limit_mn * self.smoothed(self.slip(local, r).norm()).0;
        self.points.iter().map(energy).sum()
    }

    fn add_force(&self, local: &Local, out: &mut [f64]) {
        self.for_each(local, |rubbing, slip, over, _| {
            let force = slip * (over * rubbing.limit_mn);
            for (k, out) in out.as_chunks_mut::<GROUP>().0.iter_mut().enumerate() {
                for (out, weight) in out.iter_mut().zip(self.faces.weights(rubbing.point)) {
                    *out += weight * force[k];
                }
            }
        });
    }

    fn add_stiffness(&self, local: &Local, out: &mut [f64]) {
        let mut stiffness = self.faces.stiffness();
        self.for_each(local, |rubbing, slip, over, slope| {
            let along = slip.try_normalize(0.0).unwrap_or_default();
            let tangent = Matrix3::identity() - rubbing.normal * rubbing.normal.transpose();
            let of_point = tangent * over + along * along.transpose() * (slope - over);
            stiffness.add(rubbing.point, &(of_point * rubbing.limit_mn));
        });
        stiffness.add_to(out);
    }

    /// Calls `visit(rubbing point, slip, f₁(y)/y, f₁′)` for every rubbing point.
    fn for_each(&self, local: &Local, mut visit: impl FnMut(&RubbingPoint, Vector3<f64>, f64, f64)) {
        for rubbing in self.points {
            let slip = self.slip(local, rubbing);
            let (_, over, slope) = self.smoothed(slip.norm());
            visit(rubbing, slip, over, slope);
        }
    }
}

impl Friction<'_> {
    fn law(&self, local: &Local) -> Law<'_> {
        Law { faces: self.faces, points: &self.points[local.group], full_slip_mm: self.full_slip_mm }
    }

    /// The anchor (from the tip, in the frame of the positions, mm) that a point has after this slip: the old one while it sticks; what slips drags it behind
    /// itself at the distance `AT_REST` ε, where friction is short of its limit by one part in ten thousand, so that a needle that stops meets tissue that sticks.
    pub fn dragged(&self, local: &Local, rubbing: &RubbingPoint) -> Vector3<f64> {
        let law = self.law(local);
        let slip = law.slip(local, rubbing);
        let y = slip.norm();
        if y < self.full_slip_mm {
            return rubbing.anchor;
        }
        rubbing.anchor + law.offset(local, rubbing) - slip * (AT_REST * self.full_slip_mm / y)
    }

    /// Whether each rubbing point of a face slips, with the share of its friction that is used (1 where it slips).
    pub fn used<'b>(&'b self, local: &'b Local) -> impl Iterator<Item = (RubbingPoint, f64)> + 'b {
        self.points[local.group].iter().map(move |rubbing| {
            let law = self.law(local);
            let y = law.slip(local, rubbing).norm();
            (*rubbing, if y >= self.full_slip_mm { 1.0 } else { law.smoothed(y).1 * y })
        })
    }
}

impl Effect for Friction<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, local: &Local) -> bool {
        !self.points[local.group].is_empty()
    }

    fn energy(&self, local: &Local) -> f64 {
        self.law(local).energy(local)
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        self.law(local).add_force(local, out);
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        self.law(local).add_stiffness(local, out);
    }
}
