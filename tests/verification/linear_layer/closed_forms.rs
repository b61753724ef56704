//! Against closed forms (Hertz, Sneddon, Boussinesq, Dimitriadis) and a separate solution of the integral equation. Units mm, mN, kPa.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{DMatrix, DVector};
use retina_core::layered::kernel::surface_compliance_real;
use retina_core::layered::{LayeredBed, ProfileEdge, RigidProfile};

use super::support::*;

/// Force and depth of the paraboloid r²/2R with contact radius `a`, from the integral equation by the midpoint rule and the kernel by
/// the same on the real axis: nothing in common with the prepared bed but the surface compliance.
fn paraboloid_by_midpoints(bed: &LayeredBed, radius: f64, a: f64) -> (f64, f64) {
    const N: usize = 160;
    let top = bed.layers[0];
    let c = top.half_space_normal();
    // Panels that double, 2000 midpoints each.
    let mut panels = vec![25.0 / top.thickness_mm];
    while panels[panels.len() - 1] > 60.0 {
        panels.push(0.5 * panels[panels.len() - 1]);
    }
    panels.push(0.0);
    let spectrum: Vec<(f64, f64)> = panels
        .windows(2)
        .flat_map(|panel| {
            let step = (panel[0] - panel[1]) / 2000.0;
            (0..2000).map(move |i| (panel[1] + step * (f64::from(i) + 0.5), step))
        })
        .map(|(k, step)| (k, (surface_compliance_real(bed, k).normal - c) * step))
        .collect();
    let width = a / N as f64;
    let kernel: Vec<f64> =
        (0..2 * N).map(|i| spectrum.iter().map(|(k, d)| d * (k * width * i as f64).cos()).sum()).collect();
    let matrix = DMatrix::from_fn(N, N, |i, j| {
        let identity = if i == j { FRAC_PI_2 * c } else { 0.0 };
        identity + 0.5 * width * (kernel[i.abs_diff(j)] + kernel[i + j + 1])
    });
    let at = |i: usize| width * (i as f64 + 0.5);
    let lu = matrix.lu();
    let flat = lu.solve(&DVector::from_element(N, 1.0)).expect("regular");
    let bowl = lu.solve(&DVector::from_fn(N, |i, _| at(i) * at(i) / radius)).expect("regular");
    let edge = |v: &DVector<f64>| 1.875 * v[N - 1] - 1.25 * v[N - 2] + 0.375 * v[N - 3];
    let depth = edge(&bowl) / edge(&flat);
    (TAU * width * (flat.sum() * depth - bowl.sum()), depth)
}

#[test]
fn paraboloid_on_layers() {
    for bed in [single(20.0, 0.4999, 0.25), single(20.0, 0.49, 0.08), eye_wall()] {
        let ready = prepare(&bed);
        for (radius, a) in [(0.05, 0.02), (0.05, 0.1), (0.2, 0.1), (0.2, 0.25), (1.0, 0.5)] {
            let (force, depth) = paraboloid_by_midpoints(&bed, radius, a);
            let heights = heights(&ready, |r| r * r / (2.0 * radius));
            let got = ready.indent_by_force(&smooth(&heights), force).expect("contact");
            let tolerance = if a > 3.0 * bed.layers[0].thickness_mm { WIDE_CONTACT } else { CONTACT };
            close(&format!("depth R {radius} a {a}"), got.depth_mm, depth, tolerance);
            close("contact radius", got.contact_radius_mm, a, 3.0 * tolerance);
        }
    }
    // A membrane of 1 µm: thinner than any ring but the first, and than three midpoints.
    let bed = membrane_wall();
    let ready = prepare(&bed);
    for a in [0.01, 0.05, 0.1] {
        let (force, depth) = paraboloid_by_midpoints(&bed, 0.2, a);
        let heights = heights(&ready, |r| r * r / 0.4);
        let got = ready.indent_by_force(&smooth(&heights), force).expect("contact");
        close(&format!("depth on a membrane, a {a}"), got.depth_mm, depth, WIDE_CONTACT);
    }
}

#[test]
fn hertz_sphere() {
    // R = 50 µm, E = 20 kPa, ν = 0.49; the values of Hertz' formula for the paraboloid r²/2R.
    let bed = prepare(&single(20.0, 0.49, HALF_SPACE_MM));
    let heights = heights(&bed, |r| r * r / 0.1);
    let modulus = 20.0 / (1.0 - 0.49 * 0.49);
    for depth in [0.001, 0.0033, 0.01, 0.025, 0.05] {
        let got = bed.indent_by_depth(&smooth(&heights), depth).expect("contact");
        let want = 4.0 / 3.0 * modulus * f64::sqrt(0.05) * f64::powf(depth, 1.5);
        close(&format!("Hertz force at {depth}"), got.normal_force_mn, want, CONTACT);
        close("Hertz radius", got.contact_radius_mm, f64::sqrt(0.05 * depth), 1e-2);
        let back = bed.indent_by_force(&smooth(&heights), got.normal_force_mn).expect("contact");
        close("depth of the force of a depth", back.depth_mm, depth, 1e-9);
    }
}

#[test]
fn cone() {
    // Sneddon: F = (2/π) E* tan α δ², half-angle α, f = r / tan α.
    let bed = prepare(&single(20.0, 0.3, HALF_SPACE_MM));
    let heights = heights(&bed, |r| r / 2.0);
    for depth in [0.01, 0.05, 0.2] {
        let got = bed.indent_by_depth(&smooth(&heights), depth).expect("contact");
        let want = 2.0 / PI * 20.0 / 0.91 * 2.0 * depth * depth;
        close(&format!("cone at {depth}"), got.normal_force_mn, want, CONTACT);
    }
}

#[test]
fn flat_punch() {
    // F = 2aE*δ and u_z outside = −(2δ/π) asin(a/r), u_r inside = −(1 − 2ν)/2µ · F/2πa · (a − √(a² − r²))/r.
    let (e, nu) = (20.0, 0.3);
    let bed = prepare(&single(e, nu, HALF_SPACE_MM));
    let modulus = e / (1.0 - nu * nu);
    for radius in [0.05, 0.25, 0.3205] {
        let heights = heights(&bed, |r| if r <= radius { 0.0 } else { f64::INFINITY });
        let edge = Some(ProfileEdge { radius_mm: radius, height_mm: 0.0 });
        let got = bed.indent_by_force(&RigidProfile { heights_mm: &heights, edge }, 1.0).expect("contact");
        let depth = 1.0 / (2.0 * radius * modulus);
        close(&format!("punch {radius}"), got.depth_mm, depth, PUNCH);
        assert_eq!(got.contact_radius_mm, radius);
        let response = bed.surface_response(&got);
        for ratio in [1.001, 1.02, 1.3, 3.0] {
            let (_, uz) = response.displacement(ratio * radius);
            close("outside the punch", uz, -2.0 * depth / PI * f64::asin(1.0 / ratio), PUNCH * (1.0 + ratio));
        }
        let r = 0.7 * radius;
        let slope = (1.0 - 2.0 * nu) * (1.0 + nu) / e / (TAU * radius);
        let want = -slope * (radius - (radius * radius - r * r).sqrt()) / r;
        close("radial under the punch", response.displacement(r).0, want, PUNCH);
    }
}

#[test]
fn boussinesq_far_field() {
    let bed = prepare(&single(20.0, 0.49, HALF_SPACE_MM));
    let heights = heights(&bed, |r| r * r / 0.02);
    let got = bed.indent_by_force(&smooth(&heights), 0.01).expect("contact");
    let response = bed.surface_response(&got);
    // From 1 mm (25 contact radii: a²/6r² = 3e-4 is left) to beyond the tables' end at 4 mm, less 3/4 r/h of the finite bed.
    for r in [1.0, 2.0, 3.9, 8.0] {
        let want = -0.01 * (1.0 - 0.49 * 0.49) / (PI * 20.0 * r);
        close(&format!("Boussinesq at {r}"), response.displacement(r).1, want, 5e-4 + r / HALF_SPACE_MM);
    }
}

#[test]
fn thin_bonded_layer() {
    // Dimitriadis: 1 + 1.133χ + 1.283χ² + 0.769χ³ + 0.0975χ⁴, χ = √(Rδ)/h, is an asymptotic series fitted for χ ≲ 1, ν = 1/2.
    // The series leaves the integral equation's solution (paraboloid_on_layers, within 1e-4 of ours) by about 0.3 χ².
    let bed = prepare(&single(20.0, 0.4999, 0.25));
    let heights = heights(&bed, |r| r * r / 0.1);
    for (depth, force) in [(0.005, 0.003027), (0.01, 0.008842), (0.025, 0.037339), (0.05, 0.114154)] {
        let got = bed.indent_by_depth(&smooth(&heights), depth).expect("contact");
        close(&format!("Dimitriadis at {depth}"), got.normal_force_mn, force, 0.3 * 0.05 * depth / 0.0625);
    }
}
