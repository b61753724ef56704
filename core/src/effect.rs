//! The contract of an effect: what it adds to the potential on one small group of vertices.
//!
//! "Who interacts" is data ([`Stencils`]), "with what energy" is code ([`Effect`]); the sum over groups is written once, in
//! [`crate::assemble`]. Energies are functions of the positions handed in and of nothing else that changes, so the solver may
//! evaluate them wherever it likes; but for a [`Multiplier`], which only the solver changes. Units: mm, mN, µJ.
//!
//! Local vectors are component-major: the x of every vertex of the group, then every y, then every z, so that inner loops run
//! over contiguous numbers. A local Hessian is a dense row-major square in the same order, of which only the lower triangle
//! (column ≤ row) is read.

use std::sync::atomic::{AtomicU64, Ordering};

/// Component pairs (row, column) of the blocks of a local Hessian that hold its lower triangle.
pub(crate) const LOWER_BLOCKS: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

/// One group of vertices, as an effect sees it. All slices have length 3 × vertices of the group, component-major.
#[derive(Clone, Copy, Debug)]
pub struct Local<'a> {
    /// Current positions (mm).
    pub current: &'a [f64],
    /// Index of the group among the effect's stencils.
    pub group: usize,
    /// Stresses of this group as the last linear step predicted them ([`Effect::predict_stress`]), for the Hessian's
    /// stress-dependent part; empty: the stresses of `current`.
    pub predicted: &'a [f64],
}

/// The unknown of an effect beside the positions: Lagrange's multiplier of what it holds (the pressure of an enclosed volume).
#[derive(Debug)]
pub struct Multiplier {
    first: f64,
    /// Bits of the present value: effects are shared between threads.
    now: AtomicU64,
    /// What the effect holds its measure at.
    pub wanted: f64,
    /// Force that counts as its size (mN): that of a measure that is off by all of what is wanted.
    pub force_mn: f64,
}

impl Multiplier {
    /// A multiplier that begins at `first`.
    pub fn new(first: f64, wanted: f64, force_mn: f64) -> Self {
        Multiplier { first, now: AtomicU64::new(first.to_bits()), wanted, force_mn }
    }

    /// Its present value.
    pub fn value(&self) -> f64 {
        f64::from_bits(self.now.load(Ordering::Relaxed))
    }

    /// Gives it a value.
    pub fn set(&self, value: f64) {
        self.now.store(value.to_bits(), Ordering::Relaxed);
    }

    /// Back to where it began.
    pub fn reset(&self) {
        self.set(self.first);
    }

    /// What is missing of the measure, as a force (mN).
    pub fn missing_mn(&self, held: f64) -> f64 {
        (self.wanted - held) / self.wanted * self.force_mn
    }
}

/// An energy on small groups of vertices.
pub trait Effect: Send + Sync {
    /// The name under which reports and errors mention the effect.
    fn name(&self) -> &'static str;

    /// `false` promises that energy, gradient and Hessian of this group are all zero at these positions.
    fn is_active(&self, _local: &Local) -> bool {
        true
    }

    /// Energy (µJ); infinite where the position must not be accepted (an inverted element).
    fn energy(&self, local: &Local) -> f64;

    /// Adds ∂energy/∂position (mN) to `out`; not a number where the energy is infinite.
    fn add_gradient(&self, local: &Local, out: &mut [f64]);

    /// Adds ∂²energy/∂position² (mN/mm) to the lower triangle of `out`.
    fn add_hessian(&self, local: &Local, out: &mut [f64]);

    /// How many predicted stresses a group has (0: the effect has no stiff stresses worth predicting).
    fn predicted_len(&self) -> usize {
        0
    }

    /// The stresses at the end of the linear step `step` from `current`, to first order, into `out`.
    ///
    /// Stiff stresses (the pressure of a nearly incompressible solid, a penalty's contact pressure) evaluated after a large step are far off,
    /// and their geometric stiffness spoils the next one. Their first-order prediction is what a formulation with independent stresses
    /// would carry along (mixed integration point Newton: Magisano, Leonetti & Garcea, *Int. J. Numer. Meth. Engng* 2017).
    fn predict_stress(&self, _local: &Local, _step: &[f64], _out: &mut [f64]) {}

    /// The largest fraction of `step` (positions change by `step`) that keeps the effect meaningful, in (0, 1].
    fn max_step(&self, _local: &Local, _step: &[f64]) -> f64 {
        1.0
    }

    /// The effect with what in it is no gradient held as it is at `positions`, so that it has an energy; `None` where it has one anyway.
    ///
    /// Friction is such an effect: its limit is another's pressure. A solver may balance the held effect, hold it anew, and so on.
    fn held_at<'a>(&'a self, _stencils: &Stencils, _positions: &[f64]) -> Option<Box<dyn Effect + 'a>> {
        None
    }

    /// The unknown of an effect that holds something at a value: its energy is then −multiplier × what it holds ([`Effect::held`]). At most one effect of a system has one.
    fn multiplier(&self) -> Option<&Multiplier> {
        None
    }

    /// This group's part of what is held (mm³ for a volume).
    fn held(&self, _local: &Local) -> f64 {
        0.0
    }

    /// Adds ∂[`held`](Effect::held)/∂position to `out`.
    fn add_held_slope(&self, _local: &Local, _out: &mut [f64]) {}
}

/// Groups of equally many vertices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stencils {
    /// Vertices in each group.
    pub group_size: usize,
    /// Vertex indices, group after group.
    pub vertices: Vec<u32>,
}

impl Stencils {
    /// Number of groups.
    pub fn len(&self) -> usize {
        self.vertices.len() / self.group_size
    }

    /// Whether there is no group.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The vertices of one group.
    pub fn group(&self, index: usize) -> &[u32] {
        &self.vertices[index * self.group_size..(index + 1) * self.group_size]
    }

    /// Copies the positions of one group, component-major, into `out` (length 3 × group size).
    pub fn gather(&self, index: usize, positions: &[f64], out: &mut [f64]) {
        let n = self.group_size;
        for (a, &vertex) in self.group(index).iter().enumerate() {
            let at = 3 * vertex as usize;
            out[a] = positions[at];
            out[n + a] = positions[at + 1];
            out[2 * n + a] = positions[at + 2];
        }
    }
}

/// An effect and the groups on which it acts.
pub struct Term<'a> {
    /// The energy.
    pub effect: &'a dyn Effect,
    /// Where it acts.
    pub stencils: &'a Stencils,
    /// Which of the sets that the pattern was made for these stencils are: several effects may share one.
    pub set: usize,
}

/// Adds the same matrix between like components to a local Hessian.
pub(crate) fn add_isotropic<const N: usize>(matrix: &[[f64; N]; N], out: &mut [f64]) {
    for k in 0..3 {
        for (a, row) in matrix.iter().enumerate() {
            let at = (k * N + a) * 3 * N + k * N;
            for (out, entry) in out[at..at + N].iter_mut().zip(row) {
                *out += entry;
            }
        }
    }
}
