//! A nearly incompressible retina keeps its volume: by less than 0.01 % at ν = 0.4999 under loads that move it by a fifth of its thickness, and by more at 0.49.

use nalgebra::{Isometry3, Vector3};
use retina_core::equilibrium::{Load, MeshSize, Motion, Solid, Tool, Wall};
use retina_core::mesh::disc::DiscGeometry;
use retina_core::mesh::element::{NODES, POINTS};
use retina_core::mesh::wall::WallTopology;
use retina_core::needle::NeedleShape;
use retina_core::predict::finite_element::{COARSE, REFERENCE, Resolution};
use retina_core::progress::Silent;
use retina_core::solve::newton::Workspace;
use retina_core::surface::Surface;
use retina_core::tissue::Tissue;

/// Largest change of the retina's volume, relative: the requirement of the nearly incompressible block of deal.II's step-44.
const LARGEST_CHANGE: f64 = 1e-4;

/// Relative change of the retina's volume under a 25G ball, and the travel (mm).
fn change(resolution: &Resolution, poisson_ratio: f64, force_mn: f64) -> (f64, f64) {
    let mut tissue = Tissue::default();
    tissue.retina[0].poisson_ratio = poisson_ratio;
    let topology = WallTopology::new(resolution.division(&tissue, false)).unwrap();
    let body = NeedleShape::hemispherical(0.257).body();
    let tool = Tool { body: &body, patch_from_needle: Isometry3::identity(), stiffness_mn_per_mm: None };
    let rings = resolution.rings;
    let radii = (0..=rings).map(|ring| 0.15 * 12.0_f64.powf(ring as f64 / rings as f64)).collect();
    let mesh = MeshSize { disc: DiscGeometry { center: [0.0; 2], radii, offsets: Vec::new() }, first_element_mm: 0.3 };
    let wall =
        Wall::new(&topology, &Surface::Flat, &tissue, &mesh, Solid::FiniteStrain, resolution.contact, tool).unwrap();
    let direction = -Vector3::z_axis();
    let motion = Motion { direction, force_mn: Some(force_mn), travel_mm: 0.1 };
    let mut start = wall.start();
    wall.place_tip(&mut start, &(direction.into_inner() * motion.travel_mm));
    let load = Load { motion: &motion, touch_mm: wall.touch(&direction, 0.0).unwrap(), additions: &[] };
    let mut workspace = Workspace::new(&topology.pattern, &topology.symbolic);
    let found = wall.solve(&load, start, &mut workspace, &mut Silent).unwrap();
    let (mut rest, mut now) = (0.0, 0.0);
    let mut local = [0.0; 3 * NODES];
    for element in (0..topology.elements.len()).filter(|&element| topology.element_layer[element] == 0) {
        topology.elements.gather(element, &found.positions, &mut local);
        for point in 0..POINTS {
            let weight = wall.geometry.solid.weights(element)[point];
            rest += weight;
            now += weight * wall.geometry.solid.deformation_gradient(element, point, &local).determinant();
        }
    }
    (now / rest - 1.0, found.travel_mm)
}

#[test]
fn a_nearly_incompressible_retina_keeps_its_volume() {
    for (level, resolution) in [("coarse", &COARSE), ("reference", &REFERENCE)] {
        for force_mn in [0.3, 1.0] {
            let (kept, travel_mm) = change(resolution, 0.4999, force_mn);
            let (less, _) = change(resolution, 0.49, force_mn);
            println!(
                "| volume | {level}, {force_mn} mN, travel {travel_mm:.3} mm | {:+.5} % at ν 0.4999, {:+.5} % at 0.49 |",
                100.0 * kept,
                100.0 * less
            );
            assert!(travel_mm > 0.05, "{level}, {force_mn} mN: only {travel_mm} mm");
            assert!(kept.abs() < LARGEST_CHANGE, "{level}, {force_mn} mN: {kept:e}");
            assert!(less.abs() > 10.0 * kept.abs(), "{level}, {force_mn} mN: the test sees no difference: {less:e}");
        }
    }
}
