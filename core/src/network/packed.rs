//! Products with weights that stay: they are laid out once in the order in which a product reads them.
//!
//! A panel holds as many columns of the weights as two vectors of this processor are wide, row after row. Six rows of the input meet a panel at a time: twelve
//! sums stay in registers, and each number of the panel that is read takes part in six of them. Against `dense::product`, which has to lay out anew each time, that is
//! faster where the weights are large.

use pulp::{Arch, Simd, WithSimd};

/// Vectors of a panel.
const VECTORS: usize = 2;
/// Rows of the input that meet a panel at a time.
const ROWS: usize = 6;
/// Numbers of the widest panel: two vectors of 512 bits.
const WIDEST: usize = 32;

/// Weights of `inner × columns`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Packed {
    inner: usize,
    columns: usize,
    /// Columns of a panel.
    width: usize,
    /// Panels one after the other; the last is filled up with zeros.
    panels: Vec<f32>,
}

impl Packed {
    /// Of weights that lie row by row, `columns` numbers each.
    pub fn new(weight: &[f32], columns: usize) -> Self {
        let mut packed = Packed::default();
        packed.pack(weight, columns);
        packed
    }

    /// Replaces them by others, that lie row by row, `columns` numbers each.
    pub fn pack(&mut self, weight: &[f32], columns: usize) {
        self.lay_out(weight.len() / columns, columns);
        for (first, panel) in
            (0..columns).step_by(self.width).zip(self.panels.chunks_exact_mut(self.inner * self.width))
        {
            let used = self.width.min(columns - first);
            for (to, row) in panel.chunks_exact_mut(self.width).zip(weight.chunks_exact(columns)) {
                to[..used].copy_from_slice(&row[first..][..used]);
            }
        }
    }

    /// Replaces them by others, that lie column by column; there are `columns` of them.
    pub fn pack_transposed(&mut self, weight: &[f32], columns: usize) {
        let inner = weight.len() / columns;
        self.lay_out(inner, columns);
        for (panel, weight) in self.panels.chunks_exact_mut(inner * self.width).zip(weight.chunks(inner * self.width)) {
            for (column, weight) in weight.chunks_exact(inner).enumerate() {
                for (to, x) in panel[column..].iter_mut().step_by(self.width).zip(weight) {
                    *to = *x;
                }
            }
        }
    }

    /// Makes room, zero where a panel is wider than its columns.
    fn lay_out(&mut self, inner: usize, columns: usize) {
        let width = Arch::new().dispatch(Width);
        (self.inner, self.columns, self.width) = (inner, columns, width);
        self.panels.clear();
        self.panels.resize(inner * columns.next_multiple_of(width), 0.0);
    }

    /// Numbers that they hold.
    pub fn numbers(&self) -> usize {
        self.panels.len()
    }

    /// `out = x w`, row by row.
    ///
    /// # Panics
    /// If the lengths do not fit together.
    pub fn product(&self, out: &mut Vec<f32>, x: &[f32]) {
        out.clear();
        out.resize(x.len() / self.inner * self.columns, 0.0);
        self.add_product(out, x);
    }

    /// `out += x w`, row by row. The number of rows is `x.len() / inner`.
    ///
    /// # Panics
    /// If the lengths do not fit together.
    pub fn add_product(&self, out: &mut [f32], x: &[f32]) {
        assert_eq!(x.len() * self.columns, out.len() * self.inner, "rows of input and output");
        Arch::new().dispatch(Product { packed: self, out, x });
    }
}

/// How many columns a panel has on this processor.
struct Width;

impl WithSimd for Width {
    type Output = usize;

    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        VECTORS * S::F32_LANES
    }
}

struct Product<'a> {
    packed: &'a Packed,
    out: &'a mut [f32],
    x: &'a [f32],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Packed { inner, columns, width, panels } = self.packed;
        for (panel, first) in panels.chunks_exact(inner * width).zip((0..*columns).step_by(*width)) {
            let panel = S::as_simd_f32s(panel).0.as_chunks::<VECTORS>().0;
            let columns = Columns { all: *columns, first, used: (*width).min(columns - first) };
            let (x, rest) = self.x.split_at(self.x.len() - self.x.len() % (ROWS * inner));
            let (out, last) = self.out.split_at_mut(self.out.len() - rest.len() / inner * columns.all);
            for (x, out) in x.chunks_exact(ROWS * inner).zip(out.chunks_exact_mut(ROWS * columns.all)) {
                block::<S, ROWS>(simd, panel, x, out, &columns);
            }
            match rest.len() / inner {
                1 => block::<S, 1>(simd, panel, rest, last, &columns),
                2 => block::<S, 2>(simd, panel, rest, last, &columns),
                3 => block::<S, 3>(simd, panel, rest, last, &columns),
                4 => block::<S, 4>(simd, panel, rest, last, &columns),
                5 => block::<S, 5>(simd, panel, rest, last, &columns),
                _ => {}
            }
        }
    }
}

/// Where a panel's columns stand in the output.
struct Columns {
    all: usize,
    first: usize,
    used: usize,
}

/// `R` rows of the input times one panel, added to as many rows of the output.
#[inline(always)]
fn block<S: Simd, const R: usize>(
    simd: S,
    panel: &[[S::f32s; VECTORS]],
    x: &[f32],
    out: &mut [f32],
    columns: &Columns,
) {
    let inner = panel.len();
    let rows: [&[f32]; R] = std::array::from_fn(|row| &x[row * inner..][..inner]);
    let mut sums = [[simd.splat_f32s(0.0); VECTORS]; R];
    for (k, weights) in panel.iter().enumerate() {
        for (sums, row) in sums.iter_mut().zip(&rows) {
            let number = simd.splat_f32s(row[k]);
            for (sum, weight) in sums.iter_mut().zip(weights) {
                *sum = simd.mul_add_e_f32s(number, *weight, *sum);
            }
        }
    }
    let mut summed = [0.0; WIDEST];
    for (sums, out) in sums.iter().zip(out.chunks_exact_mut(columns.all)) {
        S::as_mut_simd_f32s(&mut summed).0.iter_mut().zip(sums).for_each(|(to, sum)| *to = *sum);
        out[columns.first..][..columns.used].iter_mut().zip(&summed).for_each(|(out, sum)| *out += sum);
    }
}
