//! One element whose nodes follow a homogeneous deformation: stresses of the networks against the Prony series' closed forms.

use nalgebra::{Matrix3, Vector3};
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use retina_core::effects::solid::SolidGeometry;
use retina_core::effects::viscoelasticity::{Network, Networks};
use retina_core::mesh::element::{NODE_OFFSETS, NODES};
use retina_core::tissue::rate::RateProperties;
use retina_tests::tolerance::{DERIVATIVE, DISCRETISATION, ROUNDOFF};

/// Lasting shear modulus (kPa).
const SHEAR_KPA: f64 = 6.7;
/// Edge of the element (mm).
const EDGE_MM: f64 = 0.1;
const VOLUME_MM3: f64 = EDGE_MM * EDGE_MM * EDGE_MM;

struct Element {
    stencils: Stencils,
    rest: Vec<f64>,
    geometry: SolidGeometry,
}

impl Element {
    fn new() -> Self {
        let rest: Vec<f64> = NODE_OFFSETS.iter().flat_map(|offset| offset.map(|o| 0.5 * EDGE_MM * o as f64)).collect();
        let stencils = Stencils { group_size: NODES, vertices: (0..NODES as u32).collect() };
        let geometry = SolidGeometry::new(&stencils, &rest).expect("a cube");
        Element { stencils, rest, geometry }
    }

    fn positions(&self, f: &Matrix3<f64>) -> Vec<f64> {
        self.rest.chunks(3).flat_map(|x| <[f64; 3]>::from(f * Vector3::from_row_slice(x))).collect()
    }

    /// First Piola–Kirchhoff stress (kPa) of `effect` under the deformation gradient `f`.
    fn stress(&self, effect: &dyn Effect, f: &Matrix3<f64>) -> Matrix3<f64> {
        let mut current = vec![0.0; 3 * NODES];
        self.stencils.gather(0, &self.positions(f), &mut current);
        let mut forces = vec![0.0; 3 * NODES];
        effect.add_gradient(&Local { current: &current, group: 0, predicted: &[] }, &mut forces);
        let moment = |i: usize, k: usize| (0..NODES).map(|a| forces[i * NODES + a] * self.rest[3 * a + k]).sum::<f64>();
        Matrix3::from_fn(|i, k| moment(i, k) / VOLUME_MM3)
    }

    fn commit(&self, networks: &mut Networks, f: &Matrix3<f64>, step_s: f64) {
        networks.commit(&self.geometry, &self.stencils, &self.positions(f), step_s);
    }
}

fn default_networks() -> Vec<Network> {
    let rate = RateProperties::default();
    let lasting = rate.lasting_share();
    let network = |term: &retina_core::tissue::rate::PronyTerm| Network {
        relaxation_time_s: term.relaxation_time_s,
        modulus_ratio: term.share / lasting,
    };
    rate.retina_relaxation.iter().map(network).collect()
}

fn sheared(gamma: f64) -> Matrix3<f64> {
    let mut f = Matrix3::identity();
    f[(0, 2)] = gamma;
    f
}

#[test]
fn small_shear_relaxes_along_the_prony_series_for_steps_of_any_size() {
    let element = Element::new();
    // Small enough for the linear limit, whose error is of the order of the shear itself.
    let gamma = 1e-6;
    let load_s = 3e-3;
    for holds_s in [&[1e-6, 1e-5, 1e-3, 0.2, 7.0, 400.0, 1000.0][..], &[0.05; 20], &[1000.0; 2]] {
        let mut networks = Networks::at_rest(vec![SHEAR_KPA], default_networks());
        let (mut time_s, mut held_s) = (load_s, 0.0);
        let steps = std::iter::once(&load_s).chain(holds_s);
        for (index, &step_s) in steps.enumerate() {
            if index > 0 {
                held_s += step_s;
                time_s += step_s;
            }
            let stress = element.stress(&networks.step(&element.geometry, step_s), &sheared(gamma))[(0, 2)];
            element.commit(&mut networks, &sheared(gamma), step_s);
            let left = |n: &Network| {
                let x = load_s / n.relaxation_time_s;
                n.modulus_ratio * -(-x).exp_m1() / x * (-held_s / n.relaxation_time_s).exp()
            };
            let exact = gamma * SHEAR_KPA * default_networks().iter().map(left).sum::<f64>();
            let error = (stress - exact).abs() / (gamma * SHEAR_KPA);
            assert!(
                error < 20.0 * gamma,
                "{time_s} s: {stress} kPa, {exact} kPa, off by {error:e} of the lasting stress"
            );
        }
    }
}

#[test]
fn a_sudden_load_meets_the_glassy_modulus_and_a_lasting_one_the_elastic_one() {
    let element = Element::new();
    let networks = vec![Network { relaxation_time_s: 1.0, modulus_ratio: 2.0 }];
    let f = Matrix3::new(1.4, 0.3, 0.0, 0.0, 0.9, -0.2, 0.1, 0.0, 0.8);
    let mut memory = Networks::at_rest(vec![SHEAR_KPA], networks);
    let sudden_s = 1e-9;
    let sudden = element.stress(&memory.step(&element.geometry, sudden_s), &f);
    let glass = Lame { mu: 2.0 * SHEAR_KPA, lambda: 0.0 };
    let elastic = FiniteStrain { geometry: &element.geometry, materials: &[glass], law: NeoHookean::Logarithmic };
    let exact = element.stress(&elastic, &f);
    assert!((sudden - exact).norm() < DERIVATIVE * exact.norm(), "{sudden} against {exact}");
    // Held at finite strain, the stress of one network decays as its exponential, whatever the steps.
    element.commit(&mut memory, &f, sudden_s);
    let mut held_s = 0.0;
    for step_s in [0.1, 0.7, 1e-4, 3.0] {
        held_s += step_s;
        let stress = element.stress(&memory.step(&element.geometry, step_s), &f);
        element.commit(&mut memory, &f, step_s);
        let left = exact * f64::exp(-held_s);
        assert!((stress - left).norm() < DERIVATIVE * exact.norm(), "{held_s} s: {stress} against {left}");
    }
    let lasting = element.stress(&memory.step(&element.geometry, 1e3), &f);
    assert!(lasting.norm() < ROUNDOFF * exact.norm());
}

#[test]
fn a_turned_body_feels_nothing_of_the_turn() {
    let element = Element::new();
    let f = Matrix3::new(1.2, 0.3, 0.0, 0.0, 0.9, -0.2, 0.1, 0.0, 0.95);
    let turn = *nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0).matrix();
    let run = |last: &Matrix3<f64>| {
        let mut networks = Networks::at_rest(vec![SHEAR_KPA], default_networks());
        element.commit(&mut networks, &f, 0.01);
        element.stress(&networks.step(&element.geometry, 0.02), last)
    };
    let (still, turned) = (run(&f), run(&(turn * f)));
    assert!((turn * still - turned).norm() < ROUNDOFF * 10.0 * still.norm());
    assert!((still - turned).norm() > 0.1 * still.norm(), "a turn turns the stress");
}

/// Work per volume (kPa) on a closed loop of `steps` steps that takes `period_s`, by the trapezoidal rule, and the stored energy before and after.
fn loop_work(
    element: &Element,
    networks: &mut Networks,
    path: impl Fn(f64) -> Matrix3<f64>,
    steps: usize,
    period_s: f64,
) -> f64 {
    let step_s = period_s / steps as f64;
    let stress = |networks: &Networks, f: &Matrix3<f64>| element.stress(&networks.step(&element.geometry, step_s), f);
    let mut work = 0.0;
    let mut before = path(0.0);
    let mut stress_before = None;
    for k in 1..=steps {
        let now = path(k as f64 / steps as f64);
        let p = stress(networks, &now);
        let start = stress_before.unwrap_or(p);
        work += 0.5 * (p + start).dot(&(now - before));
        element.commit(networks, &now, step_s);
        (before, stress_before) = (now, Some(p));
    }
    work
}

#[test]
fn a_cycle_loses_what_the_loss_modulus_says() {
    let element = Element::new();
    let (gamma, frequency_hz) = (1e-3, 10.0);
    let omega = 2.0 * std::f64::consts::PI * frequency_hz;
    let mut networks = Networks::at_rest(vec![SHEAR_KPA], default_networks());
    let path = |t: f64| sheared(gamma * (2.0 * std::f64::consts::PI * t).sin());
    // The slow networks need many cycles to forget the first; their loss at this frequency is small.
    let mut work = 0.0;
    for _ in 0..12 {
        work = loop_work(&element, &mut networks, path, 200, 1.0 / frequency_hz);
    }
    let loss = |n: &Network| {
        let x = omega * n.relaxation_time_s;
        n.modulus_ratio * x / (1.0 + x * x)
    };
    let exact = std::f64::consts::PI * gamma * gamma * SHEAR_KPA * default_networks().iter().map(loss).sum::<f64>();
    assert!((work / exact - 1.0).abs() < 0.1 * DISCRETISATION, "{work} against {exact}");
}

#[test]
fn the_default_series_has_the_published_loss_tangent() {
    for decade in 0..=20 {
        let omega = 2.0 * std::f64::consts::PI * 10.0_f64.powf(0.1 * f64::from(decade));
        let (mut storage, mut loss) = (1.0, 0.0);
        for n in default_networks() {
            let x = omega * n.relaxation_time_s;
            storage += n.modulus_ratio * x * x / (1.0 + x * x);
            loss += n.modulus_ratio * x / (1.0 + x * x);
        }
        let tangent = loss / storage;
        assert!((0.2235..0.2525).contains(&tangent), "{tangent} at {omega} rad/s");
    }
}

#[test]
fn loops_dissipate_and_elastic_ones_do_not() {
    let element = Element::new();
    let materials = [Lame { mu: SHEAR_KPA, lambda: 0.0 }];
    let elastic = FiniteStrain { geometry: &element.geometry, materials: &materials, law: NeoHookean::Logarithmic };
    let mut random = fastrand::Rng::with_seed(17);
    for _ in 0..30 {
        let amplitude = [0, 1].map(|_| Matrix3::from_fn(|_, _| 0.3 * (random.f64() - 0.5)));
        let period_s = 10.0_f64.powf(4.0 * random.f64() - 3.0);
        let angle = |t: f64| 2.0 * std::f64::consts::PI * t;
        let path = |t: f64| Matrix3::identity() + amplitude[0] * angle(t).sin() + amplitude[1] * (1.0 - angle(t).cos());
        let mut networks = Networks::at_rest(vec![SHEAR_KPA], default_networks());
        let work = loop_work(&element, &mut networks, path, 400, period_s);
        let stored = networks.stored_energy_uj(&element.geometry) / VOLUME_MM3;
        let mut elastic_work = 0.0;
        for k in 0..400 {
            let (a, b) = (path(f64::from(k) / 400.0), path(f64::from(k + 1) / 400.0));
            elastic_work += 0.5 * (element.stress(&elastic, &a) + element.stress(&elastic, &b)).dot(&(b - a));
        }
        assert!(stored >= 0.0 && work - stored > 0.0, "work {work} kPa, of which {stored} kPa are stored");
        assert!(elastic_work.abs() < 1e-2 * work, "{elastic_work} kPa of {work} kPa");
        // Held still, the networks only lose: nothing is worked on them.
        let (mut before, still) = (stored, path(1.0));
        for step_s in [1e-6, 1e-3, 0.3, 50.0, 1000.0] {
            element.commit(&mut networks, &still, step_s);
            let after = networks.stored_energy_uj(&element.geometry) / VOLUME_MM3;
            assert!(after <= before + ROUNDOFF * SHEAR_KPA, "{after} kPa after {before} kPa");
            before = after;
        }
    }
}
