//! Learned levels on patches cut from meshes of surfaces that no training saw: an ellipsoid, a saddle, a ball with bumps.
//!
//! All training samples lie on a grid over a plane, a ball of 12 mm or that ball with a pit. Here the nodes are vertices of an uneven mesh, and the curvatures are
//! those of no built-in scene. Truth is level `reference` on the same patch.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::comparison::node_errors_um;
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::{Scene, SceneSurface};
use retina_core::surface::TriangleMesh;
use retina_tests::cap::{SIDE, cap};

/// Share of the mean error of what a level corrects that may be left on a surface never seen. On the surfaces of the training it is a fifth for `network` and less than half for `corrected`
/// (`models/REPORT.md`, half balls on the test split); half of the start's error leaves room for another curvature and still could not be met by a network that only knew its own surfaces, since
/// nine requests that it made worse or left alone would keep the share at one.
const LEFT: f64 = 0.5;
/// The goal on the default scene (µm), which other surfaces need not be exempt from: mean error of `network`.
const GOAL_UM: f64 = 2.0;

/// Height of a surface above the patch's plane (mm) at x, y (mm).
type Height = fn(f64, f64) -> f64;

/// The surfaces by name.
const SURFACES: [(&str, Height); 3] = [
    // Half axes of 14, 9 and 12 mm: radii of curvature of 16.3 and 6.8 mm at the apex.
    ("ellipsoid", |x, y| 12.0 * (1.0 - (1.0 - (x / 14.0).powi(2) - (y / 9.0).powi(2)).sqrt())),
    // Curved by 1/12 mm one way and as much the other way across.
    ("saddle", |x, y| (x * x - y * y) / 24.0),
    // Bumps of 15 µm, 1.6 mm from one to the next.
    ("bumpy ball", |x, y| {
        let wave = |x: f64| (std::f64::consts::TAU * x / 1.6).cos();
        12.0 - (144.0 - x * x - y * y).sqrt() + 0.015 * wave(x + 0.3) * wave(y)
    }),
];

/// The cap's uneven vertices, lifted to another surface.
fn scene(height: Height) -> PreparedScene {
    let (vertices, triangles) = cap();
    assert_eq!(vertices.len(), SIDE * SIDE);
    let vertices = vertices.into_iter().map(|v| Point3::new(v.x, v.y, height(v.x, v.y))).collect();
    let surface = SceneSurface::Mesh(Arc::new(TriangleMesh::new(vertices, triangles).unwrap()));
    PreparedScene::new(Scene { surface, ..Scene::built_in("macula").unwrap() }).unwrap()
}

/// A ball straight down, one that leans, and a flat tip: position (mm), radius (mm), lean (rad), force (mN).
fn requests(height: Height) -> [Request; 3] {
    let request = |shape: NeedleShape, [x, y]: [f64; 2], lean: f64, force_mn: f64| {
        let points = nalgebra::Unit::new_normalize(Vector3::new(lean.sin(), 0.0, -lean.cos()));
        let needle = Needle::pointing(shape, Point3::new(x, y, height(x, y) + 0.1), &points);
        let control = Control::Force(points.into_inner() * force_mn);
        Request { needle, control, level: Level::Linear, effects: EffectChoice::Auto }
    };
    [
        request(NeedleShape::hemispherical(0.257), [0.05, -0.1], 0.0, 0.8),
        request(NeedleShape::hemispherical(0.2), [-0.2, 0.15], 0.5, 0.5),
        request(NeedleShape::flat(0.15), [0.1, 0.1], 0.2, 0.3),
    ]
}

#[test]
fn learned_levels_hold_on_surfaces_that_no_training_saw() {
    let mut workspace = Workspace::default();
    let levels = [Level::Linear, Level::Network, Level::Coarse, Level::Corrected];
    let (mut all, mut moved_um) = (levels.map(|_| Vec::new()), 0.0_f64);
    for (name, height) in SURFACES {
        let scene = scene(height);
        let mut errors = levels.map(|_| Vec::new());
        for request in requests(height) {
            let mut ask = |level| {
                let request = Request { level, ..request.clone() };
                scene.predict(&request, &mut workspace, &mut Silent).unwrap_or_else(|e| panic!("{name} {level:?}: {e}"))
            };
            let truth = ask(Level::Reference);
            moved_um = truth.displacement_um.iter().copied().fold(moved_um, f64::max);
            for (level, errors) in levels.into_iter().zip(&mut errors) {
                let answer = ask(level);
                assert_eq!(answer.source_indices, truth.source_indices);
                let learned = matches!(level, Level::Network | Level::Corrected);
                assert!(!(learned && answer.expected_error.calibrated), "{name}: {level:?} calls itself calibrated");
                errors.extend(node_errors_um(&answer.vertices, &truth.vertices));
            }
        }
        let [linear, network, coarse, corrected] = errors.each_ref().map(|errors| mean(errors));
        println!("{name}: linear {linear:.2} µm, network {network:.2}, coarse {coarse:.2}, corrected {corrected:.2}");
        all.iter_mut().zip(errors).for_each(|(all, errors)| all.extend(errors));
        assert!(network < linear && corrected < coarse, "{name}: {network} {linear} {corrected} {coarse}");
    }
    let [linear, network, coarse, corrected] = all.each_ref().map(|errors| mean(errors));
    println!("all: linear {linear:.2} µm, network {network:.2}, coarse {coarse:.2}, corrected {corrected:.2}");
    assert!(moved_um > 50.0, "{moved_um} µm prove little");
    assert!(network < LEFT * linear && network < GOAL_UM, "{network} of {linear} µm");
    assert!(corrected < LEFT * coarse, "{corrected} of {coarse} µm");
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}
