//! `elasticity`: small-strain isotropic elasticity, free of volumetric locking.
//!
//! Energy per rest volume µ ε:ε + λ/2 ϑ², with ε the symmetric part of the displacement gradient H = F − 1 and ϑ its trace
//! projected on the element's pressure modes. Quadratic in the positions, so its Hessian is constant: the linearisation of
//! [`super::finite_strain`] at rest, to which it is compared in the derivative checks.

use nalgebra::Matrix3;

use super::finite_strain::Lame;
use super::solid::points::{IDENTITIES, PLACES, PointNumbers, matrix_at, put_matrix};
use super::solid::{Energy, Gradient, Hessian, SolidEnergy, SolidGeometry, StiffnessCoefficients, Volumetric};
use crate::effect::{Effect, Local};
use crate::kernel::run_kernel;
use crate::mesh::element::{NODES, POINTS};

/// Name of the effect.
pub const NAME: &str = "elasticity";

/// The effect on a set of elements.
pub struct Elasticity<'a> {
    /// Rest geometry of the elements.
    pub geometry: &'a SolidGeometry,
    /// Material of each element.
    pub materials: &'a [Lame],
}

impl Elasticity<'_> {
    /// Strain at the quadrature points and its projected trace.
    #[inline(always)]
    fn strains(&self, local: &Local) -> ([Matrix3<f64>; POINTS], PointNumbers) {
        let mut strain = [Matrix3::zeros(); POINTS];
        let mut trace = [0.0; PLACES];
        let mut f = IDENTITIES;
        self.geometry.deformation_gradients(local.group, local.current, &mut f);
        for q in 0..POINTS {
            let h = matrix_at(&f, q) - Matrix3::identity();
            strain[q] = (h + h.transpose()) * 0.5;
            trace[q] = h.trace();
        }
        (strain, self.geometry.project(local.group, &trace))
    }
}

impl SolidEnergy for Elasticity<'_> {
    #[inline(always)]
    fn energy_n(&self, local: &Local) -> f64 {
        let (strain, trace) = self.strains(local);
        let material = &self.materials[local.group];
        let weights = self.geometry.weights(local.group).iter();
        weights
            .enumerate()
            .map(|(q, w)| w * (material.mu * strain[q].norm_squared() + 0.5 * material.lambda * trace[q] * trace[q]))
            .sum()
    }

    #[inline(always)]
    fn add_gradient_n(&self, local: &Local, out: &mut [f64]) {
        let (strain, trace) = self.strains(local);
        let material = &self.materials[local.group];
        let mut stress = IDENTITIES;
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            // The projection is self-adjoint and idempotent: the stress needs no second projection.
            let at = strain[q] * (2.0 * material.mu) + Matrix3::identity() * (material.lambda * trace[q]);
            put_matrix(&mut stress, q, &(at * weight));
        }
        self.geometry.add_force(local.group, &stress, out);
    }

    #[inline(always)]
    fn add_hessian_n(&self, local: &Local, out: &mut [f64]) {
        let material = &self.materials[local.group];
        let mut gradients = [[[0.0; NODES]; POINTS]; 3];
        self.geometry.rest_gradients(local.group, &mut gradients);
        let mut coefficients = StiffnessCoefficients::ZERO;
        let mut volumetric = Volumetric { dilatation: [1.0; POINTS], stiffness: [0.0; POINTS] };
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            coefficients.rest[q] = weight * material.mu;
            coefficients.cross[q] = weight * material.mu;
            volumetric.stiffness[q] = weight * material.lambda;
        }
        self.geometry.add_stiffness(local.group, &gradients, &coefficients, Some(&volumetric), out);
    }
}

impl Effect for Elasticity<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn energy(&self, local: &Local) -> f64 {
        run_kernel(Energy(self, local))
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        run_kernel(Gradient(self, local, out))
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        run_kernel(Hessian(self, local, out))
    }
}
