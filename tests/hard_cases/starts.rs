//! Nodes that start where no tissue can be: at random, flat, in one point, inside out. The wall finds back to rest or to the one equilibrium of its
//! load, and a single Newton solve that is not allowed another start refuses by name.

use nalgebra::{Isometry3, Translation3, Vector3};
use retina_core::equilibrium::error::EquilibriumError;
use retina_core::equilibrium::{Equilibrium, Load, MeshSize, Motion, Solid, Tool, Wall};
use retina_core::mesh::disc::DiscGeometry;
use retina_core::mesh::wall::WallTopology;
use retina_core::needle::{Body, NeedleShape};
use retina_core::predict::finite_element::COARSE;
use retina_core::progress::Silent;
use retina_core::solve::newton::{Globalization, NewtonError, Workspace};
use retina_core::solve::sparse::Precision;
use retina_core::surface::Surface;
use retina_core::tissue::Tissue;

/// Distance of two equilibria of one load (mm): what a residual of 1e-7 of the force leaves.
const SAME_MM: f64 = 1e-6;
/// Newton iterations of one way back: a quadratic energy needs one step and its check; otherwise the start is given up at once and load steps from rest
/// are taken, four at most of six iterations.
const MOST_ITERATIONS: usize = 60;

/// A mesh of level `coarse` on the default tissue under a 25G ball.
struct Bench {
    topology: WallTopology,
    tissue: Tissue,
    body: Body,
}

impl Bench {
    fn new() -> Self {
        let tissue = Tissue::default();
        let topology = WallTopology::new(COARSE.division(&tissue, false)).unwrap();
        Bench { topology, tissue, body: NeedleShape::hemispherical(0.257).body() }
    }

    /// The wall with the needle's tip at this height over it (mm).
    fn wall(&self, solid: Solid, height_mm: f64) -> Wall<'_> {
        let radii = (0..=COARSE.rings).map(|ring| 0.15 * 10.0_f64.powf(ring as f64 / COARSE.rings as f64)).collect();
        let disc = DiscGeometry { center: [0.0; 2], radii, offsets: Vec::new() };
        let mesh = MeshSize { disc, first_element_mm: 0.3 };
        let patch_from_needle = Isometry3::from_parts(Translation3::new(0.0, 0.0, height_mm), nalgebra::one());
        let tool = Tool { body: &self.body, patch_from_needle, stiffness_mn_per_mm: None };
        Wall::new(&self.topology, &Surface::Flat, &self.tissue, &mesh, solid, COARSE.contact, tool).unwrap()
    }
}

/// Moves every free vertex of the wall's start, the needle stays.
fn moved(wall: &Wall, mut to: impl FnMut(Vector3<f64>) -> Vector3<f64>) -> Vec<f64> {
    let mut positions = wall.start();
    for vertex in 0..wall.topology().vertices.len() {
        if wall.topology().dofs.index(vertex, 0).is_some() {
            let place = &mut positions[3 * vertex..3 * vertex + 3];
            let new = to(Vector3::from_row_slice(place));
            place.copy_from_slice(new.as_slice());
        }
    }
    positions
}

/// The bad starts, by name.
fn bad_starts(wall: &Wall) -> Vec<(String, Vec<f64>)> {
    let middle = Vector3::new(0.0, 0.0, -0.25);
    let mut starts = vec![
        ("flat".to_owned(), moved(wall, |at| Vector3::new(at.x, at.y, -0.25))),
        ("in one point".to_owned(), moved(wall, |_| middle)),
        ("inside out".to_owned(), moved(wall, |at| Vector3::new(at.x, at.y, -0.5 - at.z))),
        ("turned about".to_owned(), moved(wall, |at| Vector3::new(-at.x, -at.y, at.z))),
        ("far away".to_owned(), moved(wall, |at| at + Vector3::new(0.0, 0.0, 1e3))),
        ("not a number".to_owned(), moved(wall, |_| Vector3::repeat(f64::NAN))),
    ];
    for (seed, size_mm) in [(1, 1e-3), (2, 0.01), (3, 0.05), (4, 0.2), (5, 1.0), (6, 10.0)] {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut shift = || size_mm * (2.0 * random.f64() - 1.0);
        let positions = moved(wall, |at| at + Vector3::new(shift(), shift(), shift()));
        starts.push((format!("at random within {size_mm} mm"), positions));
    }
    starts
}

fn solve(wall: &Wall, motion: &Motion, start: Vec<f64>) -> Result<Equilibrium, EquilibriumError> {
    let load = Load { motion, touch_mm: wall.touch(&motion.direction, 0.0).unwrap_or(0.0), additions: &[] };
    let mut workspace = Workspace::new(&wall.topology().pattern, &wall.topology().symbolic);
    wall.solve(&load, start, &mut workspace, &mut Silent)
}

fn apart_mm(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Solves from every bad start; each comes to `expected` positions.
fn all_come_to(wall: &Wall, solid: Solid, motion: &Motion, expected: &[f64], load: &str) {
    for (name, start) in bad_starts(wall) {
        assert!(name == "not a number" || apart_mm(&start, &wall.start()) > 5e-4, "{name} is not a bad start");
        let found = match solve(wall, motion, start) {
            Ok(found) => found,
            Err(error) => panic!("{solid:?}, {load}, {name}: {error}"),
        };
        let apart = apart_mm(&found.positions, expected);
        let iterations = found.newton.iterations;
        println!(
            "| starts | {solid:?}, {load}, {name} | {iterations} iterations, {apart:.1e} mm from where it belongs |"
        );
        assert!(apart < SAME_MM, "{solid:?}, {load}, {name}: {apart:e} mm from where it belongs");
        assert!(iterations <= MOST_ITERATIONS, "{solid:?}, {load}, {name}: {iterations} iterations");
        assert!(wall.strains(&found.positions).least_volume_ratio > 0.0, "{name} ends inverted");
    }
}

#[test]
fn tissue_without_a_load_returns_to_rest() {
    let bench = Bench::new();
    for solid in [Solid::Elasticity, Solid::FiniteStrain] {
        let wall = bench.wall(solid, 0.5);
        let held = Motion { direction: -Vector3::z_axis(), force_mn: None, travel_mm: 0.0 };
        all_come_to(&wall, solid, &held, &wall.start(), "no load");
    }
}

#[test]
fn tissue_under_a_load_finds_its_equilibrium() {
    let bench = Bench::new();
    for solid in [Solid::Elasticity, Solid::FiniteStrain] {
        let wall = bench.wall(solid, 0.0);
        let pushed = Motion { direction: -Vector3::z_axis(), force_mn: Some(0.3), travel_mm: 0.08 };
        let mut start = wall.start();
        wall.place_tip(&mut start, &Vector3::new(0.0, 0.0, -0.08));
        let expected = solve(&wall, &pushed, start).unwrap();
        assert!(expected.travel_mm > 0.03, "the load moves nothing");
        all_come_to(&wall, solid, &pushed, &expected.positions, "0.3 mN");
    }
}

#[test]
fn a_single_solve_names_the_effect_that_cannot_start_there() {
    use retina_core::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
    use retina_core::mesh::wall::Place;
    use retina_core::solve::newton::{Drive, NewtonSettings, System};
    let bench = Bench::new();
    let wall = bench.wall(Solid::FiniteStrain, 0.5);
    let layers = bench.tissue.layers();
    let lame = |&layer: &usize| {
        let layer = layers[layer].layer;
        Lame { mu: layer.shear_modulus_kpa(), lambda: layer.first_lame_kpa() }
    };
    let materials: Vec<Lame> = bench.topology.element_layer.iter().map(lame).collect();
    let solid = FiniteStrain { geometry: &wall.geometry.solid, materials: &materials, law: NeoHookean::Logarithmic };
    let terms = [bench.topology.term(Place::Elements, &solid)];
    let system = System {
        terms: &terms,
        dofs: &bench.topology.dofs,
        pattern: &bench.topology.pattern,
        symbolic: &bench.topology.symbolic,
        driven: Some(bench.topology.needle()),
        dead_load: &[],
    };
    for globalization in [Globalization::PredictedStress, Globalization::LineSearch] {
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization,
            force_scale_mn: 0.01,
            tolerance_mn: 1e-9,
            max_iterations: 40,
            max_weakened: 40,
            max_travel_mm: 0.1,
        };
        for (name, mut positions) in bad_starts(&wall) {
            let mut workspace = Workspace::new(&bench.topology.pattern, &bench.topology.symbolic);
            let inverted = wall.strains(&positions).least_volume_ratio;
            match system.solve(&mut positions, Drive::Held, &settings, &mut workspace, &mut Silent) {
                Err(NewtonError::BadStart { effect }) => {
                    assert!(inverted <= 0.0 || inverted.is_nan() || inverted.is_infinite(), "{name} is admissible");
                    assert_eq!(effect, "finite_strain", "{name}");
                }
                Ok(_) => {
                    assert!(inverted > 0.0, "{name}: an inverted start was accepted");
                    assert!(apart_mm(&positions, &wall.start()) < SAME_MM, "{name} ends elsewhere than at rest");
                }
                Err(error) => panic!("{name}, {globalization:?}: {error}"),
            }
        }
    }
}

#[test]
fn an_inverted_element_is_seen() {
    let bench = Bench::new();
    let wall = bench.wall(Solid::FiniteStrain, 0.5);
    let inverted = moved(&wall, |at| Vector3::new(at.x, at.y, -0.5 - at.z));
    assert!(wall.strains(&inverted).least_volume_ratio < -0.5);
    assert!((wall.strains(&wall.start()).least_volume_ratio - 1.0).abs() < 1e-12);
}
