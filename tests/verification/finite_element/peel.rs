//! A film peeled off a rigid base at a right angle: the force that keeps it going is the fracture energy times the width.
//!
//! Closed form (Rivlin; Kendall 1975): a film that is pulled off at the angle θ lets go of the area b da while the force goes F (λ − cos θ) da further and the film
//! stores its strain energy W per rest length, so F (λ − cos θ) − W = G b. With θ = 90° and a film of modulus E: F = G b (1 − F/(2 E h b)) to first
//! order in the strain, 0.7 % below G b here. The bending of the film moves along with the peel and costs nothing.

use nalgebra::Vector3;
use retina_core::assemble::{Dofs, Pattern, Scratch, gradient};
use retina_core::effect::{Effect, Local, Stencils, Term};
use retina_core::effects::adhesion::{Adhesion, Bond, GROUP, Interface};
use retina_core::effects::finite_strain::{FiniteStrain, NeoHookean};
use retina_core::effects::solid::SolidGeometry;
use retina_core::mesh::element::{NODE_OFFSETS, TOP_NODES};
use retina_core::progress::Silent;
use retina_core::solve::newton::{Drive, Globalization, NewtonSettings, System, Workspace};
use retina_core::solve::sparse::{Precision, SymbolicFactor};

use super::block::{Mesh, block, lame};

const LENGTH_MM: f64 = 1.0;
const WIDTH_MM: f64 = 0.05;
const THICKNESS_MM: f64 = 0.05;
const YOUNGS_KPA: f64 = 200.0;
const CELLS: usize = 25;
/// Length that is free from the start, at x = 0 (mm).
const FREE_MM: f64 = 0.2;
const FRACTURE_ENERGY: f64 = 0.14;

/// Steady peel force (mN) over the last of `steps` lifts of the free end.
fn peel_force(fracture_energy: f64) -> f64 {
    let mesh = Mesh::glued(&block([CELLS, 1, 1], |[s, t, w]| [LENGTH_MM * s, WIDTH_MM * t, THICKNESS_MM * w]));
    let film = mesh.vertices();
    let mut rest = mesh.rest.clone();
    let mut interface = Stencils { group_size: GROUP, vertices: Vec::new() };
    for element in 0..mesh.elements.len() {
        let group = mesh.elements.group(element);
        let bottom = TOP_NODES.map(|a| {
            let [i, j, _] = NODE_OFFSETS[a];
            let node = NODE_OFFSETS.iter().position(|&offset| offset == [i, j, 0]).expect("a node below");
            group[node]
        });
        if bottom.iter().any(|&v| mesh.at(v as usize).x < FREE_MM - 1e-9) {
            continue;
        }
        // The base: vertices of its own, all fixed.
        for &v in &bottom {
            interface.vertices.push((rest.len() / 3) as u32);
            rest.extend_from_slice(mesh.at(v as usize).as_slice());
        }
        interface.vertices.extend(bottom);
    }
    let vertices = rest.len() / 3;
    let pulled = |v: usize| v < film && mesh.at(v).x < 1e-9 && mesh.at(v).z > THICKNESS_MM - 1e-9;
    // Plane strain, so that the width is that of the base.
    let fixed = |v: usize, k: usize| v >= film || k == 1 || (k == 2 && pulled(v));
    let geometry = SolidGeometry::new(&mesh.elements, &mesh.rest).expect("a film");
    let materials = vec![lame(YOUNGS_KPA, 0.0); mesh.elements.len()];
    let solid = FiniteStrain { geometry: &geometry, materials: &materials, law: NeoHookean::Logarithmic };
    let bonded = Interface::new(&interface, &rest);
    let bond = Bond { strength_kpa: 10.0, fracture_energy_mn_per_mm: fracture_energy, stiffness_kpa_per_mm: 2e4 };
    let dofs = Dofs::new(vertices, 0..vertices, fixed, None);
    let pattern = Pattern::new(&dofs, &[&mesh.elements, &interface]);
    let symbolic = SymbolicFactor::new(&pattern).expect("analysed");
    let mut workspace = Workspace::new(&pattern, &symbolic);
    let all = Dofs::new(vertices, 0..vertices, |_, _| false, None);
    let mut positions = rest.clone();
    let mut largest_mm = vec![0.0; bonded.points() * interface.len()];
    let mut forces = Vec::new();
    let (steps, lift_mm) = (110, 0.005);
    for _step in 0..steps {
        for v in (0..film).filter(|&v| pulled(v)) {
            positions[3 * v + 2] += lift_mm;
        }
        let adhesion = Adhesion { interface: &bonded, bond, largest_mm: &largest_mm, opened: None };
        let terms = [
            Term { effect: &solid, stencils: &mesh.elements, set: 0 },
            Term { effect: &adhesion as &dyn Effect, stencils: &interface, set: 1 },
        ];
        let (dofs, pattern, symbolic) = (&dofs, &pattern, &symbolic);
        let system = System { terms: &terms, dofs, pattern, symbolic, driven: None, dead_load: &[] };
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization: Globalization::LineSearch,
            force_scale_mn: fracture_energy * WIDTH_MM,
            tolerance_mn: 1e-5 * fracture_energy * WIDTH_MM,
            max_iterations: 300,
            max_weakened: 300,
            max_travel_mm: 1.0,
        };
        system.solve(&mut positions, Drive::Held, &settings, &mut workspace, &mut Silent).expect("an equilibrium");
        let mut current = vec![0.0; 3 * GROUP];
        let mut openings = Vec::with_capacity(largest_mm.len());
        for group in 0..interface.len() {
            interface.gather(group, &positions, &mut current);
            openings.extend(adhesion.openings(&Local { current: &current, group, predicted: &[] }));
        }
        let mut residual = vec![0.0; 3 * vertices + 3];
        gradient(&terms, &positions, &all, &mut Scratch::default(), &mut residual);
        forces.push((0..film).filter(|&v| pulled(v)).map(|v| residual[3 * v + 2]).sum::<f64>());
        largest_mm = openings;
    }
    let parted = largest_mm.iter().filter(|&&largest| bond.damage(largest) == 1.0).count() as f64;
    let share = parted / largest_mm.len() as f64;
    assert!(share > 0.2 && share < 0.9, "the peel front has left the middle: {share}");
    let last = &forces[forces.len() - 30..];
    let mean = last.iter().sum::<f64>() / last.len() as f64;
    let spread = last.iter().fold(0.0_f64, |s, f| s.max((f / mean - 1.0).abs()));
    println!(
        "G {fracture_energy} N/m: steady force {mean:.5e} mN, ± {:.1} %, {:.0} % parted, top {}",
        100.0 * spread,
        100.0 * share,
        Vector3::from_row_slice(&positions[..3])
    );
    mean
}

#[test]
fn the_peel_force_is_the_fracture_energy_times_the_width() {
    for fracture_energy in [FRACTURE_ENERGY, 0.5 * FRACTURE_ENERGY] {
        let force = peel_force(fracture_energy);
        let film = YOUNGS_KPA * THICKNESS_MM;
        let exact = fracture_energy * WIDTH_MM * (1.0 - 0.5 * fracture_energy / film);
        println!("peel force {force:.5e} mN, closed form {exact:.5e} mN: {:+.2} %", 100.0 * (force / exact - 1.0));
        assert!((force / exact - 1.0).abs() < 0.03, "{force} for {exact}");
    }
}
