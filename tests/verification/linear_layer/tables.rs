//! Against tables computed independently of this code: the kernel by direct quadrature, and the whole contact. Units mm, mN, kPa.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use retina_core::layered::kernel::surface_compliance_real;
use retina_core::layered::{BedBase, LayeredBed, ProfileEdge, RigidProfile};

use super::support::*;

/// A row of the table of independent values.
struct Case {
    load: String,
    size: f64,
    bed: LayeredBed,
    force: f64,
    rows: Vec<[f64; 3]>,
}

fn cases() -> Vec<Case> {
    let mut cases: Vec<(String, Case)> = Vec::new();
    for line in include_str!("../../data/linear_layer.csv").lines().skip(1) {
        let field: Vec<&str> = line.split(',').collect();
        let number = |i: usize| field[i].parse::<f64>().unwrap_or_else(|_| panic!("column {i} of {line}"));
        let key = field[..9].join(",");
        if cases.last().is_none_or(|(last, _)| *last != key) {
            let mut bed = single(number(2), number(3), number(4));
            if field[5] == "springs" {
                bed.base = BedBase::Springs { normal_kpa_per_mm: number(6), tangential_kpa_per_mm: number(7) };
            }
            let case = Case { load: field[0].to_owned(), size: number(1), bed, force: number(8), rows: Vec::new() };
            cases.push((key, case));
        }
        cases.last_mut().expect("a case").1.rows.push([number(9), number(10), number(11)]);
    }
    cases.into_iter().map(|(_, case)| case).collect()
}

fn simpson(from: f64, to: f64, half_steps: usize, f: impl Fn(f64) -> f64) -> f64 {
    let step = (to - from) / (2 * half_steps) as f64;
    let weight = |i: usize| {
        if i == 0 || i == 2 * half_steps {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=2 * half_steps).map(|i| weight(i) * f(from + step * i as f64)).sum::<f64>() * step / 3.0
}

impl Case {
    /// Hankel transform of the pressure.
    fn transform(&self, k: f64) -> f64 {
        let z = k * self.size;
        if self.load == "disc" {
            self.force / PI * if z < 1e-6 { 0.5 } else { libm::j1(z) / z }
        } else {
            3.0 * self.force / PI * if z < 1e-2 { 1.0 / 6.0 - z * z / 96.0 } else { 8.0 * libm::jn(3, z) / z.powi(3) }
        }
    }

    /// The same pressure on the line: p̂(k) = ∫ φ(t) cos(kt) dt.
    fn line(&self, t: f64) -> f64 {
        let a = self.size;
        let cut = ((a - t) * (a + t)).max(0.0);
        if self.load == "disc" {
            2.0 / PI * self.force / (PI * a * a) * cut.sqrt()
        } else {
            2.0 / PI * 3.0 * self.force / (PI * a * a) * 8.0 / 15.0 * cut.powf(2.5) / a.powi(4)
        }
    }

    /// Force within a radius.
    fn force_within(&self, r: f64) -> f64 {
        let x2 = (r / self.size).powi(2).min(1.0);
        self.force * if self.load == "disc" { x2 } else { 1.0 - (1.0 - x2).powi(3) }
    }

    /// Simpson points of the layered rest: k, and (kC − half-space limit) p̂ times the weight, normal and radial.
    fn spectrum(&self) -> Vec<[f64; 3]> {
        let top = self.bed.layers[0];
        let steps = 3000;
        let step = 25.0 / top.thickness_mm / f64::from(steps);
        let weight = |i: i32| {
            if i == 0 || i == steps {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let point = |i: i32| {
            let k = (step * f64::from(i)).max(1e-7);
            let compliance = surface_compliance_real(&self.bed, k);
            let load = weight(i) * step / 3.0 * self.transform(k);
            let normal = compliance.normal - top.half_space_normal();
            [k, normal * load, (compliance.radial - top.half_space_radial()) * load]
        };
        (0..=steps).map(point).collect()
    }

    /// (u_r, u_z) by quadrature: the half-space part on the line, the layered rest over wave numbers.
    fn displacement(&self, spectrum: &[[f64; 3]], r: f64) -> (f64, f64) {
        let top = self.bed.layers[0];
        let reach = r.min(self.size);
        let half_space = simpson(0.0, FRAC_PI_2, 400, |angle| {
            let (sin, cos) = angle.sin_cos();
            let t = reach * sin;
            let ratio = if r <= self.size { 1.0 } else { reach * cos / (r * r - t * t).sqrt() };
            self.line(t) * ratio
        });
        let normal: f64 = spectrum.iter().map(|&[k, normal, _]| normal * libm::j0(k * r)).sum();
        let radial: f64 = spectrum.iter().map(|&[k, _, radial]| radial * libm::j1(k * r)).sum();
        let enclosed = if r > 0.0 { top.half_space_radial() / r * self.force_within(r) / TAU } else { 0.0 };
        (enclosed + radial, -(top.half_space_normal() * half_space + normal))
    }

    /// Largest |u| of the case.
    fn largest(&self) -> f64 {
        self.rows.iter().fold(0.0, |m, row| m.max(row[1].hypot(row[2])))
    }

    /// Largest error of a displacement function, relative to the largest displacement.
    fn error(&self, displacement: impl Fn(f64) -> (f64, f64)) -> f64 {
        let worst = self.rows.iter().fold(0.0_f64, |worst, &[r, ur, uz]| {
            let (got_r, got_z) = displacement(r);
            worst.max((got_r - ur).abs()).max((got_z - uz).abs())
        });
        worst / self.largest()
    }
}

#[test]
fn the_kernel_gives_the_independent_tables() {
    let cases = cases();
    assert_eq!(cases.len(), 36);
    let worst = cases
        .iter()
        .map(|case| {
            let spectrum = case.spectrum();
            case.error(|r| case.displacement(&spectrum, r))
        })
        .fold(0.0, f64::max);
    println!("kernel against tables: {worst:.2e}");
    assert!(worst <= TABLE, "{worst:e}");
}

#[test]
fn a_rigid_tool_of_the_surface_s_shape_gives_the_independent_tables() {
    // A tool of the very shape that a pressure gives the surface under it, pressed with its force, must find the pressure again, and
    // with it the surface outside. Cases whose shape is not monotone are left out: their middle would be counted as filled.
    let (mut worst, mut worst_pressure, mut count) = (0.0_f64, 0.0_f64, 0);
    for case in cases() {
        let spectrum = case.spectrum();
        let bed = prepare(&case.bed);
        let tip = case.displacement(&spectrum, 0.0).1;
        let shape = |r: f64| case.displacement(&spectrum, r).1 - tip;
        let heights = heights(&bed, |r| if r < case.size { shape(r) } else { f64::INFINITY });
        if heights.windows(2).any(|pair| pair[1] < pair[0]) {
            continue;
        }
        let edge = Some(ProfileEdge { radius_mm: case.size, height_mm: shape(case.size) });
        let got = bed.indent_by_force(&RigidProfile { heights_mm: &heights, edge }, case.force).expect("contact");
        let response = bed.surface_response(&got);
        let error = case.error(|r| response.displacement(r)).max((got.depth_mm + tip).abs() / case.largest());
        let samples = bed.sample_radii_mm();
        let pressures = bed.ring_pressures_kpa(&got);
        let mean = case.force / (PI * case.size * case.size);
        // From 10 µm outwards to the last ring but two, where the pressure of the last punches is not smooth.
        let pressure_error = samples
            .windows(2)
            .zip(&pressures)
            .filter(|(t, _)| t[0] > 0.01 && t[1] < 0.75 * case.size)
            .map(|(t, p)| {
                let want = (case.force_within(t[1]) - case.force_within(t[0])) / (PI * (t[1] * t[1] - t[0] * t[0]));
                (p - want).abs() / mean
            })
            .fold(0.0, f64::max);
        println!("{} {} {:?}: {error:.2e}, pressure {pressure_error:.2e}", case.load, case.size, case.bed);
        let allowed = if case.load == "disc" { JUMP_SHAPES } else { SMOOTH_SHAPES };
        assert!(error <= allowed, "{error:e} > {allowed:e}");
        worst = worst.max(error);
        worst_pressure = worst_pressure.max(pressure_error);
        count += 1;
    }
    println!("{count} cases, surface {worst:.2e}, pressure {worst_pressure:.2e}");
    assert!(count >= 20, "only {count} cases");
    assert!(worst_pressure <= PRESSURES, "{worst_pressure:e}");
}
