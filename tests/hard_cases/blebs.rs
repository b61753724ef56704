//! Fluid under the retina: a detached bleb under the tip, small and large, with the eye's pressure at its ends and with every other effect.
//!
//! Iterations: the fluid's pressure is one unknown more of the same Newton steps and costs one or two; a large bleb turns its retina, which takes some more. What a light force meets is found from the
//! retina as it is expected and not as it is, which costs most.

use nalgebra::Point3;
use retina_core::needle::NeedleShape;
use retina_core::scene::Scene;
use retina_core::scene::bleb::{Filling, SubretinalFluid};
use retina_core::scene::conditions::MMHG_KPA;

use crate::table::{Case, Expect::*, all, at, built_in, case, flat, held, lean, push, run, with};

fn ball() -> NeedleShape {
    NeedleShape::hemispherical(0.257)
}

fn thin() -> NeedleShape {
    NeedleShape::hemispherical(0.05)
}

/// The scene with so much fluid (mm³) under a disc of this radius (mm) at its centre.
fn wet(scene: Scene, volume_mm3: f64, radius_mm: f64) -> Scene {
    filled(scene, Filling::Volume(volume_mm3), radius_mm)
}

fn filled(scene: Scene, filling: Filling, radius_mm: f64) -> Scene {
    Scene { bleb: Some(SubretinalFluid { filling, center_mm: Point3::origin(), radius_mm }), ..scene }
}

/// The macula with fluid after the eye's pressure has changed from 15 mmHg.
fn pressed(to_mmhg: f64) -> Scene {
    wet(Scene { rest_pressure_kpa: 15.0 * MMHG_KPA, pressure_kpa: to_mmhg * MMHG_KPA, ..built_in("macula") }, 0.02, 0.6)
}

/// Thin and soft retina under which fluid rises at once.
fn soft(volume_mm3: f64, radius_mm: f64) -> Scene {
    let mut scene = wet(flat(), volume_mm3, radius_mm);
    scene.tissue.retina[0].thickness_mm = 0.08;
    scene.tissue.retina[0].youngs_modulus_kpa = 5.0;
    scene
}

/// Fluid, friction, a changed pressure and a weak bond.
fn everything(strength_kpa: f64) -> Scene {
    let mut scene = Scene { friction_coefficient: 0.3, ..pressed(25.0) };
    scene.tissue.bond.strength_kpa = strength_kpa;
    scene
}

const CASES: &[Case] = &[
    case("a bleb under the tip, no force", || wet(flat(), 0.02, 0.6), || push(ball(), 0.0), Answer(4)),
    case("a bleb under the tip, light as 1e-6 mN", || wet(flat(), 0.02, 0.6), || push(ball(), 1e-6), Answer(6)),
    case("a bleb under the tip, 0.2 mN", || wet(flat(), 0.02, 0.6), || push(ball(), 0.2), Answer(5)),
    case(
        "a bleb under the tip, 1.5 mN: down to the choroid",
        || wet(flat(), 0.02, 0.6),
        || push(ball(), 1.5),
        Answer(6),
    ),
    case("a bleb under the fovea", || wet(built_in("fovea"), 0.02, 0.6), || push(ball(), 0.2), Answer(9)),
    case(
        "a bleb under a leaning needle",
        || wet(built_in("macula"), 0.02, 0.6),
        || lean(ball(), 30.0, 40.0, 0.2),
        Answer(5),
    ),
    case("a bleb under a thin cannula", || wet(flat(), 0.02, 0.6), || push(thin(), 0.05), Answer(4)),
    case("a bleb under a flat tip", || wet(flat(), 0.02, 0.6), || push(NeedleShape::flat(0.257), 0.2), Answer(7)),
    case("a bleb under a bevel", || wet(flat(), 0.02, 0.8), || push(NeedleShape::bevelled(0.257), 0.05), Answer(6)),
    case(
        "a bleb, needle held 50 µm over the surface at rest",
        || wet(flat(), 0.05, 0.6),
        || held(at(push(ball(), 0.2), 0.0, 0.0, 0.05)),
        Answer(7),
    ),
    case(
        "a bleb, needle held 50 µm under the surface at rest",
        || wet(flat(), 0.05, 0.6),
        || held(at(push(ball(), 0.2), 0.0, 0.0, -0.05)),
        Answer(7),
    ),
    case("a tiny volume", || wet(flat(), 2e-3, 0.6), || push(ball(), 0.2), Answer(6)),
    case("a tiny bleb", || wet(flat(), 1e-3, 0.2), || push(thin(), 0.02), Answer(4)),
    case("the largest volume", || wet(flat(), 0.5, 1.0), || push(ball(), 0.2), Answer(8)),
    case("the largest volume, no needle", || wet(flat(), 0.5, 1.0), || push(ball(), 0.0), Answer(10)),
    case(
        "the largest volume under the smallest disc",
        || wet(flat(), 0.5, 0.2),
        || push(ball(), 0.0),
        Refusal("with `bleb` (0.5 mm³ under a disc of 0.2 mm radius)"),
    ),
    case("much fluid under thin, soft retina", || soft(0.3, 0.9), || push(ball(), 0.0), Answer(14)),
    case("much fluid under thin, soft retina, pressed", || soft(0.3, 0.9), || push(ball(), 0.02), Answer(16)),
    case(
        "a bleb of small strain",
        || wet(flat(), 0.02, 0.6),
        || with(push(ball(), 0.1), &["elasticity", "contact", "bleb"]),
        Answer(5),
    ),
    case("a bleb at 60 mmHg", || pressed(60.0), || push(ball(), 0.2), Answer(9)),
    case("a bleb at 0 mmHg", || pressed(0.0), || push(ball(), 0.2), Answer(7)),
    case("a bleb at 60 mmHg, no needle", || pressed(60.0), || push(ball(), 0.0), Answer(10)),
    case(
        "a bleb whose pressure is given",
        || filled(flat(), Filling::Pressure(0.2), 0.6),
        || push(ball(), 0.2),
        Answer(7),
    ),
    case(
        "the largest pressure",
        || filled(flat(), Filling::Pressure(8.0), 1.0),
        || push(ball(), 0.0),
        Refusal("with `bleb` (8 kPa under a disc of 1 mm radius)"),
    ),
    case(
        "a bleb, bond of 2 kPa, friction, 25 mmHg, every effect",
        || everything(2.0),
        || all(lean(ball(), 20.0, 30.0, 0.3)),
        Answer(18),
    ),
    case(
        "the needle beside the bleb",
        || wet(flat(), 0.02, 0.4),
        || at(push(ball(), 0.2), 0.7, 0.0, 0.1),
        Refusal("needs a contact over its fluid"),
    ),
    case(
        "a bleb smaller than the contact",
        || wet(flat(), 1e-3, 0.2),
        || push(ball(), 1.5),
        Refusal("needs a contact over its fluid"),
    ),
    case("more fluid than the range", || wet(flat(), 0.6, 0.6), || push(ball(), 0.2), Refusal("bleb.volume_mm3 = 0.6")),
];

#[test]
fn blebs() {
    run("blebs", CASES);
}
