//! Friction besides: an equilibrium whose friction has the pressures of that very equilibrium.
//!
//! The limit of friction is a pressure that friction changes. First the two are found together ([`CoupledFriction`]): from where the tissue is near rest without friction, or from what the
//! last motion left, Newton's method meets pressures and slip on the surface that is touched, as it does the contact (`solve::condensed`). Where that leads nowhere (a high friction on a steep flank, an
//! edge that sticks and slips in turn), pressures are held from round to round until they settle (`rounds`).
//! Not here: the energy (`effects::friction`), what is remembered of earlier motions (`grip`).

mod rounds;

use std::sync::OnceLock;

use nalgebra::Vector3;

use super::attempts::COUPLED;
use super::error::EquilibriumError;
use super::grip::{Approach, Grip};
use super::{Equilibrium, Load, Wall};
use crate::effect::{Effect, Local};
use crate::effects::friction::{CoupledFriction, Friction, RubbingPoint};
use crate::progress::Progress;
use crate::solve::newton::{NewtonError, Workspace};

/// Slip from which on friction is at its limit (mm): what sticks creeps by less, a fraction of what the levels resolve.
pub const FULL_SLIP_MM: f64 = 5e-4;
/// Residual relative to the force scale from which on friction joins: tissue so near to rest keeps the side of an edge on which it is, and what is left is moved by friction anyway.
const JOINED_AT: f64 = 1.0;

/// µ times the tangent of the angle between motion and normal up to which friction is coupled: holding the pressure anew leaves about this share of the error,
/// and mixing what rounds find does better beyond.
const COUPLED_UP_TO: f64 = 0.5;

/// How the tissue rubs at an equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rubbing {
    /// Share of the normal force that acts where the tissue slips, 0 to 1.
    pub slipping_share: f64,
    /// Force of friction on the needle (mN).
    pub force_mn: Vector3<f64>,
}

/// The state of the contact that friction is made from, for each quadrature point of each face.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pressed {
    /// Normal force (mN), face after face.
    forces_mn: Vec<f64>,
    /// Normal of the needle's surface, patch frame; zero where nothing presses.
    normals: Vec<Vector3<f64>>,
}

impl Pressed {
    /// Sum of the changes of the forces since `earlier`, over their sum; 0 where nothing presses.
    fn change_from(&self, earlier: &Pressed) -> f64 {
        let changes = self.forces_mn.iter().zip(&earlier.forces_mn).map(|(now, before)| (now - before).abs());
        let (change, sum): (f64, f64) = (changes.sum(), self.forces_mn.iter().sum());
        if change > 0.0 { change / sum } else { 0.0 }
    }

    /// Tangent of the angle between the motion and the force on the needle; 0 where nothing presses.
    fn steepness(&self, load: &Load) -> f64 {
        let force: Vector3<f64> = self.normals.iter().zip(&self.forces_mn).map(|(normal, force)| normal * *force).sum();
        let along = load.motion.direction.dot(&force);
        if force == Vector3::zeros() { 0.0 } else { load.motion.direction.cross(&force).norm() / along.abs() }
    }
}

impl Wall<'_> {
    /// Finds the equilibrium under `load` with friction of the coefficient `coefficient` besides.
    ///
    /// # Errors
    /// [`EquilibriumError`].
    pub fn solve_with_friction(
        &self,
        load: &Load,
        coefficient: f64,
        positions: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(Equilibrium, Rubbing), EquilibriumError> {
        let found = self.solve_gripped(load, coefficient, &Grip::default(), positions, workspace, progress);
        found.map(|(equilibrium, rubbing, _)| (equilibrium, rubbing))
    }

    /// As [`Wall::solve_with_friction`], after motions that left the needle with `grip`; the grip that this one leaves.
    ///
    /// # Errors
    /// [`EquilibriumError`].
    pub fn solve_gripped(
        &self,
        load: &Load,
        coefficient: f64,
        grip: &Grip,
        positions: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(Equilibrium, Rubbing, Grip), EquilibriumError> {
        let before =
            grip.holds().then(|| self.solve_as_before(load, coefficient, grip, &positions, workspace, progress));
        let is_warm = matches!(before, Some(Ok(_)));
        let mut lost = 0;
        let near = match before {
            Some(Ok(near)) => near,
            Some(Err(stop)) if stop.is_interrupted() => return Err(stop),
            other => {
                lost = other.and_then(Result::err).map_or(0, |failure| failure.iterations());
                self.solve_to(JOINED_AT, load, positions, workspace, progress)?
            }
        };
        let approach = self.approach(load, grip, &self.tip(&near.positions));
        let mut cost = near.newton;
        cost.iterations += lost;
        // What is held at a value ties the whole tissue together: it cannot be condensed to the surface.
        let couples = load.multipliers().next().is_none()
            && coefficient * self.pressed(&near.positions).steepness(load) <= COUPLED_UP_TO;
        let coupled = couples.then(|| self.solve_coupled(load, coefficient, &approach, &near, workspace, progress));
        let (found, rubbing, left) = match coupled {
            Some(Ok(coupled)) => coupled,
            Some(Err(stop @ NewtonError::Interrupted { .. })) => return Err(stop.into()),
            failed => {
                cost.iterations += failed.and_then(Result::err).map_or(0, |failure| failure.iterations());
                let start = if is_warm { near } else { self.solve(load, near.positions, workspace, progress)? };
                self.settle_pressures(load, coefficient, (grip, is_warm), &start, workspace, progress)?
            }
        };
        cost += found.newton;
        Ok((Equilibrium { newton: cost, ..found }, rubbing, left))
    }

    /// The equilibrium with friction whose limit follows the pressures, from `near` it.
    ///
    /// # Errors
    /// [`NewtonError`].
    fn solve_coupled(
        &self,
        load: &Load,
        coefficient: f64,
        approach: &Approach,
        near: &Equilibrium,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(Equilibrium, Rubbing, Grip), NewtonError> {
        let contact = self.contact();
        // Anchors are sought once for each point, and only where the needle presses.
        let anchors = vec![OnceLock::new(); self.topology.faces.len() * self.faces.points];
        let anchor = |group: usize, point: usize| {
            *anchors[group * self.faces.points + point].get_or_init(|| approach.anchor(self, group, point))
        };
        let friction = CoupledFriction { contact: &contact, anchor: &anchor, coefficient, full_slip_mm: FULL_SLIP_MM };
        let additions = load.with_faces(&friction);
        let with_friction = Load { additions: &additions, ..*load };
        let drive = (self.drive(load.motion, 1.0), self.contact.tolerance);
        let mut positions = near.positions.clone();
        let newton =
            self.newton(&self.contact, drive, &with_friction, &COUPLED, &mut positions, &mut 0, workspace, progress)?;
        let found = self.equilibrium(load.motion, positions, newton, near.load_steps, workspace);
        let held = friction.held(&self.topology.faces, &found.positions);
        let rubbing = self.rubbing(&held, &found.positions);
        let left = self.grip(&held, &found.positions);
        Ok((found, rubbing, left))
    }

    /// The equilibrium under the pressures that the last motion left, from which the new pressures are not far.
    ///
    /// # Errors
    /// [`EquilibriumError`]: then the frictionless equilibrium is the start, as of a first motion.
    fn solve_as_before(
        &self,
        load: &Load,
        coefficient: f64,
        grip: &Grip,
        positions: &[f64],
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, EquilibriumError> {
        let approach = self.approach(load, grip, &self.tip(positions));
        let points = self.rubbing_points(&approach, coefficient, grip.pressed());
        let friction = Friction { faces: &self.faces, points, full_slip_mm: FULL_SLIP_MM };
        let additions = load.with_faces(&friction);
        self.solve_directly(&Load { additions: &additions, ..*load }, positions.to_vec(), workspace, progress)
    }

    /// Where the needle's tip is at `positions` (mm).
    fn tip(&self, positions: &[f64]) -> Vector3<f64> {
        Vector3::from_row_slice(&positions[3 * self.topology.needle()..])
    }

    /// Normal forces and normals of every quadrature point.
    pub(super) fn pressed(&self, positions: &[f64]) -> Pressed {
        let contact = self.contact();
        let stencils = &self.topology.faces;
        let mut current = vec![0.0; 3 * stencils.group_size];
        let count = stencils.len() * self.faces.points;
        let mut pressed = Pressed { forces_mn: vec![0.0; count], normals: vec![Vector3::zeros(); count] };
        for group in 0..stencils.len() {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            for (point, force_mn, normal) in contact.pressing(&local) {
                let at = group * self.faces.points + point;
                pressed.forces_mn[at] = force_mn;
                pressed.normals[at] = normal;
            }
        }
        pressed
    }

    /// The points that rub, face by face, with their anchors.
    fn rubbing_points(&self, approach: &Approach, coefficient: f64, pressed: &Pressed) -> Vec<Vec<RubbingPoint>> {
        let face = |group: usize| -> Vec<RubbingPoint> {
            let rubs = |&point: &usize| pressed.normals[group * self.faces.points + point] != Vector3::zeros();
            let rubbing = |point: usize| {
                let at = group * self.faces.points + point;
                RubbingPoint {
                    point,
                    limit_mn: coefficient * pressed.forces_mn[at],
                    normal: pressed.normals[at],
                    anchor: approach.anchor(self, group, point),
                }
            };
            (0..self.faces.points).filter(rubs).map(rubbing).collect()
        };
        (0..self.topology.faces.len()).map(face).collect()
    }

    /// What slips, and with what force.
    fn rubbing(&self, friction: &Friction, positions: &[f64]) -> Rubbing {
        let stencils = &self.topology.faces;
        let n = stencils.group_size;
        let mut current = vec![0.0; 3 * n];
        let mut gradient = vec![0.0; 3 * n];
        let (mut limit, mut slipping) = (0.0, 0.0);
        for group in 0..stencils.len() {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            friction.add_gradient(&local, &mut gradient);
            for (point, used) in friction.used(&local) {
                limit += point.limit_mn;
                slipping += if used >= 1.0 { point.limit_mn } else { 0.0 };
            }
        }
        let force_mn = Vector3::from_fn(|k, _| -gradient[(k + 1) * n - 1]);
        Rubbing { slipping_share: if limit > 0.0 { slipping / limit } else { 0.0 }, force_mn }
    }
}
