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
    for k in 1..=12 {
        xs.push(0.01 * k as f64);
    }
    xs.push(0.12);
    for k in (0..12).rev() {
        xs.push(0.01 * k as f64);
    }
    for extra in [&["friction"][..], &["friction", "viscoelasticity"], &["friction", "viscoelasticity", "inertia"]] {
        let steps: Vec<Step> = xs.iter().enumerate().map(|(k, &x)| held(0.1 * (k + 1) as f64, x, depth)).collect();
        let start = std::time::Instant::now();
        let outcomes = run(&scene, &sequence(named(extra), steps), None);
        println!("{extra:?} {:?}", start.elapsed());
        for (x, outcome) in xs.iter().zip(&outcomes) {
            let r = outcome.prediction.needle.reaction_mn;
            println!(
                "x {x:.3} T {:.5} {:.5} N {:.5} T/N {:.4} share {:?} its {} {:?}",
                r.x,
                r.y,
                r.z,
                r.x / r.z,
                outcome.prediction.contact.slipping_share,
                outcome.prediction.solver.iterations,
                outcome.prediction.warnings
            );
        }
    }
}

#[test]
fn explore_random() {
    let mut failed = 0;
    let mut total = 0;
    let mut its = Vec::new();
    let started = std::time::Instant::now();
    for trial in 0..24u64 {
        let mut random = fastrand::Rng::with_seed(trial);
        let mu = [0.1, 0.3, 0.6, 1.0, 2.0][random.usize(0..5)];
        let scene = changed("macula", |scene| {
            scene.friction_coefficient = mu;
            if random.bool() {
                scene.pressure_kpa = 4.0;
            }
            if random.usize(0..3) == 0 {
                scene.tissue.bond.strength_kpa = 2.0;
            }
        });
        for request in crate::support::requests(&scene, 100 + trial, 2) {
            let mut steps =
                vec![Step { time_s: 1.0, force_mn: Some(crate::support::force(&request)), ..Step::default() }];
            // drag
            let alone = ask(&scene, &crate::support::at(&request, Level::Coarse));
            let Ok(alone) = alone else {
                println!("alone fails {:?}", alone.err().map(|e| e.to_string()));
                continue;
            };
            let tip = alone.needle.tip_mm;
            let a = random.f64() * 6.28;
            for k in 1..=5 {
                let s = [0.02, 0.05, 0.02, -0.05, -0.1][k - 1];
                steps.push(Step {
                    time_s: 1.0 + 0.1 * k as f64,
                    tip_mm: Some(tip + Vector3::new(a.cos(), a.sin(), 0.0) * s),
                    ..Step::default()
                });
            }
            steps.push(Step { time_s: 3.0, force_mn: Some(Vector3::zeros()), ..Step::default() });
            for effects in [EffectChoice::Auto] {
                let sequence = Sequence { needle: request.needle, steps: steps.clone(), level: Level::Coarse, effects };
                total += 1;
                let mut simulation = match Simulation::new(&scene, &sequence, &mut Silent) {
                    Ok(s) => s,
                    Err(e) => {
                        println!("{trial} refused: {e}");
                        total -= 1;
                        continue;
                    }
                };
                loop {
                    match simulation.step(&mut Silent) {
                        Ok(Some(outcome)) => {
                            if outcome.prediction.warnings.iter().any(|w| w.contains("parts")) {
                                println!("{trial} step {} {:?}", outcome.step, outcome.prediction.warnings);
                            }
                            its.push(outcome.prediction.solver.iterations)
                        }
                        Ok(None) => break,
                        Err(e) => {
                            failed += 1;
                            println!(
                                "{trial} mu {mu} {:?} bond {} p {}: {e}",
                                request.needle.shape,
                                scene.scene().tissue.bond.strength_kpa,
                                scene.scene().pressure_kpa
                            );
                            break;
                        }
                    }
                }
            }
        }
    }
    its.sort_unstable();
    println!(
        "failed {failed} of {total}; iterations {} {} {} in {:?}",
        its[its.len() / 2],
        its[its.len() * 99 / 100],
        its[its.len() - 1],
        started.elapsed()
    );
}
