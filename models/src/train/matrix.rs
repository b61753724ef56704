//! Products of f32 matrices stored row by row, plain or transposed: what a forward and a backward pass are made of.
//!
//! A batch is one matrix with a row for each node of each sample, so a layer is one product over thousands of rows.

use faer::linalg::matmul::matmul;
use faer::mat::{MatMut, MatRef};
use faer::{Accum, Par};

/// `out += x w`: `x` of `rows × inner`, `w` of `inner × columns`.
pub fn add_product(out: &mut [f32], x: &[f32], w: &[f32], inner: usize, columns: usize) {
    let rows = x.len() / inner;
    matmul(
        MatMut::from_row_major_slice_mut(out, rows, columns),
        Accum::Add,
        MatRef::from_row_major_slice(x, rows, inner),
        MatRef::from_row_major_slice(w, inner, columns),
        1.0_f32,
        Par::Seq,
    );
}

/// `out += x wᵀ`: `x` of `rows × columns`, `w` of `inner × columns`, `out` of `rows × inner`.
pub fn add_product_transposed(out: &mut [f32], x: &[f32], w: &[f32], inner: usize, columns: usize) {
    let rows = x.len() / columns;
    matmul(
        MatMut::from_row_major_slice_mut(out, rows, inner),
        Accum::Add,
        MatRef::from_row_major_slice(x, rows, columns),
        MatRef::from_row_major_slice(w, inner, columns).transpose(),
        1.0_f32,
        Par::Seq,
    );
}

/// `out += xᵀ y`: `x` of `rows × inner`, `y` of `rows × columns`, `out` of `inner × columns`. The derivative by a layer's weights.
pub fn add_transposed_product(out: &mut [f32], x: &[f32], y: &[f32], inner: usize, columns: usize) {
    let rows = x.len() / inner;
    matmul(
        MatMut::from_row_major_slice_mut(out, inner, columns),
        Accum::Add,
        MatRef::from_row_major_slice(x, rows, inner).transpose(),
        MatRef::from_row_major_slice(y, rows, columns),
        1.0_f32,
        Par::Seq,
    );
}

/// `out += Σ rows of x`. The derivative by a bias.
pub fn add_row_sum(out: &mut [f32], x: &[f32]) {
    for row in x.chunks_exact(out.len()) {
        for (out, x) in out.iter_mut().zip(row) {
            *out += x;
        }
    }
}
