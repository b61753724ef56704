//! Sparse Cholesky factorisation with a fixed pattern: analysed once, refactorised often, every solution checked.
//!
//! The unknowns are already in a fill-reducing order (the mesh numbers them by nested dissection), so faer is asked to keep it.
//! Sequential: two threads gain nothing at these sizes and change the last bits.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use thiserror::Error;

use super::dense::Dense;
use crate::assemble::Pattern;

/// Why a linear system was not solved.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LinearSolveError {
    /// The pattern could not be analysed (memory, index range).
    #[error("the sparsity pattern could not be analysed: {0}")]
    Analysis(String),
    /// The matrix is not positive definite.
    #[error("the stiffness matrix is not positive definite")]
    Indefinite,
    /// The residual stayed too large after refinement.
    #[error("the linear solution leaves a relative residual of {relative_residual:e}")]
    Inaccurate {
        /// ‖b − A x‖ / ‖b‖.
        relative_residual: f64,
    },
}

/// Largest relative residual of a linear solve that is accepted. Newton's method corrects what is left.
const MAX_RELATIVE_RESIDUAL: f64 = 1e-6;
/// Relative residual that one step of refinement is spent on.
const REFINE_ABOVE: f64 = 1e-10;

/// The analysed pattern; independent of values, shared between threads.
#[derive(Debug)]
pub struct SymbolicFactor {
    symbolic: SymbolicCholesky<u32>,
    scratch: StackReq,
}

impl SymbolicFactor {
    /// Analyses the sparse part of `pattern`.
    ///
    /// # Errors
    /// [`LinearSolveError::Analysis`].
    pub fn new(pattern: &Pattern) -> Result<Self, LinearSolveError> {
        let n = pattern.free;
        // Under the identity ordering faer analyses the matrix as it is given and expects its upper triangle there.
        let (starts, indices) = transposed(pattern);
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &indices);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(matrix, Side::Upper, SymmetricOrdering::Identity, params)
            .map_err(|error| LinearSolveError::Analysis(error.to_string()))?;
        let scratch = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(2, Par::Seq),
        ]);
        Ok(SymbolicFactor { symbolic, scratch })
    }

    /// Number of stored entries of the factor.
    pub fn stored(&self) -> usize {
        self.symbolic.len_val()
    }
}

/// Column starts and row indices of the transposed (upper) triangle.
fn transposed(pattern: &Pattern) -> (Vec<u32>, Vec<u32>) {
    let n = pattern.free;
    let mut starts = vec![0u32; n + 1];
    for &row in &pattern.rows {
        starts[row as usize + 1] += 1;
    }
    for column in 0..n {
        starts[column + 1] += starts[column];
    }
    let mut next = starts.clone();
    let mut indices = vec![0u32; pattern.rows.len()];
    for column in 0..n {
        for &row in &pattern.rows[pattern.column_starts[column] as usize..pattern.column_starts[column + 1] as usize] {
            indices[next[row as usize] as usize] = column as u32;
            next[row as usize] += 1;
        }
    }
    (starts, indices)
}

/// Memory of one numeric factorisation.
pub struct Factor {
    values: Vec<f64>,
    stack: MemBuffer,
    residual: Vec<f64>,
}

impl Factor {
    /// Memory for factors of `symbolic`.
    pub fn new(symbolic: &SymbolicFactor) -> Self {
        Factor { values: vec![0.0; symbolic.stored()], stack: MemBuffer::new(symbolic.scratch), residual: Vec::new() }
    }

    /// Factorises the sparse part of `values` (layout of `pattern`).
    ///
    /// # Errors
    /// [`LinearSolveError::Indefinite`].
    pub fn factorize(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
    ) -> Result<(), LinearSolveError> {
        let n = pattern.free;
        let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
        let matrix = SparseColMatRef::new(structure, &values[..pattern.stored()]);
        symbolic
            .symbolic
            .factorize_numeric_llt(
                &mut self.values,
                matrix,
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.stack),
                Spec::default(),
            )
            .map(|_| ())
            .map_err(|_| LinearSolveError::Indefinite)
    }

    /// Solves A x = b for right-hand sides laid out one after the other in `rhs`, in place, and checks each residual
    /// (one step of refinement where it helps).
    ///
    /// # Errors
    /// [`LinearSolveError::Inaccurate`].
    pub fn solve(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
        rhs: &mut [f64],
    ) -> Result<(), LinearSolveError> {
        let target = rhs.to_vec();
        self.substitute(symbolic, rhs);
        for (x, b) in rhs.chunks_exact_mut(pattern.free).zip(target.chunks_exact(pattern.free)) {
            self.check(symbolic, pattern, values, x, b)?;
        }
        Ok(())
    }

    /// As [`Factor::solve`], unchecked: what is made of the solutions is to be checked.
    pub(super) fn substitute(&mut self, symbolic: &SymbolicFactor, rhs: &mut [f64]) {
        let n = symbolic.symbolic.nrows();
        let factor = LltRef::new(&symbolic.symbolic, &self.values);
        let rhs = MatMut::from_column_major_slice_mut(rhs, n, rhs.len() / n);
        factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.stack));
    }

    /// Checks that A x = b, with one step of refinement where it helps.
    ///
    /// # Errors
    /// [`LinearSolveError::Inaccurate`].
    pub(super) fn check(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
        x: &mut [f64],
        b: &[f64],
    ) -> Result<(), LinearSolveError> {
        let size = norm(b);
        if size == 0.0 {
            return Ok(());
        }
        let mut relative = self.residual_into(pattern, values, x, b) / size;
        if relative > REFINE_ABOVE {
            let mut correction = std::mem::take(&mut self.residual);
            self.substitute(symbolic, &mut correction);
            for (x, c) in x.iter_mut().zip(&correction) {
                *x += c;
            }
            self.residual = correction;
            relative = self.residual_into(pattern, values, x, b) / size;
        }
        if relative.is_nan() || relative > MAX_RELATIVE_RESIDUAL {
            return Err(LinearSolveError::Inaccurate { relative_residual: relative });
        }
        Ok(())
    }

    /// The last `size` rows and columns of the factor L, with a border of `border` rows of zeros.
    pub(super) fn tail(&self, symbolic: &SymbolicFactor, size: usize, border: usize) -> Dense {
        let mut tail = Dense::zeros(size, border);
        let SymbolicCholeskyRaw::Supernodal(raw) = symbolic.symbolic.raw() else { return tail };
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
                    tail.set(start + row - first, to, values[(row, column)]);
                }
                for (row, &at) in supernode.pattern().iter().enumerate() {
                    tail.set(at as usize - first, to, values[(values.ncols() + row, column)]);
                }
            }
        }
        tail
    }

    /// Leaves b − A x in `self.residual` and returns its norm.
    fn residual_into(&mut self, pattern: &Pattern, values: &[f64], x: &[f64], b: &[f64]) -> f64 {
        self.residual.clear();
        self.residual.extend_from_slice(b);
        for column in 0..pattern.free {
            let range = pattern.column_starts[column] as usize..pattern.column_starts[column + 1] as usize;
            let mut below = 0.0;
            for (&row, value) in pattern.rows[range.clone()].iter().zip(&values[range]) {
                let row = row as usize;
                self.residual[row] -= value * x[column];
                if row != column {
                    below += value * x[row];
                }
            }
            self.residual[column] -= below;
        }
        norm(&self.residual)
    }
}

/// Euclidean norm.
pub fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}
