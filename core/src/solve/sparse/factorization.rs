//! The numbers of a sparse Cholesky factorisation whose supernodes are small: right-looking, each supernode factorised as a dense block and at once subtracted from those
//! that its rows lie in (supernodal right-looking Cholesky: Rothberg & Gupta, *ACM Trans. Math. Softw.* 17 (1991) 313–334).
//!
//! Where everything goes is known before ([`Plan`]). Not here: the dense block (`columns`), which matrices are small enough (`sparse`).

use pulp::{Simd, WithSimd};

use super::substitution::Supernode;
use crate::assemble::Pattern;
use crate::solve::columns::{SIDE_BY_SIDE, factorize, padded, subtract_products};
use crate::solve::number::Number;

/// A supernode that another one is subtracted from.
#[derive(Debug)]
struct Target {
    /// First of the other's rows that is one of its columns, and how many are.
    rows: [usize; 2],
    /// Its block among the factor's values.
    start: usize,
    /// Length of its columns.
    stride: usize,
    /// Place in its columns of each of the other's rows from the first on.
    places: Vec<u32>,
}

/// Where the entries of a matrix go, and the products of each supernode.
#[derive(Debug)]
pub(super) struct Plan {
    /// Place among the factor's values of each stored entry of the matrix.
    entries: Vec<u32>,
    /// Of each supernode.
    targets: Vec<Vec<Target>>,
    /// Memory for products.
    products: usize,
}

impl Plan {
    /// For a matrix with this pattern and a factor with these supernodes, whose columns are made whole vectors long.
    pub fn new(pattern: &Pattern, supernodes: &mut [Supernode]) -> Self {
        let mut end = 0;
        for supernode in supernodes.iter_mut() {
            supernode.stride = padded(supernode.stride);
            supernode.values = end..end + supernode.columns * supernode.stride;
            end = supernode.values.end;
        }
        let supernodes = &*supernodes;
        let mut of_column = vec![0; pattern.free];
        for (index, supernode) in supernodes.iter().enumerate() {
            of_column[supernode.start..supernode.start + supernode.columns].fill(index);
        }
        let mut entries = Vec::with_capacity(pattern.stored());
        for column in 0..pattern.free {
            let supernode = &supernodes[of_column[column]];
            let start = supernode.values.start + (column - supernode.start) * supernode.stride;
            let [first, end] = [column, column + 1].map(|column| pattern.column_starts[column] as usize);
            entries.extend(pattern.rows[first..end].iter().map(|&row| (start + supernode.place(row)) as u32));
        }
        let targets = supernodes.iter().map(|supernode| {
            let mut targets = Vec::new();
            let mut first = 0;
            while let Some(&row) = supernode.below.get(first) {
                let target = &supernodes[of_column[row as usize]];
                let rows = &supernode.below[first..];
                let columns = rows.iter().take_while(|&&row| (row as usize) < target.start + target.columns).count();
                targets.push(Target {
                    rows: [first, columns],
                    start: target.values.start,
                    stride: target.stride,
                    places: rows.iter().map(|&row| target.place(row) as u32).collect(),
                });
                first += columns;
            }
            targets
        });
        let targets = targets.collect();
        let products = SIDE_BY_SIDE * supernodes.iter().map(|supernode| supernode.stride).max().unwrap_or(0);
        Plan { entries, targets, products }
    }
}

/// Fills `values` with the factor of the matrix with the entries `matrix`; whether it is positive definite.
pub(super) struct Factorization<'a, T> {
    pub plan: &'a Plan,
    pub supernodes: &'a [Supernode],
    pub matrix: &'a [f64],
    pub values: &'a mut [T],
    pub memory: &'a mut Vec<T>,
}

impl<T: Number> WithSimd for Factorization<'_, T> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Factorization { plan, supernodes, matrix, values, memory } = self;
        values.fill(T::default());
        for (&place, &entry) in plan.entries.iter().zip(matrix) {
            values[place as usize] = T::nearest(entry);
        }
        memory.resize(plan.products.max(memory.len()), T::default());
        for (supernode, targets) in supernodes.iter().zip(&plan.targets) {
            let (before, later) = values.split_at_mut(supernode.values.end);
            let block = &mut before[supernode.values.start..];
            if !factorize(simd, block, supernode.columns, supernode.stride) {
                return false;
            }
            for target in targets {
                subtract_from(
                    simd,
                    target,
                    supernode,
                    block,
                    &mut later[target.start - supernode.values.end..],
                    memory,
                );
            }
        }
        true
    }
}

/// Subtracts the products of a supernode's columns, `block`, from the columns of one that its rows lie in.
#[inline(always)]
fn subtract_from<S: Simd, T: Number>(
    simd: S,
    target: &Target,
    supernode: &Supernode,
    block: &[T],
    out: &mut [T],
    memory: &mut [T],
) {
    let Target { rows: [first, columns], stride: target_stride, places, .. } = target;
    let stride = supernode.stride;
    for column in (0..*columns).step_by(SIDE_BY_SIDE) {
        let width = SIDE_BY_SIDE.min(columns - column);
        let top = supernode.columns + first + column;
        let products = &mut memory[..width * stride];
        products.fill(T::default());
        subtract_products(simd, block, stride, top, products);
        for (c, products) in products.chunks_exact(stride).enumerate() {
            let to = &mut out[places[column + c] as usize * target_stride..][..*target_stride];
            for (&place, product) in places[column + c..].iter().zip(&products[top + c..]) {
                to[place as usize] += *product;
            }
        }
    }
}
