//! How Newton steps are used: what makes the Hessian positive definite, and how much of a step is taken.
//!
//! - [`Globalization::PredictedStress`]: full steps; the Hessian's stress-dependent part uses the stresses that the last linear step
//!   predicted ([`crate::effect::Effect::predict_stress`]), and none in first steps far from equilibrium: stresses mean little there, and
//!   without them the Hessian is positive definite. The first steps may raise the potential Π on their way to a better
//!   place, later ones that do (a sharp edge changing sides) are halved. Where the tissue is about to buckle and the Hessian is not positive
//!   definite, the stresses are halved and then left out, which keeps the tissue's own scale in every direction (a raised diagonal has
//!   the scale of the contact's penalty and stalls), and a step that descends is lengthened while it does.
//! - [`Globalization::LineSearch`]: the exact Hessian, its diagonal raised where it must, and no step that increases Π or that an
//!   effect vetoes. Slow and sure.

use super::newton::{Drive, NewtonError, NewtonSettings, System, Workspace};
use super::sparse::LinearSolveError;
use crate::assemble::{Predicted, hessian, max_step, predict_stress};

/// How steps are kept from going astray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Globalization {
    /// Full steps with predicted stresses, guarded after the first few.
    PredictedStress,
    /// Exact Hessian and a line search on Π.
    LineSearch,
}

/// What one solve carries from step to step.
#[derive(Clone)]
pub(super) struct Trial {
    /// Positions at the beginning of the solve.
    start: Vec<f64>,
    /// Π at the last accepted positions; used by the line search alone.
    potential: f64,
    /// Predicted stresses, as of the step before the last one if that is still to be used.
    predicted: Predicted,
    /// The last step, if stresses are to be predicted from it: only another iteration needs them.
    last: Option<Taken>,
    drive: Drive,
    globalization: Globalization,
    force_scale_mn: f64,
}

/// A step that was taken.
#[derive(Clone)]
struct Taken {
    /// Positions before it.
    from: Vec<f64>,
    /// It, in the layout of positions.
    moved: Vec<f64>,
    /// Positions after it, if it met the effects on the tail as they are there.
    met: Option<Vec<f64>>,
}

/// A Newton step, not yet taken.
pub(super) struct Step {
    /// Free unknowns, then the border.
    pub step: Vec<f64>,
    /// Slope of Π along it.
    pub slope: f64,
    /// Which one, from 1.
    pub number: usize,
    /// Whether the Hessian was changed to be positive definite.
    pub weakened: bool,
    /// Whether it meets the effects on the tail as they are at its end.
    pub refined: bool,
}

/// Factor by which the diagonal shift grows until the factorisation succeeds.
const SHIFT_GROWTH: f64 = 10.0;
/// First diagonal shift, relative to the largest diagonal entry.
const FIRST_SHIFT: f64 = 1e-4;
/// Shifts tried before giving up.
const MAX_SHIFTS: usize = 8;
/// Residual over force scale above which predicted stresses are not used in the first steps.
const STRESS_STIFFNESS_BELOW: f64 = 2.0;
/// How many first steps these are; what is still far after them is on its way through large rotations, and short steps without stresses lead
/// nowhere.
const STRESSLESS_STEPS: usize = 6;
/// Shares of the predicted stresses with which a positive definite Hessian is sought.
const STRESS_SHARES: [f64; 3] = [1.0, 0.5, 0.0];
/// Steps of `PredictedStress` that may raise Π.
const FREE_STEPS: usize = 3;
/// Residual over force scale below which Π is not watched: the end of a solve is quadratic, and Π's rounding near.
const UNGUARDED_BELOW: f64 = 1e-3;
/// Halvings of a guarded step; a step that raises Π even then is taken, for the Hessian is not that of Π.
const GUARD_HALVINGS: usize = 6;
/// Doublings of a step along which the tissue buckles.
const MAX_DOUBLINGS: usize = 4;
/// Halvings tried for a step that inverts an element, and in one line search.
const MAX_HALVINGS: usize = 30;
/// Share of the residual that a step may leave without another being tried.
const CLEAR_PROGRESS: f64 = 0.5;
/// Share of the predicted decrease that a step must achieve (Armijo).
const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Relative rounding error of the total energy, below which a decrease cannot be seen: the total is a small difference of the elements'
/// energies and the work of the force.
const ENERGY_ROUNDOFF: f64 = 1e-11;

impl Trial {
    /// The stresses of the next Hessian.
    pub fn predicted(&self) -> &Predicted {
        &self.predicted
    }

    pub fn new(
        system: &System,
        positions: &[f64],
        drive: Drive,
        settings: &NewtonSettings,
        workspace: &mut Workspace,
    ) -> Self {
        let globalization = settings.globalization;
        let (potential, predicted) = match globalization {
            Globalization::PredictedStress => (0.0, Predicted::zero(system.terms)),
            Globalization::LineSearch => {
                (system.potential(positions, positions, drive, &mut workspace.scratch), Predicted::default())
            }
        };
        Trial {
            start: positions.to_vec(),
            potential,
            predicted,
            last: None,
            drive,
            globalization,
            force_scale_mn: settings.force_scale_mn,
        }
    }

    /// Takes the potential at `positions` anew: a multiplier has changed.
    pub fn renew(&mut self, system: &System, positions: &[f64], workspace: &mut Workspace) {
        if self.globalization == Globalization::LineSearch {
            self.potential = system.potential(positions, &self.start, self.drive, &mut workspace.scratch);
        }
    }
}

impl System<'_> {
    /// Assembles and factorises a positive definite Hessian; returns how often it was changed until it was one.
    pub(super) fn factorize_definite(
        &self,
        positions: &[f64],
        trial: &mut Trial,
        workspace: &mut Workspace,
    ) -> Result<usize, NewtonError> {
        workspace.responses = None;
        if let Some(Taken { from, moved, met }) = trial.last.take() {
            predict_stress(self.terms, &from, &moved, &mut workspace.scratch, &mut trial.predicted);
            if let Some(met) = met {
                self.keep_tail_stresses(&met, &mut trial.predicted, workspace);
            }
        }
        if trial.globalization == Globalization::LineSearch {
            hessian(
                self.terms,
                positions,
                &trial.predicted,
                self.pattern,
                &mut workspace.scratch,
                &mut workspace.values,
            );
            return self.factorize_raised(workspace);
        }
        for (weakened, share) in STRESS_SHARES.into_iter().enumerate() {
            trial.predicted.scale(share);
            let Workspace { scratch, values, factor, .. } = &mut *workspace;
            hessian(self.terms, positions, &trial.predicted, self.pattern, scratch, values);
            match factor.factorize(self.symbolic, self.pattern, values) {
                Ok(()) => return Ok(weakened),
                Err(LinearSolveError::Indefinite) => {}
                Err(other) => return Err(other.into()),
            }
        }
        Ok(STRESS_SHARES.len() + self.factorize_raised(workspace)?)
    }

    /// Factorises the free part, raising its diagonal where it must; returns how often.
    fn factorize_raised(&self, workspace: &mut Workspace) -> Result<usize, NewtonError> {
        let diagonal = || self.pattern.column_starts[..self.dofs.free].iter().map(|&at| at as usize);
        let mut shift = 0.0;
        for attempt in 0..=MAX_SHIFTS {
            match workspace.factor.factorize(self.symbolic, self.pattern, &workspace.values) {
                Ok(()) => return Ok(attempt),
                Err(LinearSolveError::Indefinite) => {
                    let largest = diagonal().map(|at| workspace.values[at]).fold(0.0, f64::max);
                    let wanted = if shift == 0.0 { FIRST_SHIFT * largest } else { SHIFT_GROWTH * shift };
                    for at in diagonal() {
                        workspace.values[at] += wanted - shift;
                    }
                    shift = wanted;
                }
                Err(other) => return Err(other.into()),
            }
        }
        Err(LinearSolveError::Indefinite.into())
    }

    /// Takes as much of the step as the globalization allows; returns the number of halvings and the residual, `None` if no part
    /// of it is acceptable.
    pub(super) fn advance(
        &self,
        positions: &mut [f64],
        step: &Step,
        trial: &mut Trial,
        workspace: &mut Workspace,
    ) -> Option<(usize, f64)> {
        match trial.globalization {
            Globalization::PredictedStress => self.full_step(positions, step, trial, workspace),
            Globalization::LineSearch => self.line_search(positions, step, trial, workspace),
        }
    }

    /// Takes the first of two steps, or the second where the first brings the residual `before_mn` hardly down and the second leaves less of it: tissue that turns
    /// far from where it was does not do what its condensed stiffness said.
    pub(super) fn advance_better(
        &self,
        positions: &mut [f64],
        [first, second]: [&Step; 2],
        before_mn: f64,
        trial: &mut Trial,
        workspace: &mut Workspace,
    ) -> Option<(usize, f64)> {
        let (before, untried) = (positions.to_vec(), trial.clone());
        let taken = self.advance(positions, first, trial, workspace);
        let reached_mn = taken.map_or(f64::INFINITY, |(_, residual_mn)| residual_mn);
        if reached_mn <= CLEAR_PROGRESS * before_mn {
            return taken;
        }
        let tried = (positions.to_vec(), std::mem::replace(trial, untried));
        positions.copy_from_slice(&before);
        let other = self.advance(positions, second, trial, workspace);
        if other.is_some_and(|(_, residual_mn)| residual_mn < reached_mn) {
            return other;
        }
        positions.copy_from_slice(&tried.0);
        *trial = tried.1;
        self.residual(positions, trial.drive, workspace);
        taken
    }

    /// Takes the whole step, or the first of its halves that inverts nothing and does not raise Π where it is guarded.
    fn full_step(
        &self,
        positions: &mut [f64],
        step: &Step,
        trial: &mut Trial,
        workspace: &mut Workspace,
    ) -> Option<(usize, f64)> {
        let before = positions.to_vec();
        let potential = |at: &[f64], trial: &Trial, workspace: &mut Workspace| {
            self.potential(at, &trial.start, trial.drive, &mut workspace.scratch)
        };
        let bound = (step.number > FREE_STEPS).then(|| potential(&before, trial, workspace));
        for halvings in 0..MAX_HALVINGS {
            let mut scale = 0.5_f64.powi(halvings as i32);
            positions.copy_from_slice(&before);
            self.dofs.advance(positions, &step.step, scale);
            let mut residual_mn = self.residual(positions, trial.drive, workspace);
            if !residual_mn.is_finite() {
                continue;
            }
            if let Some(bound) = bound.filter(|_| residual_mn > UNGUARDED_BELOW * trial.force_scale_mn) {
                let reached = potential(positions, trial, workspace);
                if reached > bound && halvings < GUARD_HALVINGS {
                    continue;
                }
                if step.weakened && halvings == 0 && reached < bound {
                    let mut lowest = reached;
                    for _ in 0..MAX_DOUBLINGS {
                        let mut further = before.clone();
                        self.dofs.advance(&mut further, &step.step, 2.0 * scale);
                        let reached = potential(&further, trial, workspace);
                        if reached.is_nan() || reached >= lowest {
                            break;
                        }
                        lowest = reached;
                        scale *= 2.0;
                        positions.copy_from_slice(&further);
                    }
                    residual_mn = self.residual(positions, trial.drive, workspace);
                }
            }
            let far = residual_mn > STRESS_STIFFNESS_BELOW * trial.force_scale_mn;
            if far && step.number <= STRESSLESS_STEPS {
                trial.predicted.clear();
                return Some((halvings, residual_mn));
            }
            let mut moved = vec![0.0; positions.len()];
            self.dofs.advance(&mut moved, &step.step, scale);
            let met = (step.refined && halvings == 0).then(|| positions.to_vec());
            trial.last = Some(Taken { from: before, moved, met });
            return Some((halvings, residual_mn));
        }
        None
    }

    /// Takes the largest halving of the step that decreases Π enough.
    fn line_search(
        &self,
        positions: &mut [f64],
        step: &Step,
        trial: &mut Trial,
        workspace: &mut Workspace,
    ) -> Option<(usize, f64)> {
        let before = positions.to_vec();
        let mut moved = vec![0.0; positions.len()];
        self.dofs.advance(&mut moved, &step.step, 1.0);
        let longest = max_step(self.terms, &before, &moved, &mut workspace.scratch);
        let noise = ENERGY_ROUNDOFF * trial.potential.abs();
        for halvings in 0..MAX_HALVINGS {
            let scale = longest * 0.5_f64.powi(halvings as i32);
            positions.copy_from_slice(&before);
            self.dofs.advance(positions, &step.step, scale);
            let potential = self.potential(positions, &trial.start, trial.drive, &mut workspace.scratch);
            if potential <= trial.potential + SUFFICIENT_DECREASE * scale * step.slope + noise {
                trial.potential = potential;
                return Some((halvings, self.residual(positions, trial.drive, workspace)));
            }
        }
        None
    }
}
