//! What size costs: meshes of one family from hundreds of unknowns to tens of thousands, and patches of 8 × 8 to 64 × 64 nodes read off one of them.
//!
//! `cargo run --release -p retina-tests --bin cost_of_size [-- FINEST]` prints both tables and the slopes that fit them: the power of the number of unknowns with
//! which the time of one Newton iteration grows, and that of the number of nodes with which reading them does. One thread.

use std::hint::black_box;
use std::time::Instant;

use nalgebra::{Point3, Vector3};
use retina_core::comparison::{node_errors_um, quantile};
use retina_core::mesh::disc::DiscGeometry;
use retina_core::mesh::sample::SurfaceLocator;
use retina_core::mesh::wall::{LayerThickness, WallGeometry, WallTopology};
use retina_core::needle::{Gauge, Needle, NeedleShape};
use retina_core::predict::finite_element::{REFERENCE, Resolution};
use retina_core::predict::{Control, EffectChoice, Level, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;

/// The finest mesh divides each edge of the coarsest so often, unless told.
const FINEST: usize = 4;
/// Solves that are timed on each mesh.
const REPEATS: usize = 3;
/// Readings that are timed of each patch.
const READINGS: usize = 20;
/// The force (mN): it indents the default tissue by about half the retina's thickness.
const FORCE_MN: f64 = 0.8;
/// Where the needle stands (mm).
const TIP: [f64; 3] = [0.12, -0.05, 0.0];
/// Width of the patches that are read (mm).
const PATCH_MM: f64 = 2.1;
/// Nodes along a side of each.
const SIDES: [usize; 4] = [8, 16, 32, 64];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let finest = std::env::args().nth(1).map_or(Ok(FINEST), |a| a.parse())?;
    meshes(finest)?;
    patches()
}

/// The mesh that divides each edge of the coarsest `times`.
fn divided(times: usize) -> Resolution {
    Resolution {
        core_cells: times,
        rings: 4 * times,
        retina_elements: times,
        choroid_elements: times.div_ceil(2),
        sclera_elements: 1,
        ..REFERENCE
    }
}

fn meshes(finest: usize) -> Result<(), Box<dyn std::error::Error>> {
    let scene = PreparedScene::new(Scene::built_in("macula").ok_or("no such scene")?)?;
    let shape = NeedleShape::hemispherical(Gauge::from_name("25G")?.radius_mm());
    let request = Request {
        needle: Needle::pointing(shape, Point3::from(TIP), &-Vector3::z_axis()),
        control: Control::Force(-Vector3::z() * FORCE_MN),
        level: Level::Reference,
        effects: EffectChoice::Named(["finite_strain", "contact"].map(str::to_owned).to_vec()),
    };
    let mut found: Vec<(usize, f64, Prediction)> = Vec::new();
    for times in 1..=finest {
        let mut workspace = Workspace::default();
        let (mut ms, mut last) = (Vec::new(), None);
        for _ in 0..REPEATS {
            let begun = Instant::now();
            let answer = scene.predict_at(&request, &divided(times), &mut workspace, &mut Silent)?;
            ms.push(begun.elapsed().as_secs_f64() * 1e3);
            last = Some(answer);
        }
        found.extend(last.map(|answer| (times, quantile(&ms, 0.5), answer)));
    }
    let Some((_, _, truth)) = found.last() else { return Ok(()) };
    println!(
        "| each edge divided | unknowns | ms | Newton | ms an iteration | worst node off the finest, µm |\n|---|---|---|---|---|---|"
    );
    let mut points = Vec::new();
    for (times, ms, answer) in &found {
        let each = ms / answer.solver.iterations as f64;
        let off = node_errors_um(&answer.vertices, &truth.vertices).into_iter().fold(0.0, f64::max);
        let unknowns = answer.solver.unknowns;
        println!("| {times} | {unknowns} | {ms:.1} | {} | {each:.1} | {off:.2} |", answer.solver.iterations);
        points.push((unknowns as f64, each));
    }
    println!("\nan iteration grows with the unknowns to the power {:.2}\n", slope(&points));
    Ok(())
}

fn patches() -> Result<(), Box<dyn std::error::Error>> {
    let topology =
        WallTopology::new(divided(2).division(&Scene::built_in("flat").ok_or("no such scene")?.tissue, false))?;
    let scene = Scene::built_in("flat").ok_or("no such scene")?;
    let surface = scene.patch(&Point3::origin())?.surface;
    let layers = scene.tissue.layers();
    let layer = |thickness_mm| LayerThickness { thickness_mm, thins: false, first_element_mm: f64::INFINITY };
    let layers: Vec<LayerThickness> = layers.iter().map(|named| layer(named.layer.thickness_mm)).collect();
    let rings = topology.disc.rings as f64;
    let radii = (0..=topology.disc.rings).map(|ring| 0.1 * 20.0_f64.powf(ring as f64 / rings)).collect();
    let disc = DiscGeometry { center: [0.0, 0.0], radii, offsets: Vec::new() };
    let geometry = WallGeometry::new(&topology, &disc, &layers, |x, y| surface.column(x, y))?;
    println!("| patch | nodes | µs to read it | µs a node |\n|---|---|---|---|");
    let mut points = Vec::new();
    for side in SIDES {
        let at = |index: usize| PATCH_MM * (index as f64 / (side - 1) as f64 - 0.5);
        let mut us = Vec::new();
        for _ in 0..READINGS {
            let begun = Instant::now();
            let locator = SurfaceLocator::new(&topology, &geometry);
            for node in 0..side * side {
                let sample = locator.locate([at(node % side), at(node / side)]).ok_or("a node beyond the mesh")?;
                black_box(sample.interpolate(&geometry.rest));
            }
            us.push(begun.elapsed().as_secs_f64() * 1e6);
        }
        let (nodes, us) = (side * side, quantile(&us, 0.5));
        println!("| {side} × {side} | {nodes} | {us:.0} | {:.2} |", us / nodes as f64);
        points.push((nodes as f64, us));
    }
    println!("\nreading grows with the nodes to the power {:.2}", slope(&points));
    Ok(())
}

/// Slope of the straight line that fits the points best in logarithms.
fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let (x, y) = (logs.iter().map(|p| p.0).sum::<f64>() / count, logs.iter().map(|p| p.1).sum::<f64>() / count);
    let (above, below) =
        logs.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x) * (p.0 - x)));
    above / below
}
