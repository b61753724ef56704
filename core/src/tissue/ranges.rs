//! Defaults, bounds and sources of the numbers in a [`Tissue`](super::Tissue).
//!
//! Contract: one [`LayerRanges`] a layer; what no source was found for is marked `[unverified]` in its `source`. Units: mm, kPa.
//!
//! Not here: the layers themselves and the check of a whole tissue.

use super::Layer;
use crate::range::ParameterRange;

/// Bounds and defaults of one layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerRanges {
    /// Thickness, mm.
    pub thickness: ParameterRange,
    /// Young's modulus, kPa.
    pub youngs_modulus: ParameterRange,
    /// Poisson's ratio, a pure number.
    pub poisson_ratio: ParameterRange,
}

impl LayerRanges {
    /// The layer made of the three defaults.
    pub fn default_layer(&self) -> Layer {
        Layer {
            thickness_mm: self.thickness.default,
            youngs_modulus_kpa: self.youngs_modulus.default,
            poisson_ratio: self.poisson_ratio.default,
        }
    }
}

const fn thickness(default: f64, min: f64, max: f64, source: &'static str) -> ParameterRange {
    ParameterRange { name: "thickness", unit: "mm", default, min, max, source }
}

const fn youngs_modulus(default: f64, min: f64, max: f64, source: &'static str) -> ParameterRange {
    ParameterRange { name: "Young's modulus", unit: "kPa", default, min, max, source }
}

/// Nearly incompressible up to the limit that the elements are verified for.
const fn poisson_ratio(default: f64, source: &'static str) -> ParameterRange {
    ParameterRange { name: "Poisson's ratio", unit: "1", default, min: 0.0, max: 0.4999, source }
}

/// The retina as a whole.
pub const RETINA: LayerRanges = LayerRanges {
    thickness: thickness(
        0.25,
        0.08,
        0.32,
        "0.08 mm at the ora serrata to 0.32 mm at the foveal rim (Webvision, BioNumbers 109683); default: surgical rule of thumb \
         0.25-0.30 mm",
    ),
    youngs_modulus: youngs_modulus(
        20.0,
        0.9,
        30.0,
        "default: bovine retina under traction (Jones 1992, Eye); 0.9 kPa: mouse by AFM (Soft Matter 2026, d5sm01060h); 30 kPa: \
         finite-element models (PMC7401712)",
    ),
    poisson_ratio: poisson_ratio(0.49, "finite-element models (PMC7401712)"),
};

/// How many sublayers the retina may be divided into. The bound is this program's: each costs at least one row of elements.
pub const RETINA_SUBLAYER_COUNT: ParameterRange = ParameterRange {
    name: "number of retinal sublayers",
    unit: "layers",
    default: 1.0,
    min: 1.0,
    max: 8.0,
    source: "bound of this program; OCT separates seven layers of the central retina (KoreaMed 1010506)",
};

/// One sublayer of the retina; the sum of the thicknesses is held against [`RETINA`] besides.
pub const RETINA_SUBLAYER: LayerRanges = LayerRanges {
    thickness: thickness(
        0.05,
        0.005,
        RETINA.thickness.max,
        "thinnest by OCT is 0.011 mm (nerve fibre layer, KoreaMed 1010506); the bound is half of it",
    ),
    ..RETINA
};

/// Choroid with Bruch's membrane and pigment epithelium, in the transverse direction and drained.
pub const CHOROID: LayerRanges = LayerRanges {
    thickness: thickness(0.25, 0.05, 0.5, "[unverified] about 0.25-0.3 mm under the fovea in vivo"),
    youngs_modulus: youngs_modulus(
        6.0,
        1.0,
        1300.0,
        "[unverified] drained transverse modulus: blood leaves a choroid that is pressed. In the plane, strips of the choroid \
         complex have 0.60 +/- 0.28 MPa (Friberg & Lace 1988), which the bounds include",
    ),
    poisson_ratio: poisson_ratio(0.2, "[unverified] drained: its volume changes as blood leaves it"),
};

/// Sclera.
pub const SCLERA: LayerRanges = LayerRanges {
    thickness: thickness(
        0.94,
        0.39,
        1.2,
        "0.94 +/- 0.18 mm at the posterior pole, 0.39 mm at the peripapillary flange (Vurgese 2012)",
    ),
    youngs_modulus: youngs_modulus(
        1800.0,
        500.0,
        5000.0,
        "1.8 +/- 1.1 MPa posterior, 2.9 +/- 1.4 MPa anterior (Friberg & Lace 1988)",
    ),
    poisson_ratio: poisson_ratio(0.49, "finite-element models (PMC7401712)"),
};

/// Inner limiting membrane.
pub const INNER_LIMITING_MEMBRANE: LayerRanges = LayerRanges {
    thickness: thickness(
        0.001,
        7e-5,
        0.004,
        "70 nm in the periphery (secondary source); 1-4 um hydrated by AFM [unverified]",
    ),
    youngs_modulus: youngs_modulus(
        200.0,
        10.0,
        20_000.0,
        "[unverified] tens to hundreds of kPa by AFM, MPa for the chick",
    ),
    poisson_ratio: poisson_ratio(0.49, "[unverified] taken as that of the retina"),
};

/// Strength of the bond between retina and pigment epithelium.
pub const BOND_STRENGTH: ParameterRange = ParameterRange {
    name: "strength of the retina's bond",
    unit: "kPa",
    default: 40.0,
    min: 1.0,
    max: 100.0,
    source: "[unverified] no strength is published: 2 G / 0.007 mm, the fracture energy over the length of the epithelium's villi that must be \
             drawn out. Bounds of this program",
};

/// Energy that tears retina and pigment epithelium apart.
pub const FRACTURE_ENERGY: ParameterRange = ParameterRange {
    name: "fracture energy of the retina's bond",
    unit: "mN/mm",
    default: 0.14,
    min: 0.06,
    max: 0.6,
    source: "in vivo, bleb and Laplace's law: rabbit 0.10, monkey 0.14, cat 0.18 N/m (Kita & Marmor 1992); twice that at 180 degrees, 1.5 times \
             under mannitol; the bounds are this program's. A porcine peel test gave 11 N/m (Zhang 2023), more than the retina itself bears",
};

/// Power with which strength and fracture energy of the bond grow with the speed of its opening.
pub const BOND_RATE_EXPONENT: ParameterRange = ParameterRange {
    name: "rate exponent of the retina's bond",
    unit: "1",
    default: 0.0,
    min: 0.0,
    max: 0.6,
    source: "[unverified] no dependence of the retina's bond on speed was found, hence 0; the upper bound is that of rubber peeled off glass (Maugis & Barquins 1978)",
};

/// Speed of opening from about which on the bond holds more.
pub const BOND_REFERENCE_SPEED: ParameterRange = ParameterRange {
    name: "reference speed of the retina's bond",
    unit: "mm/s",
    default: 0.01,
    min: 1e-6,
    max: 100.0,
    source: "[unverified] nothing published: the length of the epithelium's villi, 0.007 mm, in about a second. Bounds of this program",
};
