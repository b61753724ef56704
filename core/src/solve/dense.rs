//! Small dense symmetric systems (the one place that names faer's dense code; the sparse one is `sparse`). Sequential.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::solvers::Llt;
use faer::prelude::Solve;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

/// A dense square matrix.
pub(super) struct Dense(Mat<f64>);

impl Dense {
    /// With the entry (row, column) that `entry` says.
    pub fn from_fn(size: usize, entry: impl FnMut(usize, usize) -> f64) -> Self {
        Dense(Mat::from_fn(size, size, entry))
    }

    /// Without rows.
    pub fn empty() -> Self {
        Dense(Mat::new())
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.0.nrows()
    }

    /// The entry in `row` and `column`.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.0[(row, column)]
    }

    /// Sets the entry in `row` and `column`.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.0[(row, column)] = value;
    }

    /// L Lᵀ of this lower triangle L.
    pub fn times_transposed(&self) -> Self {
        let size = self.size();
        let mut product = Mat::<f64>::zeros(size, size);
        matmul(
            product.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Replace,
            self.0.as_ref(),
            BlockStructure::TriangularLower,
            self.0.as_ref().transpose(),
            BlockStructure::TriangularUpper,
            1.0,
            Par::Seq,
        );
        Dense::from_fn(size, |row, column| product[(row.max(column), row.min(column))])
    }

    /// Matrix times vector.
    pub fn times(&self, vector: &[f64]) -> Vec<f64> {
        let product = &self.0 * MatRef::from_column_major_slice(vector, vector.len(), 1);
        (0..vector.len()).map(|row| product[(row, 0)]).collect()
    }

    /// The Cholesky factor of the symmetric matrix whose lower triangle this is; `None` if it is not positive definite.
    pub fn cholesky(&self) -> Option<DenseFactor> {
        self.0.llt(Side::Lower).ok().map(DenseFactor)
    }
}

/// The Cholesky factor of a dense matrix.
pub(super) struct DenseFactor(Llt<f64>);

impl DenseFactor {
    /// Solves in place for right-hand sides of `size` entries each, one after the other.
    pub fn solve(&self, size: usize, columns: &mut [f64]) {
        let count = columns.len() / size;
        self.0.solve_in_place(MatMut::from_column_major_slice_mut(columns, size, count));
    }
}
