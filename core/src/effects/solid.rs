//! What the solid effects share: the geometry of elements at rest, and the loops that turn point-wise stress and stiffness
//! into element vectors and matrices.
//!
//! For a point energy W(F) whose second derivative has the form
//! δᵢⱼ c_rest (Gₐ·G_b) + c_cross gₐⱼ g_bᵢ + c_outer gₐᵢ g_bⱼ, with G the rest gradients of the shape functions and g = F⁻ᵀG,
//! the element matrix is a sum of outer products over quadrature points; [`SolidGeometry::add_stiffness`] is that sum.
//! Loops have compile-time lengths and run under the widest vector instructions of the machine (`run_kernel`).
//! Not here: any material, any mesh topology.

pub(super) mod products;
mod stiffness;

use nalgebra::{Matrix3, Matrix4, Vector4};
use thiserror::Error;

use crate::effect::{Local, Stencils};
use crate::kernel::Kernel;
use crate::mesh::element::{FACE_NODES, MODES, NODES, POINTS, QUADRATURE};
pub use stiffness::{PointRows, StiffnessCoefficients, Volumetric};

/// One number per node for each component: a row of shape function gradients.
pub type NodeRows = [[f64; NODES]; 3];

/// Numbers that are computed together: loops over them become vector instructions.
const LANES: usize = 4;

/// A step may shrink no element's volume at a point below this fraction of what it was.
const SMALLEST_VOLUME_RATIO: f64 = 0.1;

/// A mesh that cannot carry a solid.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SolidGeometryError {
    /// The rest Jacobian is not positive at a quadrature point.
    #[error(
        "element {element} is inverted or degenerate at rest (Jacobian {jacobian:e} mm³ at quadrature point {point})"
    )]
    Inverted {
        /// Element index.
        element: usize,
        /// Quadrature point index.
        point: usize,
        /// The offending Jacobian determinant (mm³).
        jacobian: f64,
    },
}

/// The nodes of an element's face ζ = −1, the first of its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// They move.
    Free,
    /// They do not: no matrix needs what belongs to them.
    Fixed,
}

impl Base {
    /// How many of the element's nodes are left out of its matrix.
    #[inline(always)]
    fn nodes(self) -> usize {
        match self {
            Base::Free => 0,
            Base::Fixed => FACE_NODES,
        }
    }
}

/// Rest geometry of every element of a stencil set.
#[derive(Clone, Debug)]
pub struct SolidGeometry {
    /// ∂N/∂X (1/mm), indexed (element, point).
    gradients: Vec<NodeRows>,
    /// Quadrature weight × rest Jacobian (mm³), indexed (element, point).
    weights: Vec<f64>,
    /// Pressure modes at the quadrature points of the reference element.
    mode_values: [[f64; MODES]; POINTS],
    /// Inverse of the rest-volume mass matrix of the pressure modes (1/mm³), one per element.
    mode_inverse: Vec<Matrix4<f64>>,
    /// Base of each element; none: all are free.
    bases: Vec<Base>,
}

impl SolidGeometry {
    /// Geometry of `stencils` at the rest positions (x, y, z of each vertex) (mm).
    ///
    /// # Errors
    /// If an element is inverted or flat at rest.
    pub fn new(stencils: &Stencils, rest: &[f64]) -> Result<Self, SolidGeometryError> {
        let reference = &*QUADRATURE;
        let elements = stencils.len();
        let mut gradients = Vec::with_capacity(elements * POINTS);
        let mut weights = Vec::with_capacity(elements * POINTS);
        let mut mode_inverse = Vec::with_capacity(elements);
        let mut local = [0.0; 3 * NODES];
        for element in 0..elements {
            stencils.gather(element, rest, &mut local);
            let mut mass = Matrix4::zeros();
            for (index, point) in reference.iter().enumerate() {
                let jacobian = Matrix3::from_fn(|i, k| {
                    (0..NODES).map(|a| local[i * NODES + a] * point.shapes[a].gradient[k]).sum()
                });
                let determinant = jacobian.determinant();
                let inverted = SolidGeometryError::Inverted { element, point: index, jacobian: determinant };
                let inverse = jacobian.try_inverse().filter(|_| determinant > 0.0).ok_or(inverted)?;
                gradients.push([0, 1, 2].map(|k| {
                    let row = point.shapes.map(|s| s.gradient);
                    row.map(|g| (0..3).map(|l| g[l] * inverse[(l, k)]).sum::<f64>())
                }));
                let weight = point.weight * determinant;
                weights.push(weight);
                mass += Matrix4::from_fn(|i, j| weight * point.modes[i] * point.modes[j]);
            }
            let inverted = SolidGeometryError::Inverted { element, point: 0, jacobian: mass[(0, 0)] };
            mode_inverse.push(mass.try_inverse().ok_or(inverted)?);
        }
        let mut mode_values = [[0.0; MODES]; POINTS];
        for (values, point) in mode_values.iter_mut().zip(reference.iter()) {
            *values = point.modes;
        }
        Ok(SolidGeometry { gradients, weights, mode_values, mode_inverse, bases: Vec::new() })
    }

    /// The same with what each element stands on.
    pub fn on(self, bases: Vec<Base>) -> Self {
        SolidGeometry { bases, ..self }
    }

    #[inline(always)]
    pub(super) fn base(&self, element: usize) -> Base {
        self.bases.get(element).copied().unwrap_or(Base::Free)
    }

    /// Rest gradients of the shape functions at one point: three rows (x, y, z) of one number per node (1/mm).
    #[inline(always)]
    pub fn gradients(&self, element: usize, point: usize) -> &NodeRows {
        &self.gradients[element * POINTS + point]
    }

    /// The same of all points of an element: the x, y, z rows of the first point, then those of the next.
    #[inline(always)]
    pub(super) fn gradient_rows(&self, element: usize) -> &[[f64; NODES]] {
        self.gradients[element * POINTS..(element + 1) * POINTS].as_flattened()
    }

    /// Quadrature weights × rest Jacobian of one element (mm³).
    #[inline(always)]
    pub fn weights(&self, element: usize) -> &[f64] {
        &self.weights[element * POINTS..(element + 1) * POINTS]
    }

    /// Deformation gradient F = Σ xₐ ⊗ Gₐ at one point.
    #[inline(always)]
    pub fn deformation_gradient(&self, element: usize, point: usize, current: &[f64]) -> Matrix3<f64> {
        summed(&products_in_parts(current, self.gradients(element, point)))
    }

    /// The same at every point of an element.
    #[inline(always)]
    pub fn deformation_gradients(&self, element: usize, current: &[f64]) -> [Matrix3<f64>; POINTS] {
        // The parts are added up in a loop of their own: in one with the products, the compiler packs entries and not parts.
        let mut parts = [[[[0.0; LANES]; 3]; 3]; POINTS];
        for (q, parts) in parts.iter_mut().enumerate() {
            *parts = products_in_parts(current, self.gradients(element, q));
        }
        // Loops and not `map`: a closure that is not inlined would leave the vector instructions behind.
        let mut f = [Matrix3::zeros(); POINTS];
        for (f, parts) in f.iter_mut().zip(&parts) {
            *f = summed(parts);
        }
        f
    }

    /// The largest t such that no point's J falls below a tenth of its value along `current + t step`.
    #[inline(always)]
    pub(super) fn max_step(&self, local: &Local, step: &[f64]) -> f64 {
        let mut largest = 1.0_f64;
        let now = self.deformation_gradients(local.group, local.current);
        let change = self.deformation_gradients(local.group, step);
        for (f, df) in now.iter().zip(&change) {
            let (j, _) = determinant_and_cofactor(f);
            while largest > f64::EPSILON && determinant_and_cofactor(&(f + df * largest)).0 <= SMALLEST_VOLUME_RATIO * j
            {
                largest *= 0.7;
            }
        }
        largest
    }

    /// Projects point values on the pressure modes and back: the value of the projection at every point.
    ///
    /// With M the mass matrix of the modes this is φ(q)·M⁻¹ Σ_r w_r φ(r) v_r, which keeps ∫v.
    #[inline(always)]
    pub fn project(&self, element: usize, values: &[f64; POINTS]) -> [f64; POINTS] {
        let coefficients = self.mode_inverse[element] * self.mode_integral(element, values);
        let mut out = [0.0; POINTS];
        for (value, modes) in out.iter_mut().zip(&self.mode_values) {
            *value = (0..MODES).map(|m| modes[m] * coefficients[m]).sum();
        }
        out
    }

    /// ∫ v φₘ over the element, for each pressure mode.
    #[inline(always)]
    fn mode_integral(&self, element: usize, values: &[f64; POINTS]) -> Vector4<f64> {
        let mut integral = Vector4::zeros();
        for ((value, weight), modes) in values.iter().zip(self.weights(element)).zip(&self.mode_values) {
            for m in 0..MODES {
                integral[m] += weight * value * modes[m];
            }
        }
        integral
    }

    /// Adds Σ_q Gᵀ·stress: `stress[q]` is the first Piola–Kirchhoff stress times the quadrature weight (mN·mm).
    #[inline(always)]
    pub fn add_force(&self, element: usize, stress: &[Matrix3<f64>; POINTS], out: &mut [f64]) {
        let rows = out.as_chunks_mut::<NODES>().0;
        for chunk in 0..NODES / LANES {
            let mut sum = [0, 1, 2].map(|i: usize| rows[i].as_chunks::<LANES>().0[chunk]);
            for (q, p) in stress.iter().enumerate() {
                let gradients = self.gradients(element, q);
                let g = [0, 1, 2].map(|k: usize| gradients[k].as_chunks::<LANES>().0[chunk]);
                for i in 0..3 {
                    for lane in 0..LANES {
                        sum[i][lane] += p[(i, 0)] * g[0][lane] + p[(i, 1)] * g[1][lane] + p[(i, 2)] * g[2][lane];
                    }
                }
            }
            for i in 0..3 {
                rows[i].as_chunks_mut::<LANES>().0[chunk] = sum[i];
            }
        }
    }
}

/// Products of each component of the nodes' positions with each of their gradients' at one point, added up in four interleaved parts.
#[inline(always)]
fn products_in_parts(current: &[f64], gradients: &NodeRows) -> [[[f64; LANES]; 3]; 3] {
    let position = current.as_chunks::<NODES>().0;
    let mut sum = [[[0.0; LANES]; 3]; 3];
    for chunk in 0..NODES / LANES {
        for i in 0..3 {
            for k in 0..3 {
                let x = &position[i].as_chunks::<LANES>().0[chunk];
                let g = &gradients[k].as_chunks::<LANES>().0[chunk];
                for lane in 0..LANES {
                    sum[i][k][lane] += x[lane] * g[lane];
                }
            }
        }
    }
    sum
}

/// The sum of the parts.
#[inline(always)]
fn summed(parts: &[[[f64; LANES]; 3]; 3]) -> Matrix3<f64> {
    let mut f = Matrix3::zeros();
    for i in 0..3 {
        for k in 0..3 {
            let part = &parts[i][k];
            f[(i, k)] = (part[0] + part[1]) + (part[2] + part[3]);
        }
    }
    f
}

/// Determinant of a 3 × 3 matrix and its cofactor matrix J F⁻ᵀ.
#[inline(always)]
pub(super) fn determinant_and_cofactor(f: &Matrix3<f64>) -> (f64, Matrix3<f64>) {
    let (c0, c1, c2) = (f.column(0), f.column(1), f.column(2));
    let cofactor = Matrix3::from_columns(&[c1.cross(&c2), c2.cross(&c0), c0.cross(&c1)]);
    (c0.dot(&cofactor.column(0)), cofactor)
}

/// `out` at `point` = matrix × gradients, node by node.
#[inline(always)]
pub(super) fn push_forward(matrix: &Matrix3<f64>, gradients: &NodeRows, point: usize, out: &mut PointRows) {
    for i in 0..3 {
        for a in 0..NODES {
            out[i][point][a] =
                matrix[(i, 0)] * gradients[0][a] + matrix[(i, 1)] * gradients[1][a] + matrix[(i, 2)] * gradients[2][a];
        }
    }
}

/// What a solid effect computes on one element; implementations are `#[inline(always)]`.
pub(super) trait SolidEnergy {
    /// Energy (µJ).
    fn energy_n(&self, local: &Local) -> f64;
    /// Adds the gradient (mN).
    fn add_gradient_n(&self, local: &Local, out: &mut [f64]);
    /// Adds the Hessian's lower triangle (mN/mm).
    fn add_hessian_n(&self, local: &Local, out: &mut [f64]);
}

/// The kernel of [`SolidEnergy::energy_n`].
pub(super) struct Energy<'a, S>(pub &'a S, pub &'a Local<'a>);

impl<S: SolidEnergy> Kernel for Energy<'_, S> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        self.0.energy_n(self.1)
    }
}

/// The kernel of [`SolidEnergy::add_gradient_n`].
pub(super) struct Gradient<'a, S>(pub &'a S, pub &'a Local<'a>, pub &'a mut [f64]);

impl<S: SolidEnergy> Kernel for Gradient<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.add_gradient_n(self.1, self.2)
    }
}

/// The kernel of [`SolidEnergy::add_hessian_n`].
pub(super) struct Hessian<'a, S>(pub &'a S, pub &'a Local<'a>, pub &'a mut [f64]);

impl<S: SolidEnergy> Kernel for Hessian<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.add_hessian_n(self.1, self.2)
    }
}

/// The kernel of [`SolidGeometry::max_step`].
pub(super) struct MaxStep<'a>(pub &'a SolidGeometry, pub &'a Local<'a>, pub &'a [f64]);

impl Kernel for MaxStep<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        self.0.max_step(self.1, self.2)
    }
}
