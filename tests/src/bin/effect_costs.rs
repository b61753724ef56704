//! What each effect of a single equilibrium costs and changes: the same request at level `coarse` with the effect and without it, in one
//! run, interleaved, on one thread.
//!
//! `cargo run --release -p retina-tests --bin effect_costs [-- REPEATS]` prints the table that the README shows.

use std::time::Instant;

use nalgebra::{Point3, Unit, Vector3};
use retina_core::comparison::{node_errors_um, quantile};
use retina_core::effects::{adhesion, bleb, contact, elasticity, finite_strain, friction, pressure, tool_flex};
use retina_core::needle::shaft::STIFFNESS;
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::scene::bleb::{Filling, SubretinalFluid};

/// Timed repeats of each prediction unless told.
const REPEATS: usize = 30;
/// Radius of the needle (mm): 25G.
const RADIUS_MM: f64 = 0.257;
/// Force, leaning by about 20 degrees (mN).
const FORCE_MN: [f64; 3] = [0.3, 0.0, -0.8];

/// One line of the table.
struct Case {
    effect: &'static str,
    what: &'static str,
    change: fn(&mut Scene),
    without: &'static [&'static str],
}

const CASES: [Case; 6] = [
    Case {
        effect: finite_strain::NAME,
        what: "the default scene",
        change: |_| {},
        without: &[elasticity::NAME, contact::NAME],
    },
    Case {
        effect: friction::NAME,
        what: "µ = 0.3",
        change: |scene| scene.friction_coefficient = 0.3,
        without: &[finite_strain::NAME, contact::NAME],
    },
    Case {
        effect: pressure::NAME,
        what: "2 kPa (15 mmHg) above rest",
        change: |scene| scene.pressure_kpa = scene.rest_pressure_kpa + 2.0,
        without: &[finite_strain::NAME, contact::NAME],
    },
    Case {
        effect: adhesion::NAME,
        what: "a bond of 1 kPa",
        change: |scene| scene.tissue.bond.strength_kpa = 1.0,
        without: &[finite_strain::NAME, contact::NAME],
    },
    Case {
        effect: bleb::NAME,
        what: "0.02 mm³ (20 nl) under 0.6 mm radius",
        change: |scene| {
            let (filling, center_mm, radius_mm) = (Filling::Volume(0.02), Point3::origin(), 0.6);
            scene.bleb = Some(SubretinalFluid { filling, center_mm, radius_mm });
        },
        without: &[finite_strain::NAME, contact::NAME],
    },
    Case {
        effect: tool_flex::NAME,
        what: "a 25G shaft of 67 mN/mm",
        change: |_| {},
        without: &[finite_strain::NAME, contact::NAME],
    },
];

fn main() -> Result<(), PredictError> {
    let repeats = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(REPEATS);
    println!(
        "| effect | the scene has | ms without (p10–p90) | ms with (p10–p90) | ratio | Newton without / with | largest change µm |"
    );
    println!("|---|---|---|---|---|---|---|");
    for case in CASES {
        let Some(mut scene) = Scene::built_in("macula") else { continue };
        (case.change)(&mut scene);
        let scene = PreparedScene::new(scene)?;
        let without: Vec<String> = case.without.iter().map(|name| (*name).to_owned()).collect();
        let with = without.iter().filter(|name| *name != elasticity::NAME).cloned().chain([case.effect.to_owned()]);
        let requests = [without.clone(), with.collect()].map(|names| request(EffectChoice::Named(names)));
        let mut workspaces: [Workspace; 2] = Default::default();
        let mut milliseconds: [Vec<f64>; 2] = Default::default();
        let mut answers: [Option<Prediction>; 2] = [None, None];
        for _ in 0..=repeats {
            for at in 0..2 {
                let start = Instant::now();
                answers[at] = Some(scene.predict(&requests[at], &mut workspaces[at], &mut Silent)?);
                milliseconds[at].push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        let [Some(off), Some(on)] = &answers else { continue };
        // The first of each fills the caches.
        let [off_ms, on_ms] = milliseconds.each_ref().map(|ms| [0.1, 0.5, 0.9].map(|share| quantile(&ms[1..], share)));
        let change_um = node_errors_um(&on.vertices, &off.vertices).into_iter().fold(0.0, f64::max);
        println!(
            "| `{}` | {} | {:.1} ({:.1}–{:.1}) | {:.1} ({:.1}–{:.1}) | {:.2} | {} / {} | {change_um:.2} |",
            case.effect,
            case.what,
            off_ms[1],
            off_ms[0],
            off_ms[2],
            on_ms[1],
            on_ms[0],
            on_ms[2],
            on_ms[1] / off_ms[1],
            off.solver.iterations,
            on.solver.iterations
        );
    }
    Ok(())
}

fn request(effects: EffectChoice) -> Request {
    let force = Vector3::from(FORCE_MN);
    let mut needle = Needle::pointing(
        NeedleShape::hemispherical(RADIUS_MM),
        Point3::new(0.0, 0.0, 0.1),
        &Unit::new_normalize(force),
    );
    needle.stiffness_mn_per_mm = Some(STIFFNESS.default);
    Request { needle, control: Control::Force(force), level: Level::Coarse, effects }
}
