//! The same problem a thousand times smaller and larger: the same answer in its own units, or a refusal that names the size.
//!
//! Elasticity has no length of its own: with lengths times s and moduli as they are, forces are times s² and displacements times s. What would betray a hidden length is
//! a number in the solver that has one.

use nalgebra::{Isometry3, Vector3};
use retina_core::equilibrium::{ContactSettings, Load, MeshSize, Motion, Solid, Tool, Wall};
use retina_core::mesh::disc::DiscGeometry;
use retina_core::mesh::wall::WallTopology;
use retina_core::needle::NeedleShape;
use retina_core::predict::finite_element::COARSE;
use retina_core::predict::{PreparedScene, Workspace as Memory};
use retina_core::progress::Silent;
use retina_core::scene::SceneSurface;
use retina_core::solve::newton::Workspace;
use retina_core::surface::Surface;
use retina_core::tissue::Tissue;

use crate::table::{push, tissue};

/// Two scales of one problem, relative: what the solver's residual of 1e-7 leaves.
const SAME: f64 = 1e-6;

/// Travel over s, reaction over s², largest strain and iterations of a 25G ball on the default tissue, all lengths times `s`.
fn pressed(topology: &WallTopology, s: f64, solid: Solid) -> ([f64; 3], usize) {
    let mut tissue = Tissue::default();
    tissue.retina[0].thickness_mm *= s;
    tissue.choroid.thickness_mm *= s;
    tissue.sclera.thickness_mm *= s;
    let body = NeedleShape::hemispherical(0.257 * s).body();
    let tool = Tool { body: &body, patch_from_needle: Isometry3::identity(), stiffness_mn_per_mm: None };
    let radii = (0..=COARSE.rings).map(|ring| s * 0.15 * 10.0_f64.powf(ring as f64 / COARSE.rings as f64)).collect();
    let mesh =
        MeshSize { disc: DiscGeometry { center: [0.0; 2], radii, offsets: Vec::new() }, first_element_mm: 0.3 * s };
    let contact = ContactSettings {
        stiffness_kpa_per_mm: COARSE.contact.stiffness_kpa_per_mm / s,
        smoothing_mm: COARSE.contact.smoothing_mm * s,
        ..COARSE.contact
    };
    let wall = Wall::new(topology, &Surface::Flat, &tissue, &mesh, solid, contact, tool).unwrap();
    let direction = -Vector3::z_axis();
    let motion = Motion { direction, force_mn: Some(0.5 * s * s), travel_mm: 0.08 * s };
    let mut start = wall.start();
    wall.place_tip(&mut start, &(direction.into_inner() * motion.travel_mm));
    let touch_mm = wall.touch(&direction, 0.0).unwrap();
    let load = Load { motion: &motion, touch_mm, additions: &[] };
    let mut workspace = Workspace::new(&topology.pattern, &topology.symbolic);
    let found = wall.solve(&load, start, &mut workspace, &mut Silent).unwrap();
    let strain = wall.strains(&found.positions).max_strain;
    ([found.travel_mm / s, found.reaction_mn.z / (s * s), strain], found.newton.iterations)
}

#[test]
fn a_thousandth_and_a_thousandfold_are_the_same_problem() {
    let topology = WallTopology::new(COARSE.division(&Tissue::default(), false)).unwrap();
    for solid in [Solid::Elasticity, Solid::FiniteStrain] {
        let (wanted, wanted_iterations) = pressed(&topology, 1.0, solid);
        assert!(wanted[0] > 0.03 && wanted[2] > 0.1, "{wanted:?}");
        for s in [1e-3, 1e3] {
            let (found, iterations) = pressed(&topology, s, solid);
            println!("| sizes | {solid:?}, times {s} | {iterations} iterations, {found:?} |");
            for (found, wanted) in found.iter().zip(&wanted) {
                assert!((found / wanted - 1.0).abs() < SAME, "{solid:?}, times {s}: {found} for {wanted}");
            }
            assert_eq!(iterations, wanted_iterations, "{solid:?}, times {s}");
        }
    }
}

#[test]
fn a_scene_in_other_units_is_refused_by_the_name_of_what_is_too_small_or_large() {
    let refusal = |scene| match PreparedScene::new(scene) {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    };
    let thin = refusal(tissue(|t| t.retina[0].thickness_mm *= 1e-3));
    assert!(thin.starts_with("tissue.retina[0].thickness_mm = 0.00025 mm"), "{thin}");
    let thick = refusal(tissue(|t| t.retina[0].thickness_mm *= 1e3));
    assert!(thick.starts_with("tissue.retina[0].thickness_mm = 250 mm"), "{thick}");
    let soft = refusal(tissue(|t| t.choroid.youngs_modulus_kpa *= 1e-3));
    assert!(soft.starts_with("tissue.choroid.youngs_modulus_kpa = 0.006 kPa"), "{soft}");
    let mut scene = tissue(|_| {});
    scene.surface = SceneSurface::Sphere { radius_mm: 12_000.0 };
    let ball = refusal(scene);
    assert!(ball.starts_with("surface.radius_mm = 12000 mm"), "{ball}");
    let scene = PreparedScene::new(tissue(|_| {})).unwrap();
    for s in [1e-3, 1e3] {
        let asked = push(NeedleShape::hemispherical(0.257 * s), 0.5 * s * s);
        let error = scene.predict(&asked, &mut Memory::default(), &mut Silent).unwrap_err().to_string();
        assert!(error.starts_with("needle.radius_mm = "), "{error}");
    }
}
