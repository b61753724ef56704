//! `pressure` inside a thick sphere: Lamé at small strain, neo-Hookean inflation with its limit point.
//!
//! Incompressible neo-Hookean sphere A ≤ R ≤ B, inner stretch λ_a: p/µ = ½ [(4/λ_b + λ_b⁻⁴) − (4/λ_a + λ_a⁻⁴)] with b³ − B³ = a³ − A³. With A = 1 and B = 2 the pressure has its
//! maximum 0.8164236 µ at λ_a = 1.82815: below it a given pressure has an equilibrium, above it none.

use std::f64::consts::FRAC_PI_4;

use nalgebra::Vector3;
use retina_core::assemble::{Dofs, Pattern};
use retina_core::effect::{Effect, Stencils, Term};
use retina_core::effects::elasticity::Elasticity;
use retina_core::effects::finite_strain::{FiniteStrain, NeoHookean};
use retina_core::effects::pressure::Pressure;
use retina_core::effects::solid::SolidGeometry;
use retina_core::mesh::element::TOP_NODES;
use retina_core::progress::Silent;
use retina_core::solve::newton::{Drive, Globalization, NewtonError, NewtonSettings, System, Workspace};
use retina_core::solve::sparse::{Precision, SymbolicFactor};

use super::block::{Law, Mesh, block, lame};

/// An octant of the shell 1 ≤ r ≤ 2 whose top faces are the inner sphere.
fn octant(across: usize, through: usize) -> Mesh {
    let side = |first: usize| {
        block([across, across, through], move |[s, t, w]| {
            let mut direction = Vector3::zeros();
            // The two directions across change places, for the radius runs the other way.
            direction[first] = 1.0;
            direction[(first + 1) % 3] = (FRAC_PI_4 * t).tan();
            direction[(first + 2) % 3] = (FRAC_PI_4 * s).tan();
            (direction.normalize() * (2.0 - w)).into()
        })
    };
    Mesh::glued(&[side(0), side(1), side(2)].concat())
}

/// The octant under inner pressures that rise from step to step; the mean stretch of the inner sphere after each.
struct Sphere {
    mesh: Mesh,
    inner: Stencils,
    geometry: SolidGeometry,
    dofs: Dofs,
    pattern: Pattern,
    symbolic: SymbolicFactor,
}

impl Sphere {
    fn new(across: usize, through: usize) -> Self {
        let mesh = octant(across, through);
        let mut inner = Stencils { group_size: TOP_NODES.len(), vertices: Vec::new() };
        for element in 0..mesh.elements.len() {
            let top = TOP_NODES.map(|a| mesh.elements.group(element)[a]);
            if top.iter().all(|&v| (mesh.at(v as usize).norm() - 1.0).abs() < 1e-9) {
                inner.vertices.extend(top);
            }
        }
        let geometry = SolidGeometry::new(&mesh.elements, &mesh.rest).expect("a shell");
        let fixed = |v: usize, k: usize| mesh.at(v)[k].abs() < 1e-9;
        let dofs = Dofs::new(mesh.vertices(), 0..mesh.vertices(), fixed, None);
        let pattern = Pattern::new(&dofs, &[&mesh.elements, &inner]);
        let symbolic = SymbolicFactor::new(&pattern).expect("analysed");
        Sphere { mesh, inner, geometry, dofs, pattern, symbolic }
    }

    fn inflate(&self, law: Law, poisson: f64, pressure_kpa: f64, positions: &mut [f64]) -> Result<(), NewtonError> {
        // µ = 1 kPa.
        let materials = vec![lame(2.0 * (1.0 + poisson), poisson); self.mesh.elements.len()];
        let (geometry, materials) = (&self.geometry, &materials[..]);
        let solid: Box<dyn Effect> = match law {
            Law::Linear => Box::new(Elasticity { geometry, materials }),
            Law::NeoHookean(law) => Box::new(FiniteStrain { geometry, materials, law }),
        };
        let pressure = Pressure { pressure_kpa };
        let terms = [
            Term { effect: solid.as_ref(), stencils: &self.mesh.elements, set: 0 },
            Term { effect: &pressure, stencils: &self.inner, set: 1 },
        ];
        let (dofs, pattern, symbolic) = (&self.dofs, &self.pattern, &self.symbolic);
        let system = System { terms: &terms, dofs, pattern, symbolic, driven: None, dead_load: &[] };
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization: Globalization::PredictedStress,
            force_scale_mn: pressure_kpa.abs(),
            tolerance_mn: 1e-7 * pressure_kpa.abs(),
            max_iterations: 40,
            max_weakened: 40,
            max_travel_mm: 1.0,
        };
        let mut workspace = Workspace::new(pattern, symbolic);
        system.solve(positions, Drive::Held, &settings, &mut workspace, &mut Silent).map(|_| ())
    }

    /// Mean, least and largest stretch of the inner sphere.
    fn stretch(&self, positions: &[f64]) -> [f64; 3] {
        let mut nodes: Vec<u32> = self.inner.vertices.clone();
        nodes.sort_unstable();
        nodes.dedup();
        let radii: Vec<f64> =
            nodes.iter().map(|&v| Vector3::from_row_slice(&positions[3 * v as usize..][..3]).norm()).collect();
        let fold = |f: fn(f64, f64) -> f64| radii.iter().copied().reduce(f).expect("nodes");
        [radii.iter().sum::<f64>() / radii.len() as f64, fold(f64::min), fold(f64::max)]
    }
}

#[test]
fn lames_sphere_under_the_pressure_effect() {
    let sphere = Sphere::new(4, 4);
    for poisson in [0.3, 0.4999] {
        // Small, so that the load stays on the rest surface.
        let pressure_kpa = 3e-4;
        let mut positions = sphere.mesh.rest.clone();
        sphere.inflate(Law::Linear, poisson, pressure_kpa, &mut positions).expect("an equilibrium");
        let youngs = 2.0 * (1.0 + poisson);
        // u(a) = p a³ / (E (b³ − a³)) [(1 − 2 ν) a + (1 + ν) b³ / (2 a²)] with a = 1, b = 2.
        let exact = pressure_kpa / (7.0 * youngs) * ((1.0 - 2.0 * poisson) + 4.0 * (1.0 + poisson));
        let [mean, low, high] = sphere.stretch(&positions).map(|stretch| (stretch - 1.0) / exact - 1.0);
        println!("ν {poisson}: inner displacement off by {mean:.1e} ({low:.1e} to {high:.1e})");
        assert!(low.abs().max(high.abs()) < 2e-3, "ν {poisson}: {low:e} to {high:e}");
    }
}

#[test]
fn neo_hookean_inflation_and_its_limit_point() {
    const POISSON: f64 = 0.4999;
    let law = Law::NeoHookean(NeoHookean::Logarithmic);
    let sphere = Sphere::new(2, 4);
    let mut positions = sphere.mesh.rest.clone();
    for (stretch, pressure) in [(1.05, 0.15808143), (1.1, 0.28715485), (1.25, 0.55186854), (1.5, 0.75543312)] {
        sphere.inflate(law, POISSON, pressure, &mut positions).unwrap_or_else(|e| panic!("λ {stretch}: {e}"));
        let [mean, low, high] = sphere.stretch(&positions);
        println!("p/µ {pressure}: λ {mean:.5} ({low:.5} to {high:.5}), exact {stretch}");
        // The slope dλ/dp grows without bound towards the limit point.
        assert!((mean - stretch).abs() < 0.01 * (stretch - 1.0) && high - low < 0.02 * (stretch - 1.0));
    }
    const LIMIT: f64 = 0.8164236;
    sphere.inflate(law, POISSON, 0.985 * LIMIT, &mut positions).expect("an equilibrium just below the limit point");
    let [below, ..] = sphere.stretch(&positions);
    assert!(below > 1.5 && below < 1.828, "on the branch before the limit point: {below}");
    let beyond = sphere.inflate(law, POISSON, 1.03 * LIMIT, &mut positions.clone());
    println!("λ {below:.4} below the limit point; above it: {beyond:?}");
    assert!(beyond.is_err(), "no pressure above the limit point is held");
}
