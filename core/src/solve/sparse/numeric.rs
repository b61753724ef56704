//! The numbers of one factorisation in one precision, alike for `f32` and `f64`: small ones by `factorization`, large ones by faer.
//!
//! Not here: which precision is enough (`sparse`).

use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::cholesky::{SymbolicCholesky, SymbolicCholeskyRaw};
use faer::traits::RealField;
use faer::{Par, Side, Spec};
use pulp::Arch;

use super::factorization::Factorization;
use super::substitution::{Substitution, Supernode};
use super::{SymbolicFactor, Way};
use crate::kernel::run_kernel;
use crate::solve::dense::Dense;
use crate::solve::number::Number;

/// The values of the factor L.
pub(super) struct Numeric<T> {
    values: Vec<T>,
    /// Of a substitution or of products.
    memory: Vec<T>,
    /// Entries of a matrix.
    rounded: Vec<T>,
}

impl<T: RealField + Number + Into<f64>> Numeric<T> {
    /// No factor yet.
    pub fn empty() -> Self {
        Numeric { values: Vec::new(), memory: Vec::new(), rounded: Vec::new() }
    }

    /// Factorises the matrix with the entries `matrix` in the lower triangle; whether it is positive definite.
    pub fn factorize(&mut self, symbolic: &SymbolicFactor, matrix: &[f64], stack: &mut MemStack) -> bool {
        let SymbolicFactor { symbolic, supernodes, way } = symbolic;
        let Numeric { values, memory, rounded } = self;
        values.resize(supernodes.last().map_or(0, |last| last.values.end), T::default());
        let structure = match way {
            Way::Small(plan) => {
                return Arch::new().dispatch(Factorization { plan, supernodes, matrix, values, memory });
            }
            Way::Large { structure, .. } => structure,
        };
        rounded.clear();
        rounded.extend(matrix.iter().map(|entry| T::nearest(*entry)));
        symbolic
            .factorize_numeric_llt(
                values,
                SparseColMatRef::new(structure.as_ref(), rounded),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                stack,
                Spec::default(),
            )
            .is_ok()
    }

    /// Solves in place, for right-hand sides one after the other.
    pub fn substitute(&mut self, supernodes: &[Supernode], size: usize, rhs: &mut [T]) {
        for x in rhs.chunks_exact_mut(size) {
            let memory = &mut self.memory;
            run_kernel(Substitution { supernodes, factor: &self.values, x, known: None, memory });
        }
    }

    /// Completes the solution of a system with nothing on the right-hand side above its last `known` unknowns, of which the end of `x` holds the values.
    pub fn complete(&mut self, supernodes: &[Supernode], known: usize, x: &mut [T]) {
        let memory = &mut self.memory;
        run_kernel(Substitution { supernodes, factor: &self.values, x, known: Some(known), memory });
    }

    /// The last `size` rows and columns of L, with a border of `border` rows of zeros.
    pub fn tail(&self, supernodes: &[Supernode], size: usize, border: usize) -> Dense {
        let mut tail = Dense::zeros(size, border);
        let first = supernodes.last().map_or(0, |last| last.start + last.columns) - size;
        for supernode in supernodes.iter().rev() {
            let Supernode { start, columns, below, values, stride } = supernode;
            if start + columns <= first {
                break;
            }
            let block = &self.values[values.clone()];
            for column in first.saturating_sub(*start)..*columns {
                let to = start + column - first;
                let entries = &block[column * stride..][..*stride];
                for row in column..*columns {
                    tail.set(start + row - first, to, entries[row].into());
                }
                for (entry, &row) in entries[*columns..].iter().zip(below) {
                    tail.set(row as usize - first, to, (*entry).into());
                }
            }
        }
        tail
    }
}

/// The supernodes of a factor as faer lays them out; `None` if it has none.
pub(super) fn supernodes(symbolic: &SymbolicCholesky<u32>) -> Option<Vec<Supernode>> {
    let SymbolicCholeskyRaw::Supernodal(raw) = symbolic.raw() else { return None };
    let (begins, ends, values) = (raw.supernode_begin(), raw.supernode_end(), raw.col_ptr_for_val());
    let supernode = |index: usize| {
        let columns = (ends[index] - begins[index]) as usize;
        let below = raw.supernode(index).pattern().to_vec();
        let stride = columns + below.len();
        let values = values[index] as usize..values[index + 1] as usize;
        Supernode { start: begins[index] as usize, columns, below, values, stride }
    };
    Some((0..raw.n_supernodes()).map(supernode).collect())
}
