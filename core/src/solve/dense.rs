//! Small dense symmetric systems (the one place that names faer's dense code; the sparse one is `sparse`). Sequential.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::solve;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};

use super::columns::{factorize, padded};
use crate::kernel::{Kernel, run_kernel};

/// The lower triangle of a symmetric matrix, column by column, with a border of a few rows and columns more that is carried along.
#[derive(Debug)]
pub(super) struct Dense {
    size: usize,
    /// Length of a column: its rows, those of the border, then zeros.
    stride: usize,
    values: Vec<f64>,
}

impl Clone for Dense {
    fn clone(&self) -> Self {
        Dense { values: self.values.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        (self.size, self.stride) = (source.size, source.stride);
        self.values.clone_from(&source.values);
    }
}

impl Dense {
    /// Zeros.
    pub fn zeros(size: usize, border: usize) -> Self {
        let stride = padded(size + border);
        Dense { size, stride, values: vec![0.0; stride * stride] }
    }

    /// Without rows.
    pub fn empty() -> Self {
        Dense::zeros(0, 0)
    }

    /// Number of rows that are solved for.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The entry in `row` and `column` ≤ `row`, the border's after the others.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.values[column * self.stride + row]
    }

    /// Sets the entry in `row` and `column` ≤ `row`.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.values[column * self.stride + row] = value;
    }

    /// Every entry, column by column, the border's rows and columns after the others, and the length of a column; those above the diagonal are not read.
    pub fn lower_mut(&mut self) -> (&mut [f64], usize) {
        (&mut self.values, self.stride)
    }

    /// Leaves the border zero.
    pub fn clear_border(&mut self) {
        let (size, stride) = (self.size, self.stride);
        self.values.chunks_exact_mut(stride).for_each(|column| column[size..].fill(0.0));
    }

    fn inner(&self) -> MatRef<'_, f64> {
        let whole = MatRef::from_column_major_slice(&self.values, self.stride, self.stride);
        whole.submatrix(0, 0, self.size, self.size)
    }

    fn inner_mut(&mut self) -> MatMut<'_, f64> {
        let whole = MatMut::from_column_major_slice_mut(&mut self.values, self.stride, self.stride);
        whole.submatrix_mut(0, 0, self.size, self.size)
    }

    /// L Lᵀ of this lower triangle L, its border zero.
    pub fn times_transposed(&self) -> Self {
        let mut product = Dense::zeros(self.size, self.stride - self.size);
        matmul(
            product.inner_mut(),
            BlockStructure::TriangularLower,
            Accum::Replace,
            self.inner(),
            BlockStructure::TriangularLower,
            self.inner().transpose(),
            BlockStructure::TriangularUpper,
            1.0,
            Par::Seq,
        );
        product
    }

    /// The symmetric matrix times a vector.
    pub fn times(&self, vector: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.size];
        run_kernel(SymmetricProduct { matrix: self, vector, out: &mut out });
        out
    }

    /// Replaces the matrix by its Cholesky factor; whether it is positive definite. The border's rows are solved along.
    pub fn factorize(&mut self) -> bool {
        Arch::new().dispatch(Factorization(self))
    }

    /// Solves in place with the factor that this is, for right-hand sides of `size` entries each, one after the other.
    pub fn substitute(&self, columns: &mut [f64]) {
        let count = columns.len() / self.size;
        let mut memory = MemBuffer::new(solve::solve_in_place_scratch::<f64>(self.size, count, Par::Seq));
        let columns = MatMut::from_column_major_slice_mut(columns, self.size, count);
        solve::solve_in_place(self.inner(), columns, Par::Seq, MemStack::new(&mut memory));
    }
}

struct Factorization<'a>(&'a mut Dense);

impl WithSimd for Factorization<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Dense { size, stride, values } = self.0;
        factorize(simd, values, *size, *stride)
    }
}

/// Numbers that are added up side by side.
const LANES: usize = 8;

/// Adds the symmetric matrix times `vector` to `out`, column by column: what is below the diagonal stands also beside it.
struct SymmetricProduct<'a> {
    matrix: &'a Dense,
    vector: &'a [f64],
    out: &'a mut [f64],
}

impl Kernel for SymmetricProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Dense { size, stride, values } = self.matrix;
        for (column, entries) in values.chunks_exact(*stride).take(*size).enumerate() {
            let (below, scale) = (&entries[column + 1..*size], self.vector[column]);
            let vector = &self.vector[column + 1..*size];
            let [own, out @ ..] = &mut self.out[column..*size] else { break };
            for (out, entry) in out.iter_mut().zip(below) {
                *out += entry * scale;
            }
            let (whole, rest) = below.as_chunks::<LANES>();
            let (vectors, last) = vector.as_chunks::<LANES>();
            let mut sums = [0.0; LANES];
            for (entries, vector) in whole.iter().zip(vectors) {
                for lane in 0..LANES {
                    sums[lane] += entries[lane] * vector[lane];
                }
            }
            let mut sum = entries[column] * scale;
            for (entry, x) in rest.iter().zip(last) {
                sum += entry * x;
            }
            for part in sums {
                sum += part;
            }
            *own += sum;
        }
    }
}
