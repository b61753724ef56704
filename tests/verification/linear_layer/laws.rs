//! Laws that hold for every bed and tool: superposition, reciprocity, equivalence of stacks, no pull, no penetration. Units mm, mN, kPa.

use retina_core::layered::kernel::surface_compliance_real;
use retina_core::layered::{
    BedBase, BedLayer, Indentation, LayeredBed, LayeredError, LinearBed, ProfileEdge, RigidProfile,
};

use super::support::*;

#[test]
fn a_stack_of_equal_layers_is_one_layer() {
    let whole = single(20.0, 0.4999, 0.4);
    let mut split = whole.clone();
    split.layers = [0.001, 0.299, 0.1].map(|h| BedLayer { thickness_mm: h, ..whole.layers[0] }).to_vec();
    for k in [1e-3, 0.1, 1.0, 10.0, 100.0, 3000.0] {
        let (one, many) = (surface_compliance_real(&whole, k), surface_compliance_real(&split, k));
        // Rounding: one part in 1e16, magnified by 1/(kh)³ at small kh (a bonded incompressible layer hardly yields).
        let scale = whole.layers[0].half_space_normal();
        assert!((one.normal - many.normal).abs() <= 1e-9 * one.normal.abs().max(1e-5 * scale), "{k} {one:?} {many:?}");
        assert!((one.radial - many.radial).abs() <= 1e-9 * one.radial.abs().max(1e-5 * scale), "{k} {one:?} {many:?}");
    }
    // Through the whole path, where the split bed's top layer is smaller than the rings: equal up to the tables' interpolation.
    let (whole, split) = (prepare(&whole), prepare(&split));
    let heights = heights(&whole, |r| r * r / 0.4);
    let (one, many) = [&whole, &split].map(|bed| bed.indent_by_force(&smooth(&heights), 0.5).expect("contact")).into();
    close("depth on a split bed", many.depth_mm, one.depth_mm, 1e-4);
}

#[test]
fn a_stiff_base_layer_is_a_rigid_base() {
    // 1e5 times stiffer: what is left of its own compliance is of order 1e-5 of the layer's half-space.
    let rigid = single(20.0, 0.49, 0.25);
    let mut stiff = rigid.clone();
    stiff.layers.push(BedLayer { thickness_mm: 1.0, youngs_modulus_kpa: 2e6, poisson_ratio: 0.3 });
    let scale = rigid.layers[0].half_space_normal();
    for k in [0.01, 0.5, 4.0, 30.0] {
        let (a, b) = (surface_compliance_real(&rigid, k), surface_compliance_real(&stiff, k));
        assert!(
            (a.normal - b.normal).abs() < 4e-5 * scale && (a.radial - b.radial).abs() < 4e-5 * scale,
            "{k} {a:?} {b:?}"
        );
    }
}

#[test]
fn punches_are_reciprocal() {
    // Betti: the pressure of a wide punch b works on the surface under a narrow punch a what a's force works on b's depth: d_b.
    // The wide punch's ring forces meet the rings' area means of u_z, hence second order in the ring width.
    for bed in [eye_wall(), membrane_wall()] {
        let bed = prepare(&bed);
        let samples = bed.sample_radii_mm().to_vec();
        let depths = bed.stretch_depths_mm_per_mn();
        for (narrow, wide) in [(20, 40), (30, 45), (40, 50), (50, 60)] {
            let mut load = Indentation::default();
            load.stretch_forces_mn.resize(narrow + 1, 0.0);
            load.stretch_forces_mn[narrow] = 1.0;
            let response = bed.surface_response(&load);
            let ring_forces = bed.stretch_ring_forces(wide);
            close("sum of ring forces", ring_forces.iter().sum(), 1.0, 1e-9);
            let parts = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0].map(|i| i / 16.0);
            let work: f64 = samples
                .windows(2)
                .zip(ring_forces)
                .map(|(t, force)| {
                    let (inner, outer) = (t[0] * t[0], t[1] * t[1]);
                    let mean: f64 =
                        parts.iter().map(|x| response.displacement((inner + x * (outer - inner)).sqrt()).1).sum();
                    -mean / 8.0 * force
                })
                .sum();
            close(&format!("reciprocity {narrow} {wide}"), work, depths[wide], RING_WORK);
        }
    }
}

#[test]
fn linear_and_exact_zero() {
    let mut bed = eye_wall();
    let soft = prepare(&bed);
    bed.layers.iter_mut().for_each(|layer| layer.youngs_modulus_kpa *= 3.0);
    let stiff = prepare(&bed);
    let heights = heights(&soft, |r| r * r / 0.4);
    let one = soft.indent_by_force(&smooth(&heights), 0.2).expect("contact");
    let three = stiff.indent_by_force(&smooth(&heights), 0.6).expect("contact");
    close("three times force on three times stiffness", three.depth_mm, one.depth_mm, 1e-11);
    let none = soft.indent_by_force(&smooth(&heights), 0.0).expect("no contact");
    assert_eq!((none.depth_mm, none.contact_radius_mm), (0.0, 0.0));
    let response = soft.surface_response(&none);
    for r in [0.0, 0.1, 1.0, 9.0] {
        let (ur, uz) = response.displacement(r);
        assert!(ur == 0.0 && uz == 0.0);
    }
}

#[test]
fn depth_rises_smoothly_with_force() {
    let bed = prepare(&eye_wall());
    let heights = heights(&bed, |r| r * r / 0.4);
    let depth = |force: f64| bed.indent_by_force(&smooth(&heights), force).expect("contact").depth_mm;
    let mut slope_before = f64::INFINITY;
    for step in 1..2000 {
        let force = 5e-4 * f64::from(step);
        let slope = (depth(force * (1.0 + 1e-5)) - depth(force)) / (force * 1e-5);
        // The contact only stiffens: a slope may rise between two forces 0.05 % or more apart by no more than the kinks left, 1 %.
        assert!(slope > 0.0 && slope < 1.01 * slope_before, "at {force}: {slope} after {slope_before}");
        slope_before = slope;
    }
}

/// No stop is penetrated and none pulled: what the contact law promises for any profile.
fn assert_sane(bed: &LinearBed, membrane: bool, heights: &[f64], edge: Option<ProfileEdge>, force: f64) {
    let got = bed.indent_by_force(&RigidProfile { heights_mm: heights, edge }, force).expect("contact");
    assert!(got.stretch_forces_mn.iter().all(|&q| q >= 0.0));
    let pressures = bed.ring_pressures_kpa(&got);
    let highest = pressures.iter().copied().fold(0.0, f64::max);
    // Noise of the grid; a flat punch on a stiff membrane does lift off next to its edge.
    let allowed = if membrane { f64::INFINITY } else { 1e-3 * highest };
    assert!(pressures.iter().all(|&p| p >= -allowed), "{pressures:?}");
    let total: f64 =
        got.stretch_forces_mn.iter().sum::<f64>() + got.partial_punches.iter().map(|p| p.force_mn).sum::<f64>();
    close("forces add up", total, force, 1e-12);
    let response = bed.surface_response(&got);
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let mut deepest = 0.0_f64;
    for (&r, &height) in bed.sample_radii_mm().iter().zip(heights) {
        let tool = height - lowest - got.depth_mm;
        deepest = deepest.max(response.displacement(r).1 - tool);
    }
    println!("force {force}: depth {:.4e}, penetration {:.1e} of it", got.depth_mm, deepest / got.depth_mm);
    // Exact at the stops up to rounding, but for those just outside the unfinished stretch, which is blended from its neighbours.
    assert!(deepest <= 1e-3 * got.depth_mm, "penetrates by {deepest} at {force}");
}

#[test]
fn any_profile_gives_pressure_without_penetration() {
    for bed in [eye_wall(), membrane_wall(), single(20.0, 0.4999, 0.08), single(20.0, 0.3, 5.0)] {
        let membrane = bed.layers[0].thickness_mm < 0.01;
        let bed = prepare(&bed);
        let edge = Some(ProfileEdge { radius_mm: 0.25, height_mm: 0.03 });
        let within = |r: f64, f: f64| if r <= 0.25 { f } else { f64::INFINITY };
        let ball = heights(&bed, |r| r * r / 0.4);
        let wavy = heights(&bed, |r| within(r, 0.03 * (1.0 - (40.0 * r).cos()) + 0.06 * r));
        let bevel = heights(&bed, |r| within(r, 0.05 * (-r / 0.05).exp() + 0.12 * r));
        let hollow = heights(&bed, |r| within(r, if r < 0.2 { f64::INFINITY } else { 0.03 }));
        for force in [1e-6, 1e-3, 0.03, 0.3, 2.0] {
            assert_sane(&bed, membrane, &ball, None, force);
            assert_sane(&bed, membrane, &wavy, edge, force);
            assert_sane(&bed, membrane, &bevel, edge, force);
            assert_sane(&bed, membrane, &hollow, edge, force);
            assert_sane(&bed, membrane, &wavy, None, force);
        }
    }
}

#[test]
fn extreme_beds_are_prepared_and_stay_finite() {
    let layer =
        |thickness_mm, youngs_modulus_kpa, poisson_ratio| BedLayer { thickness_mm, youngs_modulus_kpa, poisson_ratio };
    let springs =
        |normal_kpa_per_mm, tangential_kpa_per_mm| BedBase::Springs { normal_kpa_per_mm, tangential_kpa_per_mm };
    let beds = [
        (vec![layer(0.001, 1e6, 0.49), layer(0.25, 10.0, 0.49999), layer(0.3, 5.0, 0.2)], BedBase::Bonded),
        (vec![layer(0.25, 20.0, 0.49999), layer(0.01, 2e6, 0.3), layer(0.3, 20.0, 0.49999)], BedBase::Bonded),
        (vec![layer(0.02, 20.0, 0.49999)], BedBase::Bonded),
        (vec![layer(0.25, 20.0, -0.5)], springs(0.01, 0.0)),
        (vec![layer(50.0, 20.0, 0.0), layer(0.001, 1e5, 0.4)], springs(1e6, 1e-6)),
    ];
    for (layers, base) in beds {
        let bed = prepare(&LayeredBed { layers, base });
        let depths = bed.stretch_depths_mm_per_mn();
        assert!(depths.iter().all(|&d| d > 0.0 && d.is_finite()));
        // A wider punch of the same force never sinks deeper.
        assert!(depths.windows(2).all(|pair| pair[1] < pair[0]), "{depths:?}");
        let heights = heights(&bed, |r| r * r / 0.4);
        let got = bed.indent_by_depth(&smooth(&heights), 0.004).expect("contact");
        let response = bed.surface_response(&got);
        for r in [0.0, 0.05, 0.3, 1.0, 3.9, 5.0] {
            let (ur, uz) = response.displacement(r);
            // Never deeper than the tip; sideways at most what a thin incompressible layer squeezes out, about a/h of the depth.
            assert!(ur.abs() < 0.02 && uz.abs() < 0.0041, "{r} {ur} {uz}");
        }
    }
}

#[test]
fn nearly_incompressible_converges_to_incompressible() {
    // From 0.499 to 0.4999 to 0.49999 the depth of a punch on a thin bonded layer changes by a tenth each time.
    let depth = |nu: f64| {
        let bed = prepare(&single(20.0, nu, 0.25));
        bed.stretch_depths_mm_per_mn()[45]
    };
    let (a, b, c) = (depth(0.499), depth(0.4999), depth(0.49999));
    close("change per tenth", (b - c) / (a - b), 0.1, 0.1);
}

#[test]
fn bad_input_is_named() {
    let mut bed = eye_wall();
    bed.layers[1].poisson_ratio = 0.5;
    let error = LinearBed::prepare(&bed).expect_err("nu = 0.5");
    assert!(
        matches!(error, LayeredError::InvalidLayer { index: 1, field: "poisson_ratio", value: 0.5, .. }),
        "{error}"
    );
    bed.layers[1].poisson_ratio = f64::NAN;
    assert!(matches!(LinearBed::prepare(&bed), Err(LayeredError::InvalidLayer { index: 1, .. })));
    bed = eye_wall();
    bed.layers[2].thickness_mm = 0.0;
    assert!(matches!(
        LinearBed::prepare(&bed),
        Err(LayeredError::InvalidLayer { index: 2, field: "thickness_mm", .. })
    ));
    bed.layers.clear();
    assert_eq!(LinearBed::prepare(&bed).err(), Some(LayeredError::NoLayers));
    let bed = prepare(&eye_wall());
    let flat = heights(&bed, |_| 0.0);
    assert!(matches!(bed.indent_by_force(&smooth(&flat), -1.0), Err(LayeredError::InvalidLoad { .. })));
    assert!(matches!(bed.indent_by_force(&smooth(&flat), 1.0), Err(LayeredError::ContactTooWide { .. })));
    assert!(matches!(bed.indent_by_force(&smooth(&flat[1..]), 1.0), Err(LayeredError::ProfileLength { .. })));
    let broken = heights(&bed, |r| if r > 0.1 { f64::NAN } else { 0.0 });
    assert!(matches!(bed.indent_by_force(&smooth(&broken), 1.0), Err(LayeredError::InvalidProfile { .. })));
}
