//! `finite_strain`: geometrically exact neo-Hookean elasticity, free of volumetric locking.
//!
//! Two energies per rest volume, both with the Lamé constants µ, λ at small strain (J = det F, I₁ = tr FᵀF):
//! - [`NeoHookean::Logarithmic`]: µ/2 (I₁ − 3) − µ ln J + λ/2 (ln θ)²
//!   (Bonet & Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, section 6.4.3). The tissue's law: its uniaxial,
//!   biaxial and shear responses tend to P = µ(λ − λ⁻²) and so on as ν → 1/2, and −ln J resists inversion at every point.
//! - [`NeoHookean::Isochoric`]: µ/2 (J^(−2/3) I₁ − 3) + κ/2 (θ − 1)², κ = λ + 2µ/3 (Simo & Taylor 1985), for comparison with
//!   codes that split the energy.
//!
//! θ is J projected on the element's pressure modes, so only as many volume constraints act as the element can satisfy.
//! With π the projected pressure U′(θ), the stress is P = P_pointwise + π J F⁻ᵀ and the second derivative follows from
//! ∂²J/∂xₐᵢ∂x_bⱼ = J (gₐᵢ g_bⱼ − gₐⱼ g_bᵢ).

use nalgebra::Matrix3;

use super::solid::{
    Energy, Gradient, Hessian, MaxStep, PointRows, SolidEnergy, SolidGeometry, StiffnessCoefficients, Volumetric,
    determinant_and_cofactor, push_forward,
};
use crate::effect::{Effect, Local};
use crate::kernel::{Kernel, run_kernel};
use crate::mesh::element::{NODES, POINTS};

/// Name of the effect.
pub const NAME: &str = "finite_strain";

/// Which neo-Hookean energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NeoHookean {
    /// µ/2 (I₁ − 3) − µ ln J + λ/2 (ln θ)².
    Logarithmic,
    /// µ/2 (J^(−2/3) I₁ − 3) + κ/2 (θ − 1)².
    Isochoric,
}

/// Lamé constants of one element (kPa).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lame {
    /// Shear modulus µ.
    pub mu: f64,
    /// First Lamé constant λ.
    pub lambda: f64,
}

/// The effect on a set of elements.
pub struct FiniteStrain<'a> {
    /// Rest geometry of the elements.
    pub geometry: &'a SolidGeometry,
    /// Material of each element.
    pub materials: &'a [Lame],
    /// Which energy.
    pub law: NeoHookean,
}

/// What every derivative needs at the quadrature points of one element.
struct Points {
    f: [Matrix3<f64>; POINTS],
    f_inverse_transposed: [Matrix3<f64>; POINTS],
    j: [f64; POINTS],
    theta: [f64; POINTS],
}

impl FiniteStrain<'_> {
    /// Deformation at the quadrature points; `None` where a point is inverted or the projected dilatation is not positive.
    #[inline(always)]
    fn points(&self, local: &Local) -> Option<Points> {
        let mut out = Points {
            f: self.geometry.deformation_gradients(local.group, local.current),
            f_inverse_transposed: [Matrix3::identity(); POINTS],
            j: [1.0; POINTS],
            theta: [1.0; POINTS],
        };
        for q in 0..POINTS {
            let (j, cofactor) = determinant_and_cofactor(&out.f[q]);
            if j.is_nan() || j <= 0.0 {
                return None;
            }
            out.j[q] = j;
            out.f_inverse_transposed[q] = cofactor / j;
        }
        out.theta = self.geometry.project(local.group, &out.j);
        out.theta.iter().all(|&t| t > 0.0).then_some(out)
    }

    /// U, U′ and U″ of the volumetric energy at the projected dilatation.
    #[inline(always)]
    fn volumetric(&self, material: &Lame, theta: f64) -> (f64, f64, f64) {
        match self.law {
            NeoHookean::Logarithmic => {
                let log = theta.ln();
                (
                    0.5 * material.lambda * log * log,
                    material.lambda * log / theta,
                    material.lambda * (1.0 - log) / (theta * theta),
                )
            }
            NeoHookean::Isochoric => {
                let kappa = material.lambda + 2.0 / 3.0 * material.mu;
                (0.5 * kappa * (theta - 1.0).powi(2), kappa * (theta - 1.0), kappa)
            }
        }
    }

    /// The projected pressure π at every point.
    #[inline(always)]
    fn pressure(&self, local: &Local, points: &Points) -> [f64; POINTS] {
        let mut pressure = [0.0; POINTS];
        for q in 0..POINTS {
            pressure[q] = self.volumetric(&self.materials[local.group], points.theta[q]).1;
        }
        self.geometry.project(local.group, &pressure)
    }

    /// The part −2/3 µ J^(−2/3) (fₐᵢ g_bⱼ + gₐᵢ f_bⱼ), f = F G, that only the isochoric energy has.
    #[inline(always)]
    fn add_mixed(&self, local: &Local, points: &Points, spatial: &PointRows, out: &mut [f64]) {
        let mu = self.materials[local.group].mu;
        let rows = out.as_chunks_mut::<NODES>().0;
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            let mut pushed = [[[0.0; NODES]; POINTS]; 3];
            push_forward(&points.f[q], self.geometry.gradients(local.group, q), q, &mut pushed);
            let scale = -2.0 / 3.0 * weight * mu * points.j[q].powf(-2.0 / 3.0);
            for i in 0..3 {
                for a in 0..NODES {
                    for j in 0..=i {
                        let row = &mut rows[(i * NODES + a) * 3 + j];
                        for b in 0..NODES {
                            row[b] += scale * (pushed[i][q][a] * spatial[j][q][b] + spatial[i][q][a] * pushed[j][q][b]);
                        }
                    }
                }
            }
        }
    }

    /// Projected pressure at the points after `step`, to first order: U′(θ) + U″(θ) dθ with dJ = J F⁻ᵀ : dF.
    #[inline(always)]
    fn predict_pressure_n(&self, local: &Local, step: &[f64], out: &mut [f64]) {
        let Some(points) = self.points(local) else { return };
        let moved = self.geometry.deformation_gradients(local.group, step);
        let mut change = [0.0; POINTS];
        for q in 0..POINTS {
            change[q] = points.j[q] * points.f_inverse_transposed[q].dot(&moved[q]);
        }
        let change = self.geometry.project(local.group, &change);
        let mut pressure = [0.0; POINTS];
        for q in 0..POINTS {
            let (_, first, second) = self.volumetric(&self.materials[local.group], points.theta[q]);
            pressure[q] = first + second * change[q];
        }
        out.copy_from_slice(&self.geometry.project(local.group, &pressure));
    }
}

struct PredictStress<'a>(&'a FiniteStrain<'a>, &'a Local<'a>, &'a [f64], &'a mut [f64]);

impl Kernel for PredictStress<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.predict_pressure_n(self.1, self.2, self.3)
    }
}

impl SolidEnergy for FiniteStrain<'_> {
    #[inline(always)]
    fn energy_n(&self, local: &Local) -> f64 {
        let Some(points) = self.points(local) else { return f64::INFINITY };
        let material = &self.materials[local.group];
        let mut energy = 0.0;
        for (q, weight) in self.geometry.weights(local.group).iter().enumerate() {
            let i1 = points.f[q].norm_squared();
            let deviatoric = match self.law {
                NeoHookean::Logarithmic => 0.5 * material.mu * (i1 - 3.0) - material.mu * points.j[q].ln(),
                NeoHookean::Isochoric => 0.5 * material.mu * (points.j[q].powf(-2.0 / 3.0) * i1 - 3.0),
            };
            energy += weight * (deviatoric + self.volumetric(material, points.theta[q]).0);
        }
        energy
    }

    #[inline(always)]
    fn add_gradient_n(&self, local: &Local, out: &mut [f64]) {
        let Some(points) = self.points(local) else {
            out.fill(f64::NAN);
            return;
        };
        let pressure = self.pressure(local, &points);
        let mu = self.materials[local.group].mu;
        let mut stress = [Matrix3::zeros(); POINTS];
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            let (f, inverse, j) = (&points.f[q], &points.f_inverse_transposed[q], points.j[q]);
            let pointwise = match self.law {
                NeoHookean::Logarithmic => (f - inverse) * mu,
                NeoHookean::Isochoric => (f - inverse * (f.norm_squared() / 3.0)) * (mu * j.powf(-2.0 / 3.0)),
            };
            stress[q] = (pointwise + inverse * (pressure[q] * j)) * weight;
        }
        self.geometry.add_force(local.group, &stress, out);
    }

    #[inline(always)]
    fn add_hessian_n(&self, local: &Local, out: &mut [f64]) {
        let Some(points) = self.points(local) else { return };
        let mut pressure = [0.0; POINTS];
        if local.predicted.is_empty() {
            pressure = self.pressure(local, &points);
        } else {
            pressure.copy_from_slice(local.predicted);
        }
        let material = &self.materials[local.group];
        let mut spatial = [[[0.0; NODES]; POINTS]; 3];
        let mut coefficients = StiffnessCoefficients::ZERO;
        let mut volumetric = Volumetric { dilatation: points.j, stiffness: [0.0; POINTS] };
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            let rest = self.geometry.gradients(local.group, q);
            push_forward(&points.f_inverse_transposed[q], rest, q, &mut spatial);
            let j = points.j[q];
            let pj = pressure[q] * j;
            let (rest, cross, outer) = match self.law {
                NeoHookean::Logarithmic => (material.mu, material.mu - pj, pj),
                NeoHookean::Isochoric => {
                    let scaled = material.mu * j.powf(-2.0 / 3.0);
                    let i1 = points.f[q].norm_squared();
                    (scaled, scaled * i1 / 3.0 - pj, scaled * i1 * 2.0 / 9.0 + pj)
                }
            };
            coefficients.rest[q] = weight * rest;
            coefficients.cross[q] = weight * cross;
            coefficients.outer[q] = weight * outer;
            volumetric.stiffness[q] = weight * self.volumetric(material, points.theta[q]).2;
        }
        self.geometry.add_stiffness(local.group, &spatial, &coefficients, Some(&volumetric), out);
        if self.law == NeoHookean::Isochoric {
            self.add_mixed(local, &points, &spatial, out);
        }
    }
}

impl Effect for FiniteStrain<'_> {
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

    fn predicted_len(&self) -> usize {
        POINTS
    }

    fn predict_stress(&self, local: &Local, step: &[f64], out: &mut [f64]) {
        run_kernel(PredictStress(self, local, step, out))
    }

    fn max_step(&self, local: &Local, step: &[f64]) -> f64 {
        run_kernel(MaxStep(self.geometry, local, step))
    }
}
