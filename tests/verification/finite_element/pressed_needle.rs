//! A needle on one bonded layer: Hertz and Dimitriadis at small strain, tables of another code's neo-Hookean slab.

use nalgebra::{Isometry3, Vector3};
use retina_core::equilibrium::{ContactSettings, Equilibrium, Motion, Solid, Tool, Wall};
use retina_core::mesh::disc::DiscGeometry;
use retina_core::mesh::sample::locate;
use retina_core::mesh::wall::{WallDivision, WallTopology};
use retina_core::needle::NeedleShape;
use retina_core::progress::Silent;
use retina_core::solve::newton::Workspace;
use retina_core::surface::Surface;
use retina_core::tissue::{Layer, Tissue};
use retina_tests::tolerance::{MODEST_MESH, PENALTY};

/// One bonded layer in sheets of these thicknesses, one element each, inner sheet first. The rigid base is what choroid and sclera without
/// elements are.
fn layer(youngs: f64, poisson: f64, sheets_mm: &[f64]) -> (Tissue, Vec<usize>) {
    let sheet = |&thickness_mm: &f64| Layer { thickness_mm, youngs_modulus_kpa: youngs, poisson_ratio: poisson };
    let tissue = Tissue { retina: sheets_mm.iter().map(sheet).collect(), ..Tissue::default() };
    let mut elements = vec![1; sheets_mm.len()];
    elements.extend([0, 0]);
    (tissue, elements)
}

/// The mesh of a layer under a hemispherical needle that starts at touch, and its solves.
struct Press {
    topology: WallTopology,
    tissue: Tissue,
    disc: DiscGeometry,
    shape: NeedleShape,
    solid: Solid,
    contact: ContactSettings,
}

impl Press {
    fn new(sheets: (Tissue, Vec<usize>), core_cells: usize, radii: &[f64], radius_mm: f64, solid: Solid) -> Self {
        let division = WallDivision { core_cells, rings: radii.len() - 1, elements_per_layer: sheets.1 };
        Press {
            topology: WallTopology::new(division).expect("a topology"),
            tissue: sheets.0,
            disc: DiscGeometry { center: [0.0; 2], radii: radii.to_vec() },
            shape: NeedleShape::hemispherical(radius_mm),
            solid,
            contact: ContactSettings { stiffness_kpa_per_mm: 1e6, smoothing_mm: 1e-5, points_per_edge: 3 },
        }
    }

    /// Calls `see(wall, equilibrium)` after each motion (travel or force), each from the last one's answer.
    fn follow(&self, motions: &[(Option<f64>, f64)], mut see: impl FnMut(&Wall, &Equilibrium, usize)) {
        let body = self.shape.body();
        let tool = Tool { body: &body, patch_from_needle: Isometry3::identity() };
        let wall =
            Wall::new(&self.topology, &Surface::Flat, &self.tissue, &self.disc, self.solid, self.contact, tool)
                .expect("a wall");
        let mut workspace = Workspace::new(&self.topology.pattern, &self.topology.symbolic);
        let mut positions = wall.start();
        wall.place_tip(&mut positions, &Vector3::new(0.0, 0.0, -motions[0].1));
        for (index, &(force_mn, travel_mm)) in motions.iter().enumerate() {
            let motion = Motion { direction: -Vector3::z_axis(), force_mn, travel_mm };
            let answer =
                wall.solve(&motion, 0.0, positions, &mut workspace, &mut Silent).expect("an equilibrium");
            see(&wall, &answer, index);
            positions = answer.positions;
        }
    }
}

/// Force of a rigid sphere on an elastic half-space at `depth`, without the paraboloid in its place (Sneddon 1965).
fn sneddon_sphere(reduced_modulus: f64, radius: f64, depth: f64) -> f64 {
    let log = |a: f64| ((radius + a) / (radius - a)).ln();
    let (mut low, mut high) = (0.0, radius);
    for _ in 0..100 {
        let a = 0.5 * (low + high);
        if 0.5 * a * log(a) < depth { low = a } else { high = a }
    }
    reduced_modulus * (0.5 * (low * low + radius * radius) * log(low) - low * radius)
}

#[test]
fn hertz_on_a_thick_layer() {
    let (youngs, poisson, radius) = (20.0, 0.49, 0.05);
    let reduced = youngs / (1.0 - poisson * poisson);
    let sheets = [0.012, 0.015, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8, 2.4];
    let radii = [0.014, 0.018, 0.022, 0.027, 0.035, 0.06, 0.12, 0.3, 0.8, 4.0];
    let press = Press::new(layer(youngs, poisson, &sheets), 4, &radii, radius, Solid::Elasticity);
    let depths = [0.005, 0.01];
    press.follow(&depths.map(|d| (None, d)), |_, answer, index| {
        let depth = depths[index];
        let force = answer.reaction_mn.z;
        let hertz = 4.0 / 3.0 * reduced * radius.sqrt() * depth.powf(1.5);
        let sphere = sneddon_sphere(reduced, radius, depth);
        println!("Hertz, depth {depth}: {force:.6} mN, sphere {sphere:.6} ({:+.2} %), paraboloid {hertz:.6} ({:+.2} %) {:?}", 100.0*(force/sphere-1.0), 100.0*(force/hertz-1.0), answer.newton);
    });
}

#[test]
fn dimitriadis_on_a_bonded_layer() {
    let (youngs, poisson, radius, thickness) = (20.0, 0.4999, 0.05, 0.25);
    let sheets = [0.012, 0.015, 0.023, 0.04, 0.06, 0.1];
    let radii = [0.014, 0.018, 0.022, 0.027, 0.035, 0.06, 0.12, 0.3, 0.7, 2.0];
    let press = Press::new(layer(youngs, poisson, &sheets), 4, &radii, radius, Solid::Elasticity);
    let depths = [0.005, 0.01];
    press.follow(&depths.map(|d| (None, d)), |_, answer, index| {
        let depth: f64 = depths[index];
        let force = answer.reaction_mn.z;
        let chi = (radius * depth).sqrt() / thickness;
        let factor = 1.0 + 1.133 * chi + 1.283 * chi.powi(2) + 0.769 * chi.powi(3) + 0.0975 * chi.powi(4);
        let formula = 16.0 / 9.0 * youngs * radius.sqrt() * depth.powf(1.5) * factor;
        println!("Dimitriadis, depth {depth}: {force:.6} mN, wanted {formula:.6} ({:+.2} %) {:?}", 100.0*(force/formula-1.0), answer.newton);
    });
}

#[test]
fn neo_hookean_slab_under_a_capsule() {
    let mut cases: Vec<(f64, f64, Vec<[f64; 4]>)> = Vec::new();
    for line in include_str!("../../data/neo_hookean_slab.csv").lines().filter(|l| l.starts_with("capsule")) {
        let number = |i: usize| line.split(',').nth(i).and_then(|f| f.parse::<f64>().ok()).unwrap_or(0.0);
        if cases.last().is_none_or(|case| case.0 != number(6)) {
            cases.push((number(6), number(7), Vec::new()));
        }
        cases.last_mut().expect("a case").2.push([8, 9, 10, 12].map(number));
    }
    // The table's side is free, the mesh's rim is held: 2 mm away, where the displacement is below 1e-3 of the depth.
    let radii = [0.05, 0.07, 0.085, 0.1, 0.115, 0.14, 0.2, 0.4, 0.9, 2.0];
    let press = Press::new(layer(20.0, 0.49, &[0.05, 0.06, 0.07, 0.07]), 4, &radii, 0.1, Solid::FiniteStrain);
    let motions: Vec<(Option<f64>, f64)> = cases.iter().map(|case| (Some(case.0), 0.01)).collect();
    press.follow(&motions, |wall, answer, index| {
        let (force, depth, rows) = &cases[index];
        let mesh = if *force <= 0.1 { 0.003 } else if *force <= 0.5 { 0.007 } else { 0.03 };
        println!("capsule {force} mN: depth {:.6} wanted {depth:.6} ({:+.2} %, allowed {:.1}) {:?} {}", answer.travel_mm, 100.0*(answer.travel_mm/depth-1.0), 100.0*(mesh+PENALTY), answer.newton, answer.load_steps);
        let moved: Vec<f64> = answer.positions.iter().zip(&wall.geometry.rest).map(|(a, b)| a - b).collect();
        for [r, ur, uz, change] in rows {
            let found = locate(wall.topology(), &wall.geometry, [*r, 0.0]).expect("on the mesh").interpolate(&moved);
            let allowed = (mesh + PENALTY) * depth + change.abs();
            println!("   r {r}: u_r {:+.2} % u_z {:+.2} % of the depth, allowed {:.2}", 100.0*(found.x-ur)/depth, 100.0*(found.z-uz)/depth, 100.0*allowed/depth);
        }
        let _ = MODEST_MESH;
    });
}
