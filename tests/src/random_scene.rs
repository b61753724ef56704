//! Random scenes and requests over the whole ranges, for the search for trouble and the audit of effects.
//!
//! Contract: a scene and a request are plain numbers ([`SceneNumbers`], [`RequestNumbers`]) that can be written down, read back and looked at. They are drawn
//! from numbers between 0 and 1 ([`Units`]), of which 0 always stands for the plainest choice: setting units to 0 shrinks a case towards the default scene under the default
//! needle. A number with a range is its default, its ends or anything between (logarithmically where it spans more than a decade). Units: mm, mN, kPa, degrees.
//!
//! Not here: user meshes (hard cases and service tests have those), what comes of the requests.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Quaternion, Unit, UnitQuaternion, Vector3, Vector4};
use retina_core::effects::EFFECT_NAMES;
use retina_core::needle::shape::{BEVEL_ANGLE, EDGE_FRACTION_OF_RADIUS, EDGE_RADIUS, RADIUS};
use retina_core::needle::{Needle, NeedleShape, Tip};
use retina_core::predict::{Control, EffectChoice, Level, PUNCTURE_PRESSURE_PER_MODULUS, Request};
use retina_core::range::ParameterRange;
use retina_core::scene::conditions::{EYE_PRESSURE, FRICTION_COEFFICIENT};
use retina_core::scene::puncture::Puncture;
use retina_core::scene::{LEAST_PIT_FLOOR_MM, Scene, SceneSurface};
use retina_core::surface::{EYE_RADIUS, PIT_DEPTH, PIT_SIGMA};
use retina_core::tissue::ranges::{
    BOND_STRENGTH, CHOROID, FRACTURE_ENERGY, INNER_LIMITING_MEMBRANE, LayerRanges, RETINA, RETINA_SUBLAYER, SCLERA,
};
use retina_core::tissue::{Layer, RetinalBond, Tissue};
use serde::{Deserialize, Serialize};

/// Units that a scene is drawn from.
pub const SCENE_UNITS: usize = 40;
/// Units that a request is drawn from.
pub const REQUEST_UNITS: usize = 32;

/// Shares of the draws that take a parameter's default, its least and its greatest value; the others take anything between.
const AT_DEFAULT: f64 = 0.4;
/// See [`AT_DEFAULT`].
const AT_LEAST: f64 = 0.44;
/// See [`AT_DEFAULT`].
const AT_GREATEST: f64 = 0.48;
/// Ratio of the ends of a range from which on it is drawn logarithmically.
const DECADE: f64 = 10.0;
/// Tips start this far from the patch's centre at most (mm): a little beyond its edge.
const REACH_MM: f64 = 1.1;
/// Largest tilt of needles (degrees): a little beyond what is allowed.
const MAX_TILT_DEG: f64 = 78.0;
/// Largest angle between needle and force (degrees).
const MAX_LEAN_DEG: f64 = 30.0;
/// Largest force in the puncture limit.
const LARGEST_SHARE: f64 = 1.1;
/// Smallest force of the common draws in the puncture limit.
const COMMON_SHARE: f64 = 0.01;
/// Smallest force other than zero (mN).
const SMALLEST_FORCE_MN: f64 = 1e-9;

/// Numbers between 0 and 1, used up one after the other; 0 when there are no more.
pub struct Units<'a> {
    left: std::slice::Iter<'a, f64>,
}

impl<'a> Units<'a> {
    /// These numbers.
    pub fn new(units: &'a [f64]) -> Self {
        Units { left: units.iter() }
    }

    fn next(&mut self) -> f64 {
        self.left.next().copied().unwrap_or(0.0)
    }

    /// One of the choices; 0 takes the first.
    fn choice<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[((self.next() * choices.len() as f64) as usize).min(choices.len() - 1)]
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn ranged(&mut self, range: &ParameterRange) -> f64 {
        let unit = self.next();
        if unit < AT_DEFAULT {
            return range.default;
        } else if unit < AT_LEAST {
            return range.min;
        } else if unit < AT_GREATEST {
            return range.max;
        }
        let share = (unit - AT_GREATEST) / (1.0 - AT_GREATEST);
        if range.min > 0.0 && range.max / range.min > DECADE {
            (range.min.ln() + share * (range.max / range.min).ln()).exp().clamp(range.min, range.max)
        } else {
            range.min + share * (range.max - range.min)
        }
    }

    fn layer(&mut self, ranges: &LayerRanges) -> LayerNumbers {
        LayerNumbers {
            thickness_mm: self.ranged(&ranges.thickness),
            youngs_modulus_kpa: self.ranged(&ranges.youngs_modulus),
            poisson_ratio: self.ranged(&ranges.poisson_ratio),
        }
    }
}

/// A layer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerNumbers {
    /// Thickness (mm).
    pub thickness_mm: f64,
    /// Young's modulus (kPa).
    pub youngs_modulus_kpa: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
}

impl LayerNumbers {
    fn layer(self) -> Layer {
        let LayerNumbers { thickness_mm, youngs_modulus_kpa, poisson_ratio } = self;
        Layer { thickness_mm, youngs_modulus_kpa, poisson_ratio }
    }
}

/// A scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneNumbers {
    /// Radius of the eye's ball (mm); none on a plane.
    pub ball_mm: Option<f64>,
    /// Depth and width of a foveal pit (mm).
    pub pit_mm: Option<[f64; 2]>,
    /// The inner limiting membrane.
    pub membrane: Option<LayerNumbers>,
    /// The retina's sublayers.
    pub retina: Vec<LayerNumbers>,
    /// The choroid.
    pub choroid: LayerNumbers,
    /// The sclera.
    pub sclera: LayerNumbers,
    /// Strength (kPa) and fracture energy (mN/mm) of the bond.
    pub bond: [f64; 2],
    /// Coulomb's coefficient.
    pub friction_coefficient: f64,
    /// Pressure at rest and now (kPa).
    pub pressures_kpa: [f64; 2],
}

impl SceneNumbers {
    /// Draws a scene.
    pub fn draw(units: &[f64]) -> Self {
        let mut units = Units::new(units);
        let kind = units.choice(&[0, 1, 2]);
        let retina_mm = units.ranged(&RETINA.thickness);
        let count = if units.next() < 0.85 { 1 } else { units.choice(&[2, 3, 5]) };
        let retina = (0..count)
            .map(|_| LayerNumbers {
                thickness_mm: retina_mm / count as f64,
                youngs_modulus_kpa: units.ranged(&RETINA_SUBLAYER.youngs_modulus),
                poisson_ratio: units.ranged(&RETINA_SUBLAYER.poisson_ratio),
            })
            .collect();
        let choroid = units.layer(&CHOROID);
        let sclera = units.layer(&SCLERA);
        let membrane = (units.next() >= 0.8).then(|| units.layer(&INNER_LIMITING_MEMBRANE));
        let ball_mm = (kind > 0).then(|| units.ranged(&EYE_RADIUS));
        let deepest = PIT_DEPTH.max.min(retina_mm - LEAST_PIT_FLOOR_MM);
        let pit_mm = (kind == 2).then(|| [units.ranged(&PIT_DEPTH).min(deepest), units.ranged(&PIT_SIGMA)]);
        let friction_coefficient = if units.next() < 0.4 { 0.0 } else { units.ranged(&FRICTION_COEFFICIENT) };
        let changed = units.next() >= 0.6;
        let rest = units.ranged(&EYE_PRESSURE);
        let now = if changed { units.ranged(&EYE_PRESSURE) } else { rest };
        let bond = [units.ranged(&BOND_STRENGTH), units.ranged(&FRACTURE_ENERGY)];
        SceneNumbers {
            ball_mm,
            pit_mm,
            membrane,
            retina,
            choroid,
            sclera,
            bond,
            friction_coefficient,
            pressures_kpa: [rest, now],
        }
    }

    /// The scene.
    pub fn scene(&self) -> Scene {
        let surface = match (self.ball_mm, self.pit_mm) {
            (None, _) => SceneSurface::Flat,
            (Some(radius_mm), None) => SceneSurface::Sphere { radius_mm },
            (Some(radius_mm), Some([depth_mm, sigma_mm])) => SceneSurface::FovealPit { radius_mm, depth_mm, sigma_mm },
        };
        let [strength_kpa, fracture_energy_mn_per_mm] = self.bond;
        let tissue = Tissue {
            inner_limiting_membrane: self.membrane.map(LayerNumbers::layer),
            retina: self.retina.iter().map(|layer| layer.layer()).collect(),
            choroid: self.choroid.layer(),
            sclera: self.sclera.layer(),
            bond: RetinalBond { strength_kpa, fracture_energy_mn_per_mm, ..RetinalBond::default() },
            ..Tissue::default()
        };
        let [rest_pressure_kpa, pressure_kpa] = self.pressures_kpa;
        Scene {
            name: "random".to_owned(),
            surface,
            tissue,
            scene_from_patch: Isometry3::identity(),
            friction_coefficient: self.friction_coefficient,
            pressure_kpa,
            rest_pressure_kpa,
            puncture: Puncture::default(),
            bleb: None,
        }
    }
}

/// A request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RequestNumbers {
    /// Radius of the needle (mm).
    pub radius_mm: f64,
    /// Edge radius (mm) of a tip that has one.
    pub edge_radius_mm: Option<f64>,
    /// Angle of a bevel (degrees).
    pub bevel_deg: Option<f64>,
    /// Foremost point (mm).
    pub tip_mm: [f64; 3],
    /// Orientation, x, y, z, w.
    pub orientation_xyzw: [f64; 4],
    /// Force (mN); none under pose control.
    pub force_mn: Option<[f64; 3]>,
    /// `["auto"]`, `["all"]` or names.
    pub effects: Vec<String>,
}

impl RequestNumbers {
    /// Draws a request to a scene.
    pub fn draw(units: &[f64], scene: &SceneNumbers) -> Self {
        let mut units = Units::new(units);
        let kind = units.choice(&[0, 0, 1, 2]);
        let radius_mm = units.ranged(&RADIUS);
        let fraction = if units.next() < 0.5 { EDGE_FRACTION_OF_RADIUS } else { units.next() };
        let edge_radius_mm = (kind > 0).then(|| (fraction * radius_mm).clamp(EDGE_RADIUS.min, radius_mm));
        let bevel_deg = (kind == 2).then(|| units.ranged(&BEVEL_ANGLE));
        let upright = units.next();
        let tilt = MAX_TILT_DEG.to_radians() * upright * upright;
        let azimuth = units.between(0.0, 2.0 * PI);
        let points =
            Unit::new_normalize(Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), -tilt.cos()));
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), units.between(0.0, 2.0 * PI));
        let shape = NeedleShape::hemispherical(radius_mm);
        let needle = Needle::pointing(shape, Point3::origin(), &points);
        let orientation = needle.orientation * roll;
        let mut offset = || {
            let far = units.next();
            if units.next() < 0.5 { far * REACH_MM } else { -far * REACH_MM }
        };
        let (x, y) = (offset(), offset());
        let posed = units.next() >= 0.8;
        let thickness: f64 = scene.retina.iter().map(|layer| layer.thickness_mm).sum();
        let (z, force_mn) = if posed {
            (-units.between(-0.05, 1.0) * thickness, None)
        } else {
            let softest = scene.retina.iter().map(|layer| layer.youngs_modulus_kpa).fold(f64::INFINITY, f64::min);
            let puncture_mn = PUNCTURE_PRESSURE_PER_MODULUS * softest * PI * radius_mm * radius_mm;
            let (largest, common) = (LARGEST_SHARE * puncture_mn, COMMON_SHARE * puncture_mn);
            let logarithmic = |low: f64, high: f64, unit: f64| (low.ln() + unit * (high / low).ln()).exp();
            let size = match units.next() {
                u if u < 0.86 => logarithmic(common, largest, units.next()),
                u if u < 0.96 => logarithmic(SMALLEST_FORCE_MN, common, units.next()),
                u if u < 0.98 => 0.0,
                _ => logarithmic(largest, 1e3 * largest, units.next()),
            };
            let lean = MAX_LEAN_DEG.to_radians() * units.next();
            let side = units.between(0.0, 2.0 * PI);
            let across = needle.orientation * Vector3::new(side.cos(), side.sin(), 0.0);
            let direction = points.into_inner() * lean.cos() + across * lean.sin();
            let z = if units.next() < 0.8 { 0.1 } else { -thickness * units.next() };
            (z, Some((direction * size).into()))
        };
        // A surface is level at its middle: what it rises to elsewhere the needle starts above.
        let rise = scene.ball_mm.map_or(0.0, |ball| (x * x + y * y) / (2.0 * ball))
            + scene
                .pit_mm
                .map_or(0.0, |[depth, sigma]| depth * (1.0 - (-(x * x + y * y) / (2.0 * sigma * sigma)).exp()));
        let effects = match units.next() {
            u if u < 0.7 => vec!["auto".to_owned()],
            u if u < 0.8 => vec!["all".to_owned()],
            _ => {
                let solid = units.choice(&["finite_strain", "elasticity"]);
                let wanted = EFFECT_NAMES.iter().filter(|name| **name != solid && units.next() < 0.4);
                std::iter::once(solid.to_owned()).chain(wanted.map(|name| (*name).to_owned())).collect()
            }
        };
        RequestNumbers {
            radius_mm,
            edge_radius_mm,
            bevel_deg,
            tip_mm: [x, y, z + rise],
            orientation_xyzw: orientation.coords.into(),
            force_mn,
            effects,
        }
    }

    /// The request at `level`.
    pub fn request(&self, level: Level) -> Request {
        let tip = match (self.edge_radius_mm, self.bevel_deg) {
            (None, _) => Tip::Hemispherical,
            (Some(edge_radius_mm), None) => Tip::Flat { edge_radius_mm },
            (Some(edge_radius_mm), Some(angle_deg)) => Tip::Bevelled { angle_deg, edge_radius_mm },
        };
        let needle = Needle {
            shape: NeedleShape { radius_mm: self.radius_mm, tip },
            tip_mm: Point3::from(self.tip_mm),
            orientation: Unit::new_normalize(Quaternion::from(Vector4::from(self.orientation_xyzw))),
            stiffness_mn_per_mm: None,
        };
        let control = self.force_mn.map_or(Control::Pose, |force| Control::Force(Vector3::from(force)));
        let effects = match self.effects.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["auto"] => EffectChoice::Auto,
            ["all"] => EffectChoice::All,
            _ => EffectChoice::Named(self.effects.clone()),
        };
        Request { needle, control, level, effects }
    }
}

/// The units of number `index` of the stream `stream` of `seed`.
pub fn units(seed: u64, stream: u64, index: u64, count: usize) -> Vec<f64> {
    // Neighbouring seeds must not give neighbouring numbers: the generator's own mixing is applied thrice.
    let mut seeds = fastrand::Rng::with_seed(seed);
    let mut streams = fastrand::Rng::with_seed(seeds.u64(..) ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut random = fastrand::Rng::with_seed(streams.u64(..) ^ index.wrapping_mul(0xd1b5_4a32_d192_ed03));
    (0..count).map(|_| random.f64()).collect()
}

/// Sets units to 0, half of those left at a time and then one by one, while `fails` still holds.
pub fn shrink(mut units: Vec<f64>, fails: impl Fn(&[f64]) -> bool) -> Vec<f64> {
    let mut size = units.len().div_ceil(2);
    while size > 0 {
        for start in (0..units.len()).step_by(size) {
            let mut tried = units.clone();
            let end = (start + size).min(units.len());
            tried[start..end].fill(0.0);
            if tried != units && fails(&tried) {
                units = tried;
            }
        }
        size /= 2;
    }
    units
}
