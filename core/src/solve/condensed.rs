//! Newton steps that meet the contact as it is: the tissue condensed to the surface that is touched, the contact solved for on it.
//!
//! Most of what is not linear in an iteration is the contact: which points touch, and how hard. It acts on few unknowns, the tail of the numbering
//! ([`Dofs::condensed_to`]). Eliminating all others from the Newton system A Δ = −r leaves, for the tail u and the driven vertex t, the tissue's condensed
//! stiffness K = S − C (S the Schur complement of A, which its factor's last rows hold: S = L Lᵀ; C the tail's own Hessian in A) and its condensed
//! force f. On this small dense system
//!
//!   f + K u + ∇e(x + u, t) = 0,
//!
//! with e the energy of the effects on the tail, is solved by Newton's method as it stands, not linearised at x; the unknowns that were eliminated follow
//! linearly. An outer iteration then converges as the tissue does, which is smooth. The equilibrium is the same: where Δ vanishes, so does r.
//!
//! Nested iteration on condensed unknowns: the "nonlinear elimination" of Lanzkron, Rose & Wilkes, *SIAM J. Sci. Comput.* 17 (1996) 538–559.
//! Not here: which unknowns are the tail (`mesh::wall`), what becomes of the step (`globalization`).

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::prelude::Solve;
use faer::{Accum, Mat, MatRef, Par, Side};
use nalgebra::Vector3;

use super::border::{Drive, Reduced};
use super::newton::{NewtonError, System, Workspace};
use super::sparse::norm;
use crate::assemble::{Predicted, Stresses, Tail};

/// Iterations on the condensed system at most: each costs a small part of one on the whole.
const MAX_ITERATIONS: usize = 20;
/// Halvings of one of its steps: a needle that has lost touch moves as far as it may, and a stiff contact answers within a micrometre.
const MAX_HALVINGS: usize = 16;
/// Residual over the first one at which it is solved: the tissue's own change is more than what is left.
const REDUCTION: f64 = 0.05;
/// Relative difference below which the force on the driven vertex is that of the tail alone.
const SAME: f64 = 1e-9;

/// The tissue condensed to the tail, as of the last factorisation.
pub(super) struct Condensed {
    /// Schur complement S of the whole, row by row (mN/mm); empty: none is at hand.
    whole: Mat<f64>,
    /// Stiffness K of what is not in the tail.
    tissue: Mat<f64>,
    /// Memory for Hessians.
    hessian: Vec<f64>,
}

impl Condensed {
    /// Leaves none at hand.
    pub fn forget(&mut self) {
        self.whole = Mat::new();
    }
}

impl Default for Condensed {
    fn default() -> Self {
        Condensed { whole: Mat::new(), tissue: Mat::new(), hessian: Vec::new() }
    }
}

impl System<'_> {
    fn tail(&self) -> Tail<'_> {
        Tail { terms: self.terms, dofs: self.dofs, pattern: self.pattern }
    }

    /// Condenses the system that was just factorised at `positions` with the stresses `predicted`.
    pub(super) fn condense(&self, positions: &[f64], predicted: &Predicted, workspace: &mut Workspace) {
        let size = self.dofs.tail;
        let Workspace { factor, scratch, condensed, .. } = workspace;
        if size == 0 {
            return;
        }
        let lower = factor.tail(self.symbolic, size);
        let mut whole = Mat::<f64>::zeros(size, size);
        matmul(
            whole.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Replace,
            lower.as_ref(),
            BlockStructure::TriangularLower,
            lower.as_ref().transpose(),
            BlockStructure::TriangularUpper,
            1.0,
            Par::Seq,
        );
        self.tail().hessian(positions, Stresses::Predicted(predicted), scratch, &mut condensed.hessian);
        let stride = size + 3;
        condensed.tissue = Mat::from_fn(size, size, |i, j| {
            whole[(i.max(j), i.min(j))] - condensed.hessian[i.max(j) * stride + i.min(j)]
        });
        condensed.whole = Mat::from_fn(size, size, |i, j| whole[(i.max(j), i.min(j))]);
    }

    /// From the Newton step `newton` (free unknowns, then the border) at `positions` the one that meets the effects on the tail as they are at its end; `None`
    /// where that is not to be had. The driven vertex moves by no more than `max_travel_mm`.
    ///
    /// # Errors
    /// [`NewtonError::Linear`].
    pub(super) fn refine(
        &self,
        positions: &[f64],
        newton: &[f64],
        drive: Drive,
        max_travel_mm: f64,
        workspace: &mut Workspace,
    ) -> Result<Option<Vec<f64>>, NewtonError> {
        let size = self.dofs.tail;
        let (free, tail) = (self.dofs.free, self.tail());
        let first = free - size;
        // What is held at a value ties the tail to all that is below: its multiplier would be one unknown more here.
        if size == 0 || workspace.condensed.whole.nrows() != size || !workspace.held.slope.is_empty() {
            return Ok(None);
        }
        let gradient = tail.gradient(positions, &mut workspace.scratch);
        let held = &workspace.residual[free..];
        let apart = (0..3).any(|k| (held[k] - gradient[size + k]).abs() > SAME * norm(held));
        let coupling = |k: usize| &workspace.values[self.pattern.stored() + k * free..][..first];
        if apart || (0..3).any(|k| coupling(k).iter().any(|c| *c != 0.0)) {
            return Ok(None);
        }
        let start = &newton[first..];
        let mut condensed = std::mem::take(&mut workspace.condensed);
        // The condensed residual, from the step that answers it: f + ∇e = −(S u + C t).
        let border = &workspace.values[self.pattern.stored()..];
        let mut force = times(&condensed.whole, &start[..size]);
        for (i, force) in force.iter_mut().enumerate() {
            let coupled: f64 = (0..3).map(|k| border[k * free + first + i] * start[size + k]).sum();
            *force = -(*force + coupled + gradient[i]);
        }
        let model = Model { system: self, tail, force: &force, tissue: &condensed.tissue, drive, origin: positions };
        let found = model.solve(start, max_travel_mm, &mut condensed.hessian, workspace);
        let refined = found.map(|found| {
            let change: Vec<f64> = found[..size].iter().zip(start).map(|(new, old)| new - old).collect();
            let mut rest = vec![0.0; free];
            rest[first..].copy_from_slice(&times(&condensed.whole, &change));
            workspace.factor.solve(self.symbolic, self.pattern, &workspace.values, &mut rest)?;
            rest.iter_mut().zip(newton).for_each(|(r, n)| *r += n);
            rest.extend_from_slice(&found[size..]);
            Ok(rest)
        });
        workspace.condensed = condensed;
        refined.transpose()
    }

    /// Replaces predicted stresses of the effects on the tail by those at `positions`.
    pub(super) fn keep_tail_stresses(&self, positions: &[f64], predicted: &mut Predicted, workspace: &mut Workspace) {
        self.tail().keep_stresses(positions, &mut workspace.scratch, predicted);
    }
}

/// The condensed problem at one state of the whole.
struct Model<'a> {
    system: &'a System<'a>,
    tail: Tail<'a>,
    force: &'a [f64],
    tissue: &'a Mat<f64>,
    drive: Drive,
    origin: &'a [f64],
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
    fn solve(
        &self,
        start: &[f64],
        max_travel_mm: f64,
        hessian: &mut Vec<f64>,
        workspace: &mut Workspace,
    ) -> Option<Vec<f64>> {
        let newton = self.state(start.to_vec(), workspace);
        let still = self.state(vec![0.0; start.len()], workspace);
        let first = newton.left;
        let solved = REDUCTION * first.min(still.left);
        // A needle that has lost touch moves as far as it may in a Newton step.
        let mut at = if still.left < first { still } else { newton };
        for _ in 0..MAX_ITERATIONS {
            if at.left <= solved {
                break;
            }
            let Some(step) = self.step(&at, max_travel_mm, hessian, workspace) else { break };
            let Some(next) = self.descend(&at, &step, max_travel_mm, workspace) else { break };
            at = next;
        }
        (at.left < first).then_some(at.unknowns)
    }

    /// Newton's step from `at`; `None` if there is none.
    fn step(
        &self,
        at: &State,
        max_travel_mm: f64,
        hessian: &mut Vec<f64>,
        workspace: &mut Workspace,
    ) -> Option<Vec<f64>> {
        let size = self.force.len();
        let stride = size + 3;
        let positions = self.positions(&at.unknowns);
        // Stresses far above those in balance turn the Hessian over; without them it is as definite as the tissue.
        let factor = [Stresses::Current, Stresses::None].into_iter().find_map(|stresses| {
            self.tail.hessian(&positions, stresses, &mut workspace.scratch, hessian);
            let entry = |i: usize, j: usize| if i >= j { self.tissue[(i, j)] + hessian[i * stride + j] } else { 0.0 };
            Mat::from_fn(size, size, entry).llt(Side::Lower).ok()
        })?;
        let directions: Vec<Vector3<f64>> =
            self.drive.directions().into_iter().map(|(direction, _)| direction).collect();
        let coupling =
            |i: usize, direction: &Vector3<f64>| (0..3).map(|k| hessian[(size + k) * stride + i] * direction[k]).sum();
        let couplings = Mat::from_fn(size, 1 + directions.len(), |i, d| {
            if d == 0 { -at.residual[i] } else { coupling(i, &directions[d - 1]) }
        });
        let columns = factor.solve(&couplings);
        let dot = |a: usize, b: usize| (0..size).map(|i| couplings[(i, a)] * columns[(i, b)]).sum::<f64>();
        let mut reduced = Reduced { directions: &directions, stiffness: Vec::new(), drive: Vec::new() };
        for (row, along) in directions.iter().enumerate() {
            for (column, other) in directions.iter().enumerate() {
                let own: f64 = (0..3)
                    .flat_map(|i| (0..3).map(move |j| (i, j)))
                    .map(|(i, j)| along[i] * other[j] * hessian[(size + i.max(j)) * stride + size + i.min(j)])
                    .sum();
                reduced.stiffness.push(own - dot(1 + row, 1 + column));
            }
            reduced.drive.push(-at.out_of_balance[row] - dot(1 + row, 0));
        }
        let travels = reduced.solve(max_travel_mm);
        let mut step: Vec<f64> = (0..size).map(|i| columns[(i, 0)]).collect();
        for (d, travel) in travels.iter().enumerate() {
            step.iter_mut().enumerate().for_each(|(i, s)| *s -= travel * columns[(i, 1 + d)]);
        }
        let moved: Vector3<f64> = directions.iter().zip(&travels).map(|(direction, travel)| direction * *travel).sum();
        step.extend(moved.iter());
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
        let mut residual = times(self.tissue, &unknowns[..size]);
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
        let stretched = times(self.tissue, &at[..size]);
        let tissue: f64 = (0..size).map(|i| at[i] * (self.force[i] + 0.5 * stretched[i])).sum();
        own + tissue - self.drive.work(&Vector3::from_row_slice(&at[size..]))
    }
}

fn times(matrix: &Mat<f64>, vector: &[f64]) -> Vec<f64> {
    let product = matrix * MatRef::from_column_major_slice(vector, vector.len(), 1);
    (0..vector.len()).map(|i| product[(i, 0)]).collect()
}
