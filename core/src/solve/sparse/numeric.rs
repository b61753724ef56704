//! The numbers of one factorisation in one precision: what faer is asked for, alike for `f32` and `f64`.
//!
//! Not here: which precision is enough (`sparse`).

use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{SymbolicCholesky, SymbolicCholeskyRaw};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Par, Side, Spec};

use super::substitution::{Number, Substitution, Supernode};
use crate::kernel::run_kernel;
use crate::solve::dense::Dense;

/// The values of the factor L.
pub(super) struct Numeric<T> {
    values: Vec<T>,
    /// Of a substitution.
    memory: Vec<T>,
}

impl<T: RealField + Number + Into<f64>> Numeric<T> {
    /// No factor yet.
    pub fn empty() -> Self {
        Numeric { values: Vec::new(), memory: Vec::new() }
    }

    /// Factorises the matrix with the entries `matrix` in the lower triangle `structure`; whether it is positive definite.
    pub fn factorize(
        &mut self,
        symbolic: &SymbolicCholesky<u32>,
        structure: SymbolicSparseColMatRef<u32>,
        matrix: &[T],
        stack: &mut MemStack,
    ) -> bool {
        self.values.resize(symbolic.len_val(), T::zero_impl());
        symbolic
            .factorize_numeric_llt(
                &mut self.values,
                SparseColMatRef::new(structure, matrix),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                stack,
                Spec::default(),
            )
            .is_ok()
    }

    /// Solves in place, for right-hand sides one after the other.
    pub fn substitute(&mut self, supernodes: &[Supernode], size: usize, rhs: &mut [T]) {
        for x in rhs.chunks_exact_mut(size) {
            let memory = &mut self.memory;
            run_kernel(Substitution { supernodes, factor: &self.values, x, known: None, memory });
        }
    }

    /// Completes the solution of a system with nothing on the right-hand side above its last `known` unknowns, of which the end of `x` holds the values.
    pub fn complete(&mut self, supernodes: &[Supernode], known: usize, x: &mut [T]) {
        let memory = &mut self.memory;
        run_kernel(Substitution { supernodes, factor: &self.values, x, known: Some(known), memory });
    }

    /// The last `size` rows and columns of L, with a border of `border` rows of zeros.
    pub fn tail(&self, supernodes: &[Supernode], size: usize, border: usize) -> Dense {
        let mut tail = Dense::zeros(size, border);
        let first = supernodes.last().map_or(0, |last| last.start + last.columns) - size;
        for Supernode { start, columns, below, values } in supernodes.iter().rev() {
            if start + columns <= first {
                break;
            }
            let rows = columns + below.len();
            let block = &self.values[values.clone()];
            for column in first.saturating_sub(*start)..*columns {
                let to = start + column - first;
                let entries = &block[column * rows..][..rows];
                for row in column..*columns {
                    tail.set(start + row - first, to, entries[row].into());
                }
                for (entry, &row) in entries[*columns..].iter().zip(below) {
                    tail.set(row as usize - first, to, (*entry).into());
                }
            }
        }
        tail
    }
}

/// The supernodes of a factor; `None` if it has none.
pub(super) fn supernodes(symbolic: &SymbolicCholesky<u32>) -> Option<Vec<Supernode>> {
    let SymbolicCholeskyRaw::Supernodal(raw) = symbolic.raw() else { return None };
    let (begins, ends, values) = (raw.supernode_begin(), raw.supernode_end(), raw.col_ptr_for_val());
    let supernode = |index: usize| Supernode {
        start: begins[index] as usize,
        columns: (ends[index] - begins[index]) as usize,
        below: raw.supernode(index).pattern().to_vec(),
        values: values[index] as usize..values[index + 1] as usize,
    };
    Some((0..raw.n_supernodes()).map(supernode).collect())
}
