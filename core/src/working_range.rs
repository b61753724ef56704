//! Random requests over the working range: what measuring programs and tests draw their samples from.
//!
//! A request is a needle of a common gauge over the patch, tilted by up to 60°, pushed within 15° of its axis with a force between a
//! light touch and the puncture limit. Everything follows from the seed.

use std::f64::consts::{PI, TAU};

use crate::needle::{Gauge, Needle, NeedleShape};
use crate::predict::{Control, EffectChoice, Level, PUNCTURE_PRESSURE_PER_MODULUS, Request};
use crate::tissue::Tissue;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

/// Gauges of the working range.
pub const GAUGES: [&str; 4] = ["41G", "27G", "25G", "23G"];
/// Tip positions reach this far from the patch's centre (mm).
const REACH_MM: f64 = 0.8;
/// Largest tilt of the needle (degrees).
const MAX_TILT_DEG: f64 = 60.0;
/// Largest angle between needle and force (degrees).
const MAX_FORCE_ANGLE_DEG: f64 = 15.0;
/// Smallest force over cross-section, in Young's moduli of the retina.
const SMALLEST_PRESSURE: f64 = 0.02;
/// Share of the puncture limit that the largest force takes.
const LARGEST_SHARE: f64 = 0.98;

/// Draws requests for one tissue.
pub struct WorkingRange {
    random: fastrand::Rng,
    modulus_kpa: f64,
}

impl WorkingRange {
    /// Requests on `tissue`, from `seed`.
    pub fn new(tissue: &Tissue, seed: u64) -> Self {
        WorkingRange { random: fastrand::Rng::with_seed(seed), modulus_kpa: tissue.softest_retina_kpa() }
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.f64()
    }

    /// The radius of a gauge drawn at random (mm).
    pub fn radius_mm(&mut self) -> f64 {
        let gauge = self.random.choice(GAUGES).unwrap_or(GAUGES[0]);
        Gauge::from_name(gauge).map_or(0.25, |g| g.radius_mm())
    }

    /// The next request at `level`, force control, effects chosen by `auto`.
    pub fn request(&mut self, level: Level) -> Request {
        let radius_mm = self.radius_mm();
        let shape = match self.random.u8(0..4) {
            0 => NeedleShape::flat(radius_mm),
            1 => NeedleShape::bevelled(radius_mm),
            _ => NeedleShape::hemispherical(radius_mm),
        };
        self.request_with(shape, level)
    }

    /// The next request with this needle.
    pub fn request_with(&mut self, shape: NeedleShape, level: Level) -> Request {
        let tilt = self.between(0.0, MAX_TILT_DEG).to_radians();
        let azimuth = self.between(0.0, TAU);
        let points =
            Unit::new_normalize(Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), -tilt.cos()));
        let tip = Point3::new(self.between(-REACH_MM, REACH_MM), self.between(-REACH_MM, REACH_MM), 0.1);
        let mut needle = Needle::pointing(shape, tip, &points);
        needle.orientation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.between(0.0, TAU));
        let lean = self.between(0.0, MAX_FORCE_ANGLE_DEG).to_radians();
        let side = self.between(0.0, TAU);
        let across = needle.orientation * Vector3::new(side.cos(), side.sin(), 0.0);
        let direction = points.into_inner() * lean.cos() + across * lean.sin();
        let largest = LARGEST_SHARE * PUNCTURE_PRESSURE_PER_MODULUS;
        let pressure = self.between(SMALLEST_PRESSURE.ln(), largest.ln()).exp();
        let force = pressure * self.modulus_kpa * PI * shape.radius_mm * shape.radius_mm;
        Request { needle, control: Control::Force(direction * force), level, effects: EffectChoice::Auto }
    }
}
