//! `needle::shaft`: published stiffnesses, and a cantilever against its own differential equation.

use std::f64::consts::PI;

use retina_core::needle::shaft::{
    CANNULA_MM, FREE_LENGTH_MM, PUBLISHED, STEEL_KPA, STIFFNESS, cantilever, stiffness_mn_per_mm, tube,
};
use retina_core::needle::{GAUGES, Gauge};
use retina_tests::tolerance::ROUNDOFF;

#[test]
fn measured_gauges_have_their_measured_stiffness() {
    for (name, gram_force) in [("23G", 8.0), ("25G", 6.8), ("27G", 3.3)] {
        let radius_mm = Gauge::from_name(name).unwrap().radius_mm();
        let stiffness = stiffness_mn_per_mm(radius_mm);
        assert!(PUBLISHED.contains(&(radius_mm, stiffness)), "{name}: {stiffness}");
        assert!((stiffness / (gram_force * 9.80665) - 1.0).abs() < 0.012, "{name}: {stiffness} mN/mm");
    }
    assert_eq!(stiffness_mn_per_mm(Gauge::from_name("25G").unwrap().radius_mm()), STIFFNESS.default);
}

#[test]
fn every_radius_has_a_stiffness_within_range_that_grows_between_measurements() {
    let radii = |from: f64, to: f64| (0..=50).map(move |k| from + (to - from) * f64::from(k) / 50.0);
    for (from, to) in [(0.01, 0.2064), (0.2065, 0.5)] {
        let stiffnesses: Vec<f64> = radii(from, to).map(stiffness_mn_per_mm).collect();
        assert!(stiffnesses.windows(2).all(|pair| pair[0] < pair[1]), "{from} to {to}: {stiffnesses:?}");
    }
    for gauge in GAUGES {
        let stiffness = stiffness_mn_per_mm(gauge.radius_mm());
        println!("{}: {stiffness:.1} mN/mm", gauge.name);
        assert!((STIFFNESS.min..=STIFFNESS.max).contains(&stiffness), "{}: {stiffness}", gauge.name);
    }
    // A cannula yields more than the shaft that it is on, and less than one as thin all along.
    let thin = tube(STEEL_KPA, 0.05, 0.03);
    let all_along = cantilever(FREE_LENGTH_MM, thin, 0.0, thin);
    assert!(stiffness_mn_per_mm(0.05) < 67.0 && stiffness_mn_per_mm(0.05) > 10.0 * all_along);
}

#[test]
fn the_free_length_is_that_of_two_measurements_on_one_shaft() {
    // Force for 1 mm at the tip and 15 mm from it: (L/(L − 15))³ (iovs articleid=2782672).
    let lengths = [(8.0_f64, 67.3_f64), (6.8, 60.5), (3.3, 33.9)].map(|(tip, inside)| {
        let ratio = (inside / tip).cbrt();
        15.0 * ratio / (ratio - 1.0)
    });
    println!("{lengths:.1?} mm");
    assert!(lengths.iter().all(|length| (length - FREE_LENGTH_MM).abs() < 1.3), "{lengths:?}");
}

/// Deflection of the tip under a unit force, by integrating the beam's curvature M/B twice from the built-in end.
fn integrated(length_mm: f64, flexural: impl Fn(f64) -> f64) -> f64 {
    let steps = 200_000;
    let dx = length_mm / steps as f64;
    let (mut slope, mut deflection) = (0.0, 0.0);
    for k in 0..steps {
        let curvature = |x: f64| (length_mm - x) / flexural(x);
        let middle = (k as f64 + 0.5) * dx;
        let next = slope + curvature(middle) * dx;
        deflection += 0.5 * (slope + next) * dx;
        slope = next;
    }
    deflection
}

#[test]
fn a_cantilever_deflects_as_its_differential_equation_says() {
    let (thick, thin) = (tube(STEEL_KPA, 0.257, 0.16), tube(STEEL_KPA, 0.05, 0.03));
    let uniform = cantilever(FREE_LENGTH_MM, thick, 0.0, thick);
    assert!((uniform * FREE_LENGTH_MM.powi(3) / (3.0 * thick) - 1.0).abs() < ROUNDOFF, "3 E I / L³");
    assert!((uniform * integrated(FREE_LENGTH_MM, |_| thick) - 1.0).abs() < 1e-8);
    let stepped = cantilever(FREE_LENGTH_MM, thick, CANNULA_MM, thin);
    let flexural = |x: f64| if x < FREE_LENGTH_MM - CANNULA_MM { thick } else { thin };
    assert!((stepped * integrated(FREE_LENGTH_MM, flexural) - 1.0).abs() < 1e-4);
    assert!(stepped < 0.5 * uniform);
    // A steel tube of 25G with a bore of two thirds is as stiff as measured within the scatter of makers.
    let steel = cantilever(FREE_LENGTH_MM, tube(STEEL_KPA, 0.257, 0.17), 0.0, thick);
    println!("steel tube of 25G: {steel:.1} mN/mm");
    assert!((steel / STIFFNESS.default - 1.0).abs() < 0.15, "{steel}");
    assert!((tube(1.0, 1.0, 0.0) - 0.25 * PI).abs() < ROUNDOFF);
}
