//! What the data sets were drawn from: the requests for which errors were measured and networks trained.
//!
//! A number of the tissue has a *place* in its range: 0 the default, −1 and 1 the ends, between them straight or, for moduli, in the logarithm.
//! Sampled are places to ±[`INNER`]. The tissue has one layer of retina and no membrane, the surface is a built-in one, nothing rubs, and the eye has the pressure
//! at which the surface was measured, and there is no fluid under it. Units: mm, degrees.
//!
//! Not here: how often each is drawn (the data sets), what the errors are (`expected_error`).

use nalgebra::Vector3;

use crate::needle::{Gauge, NeedleShape, Tip};
use crate::range::ParameterRange;
use crate::scene::{LEAST_PIT_FLOOR_MM, Scene, SceneSurface};
use crate::tissue::ranges::{CHOROID, LayerRanges, RETINA, SCLERA};
use crate::tissue::{Layer, Tissue};

/// Largest place in its range of a number that is sampled.
pub const INNER: f64 = 0.8;
/// The thinnest and the thickest needle.
pub const GAUGES: [&str; 2] = ["41G", "23G"];
/// Edge radius of flat and bevelled tips beside the default one, in needle radii.
pub const EDGE_SHARE: [f64; 2] = [0.1, 0.3];
/// Angle of the bevel beside the default one (degrees).
pub const BEVEL_DEG: [f64; 2] = [25.0, 60.0];
/// Tilt of the needle to the patch's z axis (degrees).
pub const TILT_DEG: [f64; 2] = [0.0, 60.0];
/// Largest angle of the needle to the inward normal (degrees): that tilt and the eye's curvature.
pub const ANGLE_DEG: f64 = 65.0;
/// Angle between the needle's axis and the way that it is driven (degrees).
pub const LEAN_DEG: [f64; 2] = [0.0, 15.0];
/// Rounding of places that were computed from numbers.
const ROUNDING: f64 = 1e-9;

/// Radii of the thinnest and the thickest needle (mm).
pub fn gauge_radii_mm() -> [f64; 2] {
    // A name that is not known would give a radius that no shape accepts.
    GAUGES.map(|name| Gauge::from_name(name).map_or(f64::NAN, |gauge| gauge.radius_mm()))
}

/// The number at a place of its range, straight between default and ends.
pub fn straight(range: &ParameterRange, place: f64) -> f64 {
    let end = if place < 0.0 { range.min } else { range.max };
    range.default + place.abs() * (end - range.default)
}

/// The same in the logarithm.
pub fn logarithmic(range: &ParameterRange, place: f64) -> f64 {
    let end = if place < 0.0 { range.min } else { range.max };
    range.default * (end / range.default).powf(place.abs())
}

/// Ranges of the retina of a built-in scene: the scene's own thickness is the default, and a pit leaves its floor.
pub fn retina_ranges(scene: &Scene) -> LayerRanges {
    let pit_mm = match scene.surface {
        SceneSurface::FovealPit { depth_mm, .. } => depth_mm + LEAST_PIT_FLOOR_MM,
        _ => 0.0,
    };
    let thickness = ParameterRange {
        default: scene.tissue.retina_thickness_mm(),
        min: RETINA.thickness.min.max(pit_mm),
        ..RETINA.thickness
    };
    LayerRanges { thickness, ..RETINA }
}

/// Whether scenes like this one were sampled.
pub fn has_scene(scene: &Scene) -> bool {
    let built_in = Scene::built_in_names().iter().filter_map(|name| Scene::built_in(name));
    let mut alike = built_in.filter(|known| known.surface == scene.surface);
    !matches!(scene.surface, SceneSurface::Mesh(_))
        && scene.friction_coefficient == 0.0
        && scene.pressure_change_kpa() == 0.0
        && scene.bleb.is_none_or(|fluid| fluid.is_empty())
        && alike.any(|known| has_tissue(&known, &scene.tissue))
}

/// Whether tissue like this one was sampled on a built-in scene.
fn has_tissue(known: &Scene, tissue: &Tissue) -> bool {
    let [retina] = tissue.retina[..] else { return false };
    let layers = [(retina, retina_ranges(known)), (tissue.choroid, CHOROID), (tissue.sclera, SCLERA)];
    let numbers =
        Tissue { retina: vec![retina], choroid: tissue.choroid, sclera: tissue.sclera, ..known.tissue.clone() };
    numbers == *tissue && layers.iter().all(|(layer, ranges)| has_layer(layer, ranges))
}

fn has_layer(layer: &Layer, ranges: &LayerRanges) -> bool {
    let between =
        |value: f64, low: f64, high: f64| (low - ROUNDING * low.abs()..=high * (1.0 + ROUNDING)).contains(&value);
    between(layer.thickness_mm, straight(&ranges.thickness, -INNER), straight(&ranges.thickness, INNER))
        && between(
            layer.youngs_modulus_kpa,
            logarithmic(&ranges.youngs_modulus, -INNER),
            logarithmic(&ranges.youngs_modulus, INNER),
        )
        && between(layer.poisson_ratio, straight(&ranges.poisson_ratio, -INNER), straight(&ranges.poisson_ratio, INNER))
}

/// Whether a needle that points along `points` and is driven along `driven` (unit vectors in patch coordinates) was sampled.
pub fn has_drive(points: &Vector3<f64>, driven: &Vector3<f64>) -> bool {
    let within = |cosine: f64, [_, most_deg]: [f64; 2]| cosine >= most_deg.to_radians().cos() - ROUNDING;
    within(-points.z, TILT_DEG) && within(points.dot(driven), LEAN_DEG)
}

/// Whether needles like this one were sampled.
pub fn has_needle(shape: &NeedleShape) -> bool {
    let [thin_mm, thick_mm] = gauge_radii_mm();
    let radius_mm = shape.radius_mm;
    let within = |[low, high]: [f64; 2], value: f64| (low..=high).contains(&value);
    (thin_mm..=thick_mm).contains(&radius_mm)
        && match shape.tip {
            Tip::Hemispherical => true,
            Tip::Flat { edge_radius_mm } => {
                *shape == NeedleShape::flat(radius_mm) || within(EDGE_SHARE, edge_radius_mm / radius_mm)
            }
            Tip::Bevelled { angle_deg, edge_radius_mm } => {
                *shape == NeedleShape::bevelled(radius_mm)
                    || within(EDGE_SHARE, edge_radius_mm / radius_mm) && within(BEVEL_DEG, angle_deg)
            }
        }
}
