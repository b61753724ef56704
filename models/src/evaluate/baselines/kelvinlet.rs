//! A closed form: the regularised Kelvinlet (de Goes & James, *Regularized Kelvinlets*, 2017) of a force spread over the contact.
//!
//! `u(r) = c/E [(a−b)/r_ε I + b/r_ε³ r rᵀ + a ε²/(2 r_ε³) I] f` with `r_ε² = |r|² + ε²`, `a = (1+ν)/(2π)`, `b = a/(4(1−ν))`: an infinite body under a force at
//! the contact's centre. Strength `c` and radius `ε` over the contact's radius are the two numbers fitted to the training split, by mean absolute error.

use nalgebra::Vector3;
use retina_core::network::input::{Field, Input};
use retina_core::patch::NODE_COUNT;

use crate::describe;
use crate::evaluate::predictors::Predictor;
use crate::sample::Sample;

/// See the module.
pub struct Kelvinlet {
    strength: f32,
    radius: f32,
}

/// Radii tried, in contact radii.
const RADII: [f32; 10] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8];
/// Samples that it is fitted to: every so many-th.
const FITTED: usize = 1000;

fn unit(input: &Input, radius: f32) -> Field {
    let modulus = input.tissue.youngs_modulus_kpa[0];
    let poisson = input.tissue.poisson_ratio[0];
    let a = (1.0 + poisson) / (2.0 * std::f32::consts::PI);
    let b = a / (4.0 * (1.0 - poisson));
    let soft = radius * input.contact_radius_mm.max(1e-3);
    let force = input.direction * (input.force_mn / modulus);
    std::array::from_fn(|node| {
        let offset: Vector3<f32> = input.rest_mm[node] - input.center_mm;
        let distance = (offset.norm_squared() + soft * soft).sqrt();
        let cubed = distance * distance * distance;
        force * ((a - b) / distance + a * soft * soft / (2.0 * cubed)) + offset * (b * offset.dot(&force) / cubed)
    })
}

impl Kelvinlet {
    /// Fits the samples: for each radius the strength by least squares, then the radius with the smallest mean error.
    pub fn new(samples: &[&Sample]) -> Self {
        let chosen = samples.iter().step_by(samples.len().div_ceil(FITTED).max(1));
        let inputs: Vec<(Input, Field)> =
            chosen.map(|sample| (describe::input(sample), sample.truth.displacement_mm.map(Vector3::from))).collect();
        let fitted = RADII.map(|radius| {
            let (mut above, mut below) = (0.0_f64, 0.0_f64);
            for (input, truth) in &inputs {
                for (u, t) in unit(input, radius).iter().zip(truth) {
                    above += f64::from(u.dot(t));
                    below += f64::from(u.norm_squared());
                }
            }
            let strength = (above / below) as f32;
            let error = |(input, truth): &(Input, Field)| {
                unit(input, radius).iter().zip(truth).map(|(u, t)| (u * strength - t).norm()).sum::<f32>()
            };
            (inputs.iter().map(|pair| f64::from(error(pair))).sum::<f64>() / NODE_COUNT as f64, strength, radius)
        });
        let best = fitted.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let (strength, radius) = best.map_or((0.0, 1.0), |(_, strength, radius)| (strength, radius));
        Kelvinlet { strength, radius }
    }
}

impl Predictor for Kelvinlet {
    fn name(&self) -> String {
        format!("Kelvinlet, ε = {} a, strength {:.2}", self.radius, self.strength)
    }

    fn displacement(&mut self, _sample: &Sample, input: &Input) -> Option<Field> {
        Some(unit(input, self.radius).map(|u| u * self.strength))
    }
}
