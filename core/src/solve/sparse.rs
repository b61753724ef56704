//! Sparse Cholesky factorisation with a fixed pattern: analysed once, refactorised often, every solution checked.
//!
//! The unknowns are already in a fill-reducing order (the mesh numbers them by nested dissection), so faer is asked to keep it.
//! Sequential: two threads gain nothing at these sizes and change the last bits.
//!
//! A matrix is factorised in single precision, at half the cost, and its solutions are refined in double: residuals are those of the matrix as it is, and each step of refinement
//! brings them down by what single precision leaves (J. H. Wilkinson, *Rounding Errors in Algebraic Processes*, 1963; J. Langou et al., SC 2006). Where that is too much, for the
//! matrix is ill conditioned or close to indefinite, it is factorised once more in double precision.
//! Read on in `factorization` (small matrices), `numeric` (one factorisation; what faer is asked for) and `substitution`.

mod factorization;
mod numeric;
mod substitution;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Par, Side, Spec};
use thiserror::Error;

use super::dense::Dense;
use crate::assemble::Pattern;
use factorization::Plan;
use numeric::Numeric;
use substitution::Supernode;

/// Why a linear system was not solved.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LinearSolveError {
    /// The pattern could not be analysed (memory, index range).
    #[error("the sparsity pattern could not be analysed: {0}")]
    Analysis(String),
    /// The matrix is not positive definite.
    #[error("the stiffness matrix is not positive definite")]
    Indefinite,
    /// The residual stayed too large after refinement.
    #[error("the linear solution leaves a relative residual of {relative_residual:e}")]
    Inaccurate {
        /// ‖b − A x‖ / ‖b‖.
        relative_residual: f64,
    },
}

/// Largest relative residual of a linear solve that is accepted. Newton's method corrects what is left.
pub const MAX_RELATIVE_RESIDUAL: f64 = 1e-6;
/// Steps of refinement at most; each brings the residual down by what the one before left.
const MOST_REFINEMENTS: usize = 2;
/// Sums that a product with a column is added up in: one alone would wait for itself.
const SUMS: usize = 4;
/// Relative residual above which single precision does not suffice: a factor this far off also tells Newton's method little about its steps.
const SINGLE_SUFFICES: f64 = 1e-4;

/// Columns of the widest supernode of a factor that is small: above, packed products are faster (`columns`).
const WIDEST_SMALL: usize = 600;

/// The analysed pattern; independent of values, shared between threads.
#[derive(Debug)]
pub struct SymbolicFactor {
    symbolic: SymbolicCholesky<u32>,
    supernodes: Vec<Supernode>,
    way: Way,
}

/// How factors of one pattern are computed.
#[derive(Debug)]
enum Way {
    /// Small ones by `factorization`.
    Small(Plan),
    /// Large ones by faer.
    Large {
        /// The lower triangle, checked once for all.
        structure: SymbolicSparseColMat<u32>,
        scratch: StackReq,
    },
}

impl SymbolicFactor {
    /// Analyses the sparse part of `pattern`.
    ///
    /// # Errors
    /// [`LinearSolveError::Analysis`].
    pub fn new(pattern: &Pattern) -> Result<Self, LinearSolveError> {
        let n = pattern.free;
        // Under the identity ordering faer analyses the matrix as it is given and expects its upper triangle there.
        let (starts, indices) = transposed(pattern);
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &indices);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(matrix, Side::Upper, SymmetricOrdering::Identity, params)
            .map_err(|error| LinearSolveError::Analysis(error.to_string()))?;
        let supernodes = numeric::supernodes(&symbolic);
        let mut supernodes = supernodes.ok_or_else(|| LinearSolveError::Analysis("no supernodes".to_string()))?;
        let widest = supernodes.iter().map(|supernode| supernode.columns).max().unwrap_or(0);
        let way = if widest <= WIDEST_SMALL {
            Way::Small(Plan::new(pattern, &mut supernodes))
        } else {
            let (starts, rows) = (pattern.column_starts.clone(), pattern.rows.clone());
            let scratch = StackReq::any_of(&[
                symbolic.factorize_numeric_llt_scratch::<f32>(Par::Seq, Spec::default()),
                symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()),
            ]);
            Way::Large { structure: SymbolicSparseColMat::new_checked(n, n, starts, None, rows), scratch }
        };
        Ok(SymbolicFactor { symbolic, supernodes, way })
    }

    /// Number of stored entries of the factor.
    pub fn stored(&self) -> usize {
        self.supernodes.last().map_or(0, |last| last.values.end)
    }
}

/// Column starts and row indices of the transposed (upper) triangle.
fn transposed(pattern: &Pattern) -> (Vec<u32>, Vec<u32>) {
    let n = pattern.free;
    let mut starts = vec![0u32; n + 1];
    for &row in &pattern.rows {
        starts[row as usize + 1] += 1;
    }
    for column in 0..n {
        starts[column + 1] += starts[column];
    }
    let mut next = starts.clone();
    let mut indices = vec![0u32; pattern.rows.len()];
    for column in 0..n {
        for &row in &pattern.rows[pattern.column_starts[column] as usize..pattern.column_starts[column + 1] as usize] {
            indices[next[row as usize] as usize] = column as u32;
            next[row as usize] += 1;
        }
    }
    (starts, indices)
}

/// How many digits a factor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Seven.
    Single,
    /// Sixteen.
    Double,
}

/// Memory of one numeric factorisation.
pub struct Factor {
    single: Numeric<f32>,
    double: Numeric<f64>,
    /// Which of them is at hand.
    at_hand: Precision,
    /// Which is tried first.
    first: Precision,
    stack: MemBuffer,
    /// Right-hand sides in single precision.
    rounded: Vec<f32>,
    residual: Vec<f64>,
}

impl Factor {
    /// Memory for factors of `symbolic`.
    pub fn new(symbolic: &SymbolicFactor) -> Self {
        let scratch = match symbolic.way {
            Way::Small(_) => StackReq::EMPTY,
            Way::Large { scratch, .. } => scratch,
        };
        Factor {
            single: Numeric::empty(),
            double: Numeric::empty(),
            at_hand: Precision::Single,
            first: Precision::Single,
            stack: MemBuffer::new(scratch),
            rounded: Vec::new(),
            residual: Vec::new(),
        }
    }

    /// What comes next is another system, factorised in `first` first: whether single precision sufficed before is forgotten.
    pub(super) fn begin(&mut self, first: Precision) {
        self.first = first;
    }

    /// Factorises the sparse part of `values` (layout of `pattern`).
    ///
    /// # Errors
    /// [`LinearSolveError::Indefinite`].
    pub fn factorize(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
    ) -> Result<(), LinearSolveError> {
        if self.first == Precision::Single {
            let stack = MemStack::new(&mut self.stack);
            self.at_hand = Precision::Single;
            if self.single.factorize(symbolic, &values[..pattern.stored()], stack) {
                return Ok(());
            }
            // What seems indefinite in single precision may be definite in double; and what is about to buckle is close to singular from here on.
            self.first = Precision::Double;
        }
        self.factorize_in_double(symbolic, pattern, values)
    }

    fn factorize_in_double(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
    ) -> Result<(), LinearSolveError> {
        let stack = MemStack::new(&mut self.stack);
        self.at_hand = Precision::Double;
        match self.double.factorize(symbolic, &values[..pattern.stored()], stack) {
            true => Ok(()),
            false => Err(LinearSolveError::Indefinite),
        }
    }

    /// Solves A x = b for right-hand sides laid out one after the other in `rhs`, in place, and checks each residual
    /// (steps of refinement where they help).
    ///
    /// # Errors
    /// [`LinearSolveError::Inaccurate`]; [`LinearSolveError::Indefinite`] if the matrix proves to be so in double precision.
    pub fn solve(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
        rhs: &mut [f64],
    ) -> Result<(), LinearSolveError> {
        let target = rhs.to_vec();
        self.substitute(symbolic, rhs);
        for (x, b) in rhs.chunks_exact_mut(pattern.free).zip(target.chunks_exact(pattern.free)) {
            self.check(symbolic, pattern, values, x, b)?;
        }
        Ok(())
    }

    /// As [`Factor::solve`], unchecked: what is made of the solutions is to be checked.
    pub(super) fn substitute(&mut self, symbolic: &SymbolicFactor, rhs: &mut [f64]) {
        let SymbolicFactor { supernodes, symbolic, .. } = symbolic;
        let size = symbolic.nrows();
        self.in_its_precision(
            rhs,
            |single, rhs| single.substitute(supernodes, size, rhs),
            |double, rhs| double.substitute(supernodes, size, rhs),
        );
    }

    /// Completes the solution of a system with nothing on the right-hand side above its last `known` unknowns, of which the end of `x` holds the values.
    pub(super) fn complete(&mut self, symbolic: &SymbolicFactor, known: usize, x: &mut [f64]) {
        let supernodes = &symbolic.supernodes;
        self.in_its_precision(
            x,
            |single, x| single.complete(supernodes, known, x),
            |double, x| double.complete(supernodes, known, x),
        );
    }

    fn in_its_precision(
        &mut self,
        columns: &mut [f64],
        single: impl Fn(&mut Numeric<f32>, &mut [f32]),
        double: impl Fn(&mut Numeric<f64>, &mut [f64]),
    ) {
        match self.at_hand {
            Precision::Single => {
                self.rounded.clear();
                self.rounded.extend(columns.iter().map(|value| *value as f32));
                single(&mut self.single, &mut self.rounded);
                columns.iter_mut().zip(&self.rounded).for_each(|(x, rounded)| *x = f64::from(*rounded));
            }
            Precision::Double => double(&mut self.double, columns),
        }
    }

    /// Checks that A x = b, with steps of refinement where they help, and with a factor in double precision where they do not.
    ///
    /// # Errors
    /// [`LinearSolveError::Inaccurate`]; [`LinearSolveError::Indefinite`] if the matrix proves to be so in double precision, which the next one is factorised in at once.
    pub(super) fn check(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
        x: &mut [f64],
        b: &[f64],
    ) -> Result<(), LinearSolveError> {
        let mut relative = self.refine(symbolic, pattern, values, x, b);
        if self.at_hand == Precision::Single && !is_accurate(relative) {
            self.first = Precision::Double;
            self.factorize_in_double(symbolic, pattern, values)?;
            x.copy_from_slice(b);
            self.substitute(symbolic, x);
            relative = self.refine(symbolic, pattern, values, x, b);
        }
        if is_accurate(relative) { Ok(()) } else { Err(LinearSolveError::Inaccurate { relative_residual: relative }) }
    }

    /// The relative residual ‖b − A x‖ / ‖b‖, after steps of refinement if it is too large at first.
    fn refine(
        &mut self,
        symbolic: &SymbolicFactor,
        pattern: &Pattern,
        values: &[f64],
        x: &mut [f64],
        b: &[f64],
    ) -> f64 {
        let size = norm(b);
        if size == 0.0 {
            return 0.0;
        }
        let mut relative = self.residual_into(pattern, values, x, b) / size;
        if self.at_hand == Precision::Single && relative > SINGLE_SUFFICES {
            return relative;
        }
        for _ in 0..MOST_REFINEMENTS {
            if is_accurate(relative) {
                break;
            }
            let mut correction = std::mem::take(&mut self.residual);
            self.substitute(symbolic, &mut correction);
            x.iter_mut().zip(&correction).for_each(|(x, c)| *x += c);
            self.residual = correction;
            relative = self.residual_into(pattern, values, x, b) / size;
        }
        relative
    }

    /// The last `size` rows and columns of the factor L, with a border of `border` rows of zeros.
    pub(super) fn tail(&self, symbolic: &SymbolicFactor, size: usize, border: usize) -> Dense {
        match self.at_hand {
            Precision::Single => self.single.tail(&symbolic.supernodes, size, border),
            Precision::Double => self.double.tail(&symbolic.supernodes, size, border),
        }
    }

    /// Leaves b − A x in `self.residual` and returns its norm.
    fn residual_into(&mut self, pattern: &Pattern, values: &[f64], x: &[f64], b: &[f64]) -> f64 {
        self.residual.clear();
        self.residual.extend_from_slice(b);
        for column in 0..pattern.free {
            // The diagonal is the first entry of its column.
            let [start, end] = [column, column + 1].map(|column| pattern.column_starts[column] as usize);
            self.residual[column] -= values[start] * x[column];
            let (rows, last_rows) = pattern.rows[start + 1..end].as_chunks::<SUMS>();
            let (entries, last_entries) = values[start + 1..end].as_chunks::<SUMS>();
            let mut beside = [0.0; SUMS];
            for (rows, entries) in rows.iter().zip(entries) {
                for sum in 0..SUMS {
                    let row = rows[sum] as usize;
                    self.residual[row] -= entries[sum] * x[column];
                    beside[sum] += entries[sum] * x[row];
                }
            }
            for (sum, (&row, entry)) in last_rows.iter().zip(last_entries).enumerate() {
                self.residual[row as usize] -= entry * x[column];
                beside[sum] += entry * x[row as usize];
            }
            self.residual[column] -= beside.iter().sum::<f64>();
        }
        norm(&self.residual)
    }
}

/// Whether a relative residual is accepted; not a number is none.
fn is_accurate(relative_residual: f64) -> bool {
    relative_residual <= MAX_RELATIVE_RESIDUAL
}

/// Euclidean norm.
pub fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}
