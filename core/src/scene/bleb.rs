//! Fluid under the retina: how much of it or under which pressure, and where the retina is detached.
//!
//! Contract: one named range a number. Units: mm, mm³ (the same number in µl), kPa.
//!
//! Not here: what the fluid does (`effects::bleb`).

use nalgebra::Point3;

use crate::needle::TIP_COORDINATE;
use crate::range::{OutOfRange, ParameterRange};

/// Volume of the fluid; 0 is none, and the retina rests on the choroid everywhere.
pub const VOLUME: ParameterRange = ParameterRange {
    name: "volume of subretinal fluid",
    unit: "mm3",
    default: 0.02,
    min: 0.0,
    max: 0.5,
    source: "bound of this program: what lifts a disc of 1 mm radius by half of that. 1 mm3 is 1 ul; injections of 50-300 ul detach more than a patch [unverified]",
};

/// Pressure of the fluid above that in the eye, where it is given in place of the volume; 0 is none.
pub const PRESSURE: ParameterRange = ParameterRange {
    name: "pressure of subretinal fluid above that in the eye",
    unit: "kPa",
    default: 0.5,
    min: 0.0,
    max: 8.0,
    source: "bound of this program: the largest pressure in the eye (60 mmHg); no measurement in a bleb was found [unverified]",
};

/// Radius of the detached disc.
pub const RADIUS: ParameterRange = ParameterRange {
    name: "radius of the detached disc",
    unit: "mm",
    default: 0.5,
    min: 0.2,
    max: 1.0,
    source: "bound of this program: a disc that the patch shows whole and the mesh resolves",
};

/// What is known of the fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filling {
    /// Its volume, mm³: the pressure is part of the answer.
    Volume(f64),
    /// Its pressure above that in the eye, kPa: the volume is part of the answer.
    Pressure(f64),
}

impl Filling {
    /// Holds the number against its range.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn validate(&self) -> Result<(), OutOfRange> {
        match *self {
            Filling::Volume(volume_mm3) => VOLUME.check("bleb.volume_mm3", volume_mm3),
            Filling::Pressure(pressure_kpa) => PRESSURE.check("bleb.pressure_kpa", pressure_kpa),
        }
    }

    /// Halfway from here to `end`; `end` where that is another measure.
    pub fn halfway(self, end: Filling) -> Filling {
        match (self, end) {
            (Filling::Volume(start), Filling::Volume(end)) => Filling::Volume(0.5 * (start + end)),
            (Filling::Pressure(start), Filling::Pressure(end)) => Filling::Pressure(0.5 * (start + end)),
            (_, end) => end,
        }
    }
}

/// Fluid between retina and choroid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubretinalFluid {
    /// How much there is of it.
    pub filling: Filling,
    /// Centre of the detached disc, scene coordinates, mm; its depth does not matter.
    pub center_mm: Point3<f64>,
    /// Radius of the detached disc, mm.
    pub radius_mm: f64,
}

impl SubretinalFluid {
    /// Holds every number against its range; fails with the first that is outside.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        self.filling.validate()?;
        RADIUS.check("bleb.radius_mm", self.radius_mm)?;
        for (index, &coordinate) in self.center_mm.coords.iter().enumerate() {
            TIP_COORDINATE.check(&format!("bleb.center_mm[{index}]"), coordinate)?;
        }
        Ok(())
    }

    /// Whether there is nothing of it.
    pub fn is_empty(&self) -> bool {
        matches!(self.filling, Filling::Volume(0.0) | Filling::Pressure(0.0))
    }
}
