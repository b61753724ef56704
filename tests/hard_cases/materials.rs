//! Tissue at the ends of its ranges: nearly incompressible, layers of very different stiffness, a membrane like a foil, thin and thick retinas.
//!
//! Iterations: the linear answer is as good a start for these as for the default tissue (6), but for a stiff membrane, which it takes as flat.

use retina_core::needle::NeedleShape;
use retina_core::scene::Scene;
use retina_core::tissue::{Layer, Tissue};

use crate::table::{Case, Expect::*, all, built_in, case, lean, push, run, tissue};

const BALL: NeedleShape = NeedleShape { radius_mm: 0.257, tip: retina_core::needle::Tip::Hemispherical };

fn membrane(tissue: &mut Tissue, thickness_mm: f64, youngs_modulus_kpa: f64) {
    tissue.inner_limiting_membrane = Some(Layer { thickness_mm, youngs_modulus_kpa, poisson_ratio: 0.49 });
}

/// The macula with a membrane of 1 µm, ten times as stiff as the retina, with this Poisson ratio.
fn over_the_macula(poisson_ratio: f64) -> Scene {
    let mut scene = built_in("macula");
    scene.tissue.inner_limiting_membrane =
        Some(Layer { thickness_mm: 0.001, youngs_modulus_kpa: 200.0, poisson_ratio });
    scene
}

fn moduli(tissue: &mut Tissue, retina: f64, choroid: f64, sclera: f64) {
    tissue.retina[0].youngs_modulus_kpa = retina;
    tissue.choroid.youngs_modulus_kpa = choroid;
    tissue.sclera.youngs_modulus_kpa = sclera;
}

/// Sublayers of equal thickness with these moduli (kPa).
fn sublayers(tissue: &mut Tissue, moduli: &[f64]) {
    let whole = tissue.retina[0];
    let thickness_mm = whole.thickness_mm / moduli.len() as f64;
    let layer = |&youngs_modulus_kpa: &f64| Layer { youngs_modulus_kpa, thickness_mm, ..whole };
    tissue.retina = moduli.iter().map(layer).collect();
}

const CASES: &[Case] = &[
    case("ν 0 everywhere", || tissue(|t| every_ratio(t, 0.0)), || push(BALL, 0.5), Answer(3)),
    case("ν 0.4999 in the retina", || tissue(|t| t.retina[0].poisson_ratio = 0.4999), || push(BALL, 1.0), Answer(7)),
    case("ν 0.4999 everywhere", || tissue(|t| every_ratio(t, 0.4999)), || push(BALL, 1.0), Answer(6)),
    case(
        "ν 0.49999: the range ends",
        || tissue(|t| t.retina[0].poisson_ratio = 0.49999),
        || push(BALL, 1.0),
        Refusal("tissue.retina[0].poisson_ratio = 0.49999"),
    ),
    case(
        "ν 0.4999, leaning, every effect",
        || tissue(|t| every_ratio(t, 0.4999)),
        || all(lean(BALL, 30.0, 40.0, 0.8)),
        Answer(9),
    ),
    case("stiffness 1 on 20", || tissue(|t| moduli(t, 1.0, 20.0, 500.0)), || push(BALL, 0.08), Answer(5)),
    case("stiffness 1 on 200", || tissue(|t| moduli(t, 1.0, 200.0, 2000.0)), || push(BALL, 0.08), Answer(5)),
    case(
        "stiffness 0.9 on 1300 (1444 times)",
        || tissue(|t| moduli(t, 0.9, 1300.0, 1800.0)),
        || push(BALL, 0.08),
        Answer(5),
    ),
    case("stiffness 0.9, 1, 2000", || tissue(|t| moduli(t, 0.9, 1.0, 2000.0)), || push(BALL, 0.05), Answer(5)),
    case("stiffness 30 on 1 on 5000", || tissue(|t| moduli(t, 30.0, 1.0, 5000.0)), || push(BALL, 0.5), Answer(5)),
    case("stiff sublayer on soft, 33 times", || tissue(|t| sublayers(t, &[30.0, 0.9])), || push(BALL, 0.05), Answer(4)),
    case("soft sublayer on stiff, 33 times", || tissue(|t| sublayers(t, &[0.9, 30.0])), || push(BALL, 0.05), Answer(5)),
    case(
        "eight sublayers in turn soft and stiff",
        || tissue(|t| sublayers(t, &[0.9, 30.0, 0.9, 30.0, 0.9, 30.0, 0.9, 30.0])),
        || push(BALL, 0.05),
        Answer(5),
    ),
    case(
        "membrane 1 µm, 1000 times the retina",
        || tissue(|t| membrane(t, 0.001, 20_000.0)),
        || push(BALL, 0.5),
        Answer(6),
    ),
    case(
        "membrane 1 µm, 1000 times, light touch",
        || tissue(|t| membrane(t, 0.001, 20_000.0)),
        || push(BALL, 0.02),
        Answer(3),
    ),
    case(
        "membrane 1 µm, 1000 times, hardly a touch",
        || tissue(|t| membrane(t, 0.001, 20_000.0)),
        || push(BALL, 1e-4),
        Answer(3),
    ),
    case("membrane 1 µm, ν 0.4999, curved, light touch", || over_the_macula(0.4999), || push(BALL, 0.02), Answer(4)),
    case("membrane 70 nm, 10 times", || tissue(|t| membrane(t, 7e-5, 200.0)), || push(BALL, 0.5), Answer(5)),
    case("membrane 4 µm, 1000 times", || tissue(|t| membrane(t, 0.004, 20_000.0)), || push(BALL, 0.5), Answer(8)),
    case(
        "membrane 1 µm, 20 000 times",
        || {
            tissue(|t| {
                moduli(t, 1.0, 6.0, 1800.0);
                membrane(t, 0.001, 20_000.0)
            })
        },
        || push(BALL, 0.05),
        Answer(10),
    ),
    case("retina of 80 µm", || tissue(|t| t.retina[0].thickness_mm = 0.08), || push(BALL, 0.5), Answer(4)),
    case(
        "retina of 80 µm on choroid of 50 µm",
        || {
            tissue(|t| {
                t.retina[0].thickness_mm = 0.08;
                t.choroid.thickness_mm = 0.05
            })
        },
        || push(BALL, 0.5),
        Answer(5),
    ),
    case(
        "retina of 320 µm on choroid of 500 µm",
        || {
            tissue(|t| {
                t.retina[0].thickness_mm = 0.32;
                t.choroid.thickness_mm = 0.5
            })
        },
        || push(BALL, 0.5),
        Answer(4),
    ),
    case(
        "retina of 79 µm: the range ends",
        || tissue(|t| t.retina[0].thickness_mm = 0.079),
        || push(BALL, 0.5),
        Refusal("tissue.retina.thickness_mm = 0.079"),
    ),
];

fn every_ratio(tissue: &mut Tissue, ratio: f64) {
    tissue
        .retina
        .iter_mut()
        .chain([&mut tissue.choroid, &mut tissue.sclera])
        .for_each(|layer| layer.poisson_ratio = ratio);
}

#[test]
fn materials() {
    run("materials", CASES);
}
