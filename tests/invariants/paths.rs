//! Laws of sequences in which the way matters: friction that sticks, slips and turns back, a bond that never heals, an eye under pressure.

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::finite_element::{COARSE, Resolution};
use retina_core::predict::{ContactState, Control, EffectChoice, Level, PreparedScene, Request};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::sequence::{Sequence, Simulation, Step, StepOutcome};

use crate::support::{ask, largest_um};

fn changed(name: &str, change: impl FnOnce(&mut Scene)) -> PreparedScene {
    let mut scene = Scene::built_in(name).unwrap();
    change(&mut scene);
    PreparedScene::new(scene).unwrap()
}

fn rough(coefficient: f64) -> PreparedScene {
    changed("flat", |scene| scene.friction_coefficient = coefficient)
}

fn named(extra: &[&str]) -> EffectChoice {
    let names = ["elasticity", "finite_strain", "contact"].iter().chain(extra);
    EffectChoice::Named(names.map(|name| (*name).to_owned()).collect())
}

fn needle() -> Needle {
    Needle::pointing(NeedleShape::hemispherical(0.257), Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis())
}

fn sequence(effects: EffectChoice, steps: Vec<Step>) -> Sequence {
    Sequence { needle: needle(), steps, level: Level::Coarse, effects }
}

fn held(time_s: f64, x_mm: f64, depth_mm: f64) -> Step {
    Step { time_s, tip_mm: Some(Point3::new(x_mm, 0.0, -depth_mm)), ..Step::default() }
}

fn run(scene: &PreparedScene, sequence: &Sequence, resolution: Option<&Resolution>) -> Vec<StepOutcome> {
    let mut simulation = Simulation::at(scene, sequence, resolution, &mut Silent).unwrap();
    let mut outcomes = Vec::new();
    while let Some(outcome) = simulation.step(&mut Silent).unwrap_or_else(|error| panic!("{error}: {sequence:?}")) {
        outcomes.push(outcome);
    }
    outcomes
}

#[test]
fn explore() {
    let scene = rough(0.3);
    let depth = 0.06;
    let mut xs = vec![0.0];
    for k in 1..=12 { xs.push(0.01 * k as f64); }
    xs.push(0.12);
    for k in (0..12).rev() { xs.push(0.01 * k as f64); }
    for extra in [&["friction"][..], &["friction", "viscoelasticity"], &["friction", "viscoelasticity", "inertia"]] {
    let steps: Vec<Step> = xs.iter().enumerate().map(|(k, &x)| held(0.1 * (k + 1) as f64, x, depth)).collect();
    let start = std::time::Instant::now();
    let outcomes = run(&scene, &sequence(named(extra), steps), None);
    println!("{extra:?} {:?}", start.elapsed());
    for (x, outcome) in xs.iter().zip(&outcomes) {
        let r = outcome.prediction.needle.reaction_mn;
        println!("x {x:.3} T {:.5} {:.5} N {:.5} T/N {:.4} share {:?} its {} {:?}", r.x, r.y, r.z, r.x / r.z, outcome.prediction.contact.slipping_share, outcome.prediction.solver.iterations, outcome.prediction.warnings);
    }
    }
}
