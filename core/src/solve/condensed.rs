//! Newton steps that meet the contact as it is: the tissue condensed to the surface that is touched, the contact solved for on it.
//!
//! Most of what is not linear in an iteration is the contact: which points touch, and how hard. It acts on few unknowns, the tail of the numbering
//! ([`Dofs::condensed_to`], the shortest of them that the contact lies in). Eliminating all others from the Newton system A Δ = −r leaves, for the tail u and the driven vertex t, the tissue's condensed
//! stiffness K = S − C (S the Schur complement of A, which its factor's last rows hold: S = L Lᵀ; C the tail's own Hessian in A) and its condensed
//! force f. On this small dense system
//!
//!   f + K u + ∇e(x + u, t) = 0,
//!
//! with e the energy of the effects on the tail, is solved by Newton's method as it stands, not linearised at x; the unknowns that were eliminated follow
//! linearly. An outer iteration then converges as the tissue does, which is smooth. The equilibrium is the same: where Δ vanishes, so does r.
//!
//! Nested iteration on condensed unknowns: the "nonlinear elimination" of Lanzkron, Rose & Wilkes, *SIAM J. Sci. Comput.* 17 (1996) 538–559.
//! Read on in `model` (the small system and its iteration). Not here: which unknowns are the tail (`mesh::wall`), what becomes of the step (`globalization`).

mod model;

use nalgebra::Vector3;

use super::border::Drive;
use super::dense::Dense;
use super::newton::{System, Workspace};
use super::sparse::norm;
use crate::assemble::Predicted;
use crate::assemble::tail::{Stresses, Tail};
use model::Model;

/// Relative difference below which the force on the driven vertex is that of the tail alone.
const SAME: f64 = 1e-9;

/// The tissue condensed to a tail, as of the last factorisation.
pub(super) struct Condensed {
    /// Which tail.
    which: usize,
    /// Schur complement S of the whole (mN/mm); empty: none is at hand.
    whole: Dense,
    /// Stiffness K of what is not in the tail.
    tissue: Dense,
    /// Memory for Hessians.
    hessian: Dense,
}

impl Condensed {
    /// Leaves none at hand.
    pub fn forget(&mut self) {
        self.whole = Dense::empty();
    }
}

impl Default for Condensed {
    fn default() -> Self {
        Condensed { which: 0, whole: Dense::empty(), tissue: Dense::empty(), hessian: Dense::empty() }
    }
}

impl System<'_> {
    fn tail(&self, which: usize) -> Tail<'_> {
        Tail { terms: self.terms, dofs: self.dofs, pattern: self.pattern, which }
    }

    /// The gradient of the effects on `tail`, if theirs is all the force on the driven vertex.
    fn gradient_of_all(&self, tail: Tail, positions: &[f64], workspace: &mut Workspace) -> Option<Vec<f64>> {
        let gradient = tail.gradient(positions, &mut workspace.scratch);
        let held = &workspace.residual[self.dofs.free..];
        let apart = (0..3).any(|k| (held[k] - gradient[tail.size() + k]).abs() > SAME * norm(held));
        (!apart).then_some(gradient)
    }

    /// Condenses the system that was just factorised at `positions`, those of the last residual, with the stresses `predicted`.
    pub(super) fn condense(&self, positions: &[f64], predicted: &Predicted, workspace: &mut Workspace) {
        let mut tails = (0..self.dofs.tails.len()).map(|which| self.tail(which));
        let Some(tail) = tails.find(|tail| self.gradient_of_all(*tail, positions, workspace).is_some()) else {
            workspace.condensed.forget();
            return;
        };
        let Workspace { factor, scratch, condensed, .. } = workspace;
        condensed.which = tail.which;
        condensed.whole = factor.tail(self.symbolic, tail.size(), 3).times_transposed();
        condensed.tissue.clone_from(&condensed.whole);
        tail.add_hessian(positions, Stresses::Predicted(predicted), -1.0, scratch, condensed.tissue.lower_mut());
        condensed.tissue.clear_border();
    }

    /// From the Newton step `newton` (free unknowns, then the border) at `positions` the one that meets the effects on the tail as they are at its end; `None`
    /// where that is not to be had. The driven vertex moves by no more than `max_travel_mm`. Its linear solution is not checked: the step is judged by the residual that it leaves.
    pub(super) fn refine(
        &self,
        positions: &[f64],
        newton: &[f64],
        drive: Drive,
        max_travel_mm: f64,
        workspace: &mut Workspace,
    ) -> Option<Vec<f64>> {
        let (free, size) = (self.dofs.free, workspace.condensed.whole.size());
        let first = free - size;
        // What is held at a value ties the tail to all that is below: its multiplier would be one unknown more here.
        if size == 0 || !workspace.held.slope.is_empty() {
            return None;
        }
        let tail = self.tail(workspace.condensed.which);
        let gradient = self.gradient_of_all(tail, positions, workspace)?;
        let coupling = |k: usize| &workspace.values[self.pattern.stored() + k * free..][..first];
        if (0..3).any(|k| coupling(k).iter().any(|c| *c != 0.0)) {
            return None;
        }
        let start = &newton[first..];
        let mut condensed = std::mem::take(&mut workspace.condensed);
        // The condensed residual, from the step that answers it: f + ∇e = −(S u + C t).
        let border = &workspace.values[self.pattern.stored()..];
        let mut force = condensed.whole.times(&start[..size]);
        for (i, force) in force.iter_mut().enumerate() {
            let coupled: f64 = (0..3).map(|k| border[k * free + first + i] * start[size + k]).sum();
            *force = -(*force + coupled + gradient[i]);
        }
        let model = Model { system: self, tail, force: &force, tissue: &condensed.tissue, drive, origin: positions };
        let found = model.solve(start, max_travel_mm, &mut condensed.hessian, workspace);
        let refined = found.map(|found| {
            let change: Vec<f64> = found[..size].iter().zip(start).map(|(new, old)| new - old).collect();
            let mut rest = vec![0.0; free];
            rest[first..].copy_from_slice(&change);
            workspace.factor.complete(self.symbolic, size, &mut rest);
            rest.iter_mut().zip(newton).for_each(|(r, n)| *r += n);
            rest.extend_from_slice(&found[size..]);
            rest
        });
        workspace.condensed = condensed;
        refined
    }

    /// The slope of the potential along `step`.
    pub(super) fn slope(&self, step: &[f64], drive: Drive, workspace: &Workspace) -> f64 {
        let free = self.dofs.free;
        let residual = &workspace.residual;
        let moved = Vector3::from_row_slice(&step[free..]);
        let held = Vector3::from_row_slice(&residual[free..]).dot(&moved) - drive.work(&moved);
        (step[..free].iter().zip(residual).map(|(s, r)| s * r).sum::<f64>() + held).min(0.0)
    }

    /// Replaces predicted stresses of the effects on the tail by those at `positions`.
    pub(super) fn keep_tail_stresses(&self, positions: &[f64], predicted: &mut Predicted, workspace: &mut Workspace) {
        let tail = self.tail(workspace.condensed.which);
        tail.keep_stresses(positions, &mut workspace.scratch, predicted);
    }
}
