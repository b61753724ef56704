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

use super::solid::points::{IDENTITIES, PLACES, PointMatrices, PointNumbers, determinants_and_cofactors};
use super::solid::{
    Energy, Gradient, Hessian, MaxStep, PointRows, SolidEnergy, SolidGeometry, StiffnessCoefficients, Volumetric,
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
    f: PointMatrices,
    f_inverse_transposed: PointMatrices,
    j: PointNumbers,
    theta: PointNumbers,
}

impl Points {
    /// At rest.
    const REST: Self =
        Points { f: IDENTITIES, f_inverse_transposed: IDENTITIES, j: [1.0; PLACES], theta: [1.0; PLACES] };

    /// F:F at every point.
    #[inline(always)]
    fn squared_stretches(&self) -> PointNumbers {
        let mut sums = [0.0; PLACES];
        for row in &self.f {
            for entries in row {
                for q in 0..PLACES {
                    sums[q] += entries[q] * entries[q];
                }
            }
        }
        sums
    }
}

impl FiniteStrain<'_> {
    /// Deformation at the quadrature points; whether no point is inverted and the projected dilatation positive everywhere.
    #[inline(always)]
    fn measure(&self, local: &Local, out: &mut Points) -> bool {
        self.geometry.deformation_gradients(local.group, local.current, &mut out.f);
        determinants_and_cofactors(&out.f, &mut out.j, &mut out.f_inverse_transposed);
        let mut inverse = [0.0; PLACES];
        let mut upright = true;
        for q in 0..PLACES {
            inverse[q] = 1.0 / out.j[q];
            // Not a number is not positive either.
            upright &= out.j[q] > 0.0;
        }
        for row in &mut out.f_inverse_transposed {
            for entries in row {
                for q in 0..PLACES {
                    entries[q] *= inverse[q];
                }
            }
        }
        out.theta = self.geometry.project(local.group, &out.j);
        for theta in &out.theta[..POINTS] {
            upright &= *theta > 0.0;
        }
        upright
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
    fn pressure(&self, local: &Local, points: &Points) -> PointNumbers {
        let mut pressure = [0.0; PLACES];
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
        let mut pushed = [[[0.0; NODES]; POINTS]; 3];
        self.geometry.push_forward(local.group, &points.f, &mut pushed);
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
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
        let mut points = Points::REST;
        if !self.measure(local, &mut points) {
            return;
        }
        let mut moved = IDENTITIES;
        self.geometry.deformation_gradients(local.group, step, &mut moved);
        let mut change = [0.0; PLACES];
        for (inverse, moved) in points.f_inverse_transposed.as_flattened().iter().zip(moved.as_flattened()) {
            for q in 0..PLACES {
                change[q] += points.j[q] * inverse[q] * moved[q];
            }
        }
        let change = self.geometry.project(local.group, &change);
        let mut pressure = [0.0; PLACES];
        for q in 0..POINTS {
            let (_, first, second) = self.volumetric(&self.materials[local.group], points.theta[q]);
            pressure[q] = first + second * change[q];
        }
        out.copy_from_slice(&self.geometry.project(local.group, &pressure)[..POINTS]);
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
        let mut points = Points::REST;
        if !self.measure(local, &mut points) {
            return f64::INFINITY;
        }
        let material = &self.materials[local.group];
        let squared = points.squared_stretches();
        let mut energy = 0.0;
        for (q, weight) in self.geometry.weights(local.group).iter().enumerate() {
            let deviatoric = match self.law {
                NeoHookean::Logarithmic => 0.5 * material.mu * (squared[q] - 3.0) - material.mu * points.j[q].ln(),
                NeoHookean::Isochoric => 0.5 * material.mu * (points.j[q].powf(-2.0 / 3.0) * squared[q] - 3.0),
            };
            energy += weight * (deviatoric + self.volumetric(material, points.theta[q]).0);
        }
        energy
    }

    #[inline(always)]
    fn add_gradient_n(&self, local: &Local, out: &mut [f64]) {
        let mut points = Points::REST;
        if !self.measure(local, &mut points) {
            out.fill(f64::NAN);
            return;
        }
        let pressure = self.pressure(local, &points);
        let mu = self.materials[local.group].mu;
        let weights = self.geometry.weights_in_places(local.group);
        // The stress is a F + b F⁻ᵀ.
        let (mut a, mut b) = ([0.0; PLACES], [0.0; PLACES]);
        match self.law {
            NeoHookean::Logarithmic => {
                for q in 0..PLACES {
                    a[q] = weights[q] * mu;
                    b[q] = weights[q] * (pressure[q] * points.j[q] - mu);
                }
            }
            NeoHookean::Isochoric => {
                let squared = points.squared_stretches();
                for q in 0..PLACES {
                    a[q] = weights[q] * mu * points.j[q].powf(-2.0 / 3.0);
                    b[q] = weights[q] * pressure[q] * points.j[q] - a[q] * squared[q] / 3.0;
                }
            }
        }
        let mut stress = IDENTITIES;
        for i in 0..3 {
            for k in 0..3 {
                let (f, inverse) = (&points.f[i][k], &points.f_inverse_transposed[i][k]);
                for q in 0..PLACES {
                    stress[i][k][q] = a[q].mul_add(f[q], b[q] * inverse[q]);
                }
            }
        }
        self.geometry.add_force(local.group, &stress, out);
    }

    #[inline(always)]
    fn add_hessian_n(&self, local: &Local, out: &mut [f64]) {
        let mut points = Points::REST;
        if !self.measure(local, &mut points) {
            return;
        }
        let mut pressure = [0.0; PLACES];
        if local.predicted.is_empty() {
            pressure = self.pressure(local, &points);
        } else {
            pressure[..POINTS].copy_from_slice(local.predicted);
        }
        let material = &self.materials[local.group];
        let mut spatial = [[[0.0; NODES]; POINTS]; 3];
        self.geometry.push_forward(local.group, &points.f_inverse_transposed, &mut spatial);
        let mut coefficients = StiffnessCoefficients::ZERO;
        let mut volumetric = Volumetric { dilatation: [0.0; POINTS], stiffness: [0.0; POINTS] };
        let squared = points.squared_stretches();
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            let j = points.j[q];
            volumetric.dilatation[q] = j;
            let pj = pressure[q] * j;
            let (rest, cross, outer) = match self.law {
                NeoHookean::Logarithmic => (material.mu, material.mu - pj, pj),
                NeoHookean::Isochoric => {
                    let scaled = material.mu * j.powf(-2.0 / 3.0);
                    let i1 = squared[q];
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
