//! What a path is: split, scene, tissue, needle, direction and depths, drawn from the seed and the path's number alone.
//!
//! A number of the tissue is drawn by its *place* in its range (`retina_core::predict::sampled`). Training, validation and test draw it from a
//! triangle over the inner four fifths (places to ±[`INNER`]), and take the built-in tissue as it is for a share of the paths; `hard` puts at least
//! one number of retina or choroid into the outer fifth; `outside` leaves the tissue there and leads the needle beyond the working range.
//! Units: mm, degrees, kPa.
//!
//! Not here: whether the path's equilibria are found (`path`).

use std::f64::consts::TAU;

use clap::ValueEnum;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use retina_core::approach::first_touch;
use retina_core::needle::{Needle, NeedleShape, Tip};
use retina_core::patch::Patch;
use retina_core::predict::sampled::{
    BEVEL_DEG, EDGE_SHARE, INNER, LEAN_DEG as SAMPLED_LEAN_DEG, TILT_DEG, gauge_radii_mm, logarithmic, retina_ranges,
    straight,
};
use retina_core::scene::Scene;
use retina_core::tissue::{Layer, ranges};
use serde::{Deserialize, Serialize};

use crate::sample::Split;

/// Shares of the paths that belong to each split, in the order of [`Split::ALL`].
pub const SPLIT_SHARES: [f64; 5] = [0.80, 0.08, 0.08, 0.03, 0.01];
/// Share of the paths (but of `hard`) on the scene's own tissue.
pub const DEFAULT_TISSUE_SHARE: f64 = 0.3;
/// Shares of half balls and of flat ends; the rest are bevelled.
pub const TIP_SHARES: [f64; 2] = [0.7, 0.15];
/// Share of the flat and bevelled tips that have the default edge and angle.
pub const DEFAULT_TIP_SHARE: f64 = 0.5;
/// First touch reaches this far from the patch's centre in x and y (mm).
pub const REACH_MM: f64 = 0.8;
/// Tilt of `outside` (degrees).
pub const OUTSIDE_TILT_DEG: [f64; 2] = [60.0, 70.0];
/// Angle between needle and direction (degrees).
pub const LEAN_DEG: [f64; 2] = SAMPLED_LEAN_DEG;
/// The same of `outside` (degrees).
pub const OUTSIDE_LEAN_DEG: [f64; 2] = [15.0, 25.0];
/// Radius of `outside`'s needles: thicker than the thickest gauge, up to this (mm).
pub const OUTSIDE_RADIUS_MM: f64 = 0.45;
/// Way of the needle to first touch (mm).
pub const CLEARANCE_MM: [f64; 2] = [0.0, 0.2];
/// Steps of a path.
pub const STEPS: usize = 6;
/// Depth of the last step of a deep path, in shares of what the limits of depth and puncture allow by linear elasticity.
pub const DEEPEST_SHARE: [f64; 2] = [0.8, 1.0];
/// Depths of the steps of a light path, in the same shares, drawn evenly in the logarithm.
pub const LIGHT_SHARE: [f64; 2] = [0.01, 0.3];
/// Exponent of the depth of step k of n of a deep path, (k/n)^γ: below 1 the steps are dense where the motion is large.
pub const DEPTH_EXPONENT: f64 = 0.5;
/// How deep the steps of the paths go.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Depths {
    /// Towards the limits of depth and puncture: what moves most.
    #[default]
    Deep,
    /// From a touch to where the deep ones begin.
    Light,
}

/// Which tips the paths have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Tips {
    /// All of them, by [`TIP_SHARES`].
    #[default]
    All,
    /// Flat ends and bevels, in the proportion that they have there: what is hardest to learn and rarest among all.
    Edged,
}

/// Largest part of the distance to the step before by which a step's depth is drawn back.
pub const JITTER: f64 = 0.5;
/// Poses drawn before a path is given up: one that leans too far off the surface or touches beyond [`REACH_MM`] is drawn again.
const MOST_POSES: usize = 1000;
/// Largest angle of needle and direction to the inward normal (degrees): one degree inside what prediction allows.
const MOST_ANGLE_DEG: f64 = 74.0;

/// A path before it is computed.
pub struct PathPlan {
    /// Its number.
    pub path: u32,
    /// Its split.
    pub split: Split,
    /// Scene: index among the built-in names.
    pub scene_index: u8,
    /// The scene with the path's tissue.
    pub scene: Scene,
    /// Whether the tissue is the built-in one.
    pub default_tissue: bool,
    /// The needle before it moves.
    pub needle: Needle,
    /// The direction in which it is driven.
    pub direction: Unit<Vector3<f64>>,
    /// Depth of each step in shares of what is allowed, ascending.
    pub depth_shares: [f64; STEPS],
}

/// The path's own random numbers: splitmix64 of seed and number, so that neighbours have nothing in common.
fn random(seed: u64, path: u32) -> fastrand::Rng {
    let mut z = seed ^ u64::from(path).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    fastrand::Rng::with_seed(z ^ (z >> 31))
}

/// Draws one path.
struct Draw {
    random: fastrand::Rng,
    split: Split,
    tips: Tips,
}

/// The plan of path number `path` from `seed`, on one of the built-in scenes that `scenes` names by index. `None` if no pose was found.
pub fn plan(seed: u64, path: u32, scenes: &[u8], depths: Depths, tips: Tips) -> Option<PathPlan> {
    let mut random = random(seed, path);
    let mut left = random.f64();
    let drawn = SPLIT_SHARES.iter().position(|share| {
        left -= share;
        left < 0.0
    });
    let split = Split::ALL[drawn.unwrap_or(0)];
    let mut draw = Draw { random, split, tips };
    let scene_index = scenes[draw.random.usize(..scenes.len())];
    let name = Scene::built_in_names()[usize::from(scene_index)];
    let mut scene = Scene::built_in(name)?;
    let default_tissue = draw.random.f64() < DEFAULT_TISSUE_SHARE && split != Split::Hard;
    if !default_tissue {
        draw.tissue(&mut scene);
    }
    let patch = scene.patch(&Point3::origin()).ok()?;
    let beyond = draw.beyond();
    let shape = draw.shape(beyond[0]);
    let (needle, direction) = (0..MOST_POSES).find_map(|_| draw.pose(shape, beyond[1], beyond[2], &patch))?;
    let depth_shares = match depths {
        Depths::Deep => draw.deep(),
        Depths::Light => draw.light(),
    };
    Some(PathPlan { path, split, scene_index, scene, default_tissue, needle, direction, depth_shares })
}

impl Draw {
    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.random.f64()
    }

    /// Whether radius, tilt and lean of the needle lie beyond the working range: at least one of `outside`'s.
    fn beyond(&mut self) -> [bool; 3] {
        let chosen = self.random.u8(1..8);
        [1, 2, 4].map(|bit| self.split == Split::Outside && chosen & bit != 0)
    }

    /// Puts the numbers of retina, choroid and sclera somewhere into their ranges.
    fn tissue(&mut self, scene: &mut Scene) {
        let chosen = match self.split {
            Split::Hard => self.random.u8(1..64),
            _ => 0,
        };
        let mut at = 0;
        let mut place = |draw: &mut Self| {
            let extreme = chosen >> at & 1 == 1;
            at += 1;
            let inner = INNER * (draw.random.f64() + draw.random.f64() - 1.0);
            let outer = (INNER + (1.0 - INNER) * draw.random.f64()) * if draw.random.bool() { 1.0 } else { -1.0 };
            if extreme { outer } else { inner }
        };
        let retina = retina_ranges(scene);
        let mut layer = |draw: &mut Self, range: &ranges::LayerRanges| Layer {
            thickness_mm: straight(&range.thickness, place(draw)),
            youngs_modulus_kpa: logarithmic(&range.youngs_modulus, place(draw)),
            poisson_ratio: straight(&range.poisson_ratio, place(draw)),
        };
        scene.tissue.retina[0] = layer(self, &retina);
        scene.tissue.choroid = layer(self, &ranges::CHOROID);
        scene.tissue.sclera = layer(self, &ranges::SCLERA);
    }

    fn shape(&mut self, beyond: bool) -> NeedleShape {
        let gauges = gauge_radii_mm();
        let radii = if beyond { [gauges[1], OUTSIDE_RADIUS_MM] } else { gauges };
        // The root makes thick needles more frequent: thin ones puncture before they move much.
        let radius_mm = radii[0] + (radii[1] - radii[0]) * self.random.f64().sqrt();
        let kind = match self.tips {
            Tips::All => self.random.f64(),
            Tips::Edged => TIP_SHARES[0] + (1.0 - TIP_SHARES[0]) * self.random.f64(),
        };
        let default = self.random.f64() < DEFAULT_TIP_SHARE;
        let (edge, angle) = (self.between(EDGE_SHARE) * radius_mm, self.between(BEVEL_DEG));
        let mut shape = match kind {
            kind if kind < TIP_SHARES[0] => NeedleShape::hemispherical(radius_mm),
            kind if kind < TIP_SHARES[0] + TIP_SHARES[1] => NeedleShape::flat(radius_mm),
            _ => NeedleShape::bevelled(radius_mm),
        };
        match &mut shape.tip {
            Tip::Flat { edge_radius_mm } if !default => *edge_radius_mm = edge,
            Tip::Bevelled { angle_deg, edge_radius_mm } if !default => (*angle_deg, *edge_radius_mm) = (angle, edge),
            _ => {}
        }
        shape
    }

    /// A needle and its direction, or `None` if it would not touch within reach.
    fn pose(
        &mut self,
        shape: NeedleShape,
        tilted: bool,
        leaning: bool,
        patch: &Patch,
    ) -> Option<(Needle, Unit<Vector3<f64>>)> {
        let tilt = self.between(if tilted { OUTSIDE_TILT_DEG } else { TILT_DEG }).to_radians();
        let azimuth = self.between([0.0, TAU]);
        let points =
            Unit::new_normalize(Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), -tilt.cos()));
        let at = [0, 1].map(|_| self.between([-REACH_MM, REACH_MM]));
        let mut needle = Needle::pointing(shape, patch.surface.column(at[0], at[1]).surface, &points);
        needle.orientation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.between([0.0, TAU]));
        let lean = self.between(if leaning { OUTSIDE_LEAN_DEG } else { LEAN_DEG }).to_radians();
        let side = self.between([0.0, TAU]);
        let clearance = self.between(CLEARANCE_MM);
        let across = needle.orientation * Vector3::new(side.cos(), side.sin(), 0.0);
        let direction = Unit::new_normalize(points.into_inner() * lean.cos() + across * lean.sin());
        let touch = first_touch(&patch.surface, &shape.body(), &needle.scene_from_needle(), &direction)?;
        let steep = |along: &Unit<Vector3<f64>>| along.dot(&touch.inward) < MOST_ANGLE_DEG.to_radians().cos();
        if touch.parameter.iter().any(|c| c.abs() > REACH_MM) || steep(&points) || steep(&direction) {
            return None;
        }
        needle.tip_mm += direction.into_inner() * (touch.travel_mm - clearance);
        Some((needle, direction))
    }

    fn light(&mut self) -> [f64; STEPS] {
        let logarithms = LIGHT_SHARE.map(f64::ln);
        let mut shares = [0.0; STEPS].map(|_: f64| self.between(logarithms).exp());
        shares.sort_by(f64::total_cmp);
        shares
    }

    fn deep(&mut self) -> [f64; STEPS] {
        let deepest = self.between(DEEPEST_SHARE);
        let mut shares = [0.0; STEPS];
        for (step, share) in shares.iter_mut().enumerate() {
            let back = if step + 1 < STEPS { JITTER * self.random.f64() } else { 0.0 };
            *share = deepest * ((step as f64 + 1.0 - back) / STEPS as f64).powf(DEPTH_EXPONENT);
        }
        shares
    }
}
