//! Needles at the ends of their ranges and in awkward places: fine and blunt tips, edges first, grazing, beside the patch, inside the tissue.
//!
//! Iterations: a round tip takes what the default needle takes (6 to 9); an edge finds its contact points one by one and takes up to three times that; where the tissue is about
//! to buckle single precision goes astray and the way in double is added to what it took.

use retina_core::needle::{NeedleShape, Tip};
use retina_core::predict::{Level, Request};

use crate::table::{Case, Expect::*, at, built_in, case, flat, held, lean, push, rolled, run};

fn ball(radius_mm: f64) -> NeedleShape {
    NeedleShape::hemispherical(radius_mm)
}

fn converged(request: Request) -> Request {
    Request { level: Level::Reference, ..request }
}

fn bevel(radius_mm: f64, angle_deg: f64, edge_radius_mm: f64) -> NeedleShape {
    NeedleShape { radius_mm, tip: Tip::Bevelled { angle_deg, edge_radius_mm } }
}

/// A 25G ball pushed down at (x, y).
fn pushed_at(x: f64, y: f64, force_mn: f64) -> Request {
    at(push(ball(0.257), force_mn), x, y, 0.1)
}

const CASES: &[Case] = &[
    case("tip of 10 µm", flat, || push(ball(0.01), 0.003), Answer(8)),
    case("tip of 10 µm, feather-light", flat, || push(ball(0.01), 1e-5), Answer(6)),
    case("tip of 9 µm: the range ends", flat, || push(ball(0.009), 0.003), Refusal("needle.radius_mm = 0.009")),
    case("tip of 0.5 mm", flat, || push(ball(0.5), 4.0), Answer(9)),
    case("flat tip, square on", flat, || push(NeedleShape::flat(0.257), 0.8), Answer(10)),
    case("flat tip of 0.5 mm, square on", flat, || push(NeedleShape::flat(0.5), 2.0), Answer(9)),
    case("flat tip, edge-on at 45°", flat, || lean(NeedleShape::flat(0.257), 45.0, 45.0, 0.3), Answer(12)),
    case("flat tip, edge-on at 70°", flat, || lean(NeedleShape::flat(0.257), 70.0, 0.0, 0.1), Answer(10)),
    case(
        "flat tip of 0.1 µm edge, square on",
        flat,
        || push(NeedleShape { radius_mm: 0.257, tip: Tip::Flat { edge_radius_mm: 1e-4 } }, 0.5),
        Answer(9),
    ),
    case("bevel, point first", flat, || push(bevel(0.257, 30.0, 0.0257), 0.05), Answer(8)),
    case("bevel of 15°, point first", flat, || push(bevel(0.257, 15.0, 0.02), 0.02), Answer(12)),
    case("bevel of 75°", flat, || push(bevel(0.257, 75.0, 0.0257), 0.4), Answer(14)),
    case("bevel, heel first", flat, || rolled(lean(bevel(0.257, 45.0, 0.0257), 60.0, 30.0, 0.2), 180.0), Answer(10)),
    case("bevel on its flank", flat, || rolled(lean(bevel(0.257, 30.0, 0.0257), 45.0, 20.0, 0.2), 90.0), Answer(12)),
    case("bevel of 0.1 µm edge", flat, || push(bevel(0.1, 30.0, 1e-4), 0.002), Answer(7)),
    case("bevel that cuts in, at `reference`", flat, || converged(push(bevel(0.3205, 30.0, 0.03205), 0.2)), Answer(38)),
    case(
        "bevel that punctures, at `reference`",
        flat,
        || converged(push(bevel(0.3205, 30.0, 0.03205), 1.2)),
        Refusal("the tissue punctures"),
    ),
    case("grazing force, 1° from tangent", flat, || lean(ball(0.257), 0.0, 89.0, 0.1), Refusal("force_mn leans 89.0")),
    case(
        "grazing needle, 1° from tangent",
        flat,
        || lean(ball(0.257), 89.0, 0.0, 0.1),
        Refusal("needle.direction leans 89.0"),
    ),
    case("needle and force at 75°, the most allowed", flat, || lean(ball(0.257), 74.9, 74.9, 0.1), Answer(12)),
    case("needle and force 74° apart", flat, || lean(ball(0.257), -37.0, 37.0, 0.4), Answer(8)),
    case("on the patch's edge", flat, || pushed_at(1.05, 0.0, 0.8), Answer(8)),
    case("on the patch's corner", flat, || pushed_at(1.05, -1.05, 0.8), Answer(8)),
    case("on the corner of the ball-shaped eye", || built_in("macula"), || pushed_at(1.0, 1.0, 0.8), Answer(8)),
    case("just beside the patch", flat, || pushed_at(1.0501, 0.0, 0.8), Refusal("outside of the patch")),
    case("ten millimetres beside the patch", flat, || pushed_at(10.0, 0.0, 0.8), Refusal("outside of the patch")),
    case(
        "beside the eye",
        || built_in("macula"),
        || pushed_at(500.0, 0.0, 0.8),
        Refusal("needle.direction leans 90.0"),
    ),
    case("on the slope of the pit", || built_in("fovea"), || pushed_at(0.2, 0.1, 0.3), Answer(10)),
    case("far above the patch", flat, || at(push(ball(0.257), 0.8), 0.0, 0.0, 900.0), Answer(8)),
    case("held far above the patch", flat, || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, 900.0), Answer(0)),
    case("held a nanometre above", flat, || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, 1e-6), Answer(0)),
    case("held exactly at touch", flat, || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, 0.0), Answer(0)),
    case("held a nanometre deep", flat, || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, -1e-6), Answer(7)),
    case("held a quarter of the retina deep", flat, || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, -0.0625), Answer(8)),
    case("held the retina's thickness deep", flat, || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, -0.25), Answer(10)),
    case(
        "fine tip held the retina's thickness deep",
        flat,
        || at(held(push(ball(0.05), 0.8)), 0.0, 0.0, -0.25),
        Answer(36),
    ),
    case(
        "flat tip held half the retina deep",
        flat,
        || at(held(push(NeedleShape::flat(0.257), 0.8)), 0.0, 0.0, -0.125),
        Answer(10),
    ),
    case(
        "bevel held half the retina deep",
        flat,
        || at(held(push(NeedleShape::bevelled(0.257), 0.8)), 0.0, 0.0, -0.125),
        Answer(10),
    ),
    case(
        "held through retina and choroid",
        flat,
        || at(held(push(ball(0.257), 0.8)), 0.0, 0.0, -0.4),
        Refusal("0.400 mm deep"),
    ),
    case(
        "pushed from the retina's thickness deep: it is drawn out to where the force holds",
        flat,
        || at(push(ball(0.257), 0.8), 0.0, 0.0, -0.25),
        Answer(8),
    ),
    case("no force", flat, || push(ball(0.257), 0.0), Answer(0)),
    case("no force, from inside the tissue", flat, || at(push(ball(0.257), 0.0), 0.0, 0.0, -0.2), Answer(0)),
    case("a force of 1e-9 mN", flat, || push(ball(0.257), 1e-9), Answer(3)),
    case("a force of 1e-6 mN", flat, || push(ball(0.257), 1e-6), Answer(5)),
    case("a force of 100 mN", flat, || push(ball(0.257), 100.0), Refusal("puncture")),
    case("a force of 100 mN on the bluntest needle", flat, || push(ball(0.5), 100.0), Refusal("puncture")),
    case("a force short of puncture is too deep on thin tissue", flat, || push(ball(0.257), 3.11), Refusal("too deep")),
    case("the deepest force on thin tissue", flat, || push(ball(0.257), 2.9), Answer(9)),
    case("a force short of puncture on a fine needle", flat, || push(ball(0.05), 0.117), Answer(7)),
    case("a force that is not a number", flat, || push(ball(0.257), f64::NAN), Refusal("force_mn[0] = NaN")),
];

#[test]
fn needles() {
    run("needles", CASES);
}
