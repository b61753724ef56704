//! Friction and pressure at the ends of their ranges, alone, together and with every other effect.
//!
//! Iterations: friction repeats the solve until the contact pressures settle, each time from the factor at hand and as far as the pressures are settled: some 10 to 60 in all; a change of pressure in one step costs one or two more.

use retina_core::needle::NeedleShape;
use retina_core::scene::Scene;
use retina_core::scene::conditions::MMHG_KPA;

use crate::table::{Case, Expect::*, all, at, built_in, case, flat, held, lean, push, run, with};

fn ball() -> NeedleShape {
    NeedleShape::hemispherical(0.257)
}

/// The flat scene with friction.
fn rough(coefficient: f64) -> Scene {
    Scene { friction_coefficient: coefficient, ..flat() }
}

/// The macula after a change of the eye's pressure (mmHg).
fn pressed(from_mmhg: f64, to_mmhg: f64) -> Scene {
    Scene { rest_pressure_kpa: from_mmhg * MMHG_KPA, pressure_kpa: to_mmhg * MMHG_KPA, ..built_in("macula") }
}

/// The macula with a weak bond, friction and a changed pressure.
fn everything(coefficient: f64, to_mmhg: f64, strength_kpa: f64) -> Scene {
    let mut scene = Scene { friction_coefficient: coefficient, ..pressed(15.0, to_mmhg) };
    scene.tissue.bond.strength_kpa = strength_kpa;
    scene
}

const CASES: &[Case] = &[
    case("µ 0, leaning", || rough(0.0), || lean(ball(), 20.0, 40.0, 0.5), Answer(5)),
    case("µ 0.015, leaning", || rough(0.015), || lean(ball(), 20.0, 40.0, 0.5), Answer(5)),
    case("µ 0.5, leaning", || rough(0.5), || lean(ball(), 20.0, 40.0, 0.5), Answer(7)),
    case("µ 2, leaning", || rough(2.0), || lean(ball(), 20.0, 40.0, 0.5), Answer(13)),
    case("µ 2, straight", || rough(2.0), || push(ball(), 0.8), Answer(14)),
    case(
        "µ 2, 68° off the normal: pressure and friction hand the force to and fro",
        || rough(2.0),
        || lean(ball(), 30.0, 68.0, 0.1),
        Answer(15),
    ),
    case(
        "µ 2, 74° off the normal: some of what is so steep settles and some does not",
        || rough(2.0),
        || lean(ball(), 30.0, 74.0, 0.1),
        Either(77, "the contact pressures did not settle in 60 rounds"),
    ),
    case("µ 0.2, 74° off the normal", || rough(0.2), || lean(ball(), 30.0, 74.0, 0.1), Answer(24)),
    case("µ 2, flat tip on its edge", || rough(2.0), || lean(NeedleShape::flat(0.257), 30.0, 30.0, 0.3), Answer(11)),
    case("µ 0.5, bevel, point first", || rough(0.5), || push(NeedleShape::bevelled(0.257), 0.05), Answer(3)),
    case("µ 2.1: the range ends", || rough(2.1), || push(ball(), 0.8), Refusal("friction_coefficient = 2.1")),
    case(
        "µ 2, light as 1e-6 mN: friction asked for where nothing rubs yet",
        || rough(2.0),
        || with(lean(ball(), 20.0, 40.0, 1e-6), &["finite_strain", "contact", "friction"]),
        Refusal("the contact pressures did not settle in 60 rounds"),
    ),
    case("pressure 0, no change", || pressed(0.0, 0.0), || push(ball(), 0.8), Answer(5)),
    case("pressure 60 mmHg, no change", || pressed(60.0, 60.0), || push(ball(), 0.8), Answer(5)),
    case("pressure 0 to 60 mmHg in one step", || pressed(0.0, 60.0), || push(ball(), 0.8), Answer(10)),
    case("pressure 60 mmHg to 35 in one step", || pressed(60.0, 35.0), || push(ball(), 0.8), Answer(10)),
    case(
        "pressure 60 mmHg to 0 in one step: the choroid would more than double",
        || pressed(60.0, 0.0),
        || push(ball(), 0.8),
        Refusal("alone strains a layer of this tissue by"),
    ),
    case(
        "pressure 0 to 60 mmHg, needle clear",
        || pressed(0.0, 60.0),
        || at(held(push(ball(), 0.8)), 0.0, 0.0, 0.5),
        Answer(0),
    ),
    case("pressure 0 to 60 mmHg, light touch", || pressed(0.0, 60.0), || push(ball(), 1e-3), Answer(10)),
    case(
        "pressure 60 to 40 mmHg, small strain",
        || pressed(60.0, 40.0),
        || with(push(ball(), 0.3), &["elasticity", "contact", "pressure"]),
        Answer(3),
    ),
    case("pressure above the range", || pressed(0.0, 61.0), || push(ball(), 0.8), Refusal("pressure_kpa")),
    case(
        "µ 0.5, 15 to 60 mmHg, bond of 1 kPa, every effect",
        || everything(0.5, 60.0, 1.0),
        || all(lean(ball(), 20.0, 30.0, 0.5)),
        Answer(108),
    ),
    case(
        "µ 2, 15 to 0 mmHg, bond of 1 kPa, every effect",
        || everything(2.0, 0.0, 1.0),
        || all(lean(ball(), 20.0, 30.0, 0.5)),
        Refusal("it comes off everywhere"),
    ),
    case(
        "µ 2, 15 to 5 mmHg, bond of 2 kPa, every effect",
        || everything(2.0, 5.0, 2.0),
        || all(lean(ball(), 20.0, 30.0, 0.5)),
        Answer(9),
    ),
    case(
        "µ 0.015, 15 to 40 mmHg, bond of 100 kPa, every effect",
        || everything(0.015, 40.0, 100.0),
        || all(lean(ball(), 20.0, 30.0, 0.5)),
        Answer(7),
    ),
];

#[test]
fn conditions() {
    run("conditions", CASES);
}
