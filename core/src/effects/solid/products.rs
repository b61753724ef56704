//! Sums of outer products of rows of one number per node: what element matrices are made of.
//!
//! The sum of one block stays in registers, a tile of four rows and up to three vectors at a time, while it runs over the products; the block itself is touched once. Not here: what the rows mean.

use super::LANES;
use crate::mesh::element::NODES;

/// One number for each pair of nodes of an element.
pub(in crate::effects) type NodePairs = [[f64; NODES]; NODES];

/// Rows on the left, and as many on the right.
pub(in crate::effects) type Pair<'a> = (&'a [[f64; NODES]], &'a [[f64; NODES]]);

/// `scale` × `row`.
#[inline(always)]
pub(super) fn scaled_row(scale: f64, row: &[f64; NODES]) -> [f64; NODES] {
    let mut out = [0.0; NODES];
    for a in 0..NODES {
        out[a] = scale * row[a];
    }
    out
}

/// Adds Σₖ left[k][a] right[k][b] of every pair to `block[a][b]`.
#[inline(always)]
pub(in crate::effects) fn add_products<const PAIRS: usize>(pairs: [Pair; PAIRS], block: &mut NodePairs) {
    for a in (0..NODES).step_by(LANES) {
        add_tile::<3, PAIRS>([a, 0], &pairs, block);
        add_tile::<2, PAIRS>([a, 3], &pairs, block);
    }
}

/// As [`add_products`], for a sum that is symmetric: what lies above the diagonal by more than a vector is left out.
#[inline(always)]
pub(in crate::effects) fn add_symmetric_products<const PAIRS: usize>(pairs: [Pair; PAIRS], block: &mut NodePairs) {
    add_tile::<1, PAIRS>([0, 0], &pairs, block);
    add_tile::<2, PAIRS>([4, 0], &pairs, block);
    add_tile::<3, PAIRS>([8, 0], &pairs, block);
    add_tile::<2, PAIRS>([12, 0], &pairs, block);
    add_tile::<2, PAIRS>([12, 2], &pairs, block);
    add_tile::<3, PAIRS>([16, 0], &pairs, block);
    add_tile::<2, PAIRS>([16, 3], &pairs, block);
}

/// `VECTORS` vectors of each of four rows, from the row and the vector `at`: three of them, what they are multiplied by and one factor are what registers hold.
#[inline(always)]
fn add_tile<const VECTORS: usize, const PAIRS: usize>(
    [row, vector]: [usize; 2],
    pairs: &[Pair; PAIRS],
    block: &mut NodePairs,
) {
    let mut sum = [[[0.0; LANES]; VECTORS]; LANES];
    for r in 0..LANES {
        sum[r].copy_from_slice(&block[row + r].as_chunks::<LANES>().0[vector..][..VECTORS]);
    }
    for (left, right) in pairs {
        for (left, right) in left.iter().zip(*right) {
            let right = &right.as_chunks::<LANES>().0[vector..][..VECTORS];
            for r in 0..LANES {
                for v in 0..VECTORS {
                    for lane in 0..LANES {
                        sum[r][v][lane] = left[row + r].mul_add(right[v][lane], sum[r][v][lane]);
                    }
                }
            }
        }
    }
    for r in 0..LANES {
        block[row + r].as_chunks_mut::<LANES>().0[vector..][..VECTORS].copy_from_slice(&sum[r]);
    }
}
