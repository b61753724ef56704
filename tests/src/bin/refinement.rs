//! How far is `reference` from converged? Refines its mesh once more and compares, scene by scene and gauge by gauge.
//!
//! `cargo run --release -p retina-tests --bin refinement [-- FACTOR]` divides every edge of the reference mesh FACTOR times as finely
//! (default 1.5; 2 takes about ten times longer) and prints the largest change of any node against the larger of 0.5 µm and 1 % of the largest displacement.

use std::time::Instant;

use nalgebra::{Point3, Unit, Vector3};
use retina_core::comparison::node_errors_um;
use retina_core::needle::{Gauge, Needle, NeedleShape};
use retina_core::predict::finite_element::REFERENCE;
use retina_core::predict::{Control, EffectChoice, Level, PredictError, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;

/// Gauges compared, with a force that indents the default tissue by about half the retina's thickness or more (mN).
const CASES: [(&str, f64); 3] = [("41G", 0.08), ("25G", 1.0), ("23G", 1.4)];
/// Where the needle stands, off every axis of symmetry and mesh line (mm).
const TIP: [f64; 3] = [0.17, -0.23, 0.1];
/// Where it points: tilted by 20°.
const DIRECTION: [f64; 3] = [0.30, 0.18, -0.94];
/// Change that is accepted: absolute (µm) and relative to the largest displacement.
const ACCEPTED: (f64, f64) = (0.5, 0.01);

fn main() -> Result<(), PredictError> {
    let factor = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(1.5);
    let finer = REFERENCE.refined(factor);
    println!(
        "| scene | gauge | force mN | largest displacement µm | reference s | refined s | largest change µm | accepted µm | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut workspace = Workspace::default();
    for name in Scene::built_in_names() {
        let Some(scene) = Scene::built_in(name) else { continue };
        let scene = PreparedScene::new(scene)?;
        for (gauge, force_mn) in CASES {
            let Ok(gauge) = Gauge::from_name(gauge) else { continue };
            let direction = Unit::new_normalize(Vector3::from(DIRECTION));
            let shape = NeedleShape::hemispherical(gauge.radius_mm());
            let request = Request {
                needle: Needle::pointing(shape, Point3::from(TIP), &direction),
                control: Control::Force(direction.into_inner() * force_mn),
                level: Level::Reference,
                effects: EffectChoice::Named(["finite_strain", "contact"].map(str::to_owned).to_vec()),
            };
            let start = Instant::now();
            let reference = scene.predict(&request, &mut workspace, &mut Silent)?;
            let seconds = start.elapsed().as_secs_f64();
            let start = Instant::now();
            let fine = scene.predict_at(&request, &finer, &mut workspace, &mut Silent)?;
            let fine_seconds = start.elapsed().as_secs_f64();
            let change = node_errors_um(&reference.vertices, &fine.vertices).into_iter().fold(0.0, f64::max);
            let largest = fine.displacement_um.iter().copied().fold(0.0, f64::max);
            let accepted = ACCEPTED.0.max(ACCEPTED.1 * largest);
            println!(
                "| {name} | {} | {force_mn} | {largest:.1} | {seconds:.1} | {fine_seconds:.1} | {change:.2} | {accepted:.2} | {} |",
                gauge.name,
                if change <= accepted { "converged" } else { "NOT converged" }
            );
        }
    }
    Ok(())
}
