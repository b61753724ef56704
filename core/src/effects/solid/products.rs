//! Sums of outer products of rows of one number per node: what element matrices are made of.
//!
//! The sum of one block stays in registers, a tile of four rows and up to three vectors at a time, while it runs over the products; the block itself is touched once. What the left
//! rows are scaled by is multiplied in four of their numbers at a time: all of an element's rows, scaled, would not stay in the first cache. Not here: what the rows mean.

use super::{Base, LANES};
use crate::mesh::element::{FACE_NODES, NODES, POINTS};

/// One number for each pair of nodes of an element, a row for each node: every `step`-th row of a matrix, from `first` on.
pub(in crate::effects) struct Block<'a> {
    pub rows: &'a mut [[f64; NODES]],
    pub first: usize,
    pub step: usize,
}

impl Block<'_> {
    #[inline(always)]
    pub fn row(&mut self, node: usize) -> &mut [f64; NODES] {
        &mut self.rows[self.first + node * self.step]
    }
}

/// Products in one sum at most: a row for each component at each quadrature point.
const MOST: usize = 3 * POINTS;

/// The sum over k of `scales[k]` `left[k]` ⊗ `right[k]`: as many scales as rows on either side, 3 × [`POINTS`] at most.
#[derive(Clone, Copy)]
pub(in crate::effects) struct Products<'a> {
    pub scales: &'a [f64],
    pub left: &'a [[f64; NODES]],
    pub right: &'a [[f64; NODES]],
}

/// Adds `sums`, [`MOST`] products in all at most, to `block`, whose rows are the nodes on the left; what belongs to the element's base is left out where it does not move.
#[inline(always)]
pub(in crate::effects) fn add_products<const SUMS: usize>(base: Base, sums: [Products; SUMS], block: &mut Block) {
    let mut scaled = [[0.0; LANES]; MOST];
    match base {
        Base::Free => {
            for row in (0..NODES).step_by(LANES) {
                scale_rows(row, &sums, &mut scaled);
                add_tile::<3, SUMS>([row, 0], &scaled, &sums, block);
                add_tile::<2, SUMS>([row, 3], &scaled, &sums, block);
            }
        }
        Base::Fixed => {
            for row in (FACE_NODES..NODES).step_by(LANES) {
                scale_rows(row, &sums, &mut scaled);
                add_tile::<3, SUMS>([row, 2], &scaled, &sums, block);
            }
        }
    }
}

/// As [`add_products`], for a sum that is symmetric: what lies above the diagonal by more than a vector is left out too.
#[inline(always)]
pub(in crate::effects) fn add_symmetric_products<const SUMS: usize>(
    base: Base,
    sums: [Products; SUMS],
    block: &mut Block,
) {
    let mut scaled = [[0.0; LANES]; MOST];
    if base == Base::Fixed {
        scale_rows(8, &sums, &mut scaled);
        add_tile::<1, SUMS>([8, 2], &scaled, &sums, block);
        scale_rows(12, &sums, &mut scaled);
        add_tile::<2, SUMS>([12, 2], &scaled, &sums, block);
        scale_rows(16, &sums, &mut scaled);
        add_tile::<3, SUMS>([16, 2], &scaled, &sums, block);
        return;
    }
    scale_rows(0, &sums, &mut scaled);
    add_tile::<1, SUMS>([0, 0], &scaled, &sums, block);
    scale_rows(4, &sums, &mut scaled);
    add_tile::<2, SUMS>([4, 0], &scaled, &sums, block);
    scale_rows(8, &sums, &mut scaled);
    add_tile::<3, SUMS>([8, 0], &scaled, &sums, block);
    scale_rows(12, &sums, &mut scaled);
    add_tile::<2, SUMS>([12, 0], &scaled, &sums, block);
    add_tile::<2, SUMS>([12, 2], &scaled, &sums, block);
    scale_rows(16, &sums, &mut scaled);
    add_tile::<3, SUMS>([16, 0], &scaled, &sums, block);
    add_tile::<2, SUMS>([16, 3], &scaled, &sums, block);
}

/// Fills `scaled` with four numbers, from `row` on, of each left row of `sums`, one sum after the other.
#[inline(always)]
fn scale_rows<const SUMS: usize>(row: usize, sums: &[Products; SUMS], scaled: &mut [[f64; LANES]; MOST]) {
    let mut scaled = scaled.iter_mut();
    for sum in sums {
        for ((left, scale), scaled) in sum.left.iter().zip(sum.scales).zip(&mut scaled) {
            for lane in 0..LANES {
                scaled[lane] = scale * left[row + lane];
            }
        }
    }
}

/// `VECTORS` vectors of each of four rows, from the row and the vector `at`: three of them, what they are multiplied by and one factor are what registers hold.
#[inline(always)]
fn add_tile<const VECTORS: usize, const SUMS: usize>(
    [row, vector]: [usize; 2],
    scaled: &[[f64; LANES]; MOST],
    sums: &[Products; SUMS],
    block: &mut Block,
) {
    let mut tile = [[[0.0; LANES]; VECTORS]; LANES];
    for r in 0..LANES {
        tile[r].copy_from_slice(&block.row(row + r).as_chunks::<LANES>().0[vector..][..VECTORS]);
    }
    let mut scaled = scaled.iter();
    for sum in sums {
        for (right, scaled) in sum.right.iter().zip(&mut scaled) {
            let right = &right.as_chunks::<LANES>().0[vector..][..VECTORS];
            for r in 0..LANES {
                for v in 0..VECTORS {
                    for lane in 0..LANES {
                        tile[r][v][lane] = scaled[r].mul_add(right[v][lane], tile[r][v][lane]);
                    }
                }
            }
        }
    }
    for r in 0..LANES {
        block.row(row + r).as_chunks_mut::<LANES>().0[vector..][..VECTORS].copy_from_slice(&tile[r]);
    }
}
