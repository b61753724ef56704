//! Numbers and matrices at an element's quadrature points, side by side: loops over the points become vector instructions.
//!
//! Fourteen points do not fill whole vectors; in the places beyond the last one a matrix is the identity and a weight zero, so that what is computed there
//! is finite and counts for nothing.

use std::sync::LazyLock;

use nalgebra::{Matrix3, Vector4};

use super::{Base, LANES, NodeRows, PointRows, SolidGeometry};
use crate::kernel::{Kernel, run_kernel};
use crate::mesh::element::{MODES, NODES, POINTS, QUADRATURE};

/// Places for the points of an element.
pub(in crate::effects) const PLACES: usize = POINTS.next_multiple_of(LANES);

/// A number at each point.
pub(in crate::effects) type PointNumbers = [f64; PLACES];

/// A 3 × 3 matrix at each point, indexed (row, column, point).
pub(in crate::effects) type PointMatrices = [[PointNumbers; 3]; 3];

/// Gradients of the shape functions, indexed (component, node, point).
type NodeGradients = [[PointNumbers; NODES]; 3];

/// The identity at each point.
pub(in crate::effects) const IDENTITIES: PointMatrices = {
    let (one, zero) = ([1.0; PLACES], [0.0; PLACES]);
    [[one, zero, zero], [zero, one, zero], [zero, zero, one]]
};

/// Gradients ∂N/∂ξ of the shape functions on the reference element. All elements share them: their own would not stay in a cache.
static REFERENCE_BY_NODE: LazyLock<NodeGradients> = LazyLock::new(|| {
    let mut gradients = [[[0.0; PLACES]; NODES]; 3];
    for (q, point) in QUADRATURE.iter().enumerate() {
        for (a, shape) in point.shapes.iter().enumerate() {
            for k in 0..3 {
                gradients[k][a][q] = shape.gradient[k];
            }
        }
    }
    gradients
});

/// The same, a row for each component at each point.
static REFERENCE_BY_POINT: LazyLock<[NodeRows; POINTS]> = LazyLock::new(|| {
    let mut rows = [[[0.0; NODES]; 3]; POINTS];
    for (rows, point) in rows.iter_mut().zip(&*QUADRATURE) {
        for (a, shape) in point.shapes.iter().enumerate() {
            for k in 0..3 {
                rows[k][a] = shape.gradient[k];
            }
        }
    }
    rows
});

/// Pressure modes of the reference element, indexed (mode, point).
pub(super) static MODE_VALUES: LazyLock<[PointNumbers; MODES]> = LazyLock::new(|| {
    let mut values = [[0.0; PLACES]; MODES];
    for (q, point) in QUADRATURE.iter().enumerate() {
        for m in 0..MODES {
            values[m][q] = point.modes[m];
        }
    }
    values
});

/// The matrix at one point.
#[inline(always)]
pub(in crate::effects) fn matrix_at(matrices: &PointMatrices, point: usize) -> Matrix3<f64> {
    let row = |i: usize| [matrices[i][0][point], matrices[i][1][point], matrices[i][2][point]];
    let ([a, b, c], [d, e, f], [g, h, i]) = (row(0), row(1), row(2));
    Matrix3::new(a, b, c, d, e, f, g, h, i)
}

/// Puts a matrix at one point.
#[inline(always)]
pub(in crate::effects) fn put_matrix(matrices: &mut PointMatrices, point: usize, matrix: &Matrix3<f64>) {
    for i in 0..3 {
        for k in 0..3 {
            matrices[i][k][point] = matrix[(i, k)];
        }
    }
}

/// Σ xₐ ⊗ ∂Nₐ/∂ξ over the nodes at every point, for `current` positions x (component-major), and the identity beyond the last. The nine sums of four points at a time stay in registers.
#[inline(always)]
pub(super) fn reference_gradients_of(current: &[f64], out: &mut PointMatrices) {
    let gradients = &*REFERENCE_BY_NODE;
    let position = current.as_chunks::<NODES>().0;
    for place in 0..PLACES / LANES {
        let mut sums = [[[0.0; LANES]; 3]; 3];
        for a in 0..NODES {
            for k in 0..3 {
                let gradient = &gradients[k][a].as_chunks::<LANES>().0[place];
                for i in 0..3 {
                    for lane in 0..LANES {
                        sums[i][k][lane] = position[i][a].mul_add(gradient[lane], sums[i][k][lane]);
                    }
                }
            }
        }
        for i in 0..3 {
            for k in 0..3 {
                out[i][k].as_chunks_mut::<LANES>().0[place] = sums[i][k];
            }
        }
    }
    for i in 0..3 {
        for k in 0..3 {
            out[i][k][POINTS..].copy_from_slice(&IDENTITIES[i][k][POINTS..]);
        }
    }
}

/// A B at every point.
#[inline(always)]
fn times(a: &PointMatrices, b: &PointMatrices, out: &mut PointMatrices) {
    for i in 0..3 {
        for k in 0..3 {
            for q in 0..PLACES {
                out[i][k][q] = a[i][0][q] * b[0][k][q] + a[i][1][q] * b[1][k][q] + a[i][2][q] * b[2][k][q];
            }
        }
    }
}

/// A Bᵀ at every point.
#[inline(always)]
fn times_transposed(a: &PointMatrices, b: &PointMatrices, out: &mut PointMatrices) {
    for i in 0..3 {
        for k in 0..3 {
            for q in 0..PLACES {
                out[i][k][q] = a[i][0][q] * b[k][0][q] + a[i][1][q] * b[k][1][q] + a[i][2][q] * b[k][2][q];
            }
        }
    }
}

/// A matrix at each point times the gradients on the reference element.
#[inline(always)]
fn rows_of(matrices: &PointMatrices, out: &mut PointRows) {
    for (q, [x, y, z]) in REFERENCE_BY_POINT.iter().enumerate() {
        for i in 0..3 {
            let [a, b, c] = [matrices[i][0][q], matrices[i][1][q], matrices[i][2][q]];
            for node in 0..NODES {
                out[i][q][node] = a * x[node] + b * y[node] + c * z[node];
            }
        }
    }
}

/// Determinants J of 3 × 3 matrices F and their cofactor matrices J F⁻ᵀ.
#[inline(always)]
pub(in crate::effects) fn determinants_and_cofactors(
    f: &PointMatrices,
    determinants: &mut PointNumbers,
    cofactors: &mut PointMatrices,
) {
    for i in 0..3 {
        for k in 0..3 {
            let ([i1, i2], [k1, k2]) = ([(i + 1) % 3, (i + 2) % 3], [(k + 1) % 3, (k + 2) % 3]);
            for q in 0..PLACES {
                cofactors[i][k][q] = f[i1][k1][q] * f[i2][k2][q] - f[i2][k1][q] * f[i1][k2][q];
            }
        }
    }
    for q in 0..PLACES {
        let column =
            [f[0][0][q] * cofactors[0][0][q], f[1][0][q] * cofactors[1][0][q], f[2][0][q] * cofactors[2][0][q]];
        determinants[q] = column[0] + column[1] + column[2];
    }
}

impl SolidGeometry {
    /// Deformation gradients F = Σ xₐ ⊗ Gₐ = (Σ xₐ ⊗ ∂Nₐ/∂ξ) J⁻¹ at the points of an element, and the identity beyond the last.
    #[inline(always)]
    pub(in crate::effects) fn deformation_gradients(&self, element: usize, current: &[f64], out: &mut PointMatrices) {
        let mut reference = IDENTITIES;
        reference_gradients_of(current, &mut reference);
        times_transposed(&reference, &self.inverse_transposed[element], out);
    }

    /// Gradients G = J⁻ᵀ ∂N/∂ξ of the shape functions at rest, at the points of an element (1/mm).
    #[inline(always)]
    pub(in crate::effects) fn rest_gradients(&self, element: usize, out: &mut PointRows) {
        rows_of(&self.inverse_transposed[element], out);
    }

    /// A matrix at each point times these gradients.
    #[inline(always)]
    pub(in crate::effects) fn push_forward(&self, element: usize, matrices: &PointMatrices, out: &mut PointRows) {
        let mut products = IDENTITIES;
        times(matrices, &self.inverse_transposed[element], &mut products);
        rows_of(&products, out);
    }

    /// Projects point values on the pressure modes and back: the value of the projection at every point, zero beyond the last.
    ///
    /// With M the mass matrix of the modes this is φ(q)·M⁻¹ Σ_r w_r φ(r) v_r, which keeps ∫v.
    #[inline(always)]
    pub(in crate::effects) fn project(&self, element: usize, values: &PointNumbers) -> PointNumbers {
        let (modes, weights) = (&*MODE_VALUES, &self.weights[element]);
        let mut parts = [[0.0; LANES]; MODES];
        for first in (0..PLACES).step_by(LANES) {
            for m in 0..MODES {
                for lane in 0..LANES {
                    let q = first + lane;
                    parts[m][lane] += weights[q] * values[q] * modes[m][q];
                }
            }
        }
        let mut integral = Vector4::zeros();
        for (integral, parts) in integral.iter_mut().zip(&parts) {
            *integral = (parts[0] + parts[1]) + (parts[2] + parts[3]);
        }
        let coefficients = self.mode_inverse[element] * integral;
        let mut out = [0.0; PLACES];
        for m in 0..MODES {
            for q in 0..PLACES {
                out[q] += modes[m][q] * coefficients[m];
            }
        }
        out
    }

    /// Adds Σ_q Gᵀ·stress: `stress` is the first Piola–Kirchhoff stress times the quadrature weight (mN·mm). What belongs to a base that does not move is left out.
    #[inline(always)]
    pub(in crate::effects) fn add_force(&self, element: usize, stress: &PointMatrices, out: &mut [f64]) {
        let mut reference = IDENTITIES;
        times(stress, &self.inverse_transposed[element], &mut reference);
        match self.base(element) {
            Base::Free => {
                add_reference_force::<3>(&reference, 0, out);
                add_reference_force::<2>(&reference, 3, out);
            }
            Base::Fixed => add_reference_force::<3>(&reference, 2, out),
        }
    }
}

/// Adds Σ_q stress ∂N/∂ξ to `VECTORS` vectors of nodes from `first` on, all of whose sums stay in registers: fewer would wait for one another.
#[inline(always)]
fn add_reference_force<const VECTORS: usize>(stress: &PointMatrices, first: usize, out: &mut [f64]) {
    let mut sums = [[[0.0; LANES]; VECTORS]; 3];
    for (q, rows) in REFERENCE_BY_POINT.iter().enumerate() {
        for (k, row) in rows.iter().enumerate() {
            let gradients = &row.as_chunks::<LANES>().0[first..first + VECTORS];
            for i in 0..3 {
                for v in 0..VECTORS {
                    for lane in 0..LANES {
                        sums[i][v][lane] = stress[i][k][q].mul_add(gradients[v][lane], sums[i][v][lane]);
                    }
                }
            }
        }
    }
    for (sums, row) in sums.iter().zip(out.as_chunks_mut::<NODES>().0) {
        for (sum, out) in sums.iter().zip(&mut row.as_chunks_mut::<LANES>().0[first..]) {
            for lane in 0..LANES {
                out[lane] += sum[lane];
            }
        }
    }
}

/// How far an element is from its rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Smallest volume over that at rest, J, at a point.
    pub least_volume_ratio: f64,
    /// Largest ‖F − 1‖ at a point: no principal stretch differs from one by more.
    pub most_strain: f64,
}

impl SolidGeometry {
    /// How far an element is from its rest at the positions `current` (component-major).
    pub fn distortion(&self, element: usize, current: &[f64]) -> Distortion {
        run_kernel(Distort { geometry: self, element, current })
    }
}

struct Distort<'a> {
    geometry: &'a SolidGeometry,
    element: usize,
    current: &'a [f64],
}

impl Kernel for Distort<'_> {
    type Output = Distortion;

    #[inline(always)]
    fn run(self) -> Distortion {
        let (mut f, mut cofactors, mut j) = (IDENTITIES, IDENTITIES, [1.0; PLACES]);
        self.geometry.deformation_gradients(self.element, self.current, &mut f);
        determinants_and_cofactors(&f, &mut j, &mut cofactors);
        let mut squares = [0.0; PLACES];
        for (f, rest) in f.as_flattened().iter().zip(IDENTITIES.as_flattened()) {
            for q in 0..PLACES {
                squares[q] += (f[q] - rest[q]) * (f[q] - rest[q]);
            }
        }
        let least_volume_ratio = j[..POINTS].iter().copied().fold(f64::INFINITY, f64::min);
        let most_strain = squares.iter().copied().fold(0.0, f64::max).sqrt();
        Distortion { least_volume_ratio, most_strain }
    }
}
