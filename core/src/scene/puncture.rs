//! Where the tissue of a scene punctures: a force or a pressure under the needle, and a strain.
//!
//! Contract: one named range a number, with its source; no force and no strain at which a retina punctures is published, so all of them are the caller's to
//! set. Units: mN; the pressure is counted in Young's moduli of the softest retina, a pure number.
//!
//! Not here: what is measured and held against them (`effects::puncture`).

use std::f64::consts::PI;

use crate::range::{OutOfRange, ParameterRange};

/// Force over the needle's cross-section, in Young's moduli of the softest retina.
pub const PRESSURE_PER_MODULUS: ParameterRange = ParameterRange {
    name: "pressure under the needle that punctures, over the retina's modulus",
    unit: "1",
    default: 0.75,
    min: 0.005,
    max: 0.75,
    source: "[unverified] no puncture force of the retina is published. Default and upper bound are the model's own: up to there the finite-element levels \
             converge throughout. A blunt tip reaches one modulus at 0.157 mN with 0.05 mm radius on 20 kPa",
};

/// Force that punctures, whatever the needle.
pub const MAX_FORCE: ParameterRange = ParameterRange {
    name: "force that punctures",
    unit: "mN",
    default: 7.5,
    min: 1e-3,
    max: 100.0,
    source: "no force holds unless one is given; 7.5 mN is that above which breaks and haemorrhage are seen in surgery (PMC3971918), with blunt tools",
};

/// Strain that punctures.
pub const MAX_STRAIN: ParameterRange = ParameterRange {
    name: "largest principal stretch less one that punctures",
    unit: "1",
    default: 1.0,
    min: 0.01,
    max: 5.0,
    source: "[unverified] no failure strain of the retina was found: stretched to twice its length",
};

/// The force under the needle that punctures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PunctureForce {
    /// A pressure over the needle's cross-section, in Young's moduli of the softest retina.
    PressurePerModulus(f64),
    /// A force (mN), whatever the needle.
    Force(f64),
}

/// Where the tissue punctures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Puncture {
    /// The force under the needle.
    pub force: PunctureForce,
    /// |principal stretch − 1| anywhere in the tissue.
    pub max_strain: f64,
}

impl Default for Puncture {
    fn default() -> Self {
        Self { force: PunctureForce::PressurePerModulus(PRESSURE_PER_MODULUS.default), max_strain: MAX_STRAIN.default }
    }
}

impl Puncture {
    /// The force that punctures (mN), under a needle of this radius (mm) on a retina of this Young's modulus (kPa).
    pub fn force_mn(&self, radius_mm: f64, modulus_kpa: f64) -> f64 {
        match self.force {
            PunctureForce::PressurePerModulus(share) => share * modulus_kpa * PI * radius_mm * radius_mm,
            PunctureForce::Force(force_mn) => force_mn,
        }
    }

    /// Holds every number against its range; fails with the first that is outside.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        match self.force {
            PunctureForce::PressurePerModulus(share) => {
                PRESSURE_PER_MODULUS.check("puncture.pressure_per_modulus", share)?;
            }
            PunctureForce::Force(force_mn) => MAX_FORCE.check("puncture.max_force_mn", force_mn)?,
        }
        MAX_STRAIN.check("puncture.max_strain", self.max_strain)
    }
}
