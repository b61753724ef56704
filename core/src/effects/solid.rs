//! What the solid effects share: the geometry of elements at rest, and the loops that turn point-wise stress and stiffness
//! into element vectors and matrices.
//!
//! For a point energy W(F) whose second derivative has the form
//! δᵢⱼ c_rest (Gₐ·G_b) + c_cross gₐⱼ g_bᵢ + c_outer gₐᵢ g_bⱼ, with G the rest gradients of the shape functions and g = F⁻ᵀG,
//! the element matrix is a sum of outer products over quadrature points; [`SolidGeometry::add_stiffness`] is that sum.
//! Loops have compile-time lengths and run under the widest vector instructions of the machine (`run_kernel`).
//! Not here: any material, any mesh topology.

pub(super) mod points;
pub(super) mod products;
mod stiffness;

use nalgebra::{Matrix3, Matrix4, RowVector3, Vector3};
use thiserror::Error;

use crate::effect::{Local, Stencils};
use crate::kernel::{Kernel, run_kernel};
use crate::mesh::element::{FACE_NODES, MODES, NODES, POINTS, QUADRATURE};
use points::{
    IDENTITIES, MODE_VALUES, PLACES, PointMatrices, PointNumbers, determinants_and_cofactors, matrix_at,
    reference_gradients_of,
};
pub use stiffness::{PointRows, StiffnessCoefficients, Volumetric};

/// One number per node for each component: a row of shape function gradients.
type NodeRows = [[f64; NODES]; 3];

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
    /// J⁻ᵀ with J = ∂X/∂ξ at each element's points (1/mm): what turns gradients on the reference element into those at rest.
    inverse_transposed: Vec<PointMatrices>,
    /// Quadrature weight × rest Jacobian (mm³) of each element's points.
    weights: Vec<PointNumbers>,
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
        let elements = stencils.len();
        let mut geometry = SolidGeometry {
            inverse_transposed: vec![IDENTITIES; elements],
            weights: vec![[0.0; PLACES]; elements],
            mode_inverse: vec![Matrix4::zeros(); elements],
            bases: Vec::new(),
        };
        let mut local = [0.0; 3 * NODES];
        for element in 0..elements {
            stencils.gather(element, rest, &mut local);
            run_kernel(Measure { geometry: &mut geometry, element, rest: &local })?;
        }
        Ok(geometry)
    }

    /// The same with what each element stands on.
    pub fn on(self, bases: Vec<Base>) -> Self {
        SolidGeometry { bases, ..self }
    }

    #[inline(always)]
    pub(super) fn base(&self, element: usize) -> Base {
        self.bases.get(element).copied().unwrap_or(Base::Free)
    }

    /// Quadrature weights × rest Jacobian of one element (mm³).
    #[inline(always)]
    pub fn weights(&self, element: usize) -> &[f64] {
        &self.weights[element][..POINTS]
    }

    /// The same, zero in the places beyond the last point.
    #[inline(always)]
    pub(super) fn weights_in_places(&self, element: usize) -> &PointNumbers {
        &self.weights[element]
    }

    /// Deformation gradient F = Σ xₐ ⊗ Gₐ at one point.
    pub fn deformation_gradient(&self, element: usize, point: usize, current: &[f64]) -> Matrix3<f64> {
        let mut reference = Matrix3::zeros();
        for (a, shape) in QUADRATURE[point].shapes.iter().enumerate() {
            let position = Vector3::new(current[a], current[NODES + a], current[2 * NODES + a]);
            reference += position * RowVector3::from(shape.gradient);
        }
        reference * matrix_at(&self.inverse_transposed[element], point).transpose()
    }

    /// The largest t such that no point's J falls below a tenth of its value along `current + t step`.
    #[inline(always)]
    pub(super) fn max_step(&self, local: &Local, step: &[f64]) -> f64 {
        let mut largest = 1.0_f64;
        let (mut now, mut change) = (IDENTITIES, IDENTITIES);
        self.deformation_gradients(local.group, local.current, &mut now);
        self.deformation_gradients(local.group, step, &mut change);
        for q in 0..POINTS {
            let (f, df) = (matrix_at(&now, q), matrix_at(&change, q));
            let (j, _) = determinant_and_cofactor(&f);
            while largest > f64::EPSILON && determinant_and_cofactor(&(f + df * largest)).0 <= SMALLEST_VOLUME_RATIO * j
            {
                largest *= 0.7;
            }
        }
        largest
    }
}

/// The kernel of [`SolidGeometry::new`]: one element.
struct Measure<'a> {
    geometry: &'a mut SolidGeometry,
    element: usize,
    rest: &'a [f64],
}

impl Kernel for Measure<'_> {
    type Output = Result<(), SolidGeometryError>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Measure { geometry, element, rest } = self;
        let (mut jacobian, mut determinant) = (IDENTITIES, [1.0; PLACES]);
        reference_gradients_of(rest, &mut jacobian);
        let inverse_transposed = &mut geometry.inverse_transposed[element];
        determinants_and_cofactors(&jacobian, &mut determinant, inverse_transposed);
        for (point, &jacobian) in determinant[..POINTS].iter().enumerate() {
            if jacobian.is_nan() || jacobian <= 0.0 {
                return Err(SolidGeometryError::Inverted { element, point, jacobian });
            }
        }
        for entries in inverse_transposed.as_flattened_mut() {
            for q in 0..PLACES {
                entries[q] /= determinant[q];
            }
        }
        let weights = &mut geometry.weights[element];
        for (q, point) in QUADRATURE.iter().enumerate() {
            weights[q] = point.weight * determinant[q];
        }
        let modes = &*MODE_VALUES;
        let mut mass = Matrix4::zeros();
        for i in 0..MODES {
            for j in 0..MODES {
                for q in 0..PLACES {
                    mass[(i, j)] += weights[q] * modes[i][q] * modes[j][q];
                }
            }
        }
        let inverted = SolidGeometryError::Inverted { element, point: 0, jacobian: mass[(0, 0)] };
        geometry.mode_inverse[element] = mass.try_inverse().ok_or(inverted)?;
        Ok(())
    }
}

/// Determinant of a 3 × 3 matrix and its cofactor matrix J F⁻ᵀ.
#[inline(always)]
pub(super) fn determinant_and_cofactor(f: &Matrix3<f64>) -> (f64, Matrix3<f64>) {
    let (c0, c1, c2) = (f.column(0), f.column(1), f.column(2));
    let cofactor = Matrix3::from_columns(&[c1.cross(&c2), c2.cross(&c0), c0.cross(&c1)]);
    (c0.dot(&cofactor.column(0)), cofactor)
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
