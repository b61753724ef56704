//! A column of a layer that swings in shear: period and damping of backward Euler against closed forms, its energy, and the vitreous' drag.

use std::f64::consts::PI;

use nalgebra::Vector3;
use retina_core::assemble::{Dofs, Pattern, Scratch, energy};
use retina_core::effect::{Effect, Local, Stencils, Term};
use retina_core::effects::contact::ContactFaces;
use retina_core::effects::finite_strain::{FiniteStrain, NeoHookean};
use retina_core::effects::inertia::{Inertia, Momentum, VitreousDrag};
use retina_core::effects::solid::SolidGeometry;
use retina_core::mesh::element::{FACE_NODES, NODE_OFFSETS, TOP_NODES};
use retina_core::progress::Silent;
use retina_core::solve::newton::{Drive, Globalization, NewtonSettings, System, Workspace};
use retina_core::solve::sparse::{Precision, SymbolicFactor};
use retina_tests::tolerance::ROUNDOFF;

use crate::finite_element::block::{Mesh, block, lame};

/// Height and width of the column (mm).
const SIZE_MM: [f64; 2] = [0.25, 0.05];
const DENSITY_KG_PER_MM3: f64 = 1.05e-6;
/// Shear modulus of the layer (kPa): E = 20, ν = 0.49.
const YOUNGS_KPA: f64 = 20.0;
const POISSON: f64 = 0.49;

/// A column that moves along x alone and is held at its foot.
struct Column {
    mesh: Mesh,
    geometry: SolidGeometry,
    dofs: Dofs,
    pattern: Pattern,
    symbolic: SymbolicFactor,
    density: Vec<f64>,
}

impl Column {
    fn new() -> Self {
        let [height, width] = SIZE_MM;
        let mesh = Mesh::glued(&block([1, 1, 6], |[x, y, z]| [width * x, width * y, height * z]));
        let geometry = SolidGeometry::new(&mesh.elements, &mesh.rest).expect("a block");
        let fixed = |vertex: usize, component: usize| component > 0 || mesh.at(vertex).z < 1e-9;
        let dofs = Dofs::new(mesh.vertices(), 0..mesh.vertices(), fixed, None);
        let pattern = Pattern::new(&dofs, &[&mesh.elements]);
        let symbolic = SymbolicFactor::new(&pattern).expect("analysed");
        let density = vec![DENSITY_KG_PER_MM3; mesh.elements.len()];
        Column { mesh, geometry, dofs, pattern, symbolic, density }
    }

    fn period_s() -> f64 {
        let mu = YOUNGS_KPA / (2.0 * (1.0 + POISSON));
        4.0 * SIZE_MM[0] / (mu / DENSITY_KG_PER_MM3).sqrt()
    }

    /// The slowest mode with this amplitude (mm).
    fn swung(&self, amplitude_mm: f64) -> Vec<f64> {
        self.mesh.moved(|at| Vector3::x() * (amplitude_mm * (0.5 * PI * at.z / SIZE_MM[0]).sin()))
    }

    /// Index of a vertex at the top, and its displacement along x (mm).
    fn top_mm(&self, positions: &[f64]) -> f64 {
        let vertex = self.mesh.vertex([0.0, 0.0, SIZE_MM[0]]);
        positions[3 * vertex] - self.mesh.rest[3 * vertex]
    }

    /// One step under a uniform load along x (mN at each free unknown); the total energy after it (µJ).
    fn step(&self, momentum: &mut Momentum, step_s: f64, load_mn: f64) -> f64 {
        let materials = vec![lame(YOUNGS_KPA, POISSON); self.mesh.elements.len()];
        let solid = FiniteStrain { geometry: &self.geometry, materials: &materials, law: NeoHookean::Logarithmic };
        let coasting = momentum.coasting(step_s);
        let inertia = Inertia {
            geometry: &self.geometry,
            stencils: &self.mesh.elements,
            density_kg_per_mm3: &self.density,
            coasting: &coasting,
            step_s,
        };
        let term = |effect| Term { effect, stencils: &self.mesh.elements, set: 0 };
        let terms = [term(&solid as &dyn Effect), term(&inertia)];
        let (dofs, pattern, symbolic) = (&self.dofs, &self.pattern, &self.symbolic);
        let dead_load = vec![load_mn; dofs.free];
        let system = System { terms: &terms, dofs, pattern, symbolic, driven: None, dead_load: &dead_load };
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization: Globalization::PredictedStress,
            force_scale_mn: 1e-3,
            tolerance_mn: 1e-12,
            max_iterations: 50,
            max_weakened: 50,
            max_travel_mm: 1.0,
        };
        let mut positions = momentum.positions().to_vec();
        let mut workspace = Workspace::new(pattern, symbolic);
        system.solve(&mut positions, Drive::Held, &settings, &mut workspace, &mut Silent).expect("a step");
        momentum.commit(&positions, step_s);
        self.energy(momentum)
    }

    fn energy(&self, momentum: &Momentum) -> f64 {
        let materials = vec![lame(YOUNGS_KPA, POISSON); self.mesh.elements.len()];
        let solid = FiniteStrain { geometry: &self.geometry, materials: &materials, law: NeoHookean::Logarithmic };
        let terms = [Term { effect: &solid, stencils: &self.mesh.elements, set: 0 }];
        energy(&terms, momentum.positions(), &mut Scratch::default())
            + momentum.kinetic_energy_uj(&self.geometry, &self.mesh.elements, &self.density)
    }
}

#[test]
fn a_layer_swings_with_the_period_of_its_quarter_wave() {
    let column = Column::new();
    let period_s = Column::period_s();
    let steps = 400;
    let step_s = period_s / f64::from(steps);
    let amplitude_mm = 1e-4;
    let mut momentum = Momentum::at_rest(column.swung(amplitude_mm));
    let (mut before, mut crossings) = (amplitude_mm, Vec::new());
    for k in 1..=steps {
        column.step(&mut momentum, step_s, 0.0);
        let now = column.top_mm(momentum.positions());
        if before * now <= 0.0 {
            crossings.push(f64::from(k - 1) + before / (before - now));
        }
        before = now;
    }
    assert_eq!(crossings.len(), 2);
    // Half a period between crossings; backward Euler lengthens it by (ωh)²/3 = 8e-5.
    let found_s = 2.0 * (crossings[1] - crossings[0]) * step_s;
    let phase = 2.0 * PI / f64::from(steps);
    let exact_s = period_s * phase / phase.atan();
    assert!((found_s / exact_s - 1.0).abs() < 2e-4, "{found_s} s, {exact_s} s; without the scheme's part {period_s} s");
    // Over the whole period the amplitude falls as the scheme says.
    let left = before / amplitude_mm;
    let exact = (1.0 + phase * phase).powf(-0.5 * f64::from(steps)) * (f64::from(steps) * (phase.atan() - phase)).cos();
    assert!((left - exact).abs() < 2e-3, "{left} against {exact}");
}

#[test]
fn energy_never_rises_without_a_load_whatever_the_steps() {
    let column = Column::new();
    let mut random = fastrand::Rng::with_seed(5);
    // What rounding leaves of the energy of tissue at rest: the last digit of modulus times volume.
    let [height, width] = SIZE_MM;
    let noise_uj = f64::EPSILON * YOUNGS_KPA * height * width * width;
    for amplitude_mm in [1e-3, 0.08] {
        let mut momentum = Momentum::at_rest(column.swung(amplitude_mm));
        let mut before = column.energy(&momentum);
        let first = before;
        for _ in 0..60 {
            let step_s = 10.0_f64.powf(4.0 * random.f64() - 6.0);
            let after = column.step(&mut momentum, step_s, 0.0);
            assert!(
                after <= before * (1.0 + ROUNDOFF) + ROUNDOFF * first + noise_uj,
                "{after} µJ after {before} µJ, step {step_s} s"
            );
            before = after;
        }
        assert!(column.step(&mut momentum, 1e3, 0.0) < 1e-6 * first, "a long step is rest");
        // A load works on the column.
        let rest = column.energy(&momentum);
        assert!(column.step(&mut momentum, 1e-4, 1e-4) > rest);
    }
}

#[test]
fn momentum_is_kept_and_drag_is_area_times_velocity() {
    // Momentum alone: constant velocity is kept to the last digit.
    let mut momentum = Momentum::at_rest(vec![0.0; 6]);
    momentum.commit(&[1.0, 0.0, 0.0, 0.0, 2.0, 0.0], 0.5);
    assert_eq!(momentum.coasting(0.25), [1.5, 0.0, 0.0, 0.0, 3.0, 0.0]);
    let group = FACE_NODES + 1;
    let side_mm = 0.3;
    let mut rest: Vec<f64> = TOP_NODES
        .iter()
        .flat_map(|&a| [0.5 * side_mm * NODE_OFFSETS[a][0] as f64, 0.5 * side_mm * NODE_OFFSETS[a][1] as f64, 0.0])
        .collect();
    rest.extend([0.1, 0.1, 1.0]);
    let stencils = Stencils { group_size: group, vertices: (0..group as u32).collect() };
    let faces = ContactFaces::new(&stencils, &rest, 3);
    let (drag_kpa_s_per_mm, step_s, moved_mm) = (2.7e-3, 0.02, [0.01, -0.02, 0.03]);
    let drag = VitreousDrag { faces: &faces, stencils: &stencils, start: &rest, drag_kpa_s_per_mm, step_s };
    let mut current = vec![0.0; 3 * group];
    stencils.gather(0, &rest, &mut current);
    for k in 0..3 {
        for a in 0..group {
            current[k * group + a] += moved_mm[k];
        }
    }
    let mut forces = vec![0.0; 3 * group];
    drag.add_gradient(&Local { current: &current, group: 0, predicted: &[] }, &mut forces);
    for k in 0..3 {
        let total: f64 = forces[k * group..(k + 1) * group].iter().sum();
        let exact = drag_kpa_s_per_mm * side_mm * side_mm * moved_mm[k] / step_s;
        assert!((total - exact).abs() < ROUNDOFF * exact.abs(), "{total} mN against {exact} mN");
        assert_eq!(forces[(k + 1) * group - 1], 0.0, "the needle is not dragged");
    }
}
