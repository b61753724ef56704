//! Newton's method for the free unknowns and at most one driven vertex.
//!
//! Sought is a stationary point of Π(x, s) = Σ energies − F s over the free positions x and, under force control, the travel s of the
//! driven vertex along a unit direction d; it may have more freedom ([`Drive`]). Each step factorises the Hessian of the free part; the driven vertex is eliminated by the bordering
//! method (`border.rs`: one factor, a right-hand side more for each direction). Where the Hessian is not positive definite it is changed until it is, and only then
//! (projecting always would cost the quadratic convergence of nearly incompressible elements).
//!
//! Near the end the Hessian hardly changes any more: there the last factor is used again for as long as it pays (chord steps), at a fraction of the cost of a new one.
//!
//! What an effect holds at a value (an enclosed volume) is one equation more, and its multiplier one unknown more (`held.rs`).
//!
//! How a step is used, and kept from going astray, is [`Globalization`]'s business (`globalization.rs`).
//!
//! An unconverged state is an error with its residual, never an answer.

use std::ops::AddAssign;

use nalgebra::Vector3;
use thiserror::Error;

pub use super::border::Drive;
use super::condensed::Condensed;
pub use super::globalization::Globalization;
use super::globalization::{Step, Trial};
use super::held::Held;
use super::sparse::{Factor, LinearSolveError, Precision, SymbolicFactor, norm};
use crate::assemble::{Dofs, Pattern, Scratch, energy, gradient};
use crate::effect::Term;
use crate::progress::Progress;

/// How to solve and when to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// How steps are guarded.
    pub globalization: Globalization,
    /// In which precision matrices are factorised first.
    pub precision: Precision,
    /// Size of the forces at play (mN).
    pub force_scale_mn: f64,
    /// Largest residual force: Euclidean norm over all unknowns (mN).
    pub tolerance_mn: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// Largest number of those whose Hessian was not positive definite: a body that keeps giving way comes to rest far from where it began, if at all.
    pub max_weakened: usize,
    /// Largest travel of the driven vertex in one iteration (mm).
    pub max_travel_mm: f64,
}

/// Residual over force scale below which chord steps are tried: the tissue hardly bends any further.
const CHORD_BELOW: f64 = 0.1;
/// A chord step must bring the residual down to this share: what is far from linear is left to a new factor.
const CHORD_REDUCTION: f64 = 0.5;
/// Residual over that of a chord step which did not, below which another one is tried.
const CHORDS_AGAIN: f64 = 0.1;
/// Chord steps that may still be needed, at the rate at which the last one brought the residual down: as many cost about what an iteration does.
const MOST_CHORDS_LEFT: f64 = 5.0;

/// Residual over force scale above which a chord step is refined: below, the contact has found its points.
const REFINED_ABOVE: f64 = 1e-3;

/// What a converged solve cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NewtonReport {
    /// Newton iterations (each one factorisation).
    pub iterations: usize,
    /// Step halvings in the line search.
    pub halvings: usize,
    /// Chord steps: solves with the factor of an iteration before.
    pub chords: usize,
    /// Factorisations repeated because the Hessian was not positive definite.
    pub shifts: usize,
    /// Residual force at the end (mN).
    pub residual_mn: f64,
}

impl AddAssign for NewtonReport {
    /// The cost of two solves, one after the other.
    fn add_assign(&mut self, next: Self) {
        self.iterations += next.iterations;
        self.halvings += next.halvings;
        self.chords += next.chords;
        self.shifts += next.shifts;
        self.residual_mn = next.residual_mn;
    }
}

/// Why a solve gave no answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum NewtonError {
    /// The iteration limit was reached.
    #[error(
        "no equilibrium after {iterations} Newton iterations (residual {residual_mn:e} mN, wanted {tolerance_mn:e} mN)"
    )]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// Residual force (mN).
        residual_mn: f64,
        /// Wanted residual (mN).
        tolerance_mn: f64,
    },
    /// No part of the step was acceptable.
    #[error("no part of the Newton step is acceptable (residual {residual_mn:e} mN after {iterations} iterations)")]
    NoStep {
        /// Iterations made.
        iterations: usize,
        /// Residual force (mN).
        residual_mn: f64,
    },
    /// The starting position is vetoed by an effect.
    #[error("the starting position is not admissible: effect `{effect}` gives no finite energy")]
    BadStart {
        /// Name of the effect.
        effect: &'static str,
    },
    /// The linear system was not solved.
    #[error(transparent)]
    Linear(#[from] LinearSolveError),
    /// The caller asked to stop.
    #[error("interrupted after {iterations} Newton iterations")]
    Interrupted {
        /// Iterations made.
        iterations: usize,
    },
}

impl NewtonError {
    /// Iterations spent before the failure.
    pub fn iterations(&self) -> usize {
        match *self {
            NewtonError::NotConverged { iterations, .. }
            | NewtonError::NoStep { iterations, .. }
            | NewtonError::Interrupted { iterations } => iterations,
            NewtonError::BadStart { .. } | NewtonError::Linear(_) => 0,
        }
    }
}

/// The system to solve.
pub struct System<'a> {
    /// Effects, in the order of the pattern's stencils.
    pub terms: &'a [Term<'a>],
    /// Numbering of unknowns.
    pub dofs: &'a Dofs,
    /// Sparsity.
    pub pattern: &'a Pattern,
    /// Analysed factorisation.
    pub symbolic: &'a SymbolicFactor,
    /// Index of the driven vertex, if any.
    pub driven: Option<usize>,
    /// Constant forces on the free unknowns (mN); empty for none.
    pub dead_load: &'a [f64],
}

/// Memory of the solver, reused between solves of one pattern.
pub struct Workspace {
    pub(super) factor: Factor,
    pub(super) values: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) held: Held,
    pub(super) scratch: Scratch,
    pub(super) condensed: Condensed,
    /// What the factor at hand answers to the coupling columns of a drive.
    pub(super) responses: Option<(Drive, Vec<f64>)>,
}

impl Workspace {
    /// Memory for systems with this pattern.
    pub fn new(pattern: &Pattern, symbolic: &SymbolicFactor) -> Self {
        Workspace {
            factor: Factor::new(symbolic),
            values: vec![0.0; pattern.len()],
            residual: vec![0.0; pattern.free + 3],
            held: Held::default(),
            scratch: Scratch::default(),
            condensed: Condensed::default(),
            responses: None,
        }
    }
}

impl System<'_> {
    pub(super) fn potential(&self, positions: &[f64], start: &[f64], drive: Drive, scratch: &mut Scratch) -> f64 {
        let mut total = energy(self.terms, positions, scratch);
        if let Some(vertex) = self.driven {
            total -= drive.work(&Vector3::from_fn(|k, _| positions[3 * vertex + k] - start[3 * vertex + k]));
        }
        if !self.dead_load.is_empty() {
            for at in 0..positions.len() {
                if let Some(index) = self.dofs.index(at / 3, at % 3).filter(|&i| i < self.dofs.free) {
                    total -= self.dead_load[index] * (positions[at] - start[at]);
                }
            }
        }
        total
    }

    /// Fills `workspace.residual` with the out-of-balance forces: free unknowns, then the raw force on the driven vertex. Returns the norm over what must vanish.
    pub(super) fn residual(&self, positions: &[f64], drive: Drive, workspace: &mut Workspace) -> f64 {
        gradient(self.terms, positions, self.dofs, &mut workspace.scratch, &mut workspace.residual);
        let free = self.dofs.free;
        for (r, load) in workspace.residual.iter_mut().zip(self.dead_load) {
            *r -= load;
        }
        let along = drive.out_of_balance(&Vector3::from_row_slice(&workspace.residual[free..]));
        let forces = along.into_iter().fold(norm(&workspace.residual[..free]), f64::hypot);
        self.hold(positions, workspace).map_or(forces, |missing_mn| forces.hypot(missing_mn))
    }

    /// Solves for equilibrium from `positions`, which hold the answer on success.
    ///
    /// # Errors
    /// [`NewtonError`]; `positions` then hold the last accepted iterate.
    pub fn solve(
        &self,
        positions: &mut [f64],
        drive: Drive,
        settings: &NewtonSettings,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<NewtonReport, NewtonError> {
        let mut report = NewtonReport::default();
        let mut weakenings = 0;
        let mut chords_below_mn = CHORD_BELOW * settings.force_scale_mn;
        workspace.factor.begin(settings.precision);
        let mut trial = Trial::new(self, positions, drive, settings, workspace);
        report.residual_mn = self.residual(positions, drive, workspace);
        if !report.residual_mn.is_finite() {
            return Err(self.bad_start(positions, &mut workspace.scratch));
        }
        while report.residual_mn > settings.tolerance_mn {
            if report.iterations >= settings.max_iterations || weakenings > settings.max_weakened {
                return Err(NewtonError::NotConverged {
                    iterations: report.iterations,
                    residual_mn: report.residual_mn,
                    tolerance_mn: settings.tolerance_mn,
                });
            }
            if progress.interrupted() {
                return Err(NewtonError::Interrupted { iterations: report.iterations });
            }
            let weakened = self.factorize_definite(positions, &mut trial, workspace)?;
            report.shifts += weakened;
            weakenings += usize::from(weakened > 0);
            let (plain, slope) = match self.step(drive, settings.max_travel_mm, workspace) {
                // Definite in single precision alone: in double it is changed until it is.
                Err(NewtonError::Linear(LinearSolveError::Indefinite)) => continue,
                step => step?,
            };
            report.iterations += 1;
            if let Some(&change) = plain.get(self.dofs.free + 3) {
                self.change_multiplier(change);
                trial.renew(self, positions, workspace);
            }
            let plain = Step { step: plain, slope, number: report.iterations, weakened: weakened > 0, refined: false };
            // Tissue about to buckle is not what its changed Hessian says: there the contact is left to the iteration.
            match weakened {
                0 => self.condense(positions, trial.predicted(), workspace),
                _ => workspace.condensed.forget(),
            }
            let stuck = NewtonError::NoStep { iterations: report.iterations, residual_mn: report.residual_mn };
            let taken = match self.refine(positions, &plain.step, drive, settings.max_travel_mm, workspace) {
                Some(refined) => {
                    let slope = self.slope(&refined, drive, workspace);
                    let refined = Step { step: refined, slope, refined: true, ..plain };
                    self.advance_better(positions, [&refined, &plain], report.residual_mn, &mut trial, workspace)
                }
                None => self.advance(positions, &plain, &mut trial, workspace),
            };
            let (halvings, residual_mn) = taken.ok_or(stuck)?;
            report.halvings += halvings;
            report.residual_mn = residual_mn;
            while report.residual_mn > settings.tolerance_mn && report.residual_mn < chords_below_mn {
                let before_mn = report.residual_mn;
                let pays = self.chord(positions, drive, settings, &mut report, workspace)?;
                if report.residual_mn >= before_mn {
                    chords_below_mn = CHORDS_AGAIN * before_mn;
                }
                if !pays {
                    break;
                }
            }
        }
        Ok(report)
    }

    /// As [`System::solve`], from the answer of a system that is nearly this one: the factor that it left is used first, for as long as it pays.
    ///
    /// # Errors
    /// [`NewtonError`].
    pub fn resume(
        &self,
        positions: &mut [f64],
        drive: Drive,
        settings: &NewtonSettings,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<NewtonReport, NewtonError> {
        let residual_mn = self.residual(positions, drive, workspace);
        let mut report = NewtonReport { residual_mn, ..NewtonReport::default() };
        while report.residual_mn > settings.tolerance_mn
            && self.chord(positions, drive, settings, &mut report, workspace)?
        {}
        report += self.solve(positions, drive, settings, workspace, progress)?;
        Ok(report)
    }

    /// A step with the factor at hand, kept if it brings the residual down enough; whether another one pays.
    fn chord(
        &self,
        positions: &mut [f64],
        drive: Drive,
        settings: &NewtonSettings,
        report: &mut NewtonReport,
        workspace: &mut Workspace,
    ) -> Result<bool, NewtonError> {
        let before = positions.to_vec();
        let plain = self.step_again(drive, settings.max_travel_mm, workspace)?;
        let refined =
            |workspace: &mut Workspace| self.refine(&before, &plain, drive, settings.max_travel_mm, workspace);
        let first = match report.residual_mn > REFINED_ABOVE * settings.force_scale_mn {
            true => refined(workspace),
            false => None,
        };
        let pays = self.take_chord(positions, first.as_ref().unwrap_or(&plain), drive, settings, report, workspace);
        if pays.is_some() || first.is_some() {
            return Ok(pays.unwrap_or(false));
        }
        // Where points still touch or let go, the step that meets the contact as it is does what the plain one does not.
        let second = refined(workspace);
        let pays = second.and_then(|step| self.take_chord(positions, &step, drive, settings, report, workspace));
        Ok(pays.unwrap_or(false))
    }

    /// Takes `step`; whether another one pays. `None` where it does not bring the residual down enough: then it is taken back.
    fn take_chord(
        &self,
        positions: &mut [f64],
        step: &[f64],
        drive: Drive,
        settings: &NewtonSettings,
        report: &mut NewtonReport,
        workspace: &mut Workspace,
    ) -> Option<bool> {
        let before = positions.to_vec();
        let change = step.get(self.dofs.free + 3).copied().unwrap_or_default();
        self.change_multiplier(change);
        self.dofs.advance(positions, step, 1.0);
        let residual_mn = self.residual(positions, drive, workspace);
        report.chords += 1;
        let rate = residual_mn / report.residual_mn;
        // Not a number is not smaller either.
        if rate <= CHORD_REDUCTION {
            report.residual_mn = residual_mn;
            let left = (settings.tolerance_mn / residual_mn).ln() / rate.ln();
            return Some(left <= MOST_CHORDS_LEFT);
        }
        positions.copy_from_slice(&before);
        self.change_multiplier(-change);
        report.residual_mn = self.residual(positions, drive, workspace);
        None
    }

    fn bad_start(&self, positions: &[f64], scratch: &mut Scratch) -> NewtonError {
        let effect = self
            .terms
            .iter()
            .find(|term| !energy(std::slice::from_ref(*term), positions, scratch).is_finite())
            .map_or("unknown", |term| term.effect.name());
        NewtonError::BadStart { effect }
    }
}

/// The force that holds the driven vertex, from the residual of the last evaluation (mN).
pub fn holding_force(workspace: &Workspace) -> Vector3<f64> {
    let free = workspace.residual.len() - 3;
    Vector3::from_row_slice(&workspace.residual[free..])
}
