//! The numbers of one factorisation in one precision: what faer is asked for, alike for `f32` and `f64`.
//!
//! Not here: which precision is enough (`sparse`).

use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymbolicCholeskyRaw};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::assemble::Pattern;
use crate::solve::dense::Dense;

/// The values of the factor L.
pub(super) struct Numeric<T> {
    values: Vec<T>,
}

impl<T: RealField + Copy + Into<f64>> Numeric<T> {
    /// No factor yet.
    pub fn empty() -> Self {
        Numeric { values: Vec::new() }
    }

    /// Factorises the matrix with the sparse entries `matrix` in the layout of `pattern`; whether it is positive definite.
    pub fn factorize(
        &mut self,
        symbolic: &SymbolicCholesky<u32>,
        pattern: &Pattern,
        matrix: &[T],
        stack: &mut MemStack,
    ) -> bool {
        let n = pattern.free;
        self.values.resize(symbolic.len_val(), T::zero_impl());
        let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
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
    pub fn substitute(&self, symbolic: &SymbolicCholesky<u32>, rhs: &mut [T], stack: &mut MemStack) {
        let n = symbolic.nrows();
        let columns = MatMut::from_column_major_slice_mut(rhs, n, rhs.len() / n);
        LltRef::new(symbolic, &self.values).solve_in_place_with_conj(Conj::No, columns, Par::Seq, stack);
    }

    /// The last `size` rows and columns of L, with a border of `border` rows of zeros.
    pub fn tail(&self, symbolic: &SymbolicCholesky<u32>, size: usize, border: usize) -> Dense {
        let mut tail = Dense::zeros(size, border);
        let SymbolicCholeskyRaw::Supernodal(raw) = symbolic.raw() else { return tail };
        let first = raw.nrows() - size;
        let factor = SupernodalLltRef::new(raw, &self.values);
        for index in (0..raw.n_supernodes()).rev() {
            let supernode = factor.supernode(index);
            let (start, values) = (supernode.start(), supernode.val());
            if start + values.ncols() <= first {
                break;
            }
            for column in first.saturating_sub(start)..values.ncols() {
                let to = start + column - first;
                for row in column..values.ncols() {
                    tail.set(start + row - first, to, values[(row, column)].into());
                }
                for (row, &at) in supernode.pattern().iter().enumerate() {
                    tail.set(at as usize - first, to, values[(values.ncols() + row, column)].into());
                }
            }
        }
        tail
    }
}
