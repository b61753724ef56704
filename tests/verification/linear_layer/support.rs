//! Beds, tools, tolerances and the comparison that all checks share. Units mm, mN, kPa.

use retina_core::layered::{BedBase, BedLayer, LayeredBed, LinearBed, RigidProfile};

/// Quadrature of the loads against tables whose own refinement stopped at 1e-5 of the largest value.
pub const TABLE: f64 = 2e-5;
/// Surface under and around a tool of known pressure, of the largest displacement: second order in the grid's ratio 1.107, squared 1e-2,
/// times the share of the last stretches, about a tenth.
pub const SMOOTH_SHAPES: f64 = 1.5e-3;
/// The same where the pressure jumps at the rim, so that the tool's slope there is infinite: the last stretch before the rim counts fully.
pub const JUMP_SHAPES: f64 = 4e-3;
/// Ring pressures over the mean pressure, inside of 3/4 of the contact: second order in the ring ratio.
pub const PRESSURES: f64 = 1e-2;
/// Depth and force of a smooth contact: what is left of the second order in the ring ratio, measured at most 9e-4.
pub const CONTACT: f64 = 1e-3;
/// Contact three or more layer thicknesses wide: the rings are then as wide as the layer.
pub const WIDE_CONTACT: f64 = 5e-3;
/// Work of ring forces on ring means: the pressure is taken as uniform on rings a tenth of their radius wide.
pub const RING_WORK: f64 = 5e-3;
/// A bed of 100 m stands for the half-space: radius over thickness is below 1e-4.
pub const HALF_SPACE_MM: f64 = 1e5;
/// A flat punch on a half-space is solved exactly but for the finite bed (a/h < 1e-5) and interpolation in the radius.
pub const PUNCH: f64 = 1e-3;

pub fn single(e: f64, nu: f64, h: f64) -> LayeredBed {
    let layer = BedLayer { thickness_mm: h, youngs_modulus_kpa: e, poisson_ratio: nu };
    LayeredBed { layers: vec![layer], base: BedBase::Bonded }
}

pub fn prepare(bed: &LayeredBed) -> LinearBed {
    LinearBed::prepare(bed).expect("valid bed")
}

pub fn heights(bed: &LinearBed, f: impl Fn(f64) -> f64) -> Vec<f64> {
    bed.sample_radii_mm().iter().map(|&r| f(r)).collect()
}

pub fn smooth(heights_mm: &[f64]) -> RigidProfile<'_> {
    RigidProfile { heights_mm, edge: None }
}

#[track_caller]
pub fn close(name: &str, got: f64, want: f64, tolerance: f64) {
    let error = (got - want).abs() / want.abs();
    println!("{name}: {got:.6e} wanted {want:.6e} relative error {error:.2e}");
    assert!(error <= tolerance, "{name}: {got} wanted {want}, relative error {error:e} > {tolerance:e}");
}

pub fn eye_wall() -> LayeredBed {
    let layer =
        |thickness_mm, youngs_modulus_kpa, poisson_ratio| BedLayer { thickness_mm, youngs_modulus_kpa, poisson_ratio };
    LayeredBed {
        layers: vec![layer(0.25, 20.0, 0.49), layer(0.3, 6.0, 0.3), layer(0.6, 2000.0, 0.45)],
        base: BedBase::Bonded,
    }
}

/// A membrane of 1 µm, a thousand times as stiff, on the retina.
pub fn membrane_wall() -> LayeredBed {
    let mut bed = eye_wall();
    bed.layers.insert(0, BedLayer { thickness_mm: 0.001, youngs_modulus_kpa: 20_000.0, poisson_ratio: 0.45 });
    bed
}
