//! Friction whose limit is the pressure of the very positions that it is asked at.
//!
//! The traction is that of [`Friction`] with the pressure and the normal that `contact` has there. It is no gradient: pressure times slip has another one. Its
//! stiffness is that at a held pressure, symmetric and not negative in any direction; held, it is [`Friction`] ([`Effect::held_at`]). Holding the pressure anew from
//! balance to balance leaves a share of the error that is about µ times the tangent of the angle between motion and normal.
//! Not here: which anchors.

use nalgebra::Vector3;

use super::{Friction, Law, NAME, RubbingPoint};
use crate::effect::{Effect, Local, Stencils};
use crate::effects::contact::Contact;

/// The effect on a set of faces. The last vertex of each group is the needle's tip.
pub struct CoupledFriction<'a> {
    /// What presses.
    pub contact: &'a Contact<'a>,
    /// Anchor of a quadrature point (face, point) from the tip, in the frame of the positions (mm).
    pub anchor: &'a (dyn Fn(usize, usize) -> Vector3<f64> + Sync),
    /// Coulomb's coefficient µ.
    pub coefficient: f64,
    /// Slip ε from which on friction is at its limit (mm).
    pub full_slip_mm: f64,
}

impl CoupledFriction<'_> {
    /// The points of a face that rub.
    fn points(&self, local: &Local) -> Vec<RubbingPoint> {
        let pressing = self.contact.pressing(local);
        let rubbing = pressing.map(|(point, force_mn, normal)| RubbingPoint {
            point,
            limit_mn: self.coefficient * force_mn,
            normal,
            anchor: (self.anchor)(local.group, point),
        });
        rubbing.collect()
    }

    /// Friction under the pressures at `positions`.
    pub fn held(&self, stencils: &Stencils, positions: &[f64]) -> Friction<'_> {
        let mut current = vec![0.0; 3 * stencils.group_size];
        let points = (0..stencils.len()).map(|group| {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            if self.is_active(&local) { self.points(&local) } else { Vec::new() }
        });
        Friction { faces: self.contact.faces, points: points.collect(), full_slip_mm: self.full_slip_mm }
    }

    /// With the law at the points of a face.
    fn with_law<T>(&self, local: &Local, act: impl FnOnce(&Law) -> T) -> T {
        let points = self.points(local);
        act(&Law { faces: self.contact.faces, points: &points, full_slip_mm: self.full_slip_mm })
    }
}

impl Effect for CoupledFriction<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, local: &Local) -> bool {
        self.contact.is_active(local)
    }

    /// That of friction held at these positions.
    fn energy(&self, local: &Local) -> f64 {
        self.with_law(local, |law| law.energy(local))
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        self.with_law(local, |law| law.add_force(local, out));
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        self.with_law(local, |law| law.add_stiffness(local, out));
    }

    fn held_at<'a>(&'a self, stencils: &Stencils, positions: &[f64]) -> Option<Box<dyn Effect + 'a>> {
        Some(Box::new(self.held(stencils, positions)))
    }
}
