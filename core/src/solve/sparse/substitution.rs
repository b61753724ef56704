//! Forward and back substitution with a supernodal Cholesky factor, for few right-hand sides: each column is gone through once, four of them at a time.
//!
//! One right-hand side leaves nothing to block: what a product of matrices gains has to be set up for every supernode, and these have but a few dozen columns.
//! Not here: the factorisation (`numeric`).

use std::ops::Range;

use crate::kernel::Kernel;
use crate::solve::number::Number;

/// Neighbouring columns of the factor with the same rows below them.
#[derive(Clone, Debug)]
pub(super) struct Supernode {
    /// First column.
    pub start: usize,
    /// Number of columns.
    pub columns: usize,
    /// Rows below these columns' own.
    pub below: Vec<u32>,
    /// Its entries among those of the factor: a dense block of `columns` + `below` rows, column by column.
    pub values: Range<usize>,
    /// Length of a column of the block: as many rows, then zeros.
    pub stride: usize,
}

impl Supernode {
    /// Place of a row of the matrix in its columns.
    pub fn place(&self, row: u32) -> usize {
        match (row as usize).checked_sub(self.start) {
            Some(own) if own < self.columns => own,
            _ => self.columns + self.below.partition_point(|&below| below < row),
        }
    }
}

/// Columns that are gone through at once.
const SIDE_BY_SIDE: usize = 4;
/// Numbers that are computed together.
const LANES: usize = 8;

/// Solves L Lᵀ x = b in place, or Lᵀ x = 0 above the last unknowns if these are known.
pub(super) struct Substitution<'a, T> {
    pub supernodes: &'a [Supernode],
    /// Entries of the factor L.
    pub factor: &'a [T],
    /// b, then x.
    pub x: &'a mut [T],
    /// How many of the unknowns, from the last, x holds already; `None`: it holds b.
    pub known: Option<usize>,
    pub memory: &'a mut Vec<T>,
}

impl<T: Number> Kernel for Substitution<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Substitution { supernodes, factor, x, known, memory } = self;
        if known.is_none() {
            for supernode in supernodes {
                forward(supernode, &factor[supernode.values.clone()], x, memory);
            }
        }
        let unknown = x.len() - known.unwrap_or(0);
        for supernode in supernodes.iter().rev() {
            let columns = supernode.columns.min(unknown.saturating_sub(supernode.start));
            back(supernode, columns, &factor[supernode.values.clone()], x, memory);
        }
    }
}

#[inline(always)]
fn forward<T: Number>(supernode: &Supernode, block: &[T], x: &mut [T], memory: &mut Vec<T>) {
    let &Supernode { start, columns, ref below, stride, .. } = supernode;
    let own = &mut x[start..][..columns];
    memory.clear();
    memory.extend_from_slice(own);
    memory.resize(stride, T::default());
    let (fours, rest) = block.split_at(columns / SIDE_BY_SIDE * SIDE_BY_SIDE * stride);
    let mut first = 0;
    for four in fours.chunks_exact(SIDE_BY_SIDE * stride) {
        let column = from_row(first, four, stride);
        let (solved, left) = memory[first..].split_at_mut(SIDE_BY_SIDE);
        for c in 0..SIDE_BY_SIDE {
            for earlier in 0..c {
                let known = solved[earlier];
                solved[c] -= column[earlier][c] * known;
            }
            solved[c] = solved[c] / column[c][c];
        }
        let below = from_row(first + SIDE_BY_SIDE, four, stride);
        subtract(below, [solved[0], solved[1], solved[2], solved[3]], left);
        first += SIDE_BY_SIDE;
    }
    for column in rest.chunks_exact(stride) {
        let [solved, left @ ..] = &mut memory[first..] else { break };
        *solved = *solved / column[first];
        for (left, entry) in left.iter_mut().zip(&column[first + 1..]) {
            *left -= *entry * *solved;
        }
        first += 1;
    }
    own.copy_from_slice(&memory[..columns]);
    for (change, &row) in memory[columns..].iter().zip(below) {
        x[row as usize] += *change;
    }
}

/// Four columns of `stride` entries each, from the row `first` on. Written out: closures that are not inlined leave the vector instructions behind.
#[inline(always)]
fn from_row<T>(first: usize, four: &[T], stride: usize) -> [&[T]; SIDE_BY_SIDE] {
    let (a, others) = four.split_at(stride);
    let (b, others) = others.split_at(stride);
    let (c, d) = others.split_at(stride);
    [&a[first..], &b[first..], &c[first..], &d[first..]]
}

/// Subtracts four columns, each times its unknown, from `left`.
#[inline(always)]
fn subtract<T: Number>([a, b, c, d]: [&[T]; SIDE_BY_SIDE], unknowns: [T; SIDE_BY_SIDE], left: &mut [T]) {
    let [p, q, r, s] = unknowns;
    let (a, b, c, d) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>(), c.as_chunks::<LANES>(), d.as_chunks::<LANES>());
    let (whole, rest) = left.as_chunks_mut::<LANES>();
    for ((((left, a), b), c), d) in whole.iter_mut().zip(a.0).zip(b.0).zip(c.0).zip(d.0) {
        for lane in 0..LANES {
            left[lane] -= (a[lane] * p + b[lane] * q) + (c[lane] * r + d[lane] * s);
        }
    }
    for ((((left, a), b), c), d) in rest.iter_mut().zip(a.1).zip(b.1).zip(c.1).zip(d.1) {
        *left -= (*a * p + *b * q) + (*c * r + *d * s);
    }
}

/// The products of four columns with `vector`, all of one length.
#[inline(always)]
fn products<T: Number>([a, b, c, d]: [&[T]; SIDE_BY_SIDE], vector: &[T]) -> [T; SIDE_BY_SIDE] {
    let (whole, last) = vector.as_chunks::<LANES>();
    let (a, b, c, d) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>(), c.as_chunks::<LANES>(), d.as_chunks::<LANES>());
    let mut sums = [[T::default(); LANES]; SIDE_BY_SIDE];
    for ((((x, a), b), c), d) in whole.iter().zip(a.0).zip(b.0).zip(c.0).zip(d.0) {
        for lane in 0..LANES {
            sums[0][lane] += a[lane] * x[lane];
            sums[1][lane] += b[lane] * x[lane];
            sums[2][lane] += c[lane] * x[lane];
            sums[3][lane] += d[lane] * x[lane];
        }
    }
    let mut products = [T::default(); SIDE_BY_SIDE];
    for (product, sums) in products.iter_mut().zip(&sums) {
        *product = summed(sums);
    }
    for ((((x, a), b), c), d) in last.iter().zip(a.1).zip(b.1).zip(c.1).zip(d.1) {
        products[0] += *a * *x;
        products[1] += *b * *x;
        products[2] += *c * *x;
        products[3] += *d * *x;
    }
    products
}

/// The sum of the lanes, in halves.
#[inline(always)]
fn summed<T: Number>(lanes: &[T; LANES]) -> T {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

/// Solves for the first `columns` unknowns of a supernode, the others known.
#[inline(always)]
fn back<T: Number>(supernode: &Supernode, columns: usize, block: &[T], x: &mut [T], memory: &mut Vec<T>) {
    if columns == 0 {
        return;
    }
    let &Supernode { start, columns: own, ref below, stride, .. } = supernode;
    memory.clear();
    memory.extend_from_slice(&x[start..][..own]);
    memory.extend(below.iter().map(|&row| x[row as usize]));
    memory.resize(stride, T::default());
    let fours = columns / SIDE_BY_SIDE * SIDE_BY_SIDE;
    let (fours, rest) = block[..columns * stride].split_at(fours * stride);
    let mut first = columns;
    for column in rest.chunks_exact(stride).rev() {
        first -= 1;
        let [unknown, known @ ..] = &mut memory[first..] else { break };
        let mut left = *unknown;
        for (entry, x) in column[first + 1..].iter().zip(&*known) {
            left -= *entry * *x;
        }
        *unknown = left / column[first];
    }
    for four in fours.chunks_exact(SIDE_BY_SIDE * stride).rev() {
        first -= SIDE_BY_SIDE;
        let column = from_row(first, four, stride);
        let (unknown, known) = memory[first..].split_at_mut(SIDE_BY_SIDE);
        let products = products(from_row(first + SIDE_BY_SIDE, four, stride), known);
        for c in (0..SIDE_BY_SIDE).rev() {
            let mut left = unknown[c] - products[c];
            for later in c + 1..SIDE_BY_SIDE {
                left -= column[c][later] * unknown[later];
            }
            unknown[c] = left / column[c][c];
        }
    }
    x[start..][..columns].copy_from_slice(&memory[..columns]);
}
