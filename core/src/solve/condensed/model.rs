//! The small system of the tail: its energies as they are, the tissue below as a spring.

use nalgebra::Vector3;

use super::super::border::{Bordered, Drive};
use super::super::dense::Dense;
use super::super::newton::{System, Workspace};
use super::super::sparse::norm;
use crate::assemble::tail::{Stresses, Tail};
use crate::effect::{Effect, Term};

/// Iterations on the condensed system at most: each costs a small part of one on the whole.
const MAX_ITERATIONS: usize = 20;
/// Times at most that what is no gradient is held anew.
const MAX_ROUNDS: usize = 5;
/// Halvings of one of its steps: a needle that has lost touch moves as far as it may, and a stiff contact answers within a micrometre.
const MAX_HALVINGS: usize = 16;
/// Residual over the first one at which it is solved: the tissue's own change is more than what is left.
const REDUCTION: f64 = 0.05;

/// The condensed problem at one state of the whole.
pub(super) struct Model<'a> {
    /// The whole.
    pub system: &'a System<'a>,
    /// What acts on the tail.
    pub tail: Tail<'a>,
    /// The tissue's condensed force f (mN).
    pub force: &'a [f64],
    /// Its condensed stiffness K (mN/mm).
    pub tissue: &'a Dense,
    /// How the driven vertex moves.
    pub drive: Drive,
    /// The state of the whole.
    pub origin: &'a [f64],
}

/// Unknowns of the condensed problem and what is out of balance there.
struct State {
    /// Tail, then border (mm).
    unknowns: Vec<f64>,
    /// Residual on the tail (mN).
    residual: Vec<f64>,
    /// Along each direction of the drive (mN).
    out_of_balance: Vec<f64>,
    /// Norm of both.
    left: f64,
}

impl Model<'_> {
    /// The unknowns (tail, then border) at which the model is in balance, from `start`; `None` if nothing better than the start was found.
    pub fn solve(
        &self,
        start: &[f64],
        max_travel_mm: f64,
        hessian: &mut Dense,
        workspace: &mut Workspace,
    ) -> Option<Vec<f64>> {
        let newton = self.state(start.to_vec(), workspace);
        let still = self.state(vec![0.0; start.len()], workspace);
        let first = newton.left;
        let solved = REDUCTION * first.min(still.left);
        // A needle that has lost touch moves as far as it may in a Newton step.
        let mut at = if still.left < first { still } else { newton };
        for round in 0..MAX_ROUNDS {
            if at.left <= solved {
                break;
            }
            let Some(next) = self.balance_held(&at, max_travel_mm, hessian, workspace) else {
                at = self.balance(at, solved, max_travel_mm, hessian, workspace);
                break;
            };
            // What is held at the start is far from what it is after the first step.
            if round > 0 && next.left >= at.left {
                break;
            }
            at = next;
        }
        (at.left < first).then_some(at.unknowns)
    }

    /// The state in balance with what is no gradient held as it is at `at`; `None` where there is no such thing.
    fn balance_held(
        &self,
        at: &State,
        max_travel_mm: f64,
        hessian: &mut Dense,
        workspace: &mut Workspace,
    ) -> Option<State> {
        let positions = self.positions(&at.unknowns);
        let held: Vec<Option<Box<dyn Effect>>> =
            self.tail.terms.iter().map(|term| term.effect.held_at(term.stencils, &positions)).collect();
        if held.iter().all(Option::is_none) {
            return None;
        }
        let terms = self.tail.terms.iter().zip(&held);
        let terms: Vec<Term> =
            terms.map(|(term, held)| Term { effect: held.as_deref().unwrap_or(term.effect), ..*term }).collect();
        let model = Model { tail: Tail { terms: &terms, ..self.tail }, ..*self };
        let start = model.state(at.unknowns.clone(), workspace);
        let solved = REDUCTION * start.left;
        let found = model.balance(start, solved, max_travel_mm, hessian, workspace);
        Some(self.state(found.unknowns, workspace))
    }

    /// The state with no more than `solved` (mN) out of balance, or as near to it as steps from `at` bring.
    fn balance(
        &self,
        mut at: State,
        solved: f64,
        max_travel_mm: f64,
        hessian: &mut Dense,
        workspace: &mut Workspace,
    ) -> State {
        for _ in 0..MAX_ITERATIONS {
            if at.left <= solved {
                break;
            }
            let Some(step) = self.step(&at, max_travel_mm, hessian, workspace) else { break };
            let Some(next) = self.descend(&at, &step, max_travel_mm, workspace) else { break };
            at = next;
        }
        at
    }

    /// Newton's step from `at`; `None` if there is none.
    fn step(&self, at: &State, max_travel_mm: f64, hessian: &mut Dense, workspace: &mut Workspace) -> Option<Vec<f64>> {
        let size = self.force.len();
        let positions = self.positions(&at.unknowns);
        let directions: Vec<Vector3<f64>> =
            self.drive.directions().into_iter().map(|(direction, _)| direction).collect();
        let mut couplings = Vec::new();
        // Stresses far above those in balance turn the Hessian over; without them it is as definite as the tissue.
        [Stresses::Current, Stresses::None].into_iter().find(|stresses| {
            hessian.clone_from(self.tissue);
            self.tail.add_hessian(&positions, *stresses, 1.0, &mut workspace.scratch, hessian.lower_mut());
            couplings.clear();
            for direction in &directions {
                let coupled = |i: usize| (0..3).map(|k| hessian.at(size + k, i) * direction[k]).sum::<f64>();
                couplings.extend((0..size).map(coupled));
            }
            hessian.factorize()
        })?;
        let mut columns: Vec<f64> = at.residual.iter().map(|r| -r).collect();
        columns.extend_from_slice(&couplings);
        hessian.substitute(&mut columns);
        let bordered = Bordered {
            directions: &directions,
            couplings: &couplings,
            columns: &columns,
            out_of_balance: &at.out_of_balance,
        };
        let corner = |row: usize, column: usize| hessian.at(size + row, size + column);
        let (step, _) = bordered.step(corner, max_travel_mm);
        Some(step)
    }

    /// The first of the halves of `step` that brings the residual down or does not raise the potential.
    fn descend(&self, at: &State, step: &[f64], max_travel_mm: f64, workspace: &mut Workspace) -> Option<State> {
        let size = self.force.len();
        let mut bound = None;
        for halvings in 0..=MAX_HALVINGS {
            let scale = 0.5_f64.powi(halvings as i32);
            let next: Vec<f64> = at.unknowns.iter().zip(step).map(|(a, s)| a + scale * s).collect();
            if norm(&next[size..]) > max_travel_mm {
                continue;
            }
            let next = self.state(next, workspace);
            if next.left < at.left {
                return Some(next);
            }
            let bound = *bound.get_or_insert_with(|| self.potential(&at.unknowns, workspace));
            if self.potential(&next.unknowns, workspace) < bound {
                return Some(next);
            }
        }
        None
    }

    fn positions(&self, at: &[f64]) -> Vec<f64> {
        let mut positions = self.origin.to_vec();
        self.system.dofs.advance_tail(&mut positions, at);
        positions
    }

    fn state(&self, unknowns: Vec<f64>, workspace: &mut Workspace) -> State {
        let size = self.force.len();
        let gradient = self.tail.gradient(&self.positions(&unknowns), &mut workspace.scratch);
        let mut residual = self.tissue.times(&unknowns[..size]);
        for (i, r) in residual.iter_mut().enumerate() {
            *r += self.force[i] + gradient[i];
        }
        let out_of_balance = self.drive.out_of_balance(&Vector3::from_row_slice(&gradient[size..]));
        let left = out_of_balance.iter().fold(norm(&residual), |sum, a| sum.hypot(*a));
        State { unknowns, residual, out_of_balance, left }
    }

    fn potential(&self, at: &[f64], workspace: &mut Workspace) -> f64 {
        let size = self.force.len();
        let own = self.tail.energy(&self.positions(at), &mut workspace.scratch);
        let stretched = self.tissue.times(&at[..size]);
        let tissue: f64 = (0..size).map(|i| at[i] * (self.force[i] + 0.5 * stretched[i])).sum();
        own + tissue - self.drive.work(&Vector3::from_row_slice(&at[size..]))
    }
}
