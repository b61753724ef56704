//! A tool pressed into a bed, as the loads that stand for it, and the pressures under it. Units: mm, mN, kPa.

use std::f64::consts::PI;

use super::grid::stretch_punches;
use super::prepared::LinearBed;

/// A flat punch of a radius that is not a prepared one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartialPunch {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Force, mN; ≥ 0.
    pub force_mn: f64,
}

/// A tool pressed into a bed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Indentation {
    /// Travel of the tool since its foremost point touched, mm.
    pub depth_mm: f64,
    /// Normal force, mN.
    pub normal_force_mn: f64,
    /// Contact radius, mm; 0 without force.
    pub contact_radius_mm: f64,
    /// Force of each finished stretch of growth, inner first, mN, each ≥ 0; stretches beyond the last have none.
    pub stretch_forces_mn: Vec<f64>,
    /// Single punches: those of the unfinished stretch, of the approach to a rim, and the rim itself.
    pub partial_punches: Vec<PartialPunch>,
}

impl LinearBed {
    /// Mean pressure on each ring between consecutive sample radii, kPa. Not negative where a flat punch's own pressure is not: under
    /// a membrane that is both much stiffer than the layer below it and thinner than the contact, a flat punch lifts off next
    /// to its edge, and the first few rings (up to about 5 µm) may show a pull, of no weight in the surface or the force.
    pub fn ring_pressures_kpa(&self, indentation: &Indentation) -> Vec<f64> {
        let samples = self.sample_radii_mm();
        let mut forces = vec![0.0; samples.len() - 1];
        let mut add = |ring_forces: &[f64], force: f64| {
            forces.iter_mut().zip(ring_forces).for_each(|(sum, ring)| *sum += force * ring);
        };
        self.stretches.iter().zip(&indentation.stretch_forces_mn).for_each(|(table, &q)| add(&table.ring_forces, q));
        for partial in &indentation.partial_punches {
            for (punch, weight) in self.blend(partial.radius_mm).weights() {
                add(&self.punches[punch].ring_forces, weight * partial.force_mn);
            }
        }
        let area = |ring: &[f64]| PI * (ring[1] - ring[0]) * (ring[1] + ring[0]);
        forces.iter().zip(samples.windows(2)).map(|(force, ring)| force / area(ring)).collect()
    }
}

/// Adds the loaded ones of the punches that stand for growth from `start` to `end` under `force`; one punch if they are equal.
pub(super) fn push_punches(punches: &mut Vec<PartialPunch>, start: f64, end: f64, force: f64) {
    let parts = if start == end { [(end, 1.0), (end, 0.0)] } else { stretch_punches(start, end) };
    let loaded = parts.into_iter().map(|(radius_mm, part)| PartialPunch { radius_mm, force_mn: part * force });
    punches.extend(loaded.filter(|punch| punch.force_mn > 0.0));
}
