//! `viscoelasticity`: Prony series on the shear response, at finite strain, as networks that re-form.
//!
//! Beside the lasting shear modulus µ stand networks of moduli β µ with relaxation times τ (Green & Tobolsky, *J. Chem. Phys.* 14, 1946; Lodge,
//! *Rheol. Acta* 7, 1968). A network keeps the average G of C⁻¹ over the times at which its chains were formed, Ġ = (C⁻¹ − G)/τ, and stores
//! βµ/2 (G:C − 3 − ln det GC) per rest volume, so that its second Piola–Kirchhoff stress is S = βµ (G − C⁻¹) and its dissipation
//! βµ/2τ (tr GC + tr (GC)⁻¹ − 6) ≥ 0: in space the upper-convected Maxwell model. At once (G = 1) it is the pointwise part µ/2 (I₁ − 3) − µ ln J
//! of the neo-Hookean energy times β, in the long run (G = C⁻¹) nothing.
//!
//! Step h from state n, with x = h/τ, E = e⁻ˣ and A = (1 − E)/x: for C⁻¹ linear in time over the step, Ġ integrates to
//! G′ = E G + (A − E) Cₙ⁻¹ + (1 − A) C′⁻¹ exactly, a mean of positive definite tensors for any h, so the recurrence is stable for any step. Put into S
//! it is the derivative of the incremental potential βµ (½ B:C′ − A ln J′) with B = E G + (A − E) Cₙ⁻¹: energy, gradient and Hessian below.
//! Networks of one element share C, so their B and A are summed before the solve.
//!
//! Limits: the volumetric law stays elastic, so a fast load sees a larger µ with the same λ, and Poisson's ratio falls with the rise of µ. Relaxation
//! is linear in G: no yield, no shear thinning beyond that of the upper-convected model. With small-strain `elasticity` it agrees to first order.

use nalgebra::Matrix3;

use super::solid::points::{IDENTITIES, matrix_at, put_matrix};
use super::solid::products::{Block, Products, add_products};
use super::solid::{
    Energy, Gradient, Hessian, MaxStep, SolidEnergy, SolidGeometry, StiffnessCoefficients, determinant_and_cofactor,
};
use crate::effect::{Effect, Local, Stencils, add_isotropic};
use crate::kernel::run_kernel;
use crate::mesh::element::{NODES, POINTS};

/// Name of the effect.
pub const NAME: &str = "viscoelasticity";

/// One network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Network {
    /// Relaxation time τ (s).
    pub relaxation_time_s: f64,
    /// Its shear modulus over the lasting one, β.
    pub modulus_ratio: f64,
}

/// The weights of one step in the recurrence.
#[derive(Clone, Copy, Debug)]
struct Weights {
    /// E, of what is remembered.
    kept: f64,
    /// A − E, of the state at the start of the step.
    start: f64,
    /// 1 − A, of the state at its end.
    end: f64,
    /// A.
    barrier: f64,
}

impl Network {
    fn weights(&self, step_s: f64) -> Weights {
        let x = step_s / self.relaxation_time_s;
        let barrier = -(-x).exp_m1() / x;
        let kept = (-x).exp();
        // Below the threshold the differences are those of the series 1 − A = x/2 − x²/6 + …, A − E = x/2 − x²/3 + …, which do not cancel.
        let (start, end) = if x < SMALL_STEP {
            (x * (0.5 - x * (1.0 / 3.0 - x / 8.0)), x * (0.5 - x * (1.0 / 6.0 - x / 24.0)))
        } else {
            (barrier - kept, 1.0 - barrier)
        };
        Weights { kept, start, end, barrier }
    }

    /// Share of an increment's elastic stress that the network bears at the end of a linear load over `step_s` (s), over that of the lasting
    /// modulus: β A.
    pub fn borne(&self, step_s: f64) -> f64 {
        self.modulus_ratio * self.weights(step_s).barrier
    }
}

/// Step over relaxation time below which series replace differences: the terms left out are of the order of rounding.
const SMALL_STEP: f64 = 1e-4;

/// What the networks of every element remember.
#[derive(Clone, Debug)]
pub struct Networks {
    /// Lasting shear modulus of each element (kPa); 0 for one without networks.
    shear_kpa: Vec<f64>,
    networks: Vec<Network>,
    /// C⁻¹ at the last commit, indexed (element, point).
    inverse: Vec<Matrix3<f64>>,
    /// G at the last commit, indexed (element, point, network).
    memory: Vec<Matrix3<f64>>,
}

impl Networks {
    /// Networks in tissue that has been at rest for long; one shear modulus for each element (kPa), 0 where there are none.
    pub fn at_rest(shear_kpa: Vec<f64>, networks: Vec<Network>) -> Self {
        let points = shear_kpa.len() * POINTS;
        let memory = vec![Matrix3::identity(); points * networks.len()];
        Networks { shear_kpa, networks, inverse: vec![Matrix3::identity(); points], memory }
    }

    /// The effect during a step of `step_s` (s) from the last commit.
    pub fn step<'a>(&'a self, geometry: &'a SolidGeometry, step_s: f64) -> Viscoelasticity<'a> {
        let weights: Vec<Weights> = self.networks.iter().map(|network| network.weights(step_s)).collect();
        let mut pull = Vec::with_capacity(self.inverse.len());
        let mut offset = Vec::with_capacity(self.inverse.len());
        for (point, inverse) in self.inverse.iter().enumerate() {
            let mut sum = Matrix3::zeros();
            for ((network, weights), memory) in self.networks.iter().zip(&weights).zip(self.memory_of(point)) {
                sum += (memory * weights.kept + inverse * weights.start) * network.modulus_ratio;
            }
            // det C > 0 of an accepted state, so the inverse exists; without it only the energy's constant would differ.
            let metric = inverse.try_inverse().unwrap_or_else(Matrix3::identity);
            offset.push(0.5 * sum.dot(&metric));
            pull.push(sum);
        }
        let barrier = self.networks.iter().zip(&weights).map(|(n, w)| n.modulus_ratio * w.barrier).sum();
        Viscoelasticity { geometry, shear_kpa: &self.shear_kpa, pull, offset, barrier }
    }

    fn memory_of(&self, point: usize) -> &[Matrix3<f64>] {
        &self.memory[point * self.networks.len()..(point + 1) * self.networks.len()]
    }

    /// Remembers the end of a step of `step_s` (s) at these positions (x, y, z of each vertex) (mm).
    pub fn commit(&mut self, geometry: &SolidGeometry, stencils: &Stencils, positions: &[f64], step_s: f64) {
        let weights: Vec<Weights> = self.networks.iter().map(|network| network.weights(step_s)).collect();
        let mut local = [0.0; 3 * NODES];
        for element in (0..stencils.len()).filter(|&element| self.shear_kpa[element] > 0.0) {
            stencils.gather(element, positions, &mut local);
            for q in 0..POINTS {
                let point = element * POINTS + q;
                let inverse = inverse_metric(&geometry.deformation_gradient(element, q, &local));
                let memory = &mut self.memory[point * weights.len()..(point + 1) * weights.len()];
                for (memory, weights) in memory.iter_mut().zip(&weights) {
                    *memory = *memory * weights.kept + self.inverse[point] * weights.start + inverse * weights.end;
                }
                self.inverse[point] = inverse;
            }
        }
    }

    /// Takes these positions (x, y, z of each vertex) (mm) for those at which the tissue has been at rest for ever: every network has relaxed there, G = C⁻¹.
    pub fn settle(&mut self, geometry: &SolidGeometry, stencils: &Stencils, positions: &[f64]) {
        let mut local = [0.0; 3 * NODES];
        let networks = self.networks.len();
        for element in (0..stencils.len()).filter(|&element| self.shear_kpa[element] > 0.0) {
            stencils.gather(element, positions, &mut local);
            for q in 0..POINTS {
                let point = element * POINTS + q;
                let inverse = inverse_metric(&geometry.deformation_gradient(element, q, &local));
                self.memory[point * networks..(point + 1) * networks].fill(inverse);
                self.inverse[point] = inverse;
            }
        }
    }

    /// Free energy that the networks store at the last commit (µJ).
    pub fn stored_energy_uj(&self, geometry: &SolidGeometry) -> f64 {
        let mut total = 0.0;
        for (element, &shear) in self.shear_kpa.iter().enumerate().filter(|(_, shear)| **shear > 0.0) {
            for (q, weight) in geometry.weights(element).iter().enumerate() {
                let point = element * POINTS + q;
                let metric = self.inverse[point].try_inverse().unwrap_or_else(Matrix3::identity);
                for (network, memory) in self.networks.iter().zip(self.memory_of(point)) {
                    let stretched = memory * metric;
                    let density = stretched.trace() - 3.0 - stretched.determinant().ln();
                    total += 0.5 * weight * network.modulus_ratio * shear * density;
                }
            }
        }
        total
    }
}

/// C⁻¹ = F⁻¹F⁻ᵀ.
fn inverse_metric(f: &Matrix3<f64>) -> Matrix3<f64> {
    let (j, cofactor) = determinant_and_cofactor(f);
    let inverse_transposed = cofactor / j;
    inverse_transposed.transpose() * inverse_transposed
}

/// The effect during one step.
pub struct Viscoelasticity<'a> {
    geometry: &'a SolidGeometry,
    shear_kpa: &'a [f64],
    /// Σ β B, indexed (element, point).
    pull: Vec<Matrix3<f64>>,
    /// ½ Σ β B:C at the start of the step: the energy is counted from there, where it is small.
    offset: Vec<f64>,
    /// Σ β A.
    barrier: f64,
}

impl Viscoelasticity<'_> {
    /// F, F⁻ᵀ and J at the quadrature points; `None` where one is inverted.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    fn points(&self, local: &Local) -> Option<([Matrix3<f64>; POINTS], [Matrix3<f64>; POINTS], [f64; POINTS])> {
        let mut out = ([Matrix3::identity(); POINTS], [Matrix3::identity(); POINTS], [1.0; POINTS]);
        let mut gradients = IDENTITIES;
        self.geometry.deformation_gradients(local.group, local.current, &mut gradients);
        for q in 0..POINTS {
            let f = matrix_at(&gradients, q);
            let (j, cofactor) = determinant_and_cofactor(&f);
            if j.is_nan() || j <= 0.0 {
                return None;
            }
            (out.0[q], out.1[q], out.2[q]) = (f, cofactor / j, j);
        }
        Some(out)
    }

    #[inline(always)]
    fn pull(&self, element: usize, point: usize) -> &Matrix3<f64> {
        &self.pull[element * POINTS + point]
    }
}

impl SolidEnergy for Viscoelasticity<'_> {
    #[inline(always)]
    fn energy_n(&self, local: &Local) -> f64 {
        let Some((f, _, j)) = self.points(local) else { return f64::INFINITY };
        let mut energy = 0.0;
        for (q, weight) in self.geometry.weights(local.group).iter().enumerate() {
            let stretched = 0.5 * (f[q] * self.pull(local.group, q)).dot(&f[q]);
            energy += weight * (stretched - self.offset[local.group * POINTS + q] - self.barrier * j[q].ln());
        }
        energy * self.shear_kpa[local.group]
    }

    #[inline(always)]
    fn add_gradient_n(&self, local: &Local, out: &mut [f64]) {
        let Some((f, inverse, _)) = self.points(local) else {
            out.fill(f64::NAN);
            return;
        };
        let mut stress = IDENTITIES;
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            let scale = weight * self.shear_kpa[local.group];
            let at = f[q] * self.pull(local.group, q) - inverse[q] * self.barrier;
            put_matrix(&mut stress, q, &(at * scale));
        }
        self.geometry.add_force(local.group, &stress, out);
    }

    #[inline(always)]
    fn add_hessian_n(&self, local: &Local, out: &mut [f64]) {
        let Some((_, inverse, _)) = self.points(local) else { return };
        let (mut inverses, mut pulls) = (IDENTITIES, IDENTITIES);
        let mut coefficients = StiffnessCoefficients::ZERO;
        let mut scales = [0.0; POINTS];
        for (q, &weight) in self.geometry.weights(local.group).iter().enumerate() {
            put_matrix(&mut inverses, q, &inverse[q]);
            put_matrix(&mut pulls, q, self.pull(local.group, q));
            scales[q] = weight * self.shear_kpa[local.group];
            coefficients.cross[q] = scales[q] * self.barrier;
        }
        let [mut spatial, mut rest, mut pulled] = [[[[0.0; NODES]; POINTS]; 3]; 3];
        self.geometry.push_forward(local.group, &inverses, &mut spatial);
        self.geometry.add_stiffness(local.group, &spatial, &coefficients, None, out);
        self.geometry.rest_gradients(local.group, &mut rest);
        self.geometry.push_forward(local.group, &pulls, &mut pulled);
        let mut isotropic = [[0.0; NODES]; NODES];
        let base = self.geometry.base(local.group);
        let mut block = Block { rows: &mut isotropic, first: 0, step: 1 };
        let sum = |k: usize| Products { scales: &scales, left: &pulled[k], right: &rest[k] };
        add_products(base, [sum(0), sum(1), sum(2)], &mut block);
        add_isotropic(&isotropic, out);
    }
}

impl Effect for Viscoelasticity<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, local: &Local) -> bool {
        self.shear_kpa[local.group] > 0.0
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

    fn max_step(&self, local: &Local, step: &[f64]) -> f64 {
        run_kernel(MaxStep(self.geometry, local, step))
    }
}
