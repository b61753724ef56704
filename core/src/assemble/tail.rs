//! The same sums for the effects on the tail alone: those groups whose unknowns are all among the last ones or in the border.
//!
//! Vectors and dense matrices count the tail's unknowns, then the border's three. Not here: what is condensed to the tail (`solve::condensed`).

use super::{Dofs, Pattern, Predicted, Scratch};
use crate::effect::{Local, Term};

/// Which stresses the Hessian of the tail is made with.
#[derive(Clone, Copy)]
pub(crate) enum Stresses<'a> {
    /// None: what is left is not negative in any direction.
    None,
    /// Those of the positions.
    Current,
    /// Those predicted.
    Predicted(&'a Predicted),
}

/// The effects on a tail alone: those groups whose unknowns are all in it or in the border. Vectors and matrices count the tail's unknowns, then
/// the border's three.
#[derive(Clone, Copy)]
pub(crate) struct Tail<'a> {
    pub terms: &'a [Term<'a>],
    pub dofs: &'a Dofs,
    pub pattern: &'a Pattern,
    /// Which of the tails of `dofs`.
    pub which: usize,
}

impl Tail<'_> {
    /// Its number of unknowns.
    pub fn size(&self) -> usize {
        self.dofs.tails[self.which]
    }

    fn for_each_active(
        &self,
        positions: &[f64],
        stresses: Stresses,
        scratch: &mut Scratch,
        mut visit: impl FnMut(usize, &Term, &Local, &mut Vec<f64>, &mut Vec<f64>),
    ) {
        let longest = self.terms.iter().map(|term| term.effect.predicted_len()).max().unwrap_or(0);
        let none = vec![0.0; longest];
        let Scratch { positions: current, other, hessian } = scratch;
        for (index, term) in self.terms.iter().enumerate() {
            current.resize(3 * term.stencils.group_size, 0.0);
            let len = term.effect.predicted_len();
            for &group in &self.pattern.tail_groups[self.which][term.set] {
                term.stencils.gather(group, positions, current);
                let predicted = match stresses {
                    Stresses::None => &none[..len],
                    Stresses::Current => &[],
                    Stresses::Predicted(predicted) => predicted.of(index, group, len),
                };
                let local = Local { current, group, predicted };
                if term.effect.is_active(&local) {
                    visit(index, term, &local, other, hessian);
                }
            }
        }
    }

    /// Their energy (µJ).
    pub fn energy(&self, positions: &[f64], scratch: &mut Scratch) -> f64 {
        let mut total = 0.0;
        self.for_each_active(positions, Stresses::Current, scratch, |_, term, local, _, _| {
            total += term.effect.energy(local);
        });
        total
    }

    /// Their gradient (mN).
    pub fn gradient(&self, positions: &[f64], scratch: &mut Scratch) -> Vec<f64> {
        let mut out = vec![0.0; self.size() + 3];
        self.for_each_active(positions, Stresses::Current, scratch, |_, term, local, forces, _| {
            let n = term.stencils.group_size;
            forces.clear();
            forces.resize(3 * n, 0.0);
            term.effect.add_gradient(local, forces);
            for (force, index) in forces.iter().zip(self.unknowns(term, local.group)) {
                if let Some(index) = index {
                    out[index] += force;
                }
            }
        });
        out
    }

    /// Adds `factor` times their Hessian (mN/mm) to the lower triangle of `out`, column by column of `stride` entries.
    pub fn add_hessian(
        &self,
        positions: &[f64],
        stresses: Stresses,
        factor: f64,
        scratch: &mut Scratch,
        (out, stride): (&mut [f64], usize),
    ) {
        let mut unknowns = Vec::new();
        self.for_each_active(positions, stresses, scratch, |_, term, local, _, matrix| {
            let n = 3 * term.stencils.group_size;
            matrix.clear();
            matrix.resize(n * n, 0.0);
            term.effect.add_hessian(local, matrix);
            unknowns.clear();
            unknowns.extend(self.unknowns(term, local.group).map(|index| index.unwrap_or(usize::MAX)));
            for (at, &row) in unknowns.iter().enumerate() {
                for (value, &column) in matrix[at * n..=at * n + at].iter().zip(&unknowns) {
                    let (low, high) = (row.min(column), row.max(column));
                    if high != usize::MAX {
                        out[low * stride + high] += factor * value;
                    }
                }
            }
        });
    }

    /// Replaces the stresses of these effects in `predicted` by those at `positions`.
    pub fn keep_stresses(&self, positions: &[f64], scratch: &mut Scratch, predicted: &mut Predicted) {
        self.for_each_active(positions, Stresses::Current, scratch, |index, term, local, moved, _| {
            let len = term.effect.predicted_len();
            moved.clear();
            moved.resize(3 * term.stencils.group_size, 0.0);
            term.effect.predict_stress(local, moved, &mut predicted.terms[index][local.group * len..][..len]);
        });
    }

    /// Number within the tail of each unknown of a group, component-major; `None` for what is fixed.
    fn unknowns<'b>(&'b self, term: &'b Term, group: usize) -> impl Iterator<Item = Option<usize>> + 'b {
        let (vertices, tail) = (term.stencils.group(group), self.size());
        (0..3).flat_map(move |k| vertices.iter().map(move |&vertex| self.dofs.in_tail(tail, vertex as usize, k)))
    }
}
