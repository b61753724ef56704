//! Derivatives of every effect against central differences, and what each promises where it must not act.
//!
//! Contract: every name in [`EFFECT_NAMES`] but those in [`WITHOUT_ENERGY`] has a row in [`ROWS`]; one function, [`check_effect`], checks them all, at three sizes.
//! Lengths are scaled with their moduli, so that a row is the same problem in other units of length.

mod adhesion;
mod bleb;
mod contact;
mod friction;
mod inertia;
mod pressure;
mod solids;
mod tool_flex;

use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::elasticity::Elasticity;
use retina_core::effects::finite_strain::FiniteStrain;
use retina_core::effects::{EFFECT_NAMES, WITHOUT_ENERGY};
use retina_core::mesh::element::{FACE_NODES, NODE_OFFSETS, TOP_NODES};
use retina_tests::tolerance::{DERIVATIVE, ROUNDOFF};

use self::contact::for_each_contact;
use self::solids::{LAWS, solids};
use crate::meshes::noise;

/// One configuration of one group.
struct Case {
    label: String,
    group: usize,
    current: Vec<f64>,
    /// Step of the differences (mm).
    step_mm: f64,
}

/// Differences' step over the size of the configuration.
const STEP: f64 = 3e-6;
/// Sizes at which every row is repeated.
const SIZES: [f64; 3] = [1.0, 1e-3, 1e3];
/// Random configurations of each kind.
const REPEATS: usize = 4;

/// The rows of the derivative check: each runs [`check_effect`] on its effect.
const ROWS: [(&str, fn()); 10] = [
    ("elasticity", solids::check_elasticity),
    ("finite_strain", solids::check_finite_strain),
    ("contact", contact::check),
    ("friction", friction::check),
    ("pressure", pressure::check),
    ("adhesion", adhesion::check),
    ("bleb", bleb::check),
    ("viscoelasticity", solids::check_viscoelasticity),
    ("inertia", inertia::check),
    ("tool_flex", tool_flex::check),
];

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// `add` into zeros, and again into junk of the same size: the difference must be the same.
fn added(len: usize, add: impl Fn(&mut [f64])) -> Vec<f64> {
    let mut clean = vec![0.0; len];
    add(&mut clean);
    let size = largest(&clean);
    let mut random = noise(3);
    let junk: Vec<f64> = (0..len).map(|_| size * random()).collect();
    let mut dirty = junk.clone();
    add(&mut dirty);
    for ((dirty, junk), clean) in dirty.iter().zip(&junk).zip(&clean) {
        assert!((dirty - junk - clean).abs() <= ROUNDOFF * size, "overwritten, not added: {dirty} {junk} {clean}");
    }
    clean
}

/// Checks gradient against energy and Hessian against gradient, entry by entry, relative to the largest.
fn check_effect(name: &str, effect: &dyn Effect, cases: &[Case]) {
    assert_eq!(effect.name(), name);
    assert!(!cases.is_empty(), "{name}: no case");
    for Case { label, group, current, step_mm } in cases {
        let at = |x: &[f64], read: &mut dyn FnMut(&Local)| read(&Local { current: x, group: *group, predicted: &[] });
        let energy = |x: &[f64]| {
            let mut out = 0.0;
            at(x, &mut |local| out = effect.energy(local));
            out
        };
        let n = current.len();
        let gradient = |x: &[f64]| {
            let mut out = Vec::new();
            at(x, &mut |local| out = added(n, |out| effect.add_gradient(local, out)));
            out
        };
        at(current, &mut |local| assert!(effect.is_active(local), "{name}, {label}: not active"));
        let exact_gradient = gradient(current);
        let mut exact_hessian = Vec::new();
        at(current, &mut |local| exact_hessian = added(n * n, |out| effect.add_hessian(local, out)));
        let (size, stiffness) = (largest(&exact_gradient), largest(&exact_hessian));
        assert!(size > 0.0 && size.is_finite(), "{name}, {label}: a gradient of {size} proves nothing");
        assert!(stiffness > 0.0 && stiffness.is_finite(), "{name}, {label}: a Hessian of {stiffness} proves nothing");
        let (mut slope_error, mut curvature_error) = (0.0_f64, 0.0_f64);
        for column in 0..n {
            let moved = |by: f64| {
                let mut x = current.clone();
                x[column] += by;
                x
            };
            let (low, high) = (moved(-step_mm), moved(*step_mm));
            let width = high[column] - low[column];
            let slope = (energy(&high) - energy(&low)) / width;
            slope_error = slope_error.max((slope - exact_gradient[column]).abs() / size);
            let (low, high) = (gradient(&low), gradient(&high));
            for row in column..n {
                let curvature = (high[row] - low[row]) / width;
                curvature_error = curvature_error.max((curvature - exact_hessian[row * n + column]).abs() / stiffness);
            }
        }
        assert!(slope_error < DERIVATIVE, "{name}, {label}: gradient off by {slope_error:e}");
        assert!(curvature_error < DERIVATIVE, "{name}, {label}: Hessian off by {curvature_error:e}");
    }
}

/// Predicted stresses against stresses after a small step, and the Hessian with the stresses of no step against the plain one.
/// Whether other stresses change the Hessian (under a flat face they do not).
fn check_prediction(effect: &dyn Effect, case: &Case) -> bool {
    let (n, len) = (case.current.len(), effect.predicted_len());
    let predicted = |x: &[f64], step: &[f64]| {
        let mut out = vec![0.0; len];
        effect.predict_stress(&Local { current: x, group: case.group, predicted: &[] }, step, &mut out);
        out
    };
    let mut random = noise(11);
    let step: Vec<f64> = (0..n).map(|_| case.step_mm * random()).collect();
    let moved = |sign: f64| -> Vec<f64> { case.current.iter().zip(&step).map(|(x, s)| x + sign * s).collect() };
    let still = vec![0.0; n];
    let here = predicted(&case.current, &still);
    let (after, before) = (predicted(&moved(1.0), &still), predicted(&moved(-1.0), &still));
    let first_order = predicted(&case.current, &step);
    let change: Vec<f64> = first_order.iter().zip(&here).map(|(a, b)| a - b).collect();
    let size = largest(&change);
    assert!(size > 0.0, "{}: a stress that does not change proves nothing", case.label);
    for ((change, after), before) in change.iter().zip(&after).zip(&before) {
        // The change is a few 1e-6 of the stress: that much of its digits is gone.
        let error = (change - 0.5 * (after - before)).abs() / size;
        assert!(error < 1e-4, "{}: predicted change off by {error:e}", case.label);
    }
    let hessian = |stresses: &[f64]| {
        let local = Local { current: &case.current, group: case.group, predicted: stresses };
        added(n * n, |out| effect.add_hessian(&local, out))
    };
    let (plain, with) = (hessian(&[]), hessian(&here));
    let size = largest(&plain);
    let error = plain.iter().zip(&with).fold(0.0_f64, |e, (a, b)| e.max((a - b).abs())) / size;
    assert!(error < ROUNDOFF, "{}: Hessian with its own stresses off by {error:e}", case.label);
    let raised: Vec<f64> = here.iter().map(|s| s - 0.1 * largest(&here)).collect();
    plain != hessian(&raised)
}

/// Steps of the rows of effects with memory (s), and the relaxation times around them.
const MEMORY_STEPS_S: [f64; 3] = [1e-6, 0.05, 1e3];

/// Needle radius of the rows on faces (mm) before it is scaled.
const RADIUS: f64 = 0.25;

/// A face at rest around the origin, less than a radius wide.
fn face(size: f64) -> (Stencils, Vec<f64>) {
    let mut random = noise(23);
    let mut rest = Vec::new();
    for &a in TOP_NODES.iter() {
        let [i, j, _] = NODE_OFFSETS[a];
        let at = [i as f64 - 1.0, j as f64 - 1.0, 0.0];
        rest.extend(at.map(|c| size * RADIUS * (0.4 * c + 0.02 * random())));
    }
    rest.extend([0.0; 3]);
    (Stencils { group_size: FACE_NODES + 1, vertices: (0..=FACE_NODES as u32).collect() }, rest)
}

#[test]
fn every_effect_has_a_row() {
    for name in EFFECT_NAMES {
        let row = ROWS.iter().any(|row| row.0 == name);
        assert!(
            row != WITHOUT_ENERGY.contains(&name),
            "`{name}` has no row in the derivative check, or no energy and one"
        );
    }
    for (name, _) in ROWS {
        assert!(EFFECT_NAMES.contains(&name), "a row for `{name}`, which is no effect");
    }
}

#[test]
fn derivatives_of_every_effect() {
    for (_, check) in ROWS {
        check();
    }
}

#[test]
fn energies_grow_with_the_cube_of_the_size() {
    let energies = |size: f64| {
        let solids = solids(size);
        let mut out = Vec::new();
        for case in solids.random_cases() {
            let local = Local { current: &case.current, group: case.group, predicted: &[] };
            let (geometry, materials) = (&solids.geometry, &solids.materials[..]);
            out.push(Elasticity { geometry, materials }.energy(&local));
            out.extend(LAWS.map(|law| FiniteStrain { geometry, materials, law }.energy(&local)));
        }
        for_each_contact(size, |contact, case| {
            out.push(contact.energy(&Local { current: &case.current, group: case.group, predicted: &[] }));
        });
        out
    };
    let plain = energies(1.0);
    assert!(plain.len() > 60 && plain.iter().all(|&energy| energy > 0.0), "{plain:?}");
    for size in [1e-3, 1e3] {
        for (small, energy) in energies(size).iter().zip(&plain) {
            assert!((small / size.powi(3) - energy).abs() < 1e-9 * energy, "{small} {energy}");
        }
    }
}
