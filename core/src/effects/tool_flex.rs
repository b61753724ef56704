//! `tool_flex`: the shaft bends, so that the tip stands aside of where the guide holds it.
//!
//! The shaft is an elastic beam, built in at the guide and as straight as `a`, the unit vector along it, where nothing presses. Its tip is t; a rigid one would be at o + s d, o the
//! tip before the motion and s the guide's way along the unit direction d. The shaft neither shortens nor buckles, so the deflection u = t − o − s d is across it, a·u = 0, which gives
//! s = a·(t − o)/(a·d) and u = W (t − o) with W = 1 − d aᵗ/(a·d). A beam bent by a force on its tip has the energy
//!
//! ```text
//! Φ(t) = ½ k |W (t − o)|²,   k = 3 E I / L³ for a uniform one.
//! ```
//!
//! The guide is pushed with the force F along d, so Π = tissue + Φ − F s. Its stationary points by t have, with R the tissue's force on the tip: e·R = k e·u for every e across
//! the shaft, and d·R = −F: the same balance along the motion as for a rigid needle, which is the limit k → ∞. A guide that is held has s = 0 and any d along the shaft.
//!
//! Left out, with their sizes for a deflection δ, a radius r and a free length L of 29 mm (`needle::shaft`): the tip's own tilt of 3 δ/(2 L), which moves its edge by 1.5 r/L of δ, 1.3 % for
//! 25G; the moment of a reaction off the axis, as much of what the axial force would do across it; and the axial force's own lever on the bent shaft, its share of Euler's load
//! (1.6 N for 25G), half a percent at 7.5 mN. Friction's anchors are those of the straight way.
//!
//! Law: no energy and no force for a tip where the guide holds it, whatever s; the force across the shaft is k times the deflection.
//! Not here: stiffnesses of shafts (`needle::shaft`), how the tip is freed (`solve::border`).

use nalgebra::{Matrix3, Unit, Vector3};

use crate::effect::{Effect, Local};

/// Name of the effect.
pub const NAME: &str = "tool_flex";

/// Least cosine between shaft and motion: a guide that moves across its shaft by more than 60 degrees does not push it, it drags it.
pub const LEAST_COSINE: f64 = 0.5;

/// The effect on the needle's tip, the only vertex of its group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolFlex {
    /// The tip before the motion, undeflected (mm).
    pub origin: Vector3<f64>,
    /// The way the needle points.
    pub axis: Unit<Vector3<f64>>,
    /// The guide's way; the shaft's own direction where it is held.
    pub direction: Unit<Vector3<f64>>,
    /// Force for a deflection of the tip (mN/mm).
    pub stiffness_mn_per_mm: f64,
}

impl ToolFlex {
    /// W: takes the tip's way to its deflection.
    fn aside(&self) -> Matrix3<f64> {
        let axis = self.axis.into_inner();
        Matrix3::identity() - self.direction.into_inner() * axis.transpose() / axis.dot(&self.direction)
    }

    /// The guide's way s along the direction (mm) when the tip is at `tip`.
    pub fn travel_mm(&self, tip: &Vector3<f64>) -> f64 {
        self.axis.dot(&(tip - self.origin)) / self.axis.dot(&self.direction)
    }

    /// The deflection u (mm) when the tip is at `tip`.
    pub fn deflection(&self, tip: &Vector3<f64>) -> Vector3<f64> {
        self.aside() * (tip - self.origin)
    }

    /// Two unit vectors across the shaft, at right angles to each other.
    pub fn sides(&self) -> [Vector3<f64>; 2] {
        let axis = self.axis.into_inner();
        let lateral = Vector3::ith(axis.iamin(), 1.0).cross(&axis).normalize();
        [lateral, axis.cross(&lateral)]
    }

    /// ∂Φ/∂t (mN) at `tip`.
    pub fn force_on_guide(&self, tip: &Vector3<f64>) -> Vector3<f64> {
        self.aside().transpose() * self.deflection(tip) * self.stiffness_mn_per_mm
    }
}

fn tip(local: &Local) -> Vector3<f64> {
    Vector3::from_column_slice(local.current)
}

impl Effect for ToolFlex {
    fn name(&self) -> &'static str {
        NAME
    }

    fn energy(&self, local: &Local) -> f64 {
        0.5 * self.stiffness_mn_per_mm * self.deflection(&tip(local)).norm_squared()
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        let force = self.force_on_guide(&tip(local));
        out.iter_mut().zip(force.iter()).for_each(|(out, force)| *out += force);
    }

    fn add_hessian(&self, _local: &Local, out: &mut [f64]) {
        let aside = self.aside();
        let stiffness = aside.transpose() * aside * self.stiffness_mn_per_mm;
        for row in 0..3 {
            for column in 0..=row {
                out[3 * row + column] += stiffness[(row, column)];
            }
        }
    }
}
