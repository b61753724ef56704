//! The layered bed: thickness, stiffness and what it rests on.
//!
//! Infinite sideways, linear, isotropic and homogeneous in each layer, layers bonded to each other. Units: mm, kPa.

use super::error::LayeredError;

/// One horizontal layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BedLayer {
    /// Thickness, mm; > 0.
    pub thickness_mm: f64,
    /// Young's modulus, kPa; > 0.
    pub youngs_modulus_kpa: f64,
    /// Poisson's ratio; −1 < ν < 0.5.
    pub poisson_ratio: f64,
}

/// What the lowest layer rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BedBase {
    /// Bonded to a rigid base.
    Bonded,
    /// Linear springs per area, one value for each direction.
    Springs {
        /// Normal stiffness, kPa/mm; > 0.
        normal_kpa_per_mm: f64,
        /// Tangential stiffness, kPa/mm; ≥ 0 (0 is a frictionless base).
        tangential_kpa_per_mm: f64,
    },
}

/// A stack of layers on a base.
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredBed {
    /// The layers, inner (loaded) first.
    pub layers: Vec<BedLayer>,
    /// What the last layer rests on.
    pub base: BedBase,
}

impl BedLayer {
    /// Shear modulus µ = E / 2(1 + ν), kPa.
    pub fn shear_modulus_kpa(&self) -> f64 {
        self.youngs_modulus_kpa / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// Normal surface compliance of a half-space of this layer times the wave number, (1 − ν)/µ = 2(1 − ν²)/E, 1/kPa.
    pub fn half_space_normal(&self) -> f64 {
        (1.0 - self.poisson_ratio) / self.shear_modulus_kpa()
    }

    /// Radial surface compliance of a half-space of this layer times the wave number, −(1 − 2ν)/2µ, 1/kPa.
    pub fn half_space_radial(&self) -> f64 {
        -(1.0 - 2.0 * self.poisson_ratio) / (2.0 * self.shear_modulus_kpa())
    }
}

impl LayeredBed {
    /// Checks every number.
    ///
    /// # Errors
    /// Names the layer, the field and the value that is not finite or outside its range.
    pub fn validate(&self) -> Result<(), LayeredError> {
        if self.layers.is_empty() {
            return Err(LayeredError::NoLayers);
        }
        for (index, layer) in self.layers.iter().enumerate() {
            let refuse = |field, value, allowed| Err(LayeredError::InvalidLayer { index, field, value, allowed });
            if !(layer.thickness_mm.is_finite() && layer.thickness_mm > 0.0) {
                return refuse("thickness_mm", layer.thickness_mm, "finite, > 0");
            }
            if !(layer.youngs_modulus_kpa.is_finite() && layer.youngs_modulus_kpa > 0.0) {
                return refuse("youngs_modulus_kpa", layer.youngs_modulus_kpa, "finite, > 0");
            }
            if !(layer.poisson_ratio > -1.0 && layer.poisson_ratio < 0.5) {
                return refuse("poisson_ratio", layer.poisson_ratio, "-1 < nu < 0.5");
            }
        }
        if let BedBase::Springs { normal_kpa_per_mm, tangential_kpa_per_mm } = self.base {
            let refuse = |field, value, allowed| Err(LayeredError::InvalidBase { field, value, allowed });
            if !(normal_kpa_per_mm.is_finite() && normal_kpa_per_mm > 0.0) {
                return refuse("normal_kpa_per_mm", normal_kpa_per_mm, "finite, > 0");
            }
            if !(tangential_kpa_per_mm.is_finite() && tangential_kpa_per_mm >= 0.0) {
                return refuse("tangential_kpa_per_mm", tangential_kpa_per_mm, "finite, >= 0");
            }
        }
        Ok(())
    }
}
