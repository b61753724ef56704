//! Fluid under a clamped plate: the pressure that keeps a small volume, Laplace's law of a large one, a volume that is kept under a needle, and the energy behind both.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use retina_core::effect::Multiplier;
use retina_core::effects::adhesion::{Adhesion, Bond, Interface};
use retina_core::effects::bleb::{Fluid, Holds};
use retina_core::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use retina_core::equilibrium::bleb::{Bleb, VOLUME_TOLERANCE};
use retina_core::equilibrium::{Addition, ContactSettings, Equilibrium, Load, MeshSize, Motion, Solid, Tool, Wall};
use retina_core::mesh::disc::DiscGeometry;
use retina_core::mesh::wall::{Place, WallDivision, WallTopology};
use retina_core::needle::NeedleShape;
use retina_core::progress::Silent;
use retina_core::solve::newton::{Drive, Globalization, NewtonSettings, System, Workspace};
use retina_core::solve::sparse::Precision;
use retina_core::surface::Surface;
use retina_core::tissue::{Layer, Tissue};

const RADIUS_MM: f64 = 1.0;
const MODULUS_KPA: f64 = 20.0;
const POISSON: f64 = 0.49;

/// A retina that is clamped along a circle and detached from a choroid that hardly yields.
struct Plate {
    topology: WallTopology,
    tissue: Tissue,
    radii: Vec<f64>,
    solid: Solid,
}

/// What is found for one volume.
struct Filled {
    equilibrium: Equilibrium,
    pressure_kpa: f64,
    volume_mm3: f64,
    /// Height of the retina's inner surface over its rest in the middle (mm), and over the distance from there of its neighbours.
    profile: Vec<(f64, f64)>,
    /// In-plane stretch of the middle surface in the middle.
    stretch: f64,
}

impl Plate {
    fn new(thickness_mm: f64, solid: Solid) -> Self {
        let tissue = Tissue {
            retina: vec![Layer { thickness_mm, youngs_modulus_kpa: MODULUS_KPA, poisson_ratio: POISSON }],
            choroid: Layer { thickness_mm: 0.1, youngs_modulus_kpa: 1e5, poisson_ratio: 0.2 },
            ..Tissue::default()
        };
        let division = WallDivision {
            core_cells: 4,
            rings: 8,
            elements_per_layer: vec![1, 1, 0],
            layers_above_interface: Some(1),
        };
        let radii = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.88, 0.95, 1.0].map(|share| share * RADIUS_MM).to_vec();
        Plate { topology: WallTopology::new(division).expect("a mesh"), tissue, radii, solid }
    }

    fn wall<'a>(&'a self, tool: Tool<'a>) -> Wall<'a> {
        let disc = DiscGeometry { center: [0.0; 2], radii: self.radii.clone(), offsets: Vec::new() };
        let size = MeshSize { disc, first_element_mm: f64::INFINITY };
        let contact = ContactSettings {
            stiffness_kpa_per_mm: 4e4,
            smoothing_mm: 2e-3,
            points_per_edge: 5,
            softening: 1.0,
            tolerance: 1e-8,
        };
        Wall::new(&self.topology, &Surface::Flat, &self.tissue, &size, self.solid, contact, tool).expect("a wall")
    }

    /// The equilibrium at the volume, or at a pressure of its own, with the needle's tip at `tip_mm` over the rest surface.
    fn solve(&self, volume_mm3: f64, fixed_kpa: Option<f64>, tip_mm: f64) -> Filled {
        let body = NeedleShape::hemispherical(0.2).body();
        let pose = Isometry3::from_parts(Translation3::new(0.0, 0.0, tip_mm), UnitQuaternion::identity());
        let mut wall = self.wall(Tool { body: &body, patch_from_needle: pose, stiffness_mn_per_mm: None });
        let interface = Interface::new(&self.topology.interface, &wall.geometry.rest);
        let flat = Bleb { center: [0.0; 2], radius_mm: RADIUS_MM, volume_mm3, pressure_kpa: 0.0, keeps_volume: true };
        wall.raise(&flat, |_| -Vector3::z());
        assert!(wall.detached(&flat).iter().all(|&detached| detached));
        let count = interface.points() * self.topology.interface.len();
        let bond = Bond { strength_kpa: 1.0, fracture_energy_mn_per_mm: 0.1, stiffness_kpa_per_mm: 1e5 };
        let apart = vec![2.0 * bond.parted_mm(); count];
        let adhesion = Adhesion { interface: &interface, bond, largest_mm: &apart, opened: None };
        let first_kpa = self.pressure_kpa(volume_mm3);
        let holds = match fixed_kpa {
            Some(pressure_kpa) => Holds::Pressure(pressure_kpa),
            None => Holds::Volume(Multiplier::new(first_kpa, volume_mm3, first_kpa * PI * RADIUS_MM * RADIUS_MM)),
        };
        let fluid = Fluid { detached: &vec![true; self.topology.interface.len()], holds };
        let additions = [
            Addition { effect: &adhesion, place: Place::Interface },
            Addition { effect: &fluid, place: Place::Interface },
        ];
        let motion = Motion { direction: -Vector3::z_axis(), force_mn: None, travel_mm: 0.0 };
        let load = Load { motion: &motion, touch_mm: 0.0, additions: &additions };
        let mut workspace = Workspace::new(&self.topology.pattern, &self.topology.symbolic);
        let equilibrium = wall.solve(&load, wall.start(), &mut workspace, &mut Silent).expect("an equilibrium");
        let pressure_kpa = fluid.pressure_kpa();
        let volume_mm3 = wall.fluid_volume_mm3(&fluid, &equilibrium.positions);
        let profile = |level: usize| {
            let top = self.topology.vertices.iter().enumerate().filter(|(_, vertex)| vertex.1 == level);
            let mut list: Vec<(f64, f64)> = top
                .map(|(v, _)| {
                    let now = &equilibrium.positions[3 * v..3 * v + 3];
                    (now[0].hypot(now[1]), now[2] - wall.geometry.rest[3 * v + 2])
                })
                .collect();
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
            list
        };
        // Levels from the base: choroid 0 to 2, retina 3 to 5; 4 is its middle.
        let stretch = {
            let middle = self.topology.vertices.iter().enumerate().filter(|(_, vertex)| vertex.1 == 4);
            let ratio = |(v, _): (usize, _)| {
                let (now, rest) = (&equilibrium.positions[3 * v..], &wall.geometry.rest[3 * v..]);
                let rest_mm = rest[0].hypot(rest[1]);
                (rest_mm, now[0].hypot(now[1]) / rest_mm)
            };
            let near: Vec<(f64, f64)> = middle.map(ratio).filter(|(r, _)| *r > 0.0 && *r < 0.2).collect();
            near.iter().map(|(_, ratio)| ratio).sum::<f64>() / near.len() as f64
        };
        Filled { profile: profile(4), equilibrium, pressure_kpa, volume_mm3, stretch }
    }

    fn thickness_mm(&self) -> f64 {
        self.tissue.retina[0].thickness_mm
    }

    /// Pressure of a small volume under a clamped plate that bends and shears: V = p (π a⁶/(192 D) + π a⁴/(8 κ G t)), κ = 5/6.
    fn pressure_kpa(&self, volume_mm3: f64) -> f64 {
        let t = self.thickness_mm();
        let bending = MODULUS_KPA * t.powi(3) / (12.0 * (1.0 - POISSON * POISSON));
        let shear = 5.0 / 6.0 * MODULUS_KPA / (2.0 * (1.0 + POISSON)) * t;
        volume_mm3 / (PI * RADIUS_MM.powi(6) / (192.0 * bending) + PI * RADIUS_MM.powi(4) / (8.0 * shear))
    }
}

/// What a rim that is fixed through the whole thickness, and this mesh, stiffen the plate by.
const STIFFER: f64 = 0.1;

#[test]
fn a_small_volume_has_the_pressure_of_a_clamped_plate() {
    let ratios = [0.08, 0.12].map(|thickness_mm| {
        let plate = Plate::new(thickness_mm, Solid::Elasticity);
        let [small, large] = [1e-4, 1e-3].map(|volume_mm3| {
            let found = plate.solve(volume_mm3, None, 5.0);
            let ratio = found.pressure_kpa / plate.pressure_kpa(volume_mm3);
            println!("{thickness_mm} mm, {volume_mm3} mm³: {:.3e} kPa, {ratio:.4} of the plate's", found.pressure_kpa);
            assert!((found.volume_mm3 / volume_mm3 - 1.0).abs() <= VOLUME_TOLERANCE);
            ratio
        });
        assert!((1.0..1.0 + STIFFER).contains(&small), "{thickness_mm} mm: {small}");
        assert!((large / small - 1.0).abs() < 2e-3, "in proportion to the volume: {small} {large}");
        small
    });
    // Between the two the plate's stiffness changes more than threefold, its ratio to the closed form does not.
    assert!((ratios[1] / ratios[0] - 1.0).abs() < 0.03, "{ratios:?}");
}

#[test]
fn a_large_volume_obeys_laplaces_law_in_its_middle() {
    // A thin neo-Hookean membrane, equibiaxially stretched by λ in the middle, bears µ t (1 − λ⁻⁶) per length, and p = 2 T/R.
    let plate = Plate::new(0.08, Solid::FiniteStrain);
    for volume_mm3 in [0.6, 1.0] {
        let found = plate.solve(volume_mm3, None, 5.0);
        // R from the middle surface's height over the distance: z = z₀ − r²/(2 R).
        let near: Vec<&(f64, f64)> = found.profile.iter().filter(|(r, _)| *r < 0.3).collect();
        let (top, edge) = (near[0], near[near.len() - 1]);
        let sag = top.1 - edge.1;
        let radius_mm = ((edge.0 * edge.0 - top.0 * top.0) / sag + sag) / 2.0;
        let shear = MODULUS_KPA / (2.0 * (1.0 + POISSON));
        let tension = shear * 0.08 * (1.0 - found.stretch.powi(-6));
        let expected = 2.0 * tension / radius_mm;
        println!(
            "{volume_mm3} mm³: {:.4} kPa, Laplace {expected:.4} kPa (stretch {:.4}, radius {radius_mm:.3} mm, height {:.3} mm)",
            found.pressure_kpa, found.stretch, top.1
        );
        assert!((found.pressure_kpa / expected - 1.0).abs() < 0.03, "{} {expected}", found.pressure_kpa);
    }
}

#[test]
fn a_needle_moves_the_fluid_and_does_not_press_it_out() {
    let plate = Plate::new(0.12, Solid::FiniteStrain);
    let volume_mm3 = 0.1;
    let free = plate.solve(volume_mm3, None, 5.0);
    let top_mm = free.profile[0].1;
    let mut last = free.pressure_kpa;
    for share in [0.8, 0.5, 0.2] {
        let pressed = plate.solve(volume_mm3, None, share * top_mm);
        let leaking = plate.solve(volume_mm3, Some(free.pressure_kpa), share * top_mm);
        println!(
            "needle at {:.3} of {top_mm:.3} mm: {:.4} kPa (free {:.4}), {:.4} mN; at constant pressure {:.4} mm³, {:.4} mN",
            share * top_mm,
            pressed.pressure_kpa,
            free.pressure_kpa,
            pressed.equilibrium.reaction_mn.z,
            leaking.volume_mm3,
            leaking.equilibrium.reaction_mn.z
        );
        assert!((pressed.volume_mm3 / volume_mm3 - 1.0).abs() <= VOLUME_TOLERANCE);
        assert!(pressed.pressure_kpa > last, "the deeper the needle, the higher the pressure");
        last = pressed.pressure_kpa;
        // Fluid that may leave does, and bears less.
        assert!(leaking.volume_mm3 < 0.99 * volume_mm3);
        assert!(leaking.equilibrium.reaction_mn.z < 0.99 * pressed.equilibrium.reaction_mn.z);
    }
}

#[test]
fn a_given_pressure_encloses_the_volume_that_has_that_pressure_and_another_does_not() {
    let plate = Plate::new(0.12, Solid::FiniteStrain);
    for volume_mm3 in [0.02, 0.2] {
        let held = plate.solve(volume_mm3, None, 5.0);
        let pressed = plate.solve(volume_mm3, Some(held.pressure_kpa), 5.0);
        assert!((pressed.volume_mm3 / volume_mm3 - 1.0).abs() < VOLUME_TOLERANCE, "{}", pressed.volume_mm3);
        let more = plate.solve(volume_mm3, Some(1.02 * held.pressure_kpa), 5.0);
        println!("{volume_mm3} mm³: {:.6} kPa; 2 % more: {:.6} mm³", held.pressure_kpa, more.volume_mm3);
        assert!(more.volume_mm3 > 1.003 * volume_mm3, "{}", more.volume_mm3);
    }
}

#[test]
fn pressure_and_reaction_are_slopes_of_one_energy() {
    // E(V, d), d the needle's depth: p = ∂E/∂V and the reaction F = ∂E/∂d, so ∂p/∂d = ∂F/∂V (Maxwell's relation).
    let plate = Plate::new(0.12, Solid::FiniteStrain);
    let (volume_mm3, step_mm3, step_mm) = (0.1, 1e-4, 1e-4);
    let top_mm = plate.solve(volume_mm3, None, 5.0).profile[0].1;
    let tip_mm = 0.5 * top_mm;
    let force = |volume_mm3: f64| plate.solve(volume_mm3, None, tip_mm).equilibrium.reaction_mn.z;
    let pressure = |tip_mm: f64| plate.solve(volume_mm3, None, tip_mm).pressure_kpa;
    let force_slope = (force(volume_mm3 + step_mm3) - force(volume_mm3 - step_mm3)) / (2.0 * step_mm3);
    let pressure_slope = (pressure(tip_mm - step_mm) - pressure(tip_mm + step_mm)) / (2.0 * step_mm);
    println!("∂F/∂V {force_slope:.6} mN/mm³, ∂p/∂d {pressure_slope:.6} kPa/mm");
    assert!(force_slope > 0.1, "the fluid bears the needle: {force_slope}");
    assert!((force_slope / pressure_slope - 1.0).abs() < 1e-3, "{force_slope} {pressure_slope}");
    // At constant pressure the needle meets less: that slope is another one.
    let leaking = |volume_mm3: f64| {
        plate.solve(volume_mm3, Some(plate.solve(volume_mm3, None, 5.0).pressure_kpa), tip_mm).equilibrium.reaction_mn.z
    };
    let other = (leaking(volume_mm3 + step_mm3) - leaking(volume_mm3 - step_mm3)) / (2.0 * step_mm3);
    println!("at constant pressure {other:.6} mN/mm³");
    assert!((other / force_slope - 1.0).abs() > 0.05, "{other} {force_slope}");
}

#[test]
fn a_line_search_finds_the_pressure_that_full_steps_find() {
    let plate = Plate::new(0.12, Solid::FiniteStrain);
    let body = NeedleShape::hemispherical(0.2).body();
    let pose = Isometry3::from_parts(Translation3::new(0.0, 0.0, 5.0), UnitQuaternion::identity());
    let wall = plate.wall(Tool { body: &body, patch_from_needle: pose, stiffness_mn_per_mm: None });
    let lame = |layer: &Layer| Lame { mu: layer.shear_modulus_kpa(), lambda: layer.first_lame_kpa() };
    let layers = [lame(&plate.tissue.retina[0]), lame(&plate.tissue.choroid)];
    let materials: Vec<Lame> = plate.topology.element_layer.iter().map(|&layer| layers[layer]).collect();
    let solid = FiniteStrain { geometry: &wall.geometry.solid, materials: &materials, law: NeoHookean::Logarithmic };
    let interface = Interface::new(&plate.topology.interface, &wall.geometry.rest);
    let bond = Bond { strength_kpa: 1.0, fracture_energy_mn_per_mm: 0.1, stiffness_kpa_per_mm: 1e5 };
    let apart = vec![2.0 * bond.parted_mm(); interface.points() * plate.topology.interface.len()];
    let adhesion = Adhesion { interface: &interface, bond, largest_mm: &apart, opened: None };
    let volume_mm3 = 0.05;
    let found = |globalization: Globalization, wanted_mm3: f64| {
        let first_kpa = plate.pressure_kpa(wanted_mm3);
        let holds = Holds::Volume(Multiplier::new(first_kpa, wanted_mm3, first_kpa * PI * RADIUS_MM * RADIUS_MM));
        let fluid = Fluid { detached: &vec![true; plate.topology.interface.len()], holds };
        let terms = [
            plate.topology.term(Place::Elements, &solid),
            plate.topology.term(Place::Interface, &adhesion),
            plate.topology.term(Place::Interface, &fluid),
        ];
        let (dofs, pattern, symbolic) = (&plate.topology.dofs, &plate.topology.pattern, &plate.topology.symbolic);
        let driven = Some(plate.topology.needle());
        let system = System { terms: &terms, dofs, pattern, symbolic, driven, dead_load: &[] };
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization,
            force_scale_mn: 0.01,
            tolerance_mn: 1e-9,
            max_iterations: 60,
            max_weakened: 60,
            max_travel_mm: 1.0,
        };
        let mut positions = wall.start();
        let mut workspace = Workspace::new(pattern, symbolic);
        let report = system.solve(&mut positions, Drive::Held, &settings, &mut workspace, &mut Silent).expect("a bleb");
        println!("{globalization:?}: {:.8} kPa, {} iterations", fluid.pressure_kpa(), report.iterations);
        assert!((wall.fluid_volume_mm3(&fluid, &positions) / wanted_mm3 - 1.0).abs() < VOLUME_TOLERANCE);
        fluid.pressure_kpa()
    };
    let [full, searched] =
        [Globalization::PredictedStress, Globalization::LineSearch].map(|way| found(way, volume_mm3));
    assert!((searched / full - 1.0).abs() < 1e-6, "{searched} {full}");
    let other = found(Globalization::LineSearch, 1.01 * volume_mm3);
    assert!(other / full > 1.005, "{other} {full}");
}
