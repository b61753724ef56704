//! A bleb on whole scenes: its volume is kept, with and without a needle, at every pose; where there is none there is no trace of it.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use retina_core::equilibrium::bleb::VOLUME_TOLERANCE;
use retina_core::predict::{
    ContactState, Control, EffectChoice, EffectReport, Level, PredictError, Prediction, PreparedScene, Request,
};
use retina_core::scene::Scene;
use retina_core::scene::bleb::{Filling, SubretinalFluid};
use retina_core::scene::conditions::MMHG_KPA;

use crate::support::{ask, at, built_in, largest_um, straight};

const VOLUME_MM3: f64 = 0.02;

fn fluid(volume_mm3: f64, x_mm: f64, y_mm: f64) -> SubretinalFluid {
    SubretinalFluid { filling: Filling::Volume(volume_mm3), center_mm: Point3::new(x_mm, y_mm, 0.0), radius_mm: 0.6 }
}

fn filled(name: &str, fluid: SubretinalFluid) -> PreparedScene {
    PreparedScene::new(Scene { bleb: Some(fluid), ..Scene::built_in(name).unwrap() }).unwrap()
}

fn row(answer: &Prediction) -> EffectReport {
    answer.effects.iter().find(|effect| effect.name == "bleb").unwrap().clone()
}

/// Height of every node over its rest (mm).
fn heights(scene: &PreparedScene, answer: &Prediction) -> Vec<f64> {
    let patch = scene.scene().patch(&Point3::origin()).unwrap();
    answer.vertices.iter().zip(&patch.vertices).map(|(now, rest)| now.z - rest.z).collect()
}

#[test]
fn fluid_lifts_the_retina_over_it_and_nothing_else() {
    for name in Scene::built_in_names() {
        let mut last_um = 0.0;
        for volume_mm3 in [0.005, 0.02, 0.05] {
            let scene = filled(name, fluid(volume_mm3, 0.15, 0.15));
            let answer = ask(&scene, &straight(Level::Coarse, 0.0)).unwrap();
            let bleb = answer.contact.bleb.unwrap();
            let heights = heights(&scene, &answer);
            let patch = scene.scene().patch(&Point3::origin()).unwrap();
            println!(
                "{name}, {volume_mm3} mm³: {:.4} kPa, up to {:.2} µm, {} iterations",
                bleb.pressure_kpa,
                largest_um(&answer),
                answer.solver.iterations
            );
            assert!(row(&answer).simulated && answer.contact.state == ContactState::Clear);
            assert_eq!(answer.needle.reaction_mn, Vector3::zeros());
            assert!((bleb.volume_mm3 / volume_mm3 - 1.0).abs() <= VOLUME_TOLERANCE && bleb.pressure_kpa > 0.0);
            assert!(largest_um(&answer) > last_um, "more fluid lifts it further");
            last_um = largest_um(&answer);
            for (height, [x, y]) in heights.iter().zip(&patch.parameters) {
                let away = (x - 0.15).hypot(y - 0.15);
                assert!(away > 0.4 || *height > 0.2 * last_um * 1e-3, "{name}: {height} at {away}");
                assert!(away < 1.1 || height.abs() < 0.03 * last_um * 1e-3, "{name}: {height} at {away}");
            }
            assert!(!answer.expected_error.calibrated);
        }
    }
}

#[test]
fn a_needle_on_a_bleb_is_borne_by_its_fluid() {
    for name in ["flat", "macula"] {
        let scene = filled(name, fluid(VOLUME_MM3, 0.0, 0.0));
        let free = ask(&scene, &straight(Level::Coarse, 0.0)).unwrap().contact.bleb.unwrap();
        let mut last = free.pressure_kpa;
        for force_mn in [0.05, 0.2, 0.5] {
            let answer =
                ask(&scene, &straight(Level::Coarse, force_mn)).unwrap_or_else(|e| panic!("{name} {force_mn} mN: {e}"));
            let bleb = answer.contact.bleb.unwrap();
            let dry = ask(&built_in(name), &straight(Level::Coarse, force_mn)).unwrap();
            println!(
                "{name}, {force_mn} mN: {:.4} kPa, tip at {:.4} mm (without fluid {:.4}), {} iterations",
                bleb.pressure_kpa, answer.needle.tip_mm.z, dry.needle.tip_mm.z, answer.solver.iterations
            );
            assert!((answer.needle.reaction_mn.z - force_mn).abs() < 1e-6 * force_mn);
            assert!((bleb.volume_mm3 / VOLUME_MM3 - 1.0).abs() <= VOLUME_TOLERANCE, "the volume is kept");
            assert!(bleb.pressure_kpa > last, "the harder the push, the higher the pressure");
            last = bleb.pressure_kpa;
        }
        // Held where its tip just reaches the lifted retina and not the one at rest.
        let mut held = straight(Level::Coarse, 0.0);
        (held.control, held.needle.tip_mm) = (Control::Pose, Point3::new(0.0, 0.0, 0.01));
        let answer = ask(&scene, &held).unwrap();
        assert_eq!(answer.contact.state, ContactState::Touching);
        assert!(
            answer.needle.reaction_mn.z > 0.0
                && ask(&built_in(name), &held).unwrap().contact.state == ContactState::Clear
        );
    }
}

#[test]
fn where_the_needle_stands_on_a_bleb_hardly_matters_to_its_fluid() {
    // Each place has a mesh of its own; under a touch of no weight the fluid is that without a needle.
    let scene = filled("flat", fluid(VOLUME_MM3, 0.1, 0.05));
    let free = ask(&scene, &straight(Level::Coarse, 0.0)).unwrap().contact.bleb.unwrap().pressure_kpa;
    for (x, y) in [(0.1, 0.05), (0.3, 0.05), (-0.1, -0.2), (0.1, 0.4)] {
        let mut touch = straight(Level::Coarse, 1e-3);
        (touch.needle.tip_mm.x, touch.needle.tip_mm.y) = (x, y);
        let pressure = ask(&scene, &touch).unwrap().contact.bleb.unwrap().pressure_kpa;
        println!("at ({x}, {y}): {:.4} of {free:.4} kPa", pressure / free);
        assert!((pressure / free - 1.0).abs() < 0.1, "({x}, {y}): {pressure} {free}");
    }
}

#[test]
fn a_bleb_goes_with_its_scene() {
    let move_by =
        Isometry3::from_parts(Translation3::new(10.0, -20.0, 30.0), UnitQuaternion::from_euler_angles(0.4, -0.2, 1.0));
    let here = filled("macula", fluid(VOLUME_MM3, 0.2, -0.1));
    let mut there = here.scene().clone();
    there.scene_from_patch = move_by;
    there.bleb = there.bleb.map(|fluid| SubretinalFluid { center_mm: move_by * fluid.center_mm, ..fluid });
    let there = PreparedScene::new(there).unwrap();
    let request = straight(Level::Coarse, 0.2);
    let answer = ask(&here, &request).unwrap();
    let moved = ask(&there, &crate::support::moved(&request, &move_by)).unwrap();
    for (a, b) in answer.vertices.iter().zip(&moved.vertices) {
        assert!((move_by * a - b).norm() < 1e-5, "{a} {b}");
    }
    let elsewhere = ask(&filled("macula", fluid(VOLUME_MM3, -0.2, -0.1)), &request).unwrap();
    let apart = elsewhere.vertices.iter().zip(&answer.vertices).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart > 5e-3, "{apart}");
}

#[test]
fn without_fluid_there_is_no_trace_and_with_it_the_choice_is_said() {
    let dry = built_in("macula");
    let request = straight(Level::Coarse, 0.4);
    let plain = ask(&dry, &request).unwrap();
    assert_eq!(
        (row(&plain).simulated, row(&plain).reason.as_str()),
        (false, "the scene has no fluid under the retina")
    );
    assert_eq!(plain.contact.bleb, None);
    let wet = filled("macula", fluid(VOLUME_MM3, 0.0, 0.0));
    let names = ["elasticity", "finite_strain", "contact"].map(str::to_owned).to_vec();
    let without = Request { effects: EffectChoice::Named(names), ..request.clone() };
    let left_out = ask(&wet, &without).unwrap();
    assert_eq!((&left_out.vertices, left_out.solver), (&plain.vertices, plain.solver));
    assert!(left_out.warnings.iter().any(|warning| warning.contains("`bleb` is not simulated though")));
    let linear = ask(&wet, &at(&request, Level::Linear)).unwrap();
    assert!(row(&linear).reason.contains("no cavity") && linear.contact.bleb.is_none());
    assert!(!linear.expected_error.calibrated);
    let droplet = filled("macula", fluid(1e-4, 0.0, 0.0));
    let small = ask(&droplet, &request).unwrap();
    assert!(!row(&small).simulated && row(&small).value.unwrap() < row(&small).threshold.unwrap(), "{:?}", row(&small));
    assert_eq!(small.vertices, plain.vertices);
}

#[test]
fn what_a_bleb_cannot_be_is_refused() {
    let refused = |change: fn(&mut SubretinalFluid)| {
        let mut fluid = fluid(VOLUME_MM3, 0.0, 0.0);
        change(&mut fluid);
        let scene = Scene { bleb: Some(fluid), ..Scene::built_in("flat").unwrap() };
        let answer = PreparedScene::new(scene).and_then(|scene| ask(&scene, &straight(Level::Coarse, 0.1)));
        match answer.unwrap_err() {
            PredictError::OutOfRange(out) => out.field,
            PredictError::BlebOutsidePatch { y_mm, .. } => format!("outside the patch at {y_mm}"),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|fluid| fluid.filling = Filling::Volume(-0.1)), "bleb.volume_mm3");
    assert_eq!(refused(|fluid| fluid.filling = Filling::Volume(0.6)), "bleb.volume_mm3");
    assert_eq!(refused(|fluid| fluid.filling = Filling::Pressure(9.0)), "bleb.pressure_kpa");
    assert_eq!(refused(|fluid| fluid.radius_mm = 2.0), "bleb.radius_mm");
    assert_eq!(refused(|fluid| fluid.center_mm.x = f64::NAN), "bleb.center_mm[0]");
    assert_eq!(refused(|fluid| fluid.center_mm.y = 1.5), "outside the patch at 1.5");
    // A needle beside the fluid is refused by name, one over it is answered, and one beside it where the bleb is left out.
    let wet = filled("flat", fluid(VOLUME_MM3, 0.6, 0.0));
    let error = ask(&wet, &straight(Level::Coarse, 0.2)).unwrap_err();
    assert!(matches!(error, PredictError::BesideBleb { away_mm, .. } if (away_mm - 0.6).abs() < 0.01), "{error:?}");
    let mut over = straight(Level::Coarse, 0.2);
    over.needle.tip_mm.x = 0.4;
    assert!(ask(&wet, &over).is_ok());
    let names = ["elasticity", "contact"].map(str::to_owned).to_vec();
    assert!(ask(&wet, &Request { effects: EffectChoice::Named(names), ..straight(Level::Coarse, 0.2) }).is_ok());
}

#[test]
fn no_volume_and_no_pressure_are_no_bleb() {
    let dry = built_in("macula");
    for filling in [Filling::Volume(0.0), Filling::Pressure(0.0)] {
        let empty = filled("macula", SubretinalFluid { filling, ..fluid(VOLUME_MM3, 0.0, 0.0) });
        for effects in [EffectChoice::Auto, EffectChoice::All] {
            for level in [Level::Linear, Level::Network, Level::Coarse] {
                let request = Request { effects: effects.clone(), ..straight(level, 0.4) };
                let (with, without) = (ask(&empty, &request), ask(&dry, &request));
                assert_eq!(format!("{with:?}"), format!("{without:?}"), "{level:?}");
            }
        }
        assert_ne!(
            ask(&filled("macula", fluid(VOLUME_MM3, 0.0, 0.0)), &straight(Level::Coarse, 0.4)),
            ask(&empty, &straight(Level::Coarse, 0.4))
        );
    }
}

#[test]
fn a_pressure_that_is_given_is_that_of_the_volume_it_lifts() {
    let request = straight(Level::Coarse, 0.2);
    let by_volume = ask(&filled("macula", fluid(VOLUME_MM3, 0.1, 0.0)), &request).unwrap();
    let pressure_kpa = by_volume.contact.bleb.unwrap().pressure_kpa;
    let given = |pressure_kpa| SubretinalFluid { filling: Filling::Pressure(pressure_kpa), ..fluid(0.0, 0.1, 0.0) };
    let by_pressure = ask(&filled("macula", given(pressure_kpa)), &request).unwrap();
    let found = by_pressure.contact.bleb.unwrap();
    println!("{pressure_kpa:.5} kPa: {:.7} mm³ of {VOLUME_MM3}", found.volume_mm3);
    assert_eq!(found.pressure_kpa, pressure_kpa);
    assert!((found.volume_mm3 / VOLUME_MM3 - 1.0).abs() < VOLUME_TOLERANCE, "{found:?}");
    let more = ask(&filled("macula", given(1.1 * pressure_kpa)), &request).unwrap().contact.bleb.unwrap();
    assert!(more.volume_mm3 > 1.02 * VOLUME_MM3, "{more:?}");
}

#[test]
fn levels_that_have_no_fluid_say_so() {
    let wet = filled("macula", fluid(VOLUME_MM3, 0.0, 0.0));
    for force_mn in [0.0, 0.2] {
        let linear = ask(&wet, &straight(Level::Linear, force_mn)).unwrap();
        assert!(!linear.expected_error.calibrated && linear.expected_error.p95_um == f64::INFINITY);
        assert!(linear.warnings.iter().any(|warning| warning.contains("`bleb` is not simulated though")));
        for level in [Level::Network, Level::Corrected] {
            let error = ask(&wet, &straight(level, force_mn)).unwrap_err();
            assert!(matches!(&error, PredictError::Effect { name, .. } if name == "bleb"), "{level:?}: {error:?}");
        }
    }
}

#[test]
fn the_pressure_counts_from_that_in_the_eye() {
    let at_eye = |mmhg: f64| {
        let mut scene = Scene::built_in("macula").unwrap();
        (scene.rest_pressure_kpa, scene.pressure_kpa) = (15.0 * MMHG_KPA, mmhg * MMHG_KPA);
        scene.bleb = Some(fluid(VOLUME_MM3, 0.0, 0.0));
        let answer = ask(&PreparedScene::new(scene).unwrap(), &straight(Level::Coarse, 0.0)).unwrap();
        assert_eq!(answer.effects.iter().any(|effect| effect.name == "pressure" && effect.simulated), mmhg != 15.0);
        answer.contact.bleb.unwrap().pressure_kpa
    };
    let rest = at_eye(15.0);
    for mmhg in [10.0, 30.0, 60.0] {
        let changed = at_eye(mmhg);
        println!("{mmhg} mmHg: {changed:.4} kPa above the eye's, {rest:.4} at rest");
        // The layers under it are squeezed, which changes their stiffness and not what the fluid has to lift.
        assert!((changed / rest - 1.0).abs() < 0.5, "{changed} {rest}");
        assert!((changed - rest).abs() < 0.1 * (mmhg - 15.0).abs() * MMHG_KPA, "{changed} {rest}");
    }
}

#[test]
fn fluid_that_would_peel_the_retina_is_told() {
    let warned = |volume_mm3: f64| {
        let answer = ask(&filled("flat", fluid(volume_mm3, 0.0, 0.0)), &straight(Level::Coarse, 0.0)).unwrap();
        let bleb = answer.contact.bleb.unwrap();
        let offered = bleb.pressure_kpa * volume_mm3 / (std::f64::consts::PI * 0.36);
        println!("{volume_mm3} mm³: {:.4} kPa, {offered:.4} mN/mm", bleb.pressure_kpa);
        let told = answer.warnings.iter().any(|warning| warning.contains("would peel the retina further"));
        let borne = Scene::built_in("flat").unwrap().tissue.bond.fracture_energy_mn_per_mm;
        assert_eq!(told, offered > borne, "{offered} {borne}");
        told
    };
    assert!(!warned(0.01) && warned(0.3));
}

/// How far `coarse` may be off over fluid, over how far it is off without: contacts on a softer bed are wider, and the bleb is meshed coarsely.
const WORSE_OVER_FLUID: f64 = 2.0;

#[test]
fn reference_finds_nearly_the_same_as_coarse() {
    let worst = |scene: &PreparedScene, force_mn: f64| {
        let [coarse, reference] =
            [Level::Coarse, Level::Reference].map(|level| ask(scene, &straight(level, force_mn)).unwrap());
        let apart = coarse.vertices.iter().zip(&reference.vertices).map(|(a, b)| (a - b).norm() * 1e3);
        let (worst_um, moved_um) = (apart.fold(0.0, f64::max), largest_um(&reference));
        println!(
            "{force_mn} mN: coarse {worst_um:.2} µm from reference of {moved_um:.2} µm, {} iterations",
            reference.solver.iterations
        );
        (worst_um, moved_um)
    };
    let wet = filled("flat", fluid(VOLUME_MM3, 0.1, 0.0));
    let (alone_um, moved_um) = worst(&wet, 0.0);
    assert!(alone_um < 0.03 * moved_um, "{alone_um} {moved_um}");
    let (with_um, without_um) = (worst(&wet, 0.3).0, worst(&built_in("flat"), 0.3).0);
    assert!(with_um < WORSE_OVER_FLUID * without_um, "{with_um} {without_um}");
}
