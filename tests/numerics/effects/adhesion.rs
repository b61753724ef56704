//! `adhesion`: derivatives in every part of its law, irreversibility, and the energy of letting go.

use nalgebra::Vector3;
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::adhesion::rate::Opened;
use retina_core::effects::adhesion::{Adhesion, Bond, GROUP, Interface};
use retina_core::mesh::element::FACE_NODES;
use retina_tests::tolerance::ROUNDOFF;

use super::{Case, RADIUS, REPEATS, SIZES, STEP, added, check_effect, face};
use crate::meshes::noise;

/// A bond whose openings are a share of the face's size.
fn bond(size: f64) -> Bond {
    let strength_kpa = 5.0;
    let onset = 0.02 * RADIUS * size;
    Bond {
        strength_kpa,
        fracture_energy_mn_per_mm: 5.0 * onset * strength_kpa,
        stiffness_kpa_per_mm: strength_kpa / onset,
    }
}

/// Two coinciding faces, and the positions with the upper one moved by `apart` onsets and shaken by a share of that.
fn parted(size: f64, apart: Vector3<f64>, shake: f64, seed: u64) -> (Interface, Vec<f64>) {
    let (stencils, rest) = face(size);
    let mut local = vec![0.0; 3 * stencils.group_size];
    stencils.gather(0, &rest, &mut local);
    let n = stencils.group_size;
    let mut doubled = Vec::new();
    for _ in 0..2 {
        (0..FACE_NODES).for_each(|a| doubled.extend((0..3).map(|k| local[k * n + a])));
    }
    let stencils = Stencils { group_size: GROUP, vertices: (0..GROUP as u32).collect() };
    let interface = Interface::new(&stencils, &doubled);
    let onset = bond(size).onset_mm();
    let mut random = noise(90 + seed);
    for v in 0..GROUP {
        for k in 0..3 {
            let lifted = if v >= FACE_NODES { apart[k] } else { 0.0 };
            doubled[3 * v + k] += onset * (lifted + shake * random());
        }
    }
    let mut current = vec![0.0; 3 * GROUP];
    stencils.gather(0, &doubled, &mut current);
    (interface, current)
}

pub fn check() {
    // Label, opening and largest opening of the past, in onsets; the bond is parted at ten.
    let parts = [
        ("intact", Vector3::new(0.2, 0.1, 0.4), 0.0),
        ("closed and shearing", Vector3::new(0.5, 0.2, -0.6), 0.0),
        ("letting go", Vector3::new(2.0, -1.0, 3.0), 0.0),
        ("letting go closed", Vector3::new(3.0, 2.0, -1.0), 0.0),
        ("damaged", Vector3::new(1.0, 1.0, 2.0), 6.0),
        ("damaged and further", Vector3::new(3.0, 2.0, 6.0), 4.0),
    ];
    for size in SIZES {
        for (label, apart, past) in parts {
            for seed in 0..REPEATS as u64 {
                let (interface, current) = parted(size, apart, 0.05, seed);
                let largest_mm = vec![past * bond(size).onset_mm(); interface.points()];
                let effect =
                    Adhesion { interface: &interface, bond: bond(size), largest_mm: &largest_mm, opened: None };
                let case = Case {
                    label: format!("{label}, seed {seed}, size {size:e}"),
                    group: 0,
                    current,
                    step_mm: 0.01 * STEP * RADIUS * size,
                };
                check_effect("adhesion", &effect, std::slice::from_ref(&case));
                // The same openings, reached in haste from half of them.
                let local = Local { current: &case.current, group: 0, predicted: &[] };
                let start_mm: Vec<f64> = effect.present(&local).map(|present| 0.5 * present).collect();
                for reference in [1e-3, 1.0, 1e6] {
                    let reference_mm = reference * bond(size).onset_mm();
                    let opened = Some(Opened { exponent: 0.4, reference_mm, start_mm: &start_mm });
                    check_effect("adhesion", &Adhesion { opened, ..effect }, std::slice::from_ref(&case));
                }
            }
        }
    }
}

#[test]
fn letting_go_costs_the_fracture_energy_and_gives_nothing_back() {
    let bond = bond(1.0);
    for direction in [Vector3::z(), Vector3::x(), Vector3::new(0.6, 0.0, 0.8)] {
        let (interface, _) = parted(1.0, Vector3::zeros(), 0.0, 0);
        let area: f64 = interface.areas(0).iter().sum();
        let mut largest_mm = vec![0.0; interface.points()];
        let (mut work, mut peak, mut last) = (0.0, 0.0_f64, 0.0);
        // Out to six onsets, back to rest, and out until it has let go.
        let steps = 400;
        let way = |i: usize| -> f64 {
            let t = i as f64 / steps as f64;
            if t < 0.25 {
                24.0 * t
            } else if t < 0.5 {
                6.0 - 24.0 * (t - 0.25)
            } else {
                24.0 * (t - 0.5)
            }
        };
        let mut returned = f64::NAN;
        for i in 0..=steps {
            let (_, current) = parted(1.0, direction * way(i), 0.0, 0);
            let effect = Adhesion { interface: &interface, bond, largest_mm: &largest_mm, opened: None };
            let local = Local { current: &current, group: 0, predicted: &[] };
            let forces = added(3 * GROUP, |out| effect.add_gradient(&local, out));
            let on = |from: usize| -> Vector3<f64> {
                (from..from + FACE_NODES).map(|a| Vector3::from_fn(|k, _| forces[k * GROUP + a])).sum()
            };
            assert!((on(0) + on(FACE_NODES)).norm() <= ROUNDOFF * bond.strength_kpa * area, "equal and opposite");
            let force = on(FACE_NODES).dot(&direction);
            if i > 0 {
                work += 0.5 * (force + last) * (way(i) - way(i - 1)) * bond.onset_mm();
            }
            if i == steps / 2 {
                returned = work;
            }
            (peak, last) = (peak.max(force), force);
            let openings: Vec<f64> = effect.openings(&local).collect();
            assert!(openings.iter().zip(&largest_mm).all(|(now, before)| now >= before), "damage healed");
            largest_mm = openings;
        }
        let cost = bond.fracture_energy_mn_per_mm * area;
        println!("{:?}: work {work:.4e}, G A {cost:.4e}, after the cycle {returned:.4e}", direction.as_slice());
        assert!((work / cost - 1.0).abs() < 5e-3, "{work} for {cost}");
        assert!((peak / (bond.strength_kpa * area) - 1.0).abs() < 0.05, "{peak}");
        assert!(returned > 0.3 * cost && returned < cost, "a cycle keeps what it took: {returned}");
        assert!(largest_mm.iter().all(|&largest| bond.damage(largest) == 1.0), "parted for good");
        assert_eq!(bond.damage(0.5 * bond.onset_mm()), 0.0);
    }
}

#[test]
fn a_hasty_opening_costs_more_by_the_power_of_its_speed() {
    let bond = bond(1.0);
    let (n, start) = (0.3, [0.0]);
    // Torn open at constant speed in one step, or in many: the bond has borne the same, times (1 + v/v₀)ⁿ.
    for haste in [1e-9, 1e-3, 1.0, 1e3] {
        let parted = bond.parted_mm();
        let torn = |steps: usize| -> f64 {
            let width = parted / steps as f64;
            let traction = |k: usize| {
                let start = [width * k as f64];
                let opened = Opened { exponent: n, reference_mm: width / haste, start_mm: &start };
                opened.potential(&bond, start[0] + width, start[0], 0).1
            };
            (0..steps).map(traction).sum::<f64>() * width
        };
        let exact = bond.fracture_energy_mn_per_mm * (1.0 + haste).powf(n);
        println!(
            "haste {haste:e}: work in 200 steps {:.5}, in 2000 {:.5} of the closed form",
            torn(200) / exact,
            torn(2000) / exact
        );
        assert!((torn(2000) / exact - 1.0).abs() < 1e-3, "{} for {exact}", torn(2000));
    }
    // What closes, and what has no power, is the bond without haste, to the last bit.
    fn opened(exponent: f64, start_mm: &[f64]) -> Opened<'_> {
        Opened { exponent, reference_mm: 1e-6, start_mm }
    }
    for o in [0.3, 1.5, 4.0].map(|onsets| onsets * bond.onset_mm()) {
        let closing = [2.0 * o];
        assert_eq!(opened(n, &closing).potential(&bond, o, closing[0], 0), bond.potential(o, closing[0]));
        let slow = opened(0.0, &start).potential(&bond, o, 0.0, 0);
        let (energy, traction, slope) = bond.potential(o, 0.0);
        assert!((slow.0 / energy - 1.0).abs() < ROUNDOFF && (slow.1, slow.2) == (traction, slope));
        assert!(opened(n, &start).potential(&bond, o, 0.0, 0).1 > traction, "the paired negative: haste is felt");
    }
}
