//! The Cholesky factor of a dense block of columns, for blocks of up to some hundred columns.
//!
//! The block has as many rows as columns or more, and is laid out column by column; what is above the diagonal is not read and not kept. Column by column it is A on entry and L on
//! return, with L Lᵀ = A in its square part and the rows below it solved along. Left-looking: from columns that come next the products of those before are subtracted, a tile of two vectors of
//! rows and six columns (two vertices) at a time, which stays in registers while it runs over the columns before; four times six columns are brought up to date at once, so that
//! the rows of a tile are read from the first cache for all but the first six. Columns are whole vectors long ([`padded`]), and tiles begin at whole vectors: no row is left over, and what
//! is computed beside the lower triangle is nobody's.
//!
//! A general library packs its operands first, which pays where blocks are large: above a thousand columns faer's is faster, below 100 it takes twice as long.
//! Vectors are named, for the compiler leaves them behind in loops over tiles like these.
//! Not here: sparse matrices (`sparse::factorization`), systems (`dense`).

use std::cmp::Ordering;

use pulp::{Arch, Simd, WithSimd};

use super::number::Number;

/// Columns of a vertex, of which most blocks have whole ones.
const VERTEX: usize = 3;
/// Columns that are multiplied at once.
pub(super) const SIDE_BY_SIDE: usize = 2 * VERTEX;
/// Columns that are brought up to date at once.
const BLOCK: usize = 4 * SIDE_BY_SIDE;

/// Length of columns of `rows` rows: whole vectors of either precision on this processor.
pub(super) fn padded(rows: usize) -> usize {
    struct Lanes;

    impl WithSimd for Lanes {
        type Output = usize;

        fn with_simd<S: Simd>(self, _simd: S) -> usize {
            S::F32_LANES
        }
    }

    rows.next_multiple_of(Arch::new().dispatch(Lanes))
}

/// Replaces the first columns of a block, `stride` numbers each, by those of the factor; whether the matrix is positive definite.
#[inline(always)]
pub(super) fn factorize<S: Simd, T: Number>(simd: S, block: &mut [T], columns: usize, stride: usize) -> bool {
    for first in (0..columns).step_by(BLOCK) {
        let (before, own) = block.split_at_mut(first * stride);
        let end = columns.min(first + BLOCK);
        let own = &mut own[..(end - first) * stride];
        subtract_products(simd, before, stride, first, own);
        for at in (first..end).step_by(SIDE_BY_SIDE) {
            let (before, panel) = own.split_at_mut((at - first) * stride);
            let width = SIDE_BY_SIDE.min(end - at);
            let panel = &mut panel[..width * stride];
            subtract_products(simd, before, stride, at, panel);
            let definite = match width {
                1 => factorize_panel::<S, T, 1>(simd, panel, at, stride),
                2 => factorize_panel::<S, T, 2>(simd, panel, at, stride),
                3 => factorize_panel::<S, T, 3>(simd, panel, at, stride),
                4 => factorize_panel::<S, T, 4>(simd, panel, at, stride),
                5 => factorize_panel::<S, T, 5>(simd, panel, at, stride),
                _ => factorize_panel::<S, T, SIDE_BY_SIDE>(simd, panel, at, stride),
            };
            if !definite {
                return false;
            }
        }
    }
    true
}

/// From the columns of `out` subtracts the sum over the columns of `before` of the column times its entry in row `top`, for the first of them, in the row after it for the next, and so
/// on. All columns have `stride` numbers; what is above the row `top` is not kept.
#[inline(always)]
pub(super) fn subtract_products<S: Simd, T: Number>(simd: S, before: &[T], stride: usize, top: usize, out: &mut [T]) {
    if before.is_empty() {
        return;
    }
    let vectors = T::vectors::<S>(&before[..stride]).len();
    let mut at = top / (stride / vectors);
    while at + 2 <= vectors {
        subtract_in_rows::<S, T, 2>(simd, before, stride, [at, top], out);
        at += 2;
    }
    if at < vectors {
        subtract_in_rows::<S, T, 1>(simd, before, stride, [at, top], out);
    }
}

/// The same for `VECTORS` vectors of rows from the vector `at` on.
#[inline(always)]
fn subtract_in_rows<S: Simd, T: Number, const VECTORS: usize>(
    simd: S,
    before: &[T],
    stride: usize,
    [at, top]: [usize; 2],
    out: &mut [T],
) {
    for (panel, top) in out.chunks_mut(SIDE_BY_SIDE * stride).zip((top..).step_by(SIDE_BY_SIDE)) {
        if panel.len() == SIDE_BY_SIDE * stride {
            subtract_tile::<S, T, VECTORS, SIDE_BY_SIDE>(simd, before, stride, [at, top], panel);
        } else if panel.len() == VERTEX * stride {
            subtract_tile::<S, T, VECTORS, VERTEX>(simd, before, stride, [at, top], panel);
        } else {
            for (column, top) in panel.chunks_exact_mut(stride).zip(top..) {
                subtract_tile::<S, T, VECTORS, 1>(simd, before, stride, [at, top], column);
            }
        }
    }
}

#[inline(always)]
fn subtract_tile<S: Simd, T: Number, const VECTORS: usize, const WIDTH: usize>(
    simd: S,
    before: &[T],
    stride: usize,
    [at, top]: [usize; 2],
    panel: &mut [T],
) {
    let mut tile = [[T::default().splat(simd); VECTORS]; WIDTH];
    let mut before = before;
    while let Some((column, others)) = before.split_at_checked(stride) {
        before = others;
        let left = &T::vectors::<S>(column)[at..][..VECTORS];
        let factors = &column[top..][..WIDTH];
        for c in 0..WIDTH {
            let factor = factors[c].splat(simd);
            for v in 0..VECTORS {
                tile[c][v] = T::mul_add(simd, left[v], factor, tile[c][v]);
            }
        }
    }
    let minus = (T::default() - T::ONE).splat(simd);
    for (column, tile) in panel.chunks_exact_mut(stride).zip(&tile) {
        for (out, product) in T::vectors_mut::<S>(column)[at..][..VECTORS].iter_mut().zip(tile) {
            *out = T::mul_add(simd, *product, minus, *out);
        }
    }
}

/// The factor of `WIDTH` columns from which nothing is left to subtract; the first one's diagonal is in the row `top`.
#[inline(always)]
fn factorize_panel<S: Simd, T: Number, const WIDTH: usize>(
    simd: S,
    panel: &mut [T],
    top: usize,
    stride: usize,
) -> bool {
    let mut corner = [[T::default(); WIDTH]; WIDTH];
    let mut inverse = [T::default(); WIDTH];
    for c in 0..WIDTH {
        for r in c..WIDTH {
            let mut left = panel[c * stride + top + r];
            for earlier in 0..c {
                left -= corner[r][earlier] * corner[c][earlier];
            }
            if r > c {
                corner[r][c] = left * inverse[c];
                continue;
            }
            // Not a number is not positive either.
            if left.partial_cmp(&T::default()) != Some(Ordering::Greater) {
                return false;
            }
            corner[c][c] = left.sqrt();
            inverse[c] = T::ONE / corner[c][c];
        }
    }
    let vectors = T::vectors::<S>(&panel[..stride]).len();
    for at in top / (stride / vectors)..vectors {
        let mut solved = [T::default().splat(simd); WIDTH];
        for c in 0..WIDTH {
            let entries = &mut T::vectors_mut::<S>(&mut panel[c * stride..][..stride])[at];
            let mut left = *entries;
            for earlier in 0..c {
                let factor = (T::default() - corner[c][earlier]).splat(simd);
                left = T::mul_add(simd, solved[earlier], factor, left);
            }
            solved[c] = T::product(simd, left, inverse[c].splat(simd));
            *entries = solved[c];
        }
    }
    for c in 0..WIDTH {
        for r in c..WIDTH {
            panel[c * stride + top + r] = corner[r][c];
        }
    }
    true
}
