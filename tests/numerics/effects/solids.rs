//! The rows of the effects on elements, and what these effects promise of each other.

use nalgebra::{Matrix3, Rotation3, Vector3};
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::elasticity::Elasticity;
use retina_core::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use retina_core::effects::solid::{Base, SolidGeometry};
use retina_core::effects::viscoelasticity::{Network, Networks};
use retina_core::mesh::element::{NODE_OFFSETS, NODES};
use retina_tests::tolerance::ROUNDOFF;

use super::{Case, MEMORY_STEPS_S, REPEATS, SIZES, STEP, added, check_effect, check_prediction, largest};
use crate::meshes::noise;

/// Two distorted elements side by side and their materials.
pub struct Solids {
    pub stencils: Stencils,
    pub rest: Vec<f64>,
    pub geometry: SolidGeometry,
    pub materials: Vec<Lame>,
    pub size: f64,
}

/// Edges of an element (mm) before it is scaled and distorted.
const EDGES: [f64; 3] = [0.12, 0.1, 0.08];

pub fn solids(size: f64) -> Solids {
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

    pub fn random_cases(&self) -> Vec<Case> {
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

pub fn check_elasticity() {
    for size in SIZES {
        let solids = solids(size);
        let effect = Elasticity { geometry: &solids.geometry, materials: &solids.materials };
        check_effect("elasticity", &effect, &solids.random_cases());
    }
}

pub const LAWS: [NeoHookean; 2] = [NeoHookean::Logarithmic, NeoHookean::Isochoric];

pub fn check_finite_strain() {
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

pub fn check_viscoelasticity() {
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

/// What a fixed base leaves out, and that it leaves out nothing else.
#[test]
fn a_fixed_base_leaves_out_what_belongs_to_it() {
    let solids = solids(1.0);
    let (materials, n) = (&solids.materials[..], 3 * NODES);
    let based = solids.geometry.clone().on(vec![Base::Fixed, Base::Free]);
    let of_base = |at: usize| NODE_OFFSETS[at % NODES][2] == 0;
    let networks = Networks::at_rest(vec![7.0, 3.0], vec![Network { relaxation_time_s: 0.02, modulus_ratio: 2.0 }]);
    let compare = |whole: &dyn Effect, based: &dyn Effect, case: &Case| {
        let local = Local { current: &case.current, group: case.group, predicted: &[] };
        let forces = [whole, based].map(|effect| added(n, |out| effect.add_gradient(&local, out)));
        let matrices = [whole, based].map(|effect| added(n * n, |out| effect.add_hessian(&local, out)));
        let left_out = |at: usize| case.group == 0 && of_base(at);
        for row in 0..n {
            let expected = if left_out(row) { 0.0 } else { forces[0][row] };
            assert_eq!(forces[1][row], expected, "{}, force {row}", case.label);
            for column in 0..=row {
                let [expected, found] = [0, 1].map(|which| matrices[which][row * n + column]);
                let needed = !left_out(row) && !left_out(column);
                assert!(!needed || found == expected, "{}, entry {row}, {column}: {found} {expected}", case.label);
            }
        }
    };
    for case in solids.random_cases() {
        let geometry = &solids.geometry;
        for law in LAWS {
            let whole = FiniteStrain { geometry, materials, law };
            compare(&whole, &FiniteStrain { geometry: &based, materials, law }, &case);
        }
        compare(&Elasticity { geometry, materials }, &Elasticity { geometry: &based, materials }, &case);
        compare(&networks.step(geometry, 0.05), &networks.step(&based, 0.05), &case);
    }
}
