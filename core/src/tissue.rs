//! The layers of the eye wall under the patch: what each is made of and how thick it is.
//!
//! Contract: a [`Tissue`] lists its layers from the vitreous outwards; [`Tissue::validate`] holds every number against the ranges of
//! [`ranges`]. Units: mm, kPa; Poisson's ratio is a pure number.
//!
//! Not here: where the layers lie in space (`surface`), the energy of the material (`effect`). Published moduli of the retina
//! span 0.9 to 30 kPa by method, so every number is a scene parameter and none a constant.

pub mod ranges;
pub mod rate;

use crate::range::{OutOfRange, ParameterRange};
use ranges::LayerRanges;
use rate::RateProperties;

/// One homogeneous, isotropic elastic layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Thickness along the inward normal, mm.
    pub thickness_mm: f64,
    /// Young's modulus at small strain, kPa.
    pub youngs_modulus_kpa: f64,
    /// Poisson's ratio, 0 to 0.4999.
    pub poisson_ratio: f64,
}

impl Layer {
    /// Shear modulus µ = E / (2 (1 + ν)), kPa.
    pub fn shear_modulus_kpa(&self) -> f64 {
        self.youngs_modulus_kpa / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// First Lamé parameter λ = E ν / ((1 + ν)(1 − 2 ν)), kPa.
    pub fn first_lame_kpa(&self) -> f64 {
        let nu = self.poisson_ratio;
        self.youngs_modulus_kpa * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }

    /// Bulk modulus K = E / (3 (1 − 2 ν)), kPa.
    pub fn bulk_modulus_kpa(&self) -> f64 {
        self.youngs_modulus_kpa / (3.0 * (1.0 - 2.0 * self.poisson_ratio))
    }

    fn validate(&self, path: &str, allowed: &LayerRanges) -> Result<(), OutOfRange> {
        let check = |range: &ParameterRange, name: &str, value| range.check(&format!("{path}.{name}"), value);
        check(&allowed.thickness, "thickness_mm", self.thickness_mm)?;
        check(&allowed.youngs_modulus, "youngs_modulus_kpa", self.youngs_modulus_kpa)?;
        check(&allowed.poisson_ratio, "poisson_ratio", self.poisson_ratio)
    }
}

/// Which layer of the wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LayerKind {
    /// The membrane between vitreous and retina.
    InnerLimitingMembrane,
    /// A sublayer of the retina, counted from the vitreous; 0 where the retina is one layer.
    Retina(usize),
    /// Choroid with Bruch's membrane and the pigment epithelium.
    Choroid,
    /// Sclera.
    Sclera,
}

impl LayerKind {
    /// Path of the layer inside a scene, for example `tissue.retina[2]`.
    pub fn path(self) -> String {
        match self {
            Self::InnerLimitingMembrane => "tissue.inner_limiting_membrane".to_owned(),
            Self::Retina(index) => format!("tissue.retina[{index}]"),
            Self::Choroid => "tissue.choroid".to_owned(),
            Self::Sclera => "tissue.sclera".to_owned(),
        }
    }
}

/// A layer and which one it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedLayer {
    /// Which layer of the wall.
    pub kind: LayerKind,
    /// Its thickness and stiffness.
    pub layer: Layer,
}

/// How the retina holds on to the pigment epithelium under it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetinalBond {
    /// Largest traction, kPa.
    pub strength_kpa: f64,
    /// Energy that letting go costs, mN/mm (the same number in N/m).
    pub fracture_energy_mn_per_mm: f64,
    /// Power with which both grow with the speed of opening, in sequences; 0: they do not.
    pub rate_exponent: f64,
    /// Speed of opening from about which on they grow, mm/s.
    pub reference_speed_mm_per_s: f64,
}

impl Default for RetinalBond {
    fn default() -> Self {
        Self {
            strength_kpa: ranges::BOND_STRENGTH.default,
            fracture_energy_mn_per_mm: ranges::FRACTURE_ENERGY.default,
            rate_exponent: ranges::BOND_RATE_EXPONENT.default,
            reference_speed_mm_per_s: ranges::BOND_REFERENCE_SPEED.default,
        }
    }
}

/// The eye wall, from the vitreous outwards.
#[derive(Debug, Clone, PartialEq)]
pub struct Tissue {
    /// The inner limiting membrane; `None` (the default) leaves it out.
    pub inner_limiting_membrane: Option<Layer>,
    /// The retina: one layer, or its sublayers from the vitreous outwards.
    pub retina: Vec<Layer>,
    /// Choroid with Bruch's membrane and the pigment epithelium, with its transverse, drained stiffness.
    pub choroid: Layer,
    /// Sclera.
    pub sclera: Layer,
    /// The bond between retina and choroid.
    pub bond: RetinalBond,
    /// What depends on time.
    pub rate: RateProperties,
}

/// Young's moduli of five layers of the rabbit retina in vivo, from the vitreous outwards, kPa (PMC5783626, acoustic radiation
/// force optical coherence elastography).
pub const RABBIT_SUBLAYER_MODULI_KPA: [f64; 5] = [3.09, 3.82, 4.53, 6.59, 16.11];

impl Default for Tissue {
    /// Retina as one layer on choroid and sclera, no inner limiting membrane, every number the default of its range.
    fn default() -> Self {
        Self {
            inner_limiting_membrane: None,
            retina: vec![ranges::RETINA.default_layer()],
            choroid: ranges::CHOROID.default_layer(),
            sclera: ranges::SCLERA.default_layer(),
            bond: RetinalBond::default(),
            rate: RateProperties::default(),
        }
    }
}

impl Tissue {
    /// The default wall with the inner limiting membrane on it.
    pub fn with_inner_limiting_membrane() -> Self {
        Self { inner_limiting_membrane: Some(ranges::INNER_LIMITING_MEMBRANE.default_layer()), ..Self::default() }
    }

    /// The default wall with the retina as five sublayers of equal thickness and [`RABBIT_SUBLAYER_MODULI_KPA`].
    ///
    /// The source gives moduli and not thicknesses, so equal thickness is a choice (unverified).
    pub fn rabbit_sublayers() -> Self {
        let whole = ranges::RETINA.default_layer();
        let thickness_mm = whole.thickness_mm / RABBIT_SUBLAYER_MODULI_KPA.len() as f64;
        let sublayer = |youngs_modulus_kpa| Layer { thickness_mm, youngs_modulus_kpa, ..whole };
        Self { retina: RABBIT_SUBLAYER_MODULI_KPA.map(sublayer).to_vec(), ..Self::default() }
    }

    /// All layers from the vitreous outwards.
    pub fn layers(&self) -> Vec<NamedLayer> {
        let membrane = self.inner_limiting_membrane.map(|layer| (LayerKind::InnerLimitingMembrane, layer));
        let retina = self.retina.iter().enumerate().map(|(index, layer)| (LayerKind::Retina(index), *layer));
        let backing = [(LayerKind::Choroid, self.choroid), (LayerKind::Sclera, self.sclera)];
        membrane.into_iter().chain(retina).chain(backing).map(|(kind, layer)| NamedLayer { kind, layer }).collect()
    }

    /// Thickness of the retina, all sublayers together and without the inner limiting membrane, mm.
    pub fn retina_thickness_mm(&self) -> f64 {
        self.retina.iter().map(|layer| layer.thickness_mm).sum()
    }

    /// Young's modulus of the softest part of the retina, kPa.
    pub fn softest_retina_kpa(&self) -> f64 {
        self.retina.iter().fold(f64::INFINITY, |low, layer| low.min(layer.youngs_modulus_kpa))
    }

    /// Holds every number against [`ranges`]; the retina's thickness both by sublayer and as a sum.
    ///
    /// Fails with the first field that is outside, from the vitreous outwards.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        ranges::RETINA_SUBLAYER_COUNT.check("tissue.retina", self.retina.len() as f64)?;
        for NamedLayer { kind, layer } in self.layers() {
            let allowed = match kind {
                LayerKind::InnerLimitingMembrane => &ranges::INNER_LIMITING_MEMBRANE,
                LayerKind::Retina(_) => &ranges::RETINA_SUBLAYER,
                LayerKind::Choroid => &ranges::CHOROID,
                LayerKind::Sclera => &ranges::SCLERA,
            };
            layer.validate(&kind.path(), allowed)?;
        }
        ranges::BOND_STRENGTH.check("tissue.bond.strength_kpa", self.bond.strength_kpa)?;
        let energy = self.bond.fracture_energy_mn_per_mm;
        ranges::FRACTURE_ENERGY.check("tissue.bond.fracture_energy_mn_per_mm", energy)?;
        ranges::BOND_RATE_EXPONENT.check("tissue.bond.rate_exponent", self.bond.rate_exponent)?;
        let speed = self.bond.reference_speed_mm_per_s;
        ranges::BOND_REFERENCE_SPEED.check("tissue.bond.reference_speed_mm_per_s", speed)?;
        ranges::RETINA.thickness.check("tissue.retina.thickness_mm", self.retina_thickness_mm())?;
        self.rate.validate()
    }
}
