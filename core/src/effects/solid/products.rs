//! Sums of outer products of rows of one number per node: what element matrices are made of.
//!
//! The sum of one block stays in registers, two of its rows at a time, while it runs over the products; the block itself is touched once. Not here: what the rows mean.

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
    for a in (0..NODES).step_by(2) {
        add_two_rows::<NODES, PAIRS>(a, &pairs, block);
    }
}

/// As [`add_products`], for a sum that is symmetric: what lies above the diagonal by more than a vector is left out.
#[inline(always)]
pub(in crate::effects) fn add_symmetric_products<const PAIRS: usize>(pairs: [Pair; PAIRS], block: &mut NodePairs) {
    for a in [0, 2] {
        add_two_rows::<4, PAIRS>(a, &pairs, block);
    }
    for a in [4, 6] {
        add_two_rows::<8, PAIRS>(a, &pairs, block);
    }
    for a in [8, 10] {
        add_two_rows::<12, PAIRS>(a, &pairs, block);
    }
    for a in [12, 14] {
        add_two_rows::<16, PAIRS>(a, &pairs, block);
    }
    for a in [16, 18] {
        add_two_rows::<20, PAIRS>(a, &pairs, block);
    }
}

/// The first `WIDTH` entries of the rows `a` and `a + 1`.
#[inline(always)]
fn add_two_rows<const WIDTH: usize, const PAIRS: usize>(a: usize, pairs: &[Pair; PAIRS], block: &mut NodePairs) {
    let (mut first, mut second) = ([0.0; WIDTH], [0.0; WIDTH]);
    first.copy_from_slice(&block[a][..WIDTH]);
    second.copy_from_slice(&block[a + 1][..WIDTH]);
    for (left, right) in pairs {
        for (left, right) in left.iter().zip(*right) {
            let (one, other) = (left[a], left[a + 1]);
            for b in 0..WIDTH {
                first[b] = one.mul_add(right[b], first[b]);
            }
            for b in 0..WIDTH {
                second[b] = other.mul_add(right[b], second[b]);
            }
        }
    }
    block[a][..WIDTH].copy_from_slice(&first);
    block[a + 1][..WIDTH].copy_from_slice(&second);
}
