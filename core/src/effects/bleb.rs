//! `bleb`: fluid of a given volume between retina and choroid, where the retina is detached.
//!
//! The fluid fills the space between the two sides x⁻ (choroid) and x⁺ (retina) of the interface inside the detached disc, presses on both with one pressure p and does not yield: V(x) = V₀.
//! Equilibrium with this constraint is a stationary point of Π − p (V − V₀), so p is its multiplier, and for a given p the fluid's energy is −p V.
//!
//! Volume between the sides. Points of both sides with the same parameters (ξ, η) are joined by straight lines x_t = (1 − t) x⁻ + t x⁺. With d = x⁺ − x⁻ and the tangents a_t, b_t of x_t,
//!
//! ```text
//! V = ∫∫ ∫₀¹ d · (a_t × b_t) dt dξ dη,
//! ```
//!
//! which for a closed surface is what the divergence theorem gives, and does not depend on the origin for a part of it. The integrand is quadratic in t, so Simpson's rule is exact, and of degree five
//! in ξ and η, for which three Gauss points are. Every value is trilinear in linear functions of the nodes; gradient and Hessian follow term by term, the Hessian symmetric: a load that follows its surfaces.
//!
//! While Newton's method is far off, the Hessian takes the pressure that its last linear step predicted, as that of other stiff stresses.
//! Where the sides touch, they rest on each other as those of a parted bond do (`adhesion`).
//!
//! Law: the forces on all nodes of a group balance; the pressure's work for a displacement is p times the volume it adds.
//! Not here: how p is found (`solve::held`), what holds the retina outside of the disc (`adhesion`).

use nalgebra::{Matrix3, Vector3};

use super::adhesion::GROUP;
use super::pressure::FACE_POINTS;
use crate::effect::{Effect, Local, Multiplier};
use crate::mesh::element::FACE_NODES;

/// Name of the effect.
pub const NAME: &str = "bleb";

/// Simpson's rule on [0, 1].
const SIMPSON: [(f64, f64); 3] = [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)];

/// The fluid between the sides of an interface; groups hold the lower side's nodes, then the upper one's.
#[derive(Debug)]
pub struct Fluid<'a> {
    /// Which faces are detached.
    pub detached: &'a [bool],
    /// What it is held by.
    pub holds: Holds,
}

/// What of the fluid is held.
#[derive(Debug)]
pub enum Holds {
    /// Its volume (mm³), by a pressure that is sought (kPa).
    Volume(Multiplier),
    /// Its pressure (kPa).
    Pressure(f64),
}

/// A linear function of the nodes: one weight each.
type Weights = [f64; GROUP];

/// The three linear functions d, a_t, b_t of a product, and its weight.
struct Product {
    weight: f64,
    factors: [Weights; 3],
}

impl Product {
    fn values(&self, local: &Local) -> [Vector3<f64>; 3] {
        let node = |a: usize| Vector3::from_fn(|k, _| local.current[k * GROUP + a]);
        self.factors.map(|weights| weights.iter().enumerate().map(|(a, weight)| node(a) * *weight).sum())
    }
}

impl Fluid<'_> {
    /// The products whose sum is the volume of a group.
    fn products(&self, group: usize) -> impl Iterator<Item = Product> + '_ {
        let points = if self.detached[group] { &FACE_POINTS[..] } else { &[] };
        points.iter().flat_map(|point| {
            SIMPSON.map(|(t, share)| {
                let both = |values: &[f64; FACE_NODES], below: f64, above: f64| {
                    std::array::from_fn(
                        |a| if a < FACE_NODES { below * values[a] } else { above * values[a - FACE_NODES] },
                    )
                };
                let [value, along, across] = &point.values;
                let factors = [both(value, -1.0, 1.0), both(along, 1.0 - t, t), both(across, 1.0 - t, t)];
                Product { weight: share * point.weight, factors }
            })
        })
    }

    /// Its pressure (kPa).
    pub fn pressure_kpa(&self) -> f64 {
        match &self.holds {
            Holds::Volume(pressure) => pressure.value(),
            Holds::Pressure(pressure_kpa) => *pressure_kpa,
        }
    }

    /// Volume between the sides of a detached group, 0 of another (mm³).
    pub fn volume(&self, local: &Local) -> f64 {
        let product = |product: Product| {
            let [d, a, b] = product.values(local);
            product.weight * d.dot(&a.cross(&b))
        };
        self.products(local.group).map(product).sum()
    }

    /// Adds `factor` times the slope of the volume.
    fn add_slope(&self, local: &Local, factor: f64, out: &mut [f64]) {
        for product in self.products(local.group) {
            let [d, a, b] = product.values(local);
            let scale = factor * product.weight;
            let slopes = [a.cross(&b), b.cross(&d), d.cross(&a)].map(|slope| slope * scale);
            for node in 0..GROUP {
                let force: Vector3<f64> =
                    slopes.iter().zip(&product.factors).map(|(slope, weights)| slope * weights[node]).sum();
                for k in 0..3 {
                    out[k * GROUP + node] += force[k];
                }
            }
        }
    }
}

impl Effect for Fluid<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_active(&self, local: &Local) -> bool {
        self.pressure_kpa() != 0.0 && self.detached[local.group]
    }

    fn energy(&self, local: &Local) -> f64 {
        -self.pressure_kpa() * self.volume(local)
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        self.add_slope(local, -self.pressure_kpa(), out);
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let pressure_kpa = local.predicted.first().copied().unwrap_or_else(|| self.pressure_kpa());
        for product in self.products(local.group) {
            let scale = -pressure_kpa * product.weight;
            // u · (v × w) = u · [v] w = −u · [w] v with [·] the matrix of the cross product.
            let [d, a, b] = product.values(local).map(|value| value.cross_matrix() * scale);
            let [on_d, on_a, on_b] = &product.factors;
            for m in 0..GROUP {
                for n in 0..GROUP {
                    let block: Matrix3<f64> = b * (on_a[m] * on_d[n] - on_d[m] * on_a[n])
                        + a * (on_d[m] * on_b[n] - on_b[m] * on_d[n])
                        + d * (on_b[m] * on_a[n] - on_a[m] * on_b[n]);
                    for i in 0..3 {
                        for j in 0..=i {
                            out[(i * GROUP + m) * 3 * GROUP + j * GROUP + n] += block[(i, j)];
                        }
                    }
                }
            }
        }
    }

    fn predicted_len(&self) -> usize {
        1
    }

    fn predict_stress(&self, _local: &Local, _step: &[f64], out: &mut [f64]) {
        out[0] = self.pressure_kpa();
    }

    fn multiplier(&self) -> Option<&Multiplier> {
        match &self.holds {
            Holds::Volume(pressure) => Some(pressure),
            Holds::Pressure(_) => None,
        }
    }

    fn held(&self, local: &Local) -> f64 {
        self.volume(local)
    }

    fn add_held_slope(&self, local: &Local, out: &mut [f64]) {
        self.add_slope(local, 1.0, out);
    }
}
