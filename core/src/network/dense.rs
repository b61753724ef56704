//! Products of dense f32 matrices, row by row in memory: the one place of the networks that names faer.
//!
//! `out = x w`, `x` of `rows × inner`, `w` of `inner × columns`. Sequential: a prediction runs on the thread that asked for it.

use faer::linalg::matmul::matmul;
use faer::mat::{MatMut, MatRef};
use faer::{Accum, Par};

/// What becomes of the numbers that stand in the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Into {
    /// They are overwritten.
    Place,
    /// The product is added to them.
    Sum,
}

/// `out = x w`, or `out += x w`. The number of rows is `x.len() / inner`.
///
/// # Panics
/// If the lengths do not fit together.
pub fn product(out: &mut [f32], x: &[f32], w: &[f32], inner: usize, columns: usize, into: Into) {
    let rows = x.len() / inner;
    let accum = match into {
        Into::Place => Accum::Replace,
        Into::Sum => Accum::Add,
    };
    matmul(
        MatMut::from_row_major_slice_mut(out, rows, columns),
        accum,
        MatRef::from_row_major_slice(x, rows, inner),
        MatRef::from_row_major_slice(w, inner, columns),
        1.0_f32,
        Par::Seq,
    );
}

/// Every row of `out` becomes `row`: the bias, or what all nodes share.
pub fn fill_rows(out: &mut [f32], row: &[f32]) {
    for target in out.chunks_exact_mut(row.len()) {
        target.copy_from_slice(row);
    }
}

/// `out = x wᵀ`: `x` of `rows × inner`, `w` of `columns × inner`.
///
/// # Panics
/// If the lengths do not fit together.
pub fn product_transposed(out: &mut [f32], x: &[f32], w: &[f32], columns: usize, inner: usize) {
    let rows = x.len() / inner;
    matmul(
        MatMut::from_row_major_slice_mut(out, rows, columns),
        Accum::Replace,
        MatRef::from_row_major_slice(x, rows, inner),
        MatRef::from_row_major_slice(w, columns, inner).transpose(),
        1.0_f32,
        Par::Seq,
    );
}
