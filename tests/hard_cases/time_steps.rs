//! Sequences with steps from a microsecond to a quarter of an hour, with everything that remembers: every step sound, and what lasts is what a single
//! prediction says.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::scene::bleb::{Filling, SubretinalFluid};
use retina_core::sequence::{Sequence, Simulation, Step};
use retina_tests::laws::broken;

use crate::table::{built_in, push};

/// Force of the pushes (mN).
const FORCE_MN: f64 = 0.3;
/// Newton iterations of a step: a lasting mesh needs no more than a single prediction (6), a change within a microsecond meets tissue
/// eleven times as stiff and a start that knows nothing of it.
const MOST_ITERATIONS: usize = 25;

fn needle() -> Needle {
    Needle::pointing(NeedleShape::hemispherical(0.257), Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis())
}

/// A step that pushes down.
fn pushed(time_s: f64, force_mn: f64) -> Step {
    Step { time_s, force_mn: Some(Vector3::new(0.0, 0.0, -force_mn)), ..Step::default() }
}

/// A step that holds the needle this deep.
fn held(time_s: f64, depth_mm: f64) -> Step {
    Step { time_s, tip_mm: Some(Point3::new(0.0, 0.0, -depth_mm)), ..Step::default() }
}

/// Steps of one length: push, hold, push harder, let go, wait.
fn steps(step_s: f64) -> Vec<Step> {
    let time = |count: usize| count as f64 * step_s;
    vec![
        pushed(time(1), FORCE_MN),
        Step { time_s: time(2), ..Step::default() },
        pushed(time(3), 2.0 * FORCE_MN),
        held(time(4), 0.05),
        pushed(time(5), 0.0),
        pushed(time(6), 0.0),
    ]
}

/// Runs the steps; every answer sound. Its largest displacement (µm) and iterations, step by step.
fn run(name: &str, steps: &[Step]) -> Vec<(f64, usize)> {
    run_in(built_in("macula"), &["finite_strain", "contact", "viscoelasticity", "inertia"], name, steps)
}

/// The same in this scene with these effects.
fn run_in(scene: Scene, effects: &[&str], name: &str, steps: &[Step]) -> Vec<(f64, usize)> {
    let scene = Arc::new(PreparedScene::new(scene).unwrap());
    let effects = EffectChoice::Named(effects.iter().map(|name| (*name).to_owned()).collect());
    let sequence = Sequence { needle: needle(), steps: steps.to_vec(), level: Level::Coarse, effects };
    let mut simulation =
        Simulation::new(&scene, &sequence, &mut Silent).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut found = Vec::new();
    let mut tip_mm = needle().tip_mm;
    let mut filling = scene.scene().bleb.map(|fluid| fluid.filling);
    for step in steps {
        let outcome = simulation.step(&mut Silent).unwrap_or_else(|error| panic!("{name}: {error}")).unwrap();
        let needle = Needle { tip_mm: step.tip_mm.unwrap_or(tip_mm), ..needle() };
        // A needle without a force is drawn back and held there: the forces at play are those of a held one.
        let pushes = step.force_mn.filter(|force| force.norm() > 0.0);
        let control = pushes.map_or(Control::Pose, Control::Force);
        let asked = Request { needle, control, level: Level::Coarse, effects: sequence.effects.clone() };
        let answer = outcome.prediction;
        let mut told = scene.scene().clone();
        filling = step.fluid.or(filling);
        told.bleb = told.bleb.zip(filling).map(|(fluid, filling)| SubretinalFluid { filling, ..fluid });
        let laws = broken(&told, &asked, &answer);
        assert!(laws.is_empty(), "{name}, {} s: {laws:?}", step.time_s);
        let iterations = answer.solver.iterations;
        assert!(iterations <= MOST_ITERATIONS, "{name}, {} s: {iterations} iterations", step.time_s);
        tip_mm = answer.needle.tip_mm;
        let moved_um = answer.displacement_um.iter().copied().fold(0.0, f64::max);
        println!("| time steps | {name}, {} s | {iterations} iterations, {moved_um:.3} µm |", step.time_s);
        found.push((moved_um, iterations));
    }
    found
}

#[test]
fn steps_of_any_length_are_sound() {
    for step_s in [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3] {
        let moved = run(&format!("steps of {step_s} s"), &steps(step_s));
        assert!(moved[2].0 > 0.0, "{step_s}: nothing moves");
    }
}

/// Fluid comes, is pressed, comes under a needle that is held, and goes, within a microsecond or a quarter of an hour each.
#[test]
fn fluid_within_steps_of_any_length_is_sound() {
    let bleb = SubretinalFluid { filling: Filling::Volume(0.01), center_mm: Point3::origin(), radius_mm: 0.6 };
    let effects = ["finite_strain", "contact", "bleb", "viscoelasticity", "inertia"];
    for step_s in [1e-6, 1e-4, 1e-2, 1.0, 1e3] {
        let filled = |step: Step, volume_mm3: f64| Step { fluid: Some(Filling::Volume(volume_mm3)), ..step };
        let time = |count: usize| count as f64 * step_s;
        let steps = [
            filled(pushed(time(1), 0.0), 0.02),
            pushed(time(2), 0.1),
            filled(Step { time_s: time(3), ..Step::default() }, 0.025),
            filled(pushed(time(4), 0.0), 0.01),
            filled(pushed(time(5), 0.0), 0.0),
        ];
        let scene = Scene { bleb: Some(bleb), ..built_in("macula") };
        let moved = run_in(scene, &effects, &format!("fluid in steps of {step_s} s"), &steps);
        assert!(moved.iter().all(|(moved_um, _)| *moved_um > 0.0), "{step_s}: nothing moves");
    }
}

#[test]
fn the_longest_steps_forget_and_the_shortest_hardly_move_the_tissue() {
    let scene = Arc::new(PreparedScene::new(built_in("macula")).unwrap());
    let push = push(NeedleShape::hemispherical(0.257), FORCE_MN);
    let lasting = scene.predict(&push, &mut Workspace::default(), &mut Silent).unwrap();
    let lasting_um = lasting.displacement_um.iter().copied().fold(0.0, f64::max);
    let slow = run("push within 1000 s", &[pushed(1e3, FORCE_MN)])[0].0;
    let fast = run("push within 1e-6 s", &[pushed(1e-6, FORCE_MN)])[0].0;
    // The mesh that lasts is finer than that of a single prediction, and the longest relaxation time is a tenth of the ramp.
    assert!((slow / lasting_um - 1.0).abs() < 0.1, "{slow} and {lasting_um} µm");
    assert!(fast < 0.01 * slow, "mass alone holds the tissue for a microsecond: {fast} and {slow} µm");
}

#[test]
fn steps_that_change_their_length_by_nine_decades_are_sound() {
    let steps = [
        pushed(1e-6, FORCE_MN),
        pushed(1e-6 + 1e3, FORCE_MN),
        pushed(2e-6 + 1e3, 2.0 * FORCE_MN),
        Step { time_s: 4e-6 + 1e3, ..Step::default() },
        pushed(2e3, 0.0),
        pushed(2e3 + 1e-5, FORCE_MN),
        pushed(3e3, FORCE_MN),
    ];
    run("steps of 1e-6 and 1e3 s in turn", &steps);
}

#[test]
fn steps_out_of_order_or_range_are_refused_by_name() {
    let scene = Arc::new(PreparedScene::new(built_in("macula")).unwrap());
    for (times, step) in [
        (&[1e-7][..], 0),
        (&[2e3], 0),
        (&[0.1, 0.1], 1),
        (&[0.2, 0.1], 1),
        (&[0.1, f64::NAN], 1),
        (&[-1.0], 0),
        (&[0.0], 0),
    ] {
        let steps = times.iter().map(|&time_s| pushed(time_s, FORCE_MN)).collect();
        let sequence = Sequence { needle: needle(), steps, level: Level::Coarse, effects: EffectChoice::Auto };
        let error = Simulation::new(&scene, &sequence, &mut Silent).err().map(|error| error.to_string());
        assert!(
            error.as_ref().is_some_and(|error| error.contains(&format!("steps[{step}].time_s"))),
            "{times:?}: {error:?}"
        );
    }
}
