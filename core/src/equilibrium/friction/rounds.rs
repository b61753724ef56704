//! The repetition that friction needs where its pressures cannot be followed: solve, take new contact pressures and normals, solve again, until they settle.
//!
//! It starts from the frictionless equilibrium, or after another motion from the equilibrium under the pressures that this one left. The pressures of the next round are a mix of those used and those found (Anderson, *J. ACM* 12 (1965) 547–560, with one round remembered): where the
//! force along the motion is shared between pressure and friction, each round answers the last one's error with one of the opposite sign, and plain repetition
//! would diverge beyond µ tan(angle) = 1. That direction is found from two rounds and gone along at once; in all others the mix goes a part of the way. The friction itself begins with a coefficient that rises and a wide stick zone that narrows from round to round, so that no solve has to find many points' way
//! across it at once. A round begins with the stiffness that the one before left, factorised, and ends as near to equilibrium as the pressures are to rest.

use nalgebra::Vector3;

use super::super::attempts::{ROUND_TRAVELS, repetitions};
use super::super::error::EquilibriumError;
use super::super::grip::Grip;
use super::super::{Equilibrium, Load, Wall};
use super::{FULL_SLIP_MM, Rubbing};
use crate::effects::friction::Friction;
use crate::progress::Progress;
use crate::solve::newton::{NewtonError, NewtonReport, Workspace};

/// Change of the pressures from one round to the next, relative to their sum, at which they count as settled. Friction is off by no more than
/// this share.
const SETTLED: f64 = 1e-3;
/// Residual relative to the force scale at which a round stops, between these: no nearer to equilibrium than a share of what the pressures still change from round
/// to round, for the next round moves it again (the forcing term of an inexact Newton method: Dembo, Eisenstat & Steihaug 1982). The last one goes on to that of
/// every solve.
const ROUND_TOLERANCE: (f64, f64) = (1e-3, 0.03);
/// That share.
const FORCING: f64 = 0.1;
/// Rounds before friction counts as not settling.
const MAX_ROUNDS: usize = 60;
/// Largest rise of the coefficient from one round to the next: what is held at once by a high friction is held wherever it happens to be.
const COEFFICIENT_STEP: f64 = 0.5;
/// Stick zone of the first round over the last one's.
const FIRST_WIDENING: f64 = 16.0;
/// Factor by which the stick zone narrows from round to round.
const NARROWING: f64 = 0.25;
/// Share of what was found in the next mix, apart from the direction in which the last round changed: by trial on steep pushes with high friction, of which more settle with it than with a half, with
/// less, or with a share that follows the changes.
const SHARE: f64 = 0.3;

impl Wall<'_> {
    /// The equilibrium with friction of the coefficient `coefficient`, from `start`: the one without it, or (`is_warm`) the one under the pressures that the last motion left.
    ///
    /// # Errors
    /// [`EquilibriumError`].
    pub(super) fn settle_pressures(
        &self,
        load: &Load,
        coefficient: f64,
        remembered: (&Grip, bool),
        start: &Equilibrium,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(Equilibrium, Rubbing, Grip), EquilibriumError> {
        let mut total = start.newton;
        let mut settled = Err(NewtonError::Interrupted { iterations: 0 }.into());
        for travel in ROUND_TRAVELS {
            settled = self.settle_by(travel, load, coefficient, remembered, (start, &mut total), workspace, progress);
            match &settled {
                Err(failure) if !failure.is_interrupted() => {}
                _ => break,
            }
        }
        settled
    }

    /// The same in steps of `travel` at most, in that of a direct attempt; their cost is added to the start's.
    #[allow(clippy::too_many_arguments)]
    fn settle_by(
        &self,
        travel: f64,
        load: &Load,
        coefficient: f64,
        (grip, is_warm): (&Grip, bool),
        (start, total): (&Equilibrium, &mut NewtonReport),
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(Equilibrium, Rubbing, Grip), EquilibriumError> {
        let mut found = start.clone();
        let approach = self.approach(load, grip, &self.tip(&found.positions));
        let mut pressed = self.pressed(&found.positions);
        let mut mixing = Mixing::default();
        let mut widening = if is_warm { 1.0 } else { FIRST_WIDENING };
        let mut tolerance = ROUND_TOLERANCE.1;
        let (mut change, mut last_change) = (f64::INFINITY, f64::INFINITY);
        for round in 1..=MAX_ROUNDS {
            let reached = if is_warm { coefficient } else { coefficient.min(round as f64 * COEFFICIENT_STEP) };
            let settling = reached == coefficient && widening == 1.0;
            let points = self.rubbing_points(&approach, reached, &pressed);
            let friction = Friction { faces: &self.faces, points, full_slip_mm: FULL_SLIP_MM * widening };
            let additions = load.with_faces(&friction);
            let with_friction = Load { additions: &additions, ..*load };
            *total += self.repeat(travel, &with_friction, tolerance, &mut found, workspace, progress)?;
            let mut now = self.pressed(&found.positions);
            change = now.change_from(&pressed);
            if settling && change <= SETTLED && tolerance > self.contact.tolerance {
                tolerance = self.contact.tolerance;
                *total += self.repeat(travel, &with_friction, tolerance, &mut found, workspace, progress)?;
                now = self.pressed(&found.positions);
                change = now.change_from(&pressed);
            }
            if settling && change <= SETTLED {
                let rubbing = self.rubbing(&friction, &found.positions);
                let left = self.grip(&friction, &found.positions);
                return Ok((Equilibrium { newton: *total, ..found }, rubbing, left));
            }
            let error: Vec<f64> = now.forces_mn.iter().zip(&pressed.forces_mn).map(|(new, used)| new - used).collect();
            if settling && tolerance > self.contact.tolerance {
                // Pressures that do not come to rest are looked at closely.
                let wanted = if change > last_change { 0.0 } else { FORCING * change };
                tolerance = wanted.clamp(ROUND_TOLERANCE.0, ROUND_TOLERANCE.1);
            }
            last_change = change;
            let share = if settling { SHARE } else { 1.0 };
            mixing.mix(&mut pressed.forces_mn, error, share);
            if !settling {
                // The next round is another problem: nothing is learned from this one.
                mixing = Mixing::default();
            }
            for (used, new) in pressed.normals.iter_mut().zip(&now.normals) {
                // At a sharp edge normals swing as far as pressures; where the contact is new or gone, there is nothing to mix.
                *used = if *used == Vector3::zeros() || *new == Vector3::zeros() {
                    *new
                } else {
                    (*used * (1.0 - share) + new * share).normalize()
                };
            }
            if reached == coefficient {
                widening = (widening * NARROWING).max(1.0);
            }
        }
        Err(EquilibriumError::NotSettled { rounds: MAX_ROUNDS, change, allowed: SETTLED })
    }

    /// One more solve from an equilibrium nearby, to `tolerance` relative to the force scale: with full steps, and where they fail with a line search.
    fn repeat(
        &self,
        travel: f64,
        load: &Load,
        tolerance: f64,
        found: &mut Equilibrium,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<NewtonReport, NewtonError> {
        let drive = self.drive(load.motion, 1.0);
        let mut spent = 0;
        let mut failure = NewtonError::Interrupted { iterations: 0 };
        for attempt in &repetitions(travel) {
            let mut positions = found.positions.clone();
            let drive = (drive, tolerance);
            match self.newton(&self.contact, drive, load, attempt, &mut positions, &mut spent, workspace, progress) {
                Ok(mut report) => {
                    report.iterations = spent;
                    *found = self.equilibrium(load.motion, positions, report, found.load_steps, workspace);
                    return Ok(report);
                }
                Err(stop @ NewtonError::Interrupted { .. }) => return Err(stop),
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }
}

/// How the forces of the next round follow from those of the last two (Anderson 1965 with one round remembered).
#[derive(Default)]
struct Mixing {
    /// Forces that were used in the last round, and what was found over them (mN).
    last: Option<(Vec<f64>, Vec<f64>)>,
}

impl Mixing {
    /// Replaces the forces `used`, which missed those found by `error`: along the change of the last round they go to where the error would vanish, apart from it by `share` of what is left.
    fn mix(&mut self, used: &mut [f64], error: Vec<f64>, share: f64) {
        let before = used.to_vec();
        let mut back = 0.0;
        if let Some((_, last)) = &self.last {
            let (mut along, mut squared) = (0.0, 0.0);
            for (last, now) in last.iter().zip(&error) {
                along += now * (now - last);
                squared += (now - last) * (now - last);
            }
            back = if squared > 0.0 { along / squared } else { 0.0 };
        }
        for (at, used) in used.iter_mut().enumerate() {
            let step = |used: f64, error: f64| used + share * error;
            let now = step(*used, error[at]);
            let last = self.last.as_ref().map_or(now, |(used, error)| step(used[at], error[at]));
            *used = (now - back * (now - last)).max(0.0);
        }
        self.last = Some((before, error));
    }
}
