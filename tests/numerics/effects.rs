//! Derivatives of every effect against central differences, and what each promises where it must not act.
//!
//! Contract: every name in [`EFFECT_NAMES`] but those in [`WITHOUT_ENERGY`] has a row in [`ROWS`]; one function, [`check_effect`], checks them all, at three sizes.
//! Lengths are scaled with their moduli, so that a row is the same problem in other units of length.

mod adhesion;
mod bleb;
mod contact;
mod friction;
mod pressure;
mod tool_flex;

use nalgebra::{Matrix3, Rotation3, Vector3};
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::contact::ContactFaces;
use retina_core::effects::elasticity::Elasticity;
use retina_core::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use retina_core::effects::inertia::{Inertia, VitreousDrag};
use retina_core::effects::solid::SolidGeometry;
use retina_core::effects::viscoelasticity::{Network, Networks};
use retina_core::effects::{EFFECT_NAMES, WITHOUT_ENERGY};
use retina_core::mesh::element::{FACE_NODES, NODE_OFFSETS, NODES, TOP_NODES};
use retina_tests::tolerance::{DERIVATIVE, ROUNDOFF};

use self::contact::for_each_contact;
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
    ("elasticity", check_elasticity),
    ("finite_strain", check_finite_strain),
    ("contact", contact::check),
    ("friction", friction::check),
    ("pressure", pressure::check),
    ("adhesion", adhesion::check),
    ("bleb", bleb::check),
    ("viscoelasticity", check_viscoelasticity),
    ("inertia", check_inertia),
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

/// Two distorted elements side by side and their materials.
struct Solids {
    stencils: Stencils,
    rest: Vec<f64>,
    geometry: SolidGeometry,
    materials: Vec<Lame>,
    size: f64,
}

/// Edges of an element (mm) before it is scaled and distorted.
const EDGES: [f64; 3] = [0.12, 0.1, 0.08];

fn solids(size: f64) -> Solids {
    let mut random = noise(5);
    let mut rest = Vec::new();
    for element in 0..2 {
        for offset in NODE_OFFSETS.iter() {
            for k in 0..3 {
                let shift = if k == 0 { element as f64 } else { 0.0 };
                rest.push(size * EDGES[k] * (shift + 0.5 * offset[k] as f64 + 0.03 * random()));
            }
        }
    }
    let stencils = Stencils { group_size: NODES, vertices: (0..2 * NODES as u32).collect() };
    let geometry = SolidGeometry::new(&stencils, &rest).unwrap();
    let lame = |youngs: f64, nu: f64| Lame {
        mu: youngs / (2.0 * (1.0 + nu)),
        lambda: youngs * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
    };
    Solids { stencils, rest, geometry, materials: vec![lame(20.0, 0.49), lame(5.0, 0.3)], size }
}

impl Solids {
    /// The group under the map `f` with each coordinate shaken by `shake` of an element.
    fn case(&self, label: &str, group: usize, f: &Matrix3<f64>, shake: f64, seed: u64) -> Case {
        let mut random = noise(seed);
        let mut current = vec![0.0; 3 * NODES];
        self.stencils.gather(group, &self.rest, &mut current);
        for a in 0..NODES {
            let at = f * Vector3::from_fn(|k, _| current[k * NODES + a]);
            for k in 0..3 {
                current[k * NODES + a] = at[k] + self.size * EDGES[2] * shake * random();
            }
        }
        Case {
            label: format!("{label}, element {group}, size {:e}", self.size),
            group,
            current,
            step_mm: STEP * self.size * EDGES[2],
        }
    }

    fn random_cases(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for seed in 0..REPEATS as u64 {
            let mut random = noise(100 + seed);
            let f = Matrix3::identity() + Matrix3::from_fn(|_, _| 0.15 * random());
            let turn = *Rotation3::from_euler_angles(3.0 * random(), random(), 3.0 * random()).matrix();
            for group in 0..2 {
                cases.push(self.case("random map", group, &f, 0.03, seed));
                cases.push(self.case("random map, turned", group, &(turn * f), 0.03, seed));
            }
        }
        cases
    }
}

fn check_elasticity() {
    for size in SIZES {
        let solids = solids(size);
        let effect = Elasticity { geometry: &solids.geometry, materials: &solids.materials };
        check_effect("elasticity", &effect, &solids.random_cases());
    }
}

const LAWS: [NeoHookean; 2] = [NeoHookean::Logarithmic, NeoHookean::Isochoric];

fn check_finite_strain() {
    for size in SIZES {
        let solids = solids(size);
        let mut cases = solids.random_cases();
        let flattened = Matrix3::from_diagonal(&Vector3::new(1.3, 0.9, 0.06));
        for seed in 0..REPEATS as u64 {
            // A step is then small against what is left of the element.
            let mut case = solids.case("near inversion", seed as usize % 2, &flattened, 0.002, seed);
            case.step_mm *= 0.06;
            cases.push(case);
        }
        for law in LAWS {
            let effect = FiniteStrain { geometry: &solids.geometry, materials: &solids.materials, law };
            check_effect("finite_strain", &effect, &cases);
            for case in &cases {
                assert!(check_prediction(&effect, case), "the Hessian does not see the stresses: {}", case.label);
            }
        }
    }
}

/// Steps of the rows of effects with memory (s), and the relaxation times around them.
const MEMORY_STEPS_S: [f64; 3] = [1e-6, 0.05, 1e3];

fn check_viscoelasticity() {
    let network = |relaxation_time_s, modulus_ratio| Network { relaxation_time_s, modulus_ratio };
    for size in SIZES {
        let solids = solids(size);
        let mut networks = Networks::at_rest(vec![7.0, 3.0], vec![network(0.02, 2.0), network(5.0, 0.7)]);
        let cases = solids.random_cases();
        for (round, step_s) in MEMORY_STEPS_S.into_iter().enumerate() {
            check_effect("viscoelasticity", &networks.step(&solids.geometry, step_s), &cases);
            // What is remembered from now on is a deformed state, not rest.
            let mut positions = solids.rest.clone();
            let mut random = noise(70 + round as u64);
            for coordinate in &mut positions {
                *coordinate *= 1.1;
                *coordinate += 0.02 * size * EDGES[2] * random();
            }
            networks.commit(&solids.geometry, &solids.stencils, &positions, 0.01);
        }
    }
}

fn check_inertia() {
    for size in SIZES {
        let solids = solids(size);
        let coasting: Vec<f64> = solids.rest.iter().map(|x| 1.2 * x + 0.01 * size).collect();
        let (stencils, rest) = face(size);
        let faces = ContactFaces::new(&stencils, &rest, 3);
        for step_s in MEMORY_STEPS_S {
            let density_kg_per_mm3 = &[1e-6, 1.2e-6];
            let inertia = Inertia {
                geometry: &solids.geometry,
                stencils: &solids.stencils,
                density_kg_per_mm3,
                coasting: &coasting,
                step_s,
            };
            check_effect("inertia", &inertia, &solids.random_cases());
            let drag =
                VitreousDrag { faces: &faces, stencils: &stencils, start: &rest, drag_kpa_s_per_mm: 2.7e-3, step_s };
            let mut random = noise(9);
            let current = vec![0.0; rest.len()];
            let current: Vec<f64> = current.iter().map(|_| size * RADIUS * random()).collect();
            let case = Case { label: format!("drag, size {size:e}"), group: 0, current, step_mm: STEP * RADIUS * size };
            check_effect("inertia", &drag, &[case]);
        }
    }
}

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

#[test]
fn elasticity_is_finite_strain_at_rest() {
    let solids = solids(1.0);
    let case = solids.case("rest", 0, &Matrix3::identity(), 0.0, 0);
    let local = Local { current: &case.current, group: 0, predicted: &[] };
    let n = 3 * NODES;
    let small = Elasticity { geometry: &solids.geometry, materials: &solids.materials };
    let small = added(n * n, |out| small.add_hessian(&local, out));
    let finite = |law| {
        let effect = FiniteStrain { geometry: &solids.geometry, materials: &solids.materials, law };
        added(n * n, |out| effect.add_hessian(&local, out))
    };
    let logarithmic = finite(NeoHookean::Logarithmic);
    let error = (0..n).flat_map(|i| (0..=i).map(move |j| i * n + j)).map(|at| (small[at] - logarithmic[at]).abs());
    let error = error.fold(0.0, f64::max) / largest(&small);
    assert!(error < ROUNDOFF, "{error:e}");
    // The isochoric law projects the whole volume change and the others only their λ part: equal where it is uniform.
    let mut random = noise(31);
    let map = Matrix3::from_fn(|_, _| random());
    let moved: Vec<f64> =
        (0..n).map(|at| (0..3).map(|k| map[(at / NODES, k)] * case.current[k * NODES + at % NODES]).sum()).collect();
    let energy = |hessian: &[f64]| -> f64 {
        let entry = |i: usize, j: usize| hessian[i.max(j) * n + i.min(j)] * moved[i] * moved[j];
        (0..n * n).map(|at| entry(at / n, at % n)).sum()
    };
    let (a, b) = (energy(&small), energy(&finite(NeoHookean::Isochoric)));
    assert!(a > 0.0 && (a - b).abs() < 1e2 * ROUNDOFF * a, "{a} {b}");
}

#[test]
fn a_turn_costs_finite_strain_nothing_and_elasticity_something() {
    let solids = solids(1.0);
    let turn = *Rotation3::from_euler_angles(0.4, -0.3, 1.0).matrix();
    let case = solids.case("turned", 1, &turn, 0.0, 0);
    let local = Local { current: &case.current, group: 1, predicted: &[] };
    let (geometry, materials) = (&solids.geometry, &solids.materials[..]);
    let scale = Elasticity { geometry, materials }.energy(&local);
    assert!(scale > 0.0);
    for law in LAWS {
        let energy = FiniteStrain { geometry, materials, law }.energy(&local);
        assert!(energy.abs() < ROUNDOFF * scale, "{law:?} {energy}");
    }
}

#[test]
fn an_inverted_element_is_refused_and_steps_stop_before_it() {
    let solids = solids(1.0);
    let mirrored = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -0.1));
    let rest = solids.case("rest", 0, &Matrix3::identity(), 0.0, 0);
    let inverted = solids.case("inverted", 0, &mirrored, 0.0, 0);
    let step: Vec<f64> = inverted.current.iter().zip(&rest.current).map(|(a, b)| a - b).collect();
    for law in LAWS {
        let effect = FiniteStrain { geometry: &solids.geometry, materials: &solids.materials, law };
        let local = Local { current: &inverted.current, group: 0, predicted: &[] };
        assert_eq!(effect.energy(&local), f64::INFINITY);
        let mut gradient = vec![0.0; 3 * NODES];
        effect.add_gradient(&local, &mut gradient);
        assert!(gradient.iter().all(|force| force.is_nan()));
        let local = Local { current: &rest.current, group: 0, predicted: &[] };
        let share = effect.max_step(&local, &step);
        assert!(share > 0.0 && share < 1.0, "{share}");
        let stopped: Vec<f64> = rest.current.iter().zip(&step).map(|(x, s)| x + share * s).collect();
        assert!(effect.energy(&Local { current: &stopped, group: 0, predicted: &[] }).is_finite());
        let back: Vec<f64> = step.iter().map(|s| -0.1 * s).collect();
        assert_eq!(effect.max_step(&local, &back), 1.0, "a step that stretches is not cut");
    }
}
