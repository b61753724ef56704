//! `tool_flex`: derivatives, and what holds the tip where.

use nalgebra::{Unit, Vector3};
use retina_core::effect::{Effect, Local};
use retina_core::effects::tool_flex::ToolFlex;
use retina_tests::tolerance::ROUNDOFF;

use super::{Case, REPEATS, SIZES, STEP, added, check_effect};
use crate::meshes::noise;

/// A shaft that leans, pushed along a direction that leans otherwise.
fn leaning(size: f64) -> ToolFlex {
    ToolFlex {
        origin: Vector3::new(0.4, -0.2, 0.3) * size,
        axis: Unit::new_normalize(Vector3::new(0.5, 0.1, -0.8)),
        direction: Unit::new_normalize(Vector3::new(0.1, -0.3, -0.9)),
        stiffness_mn_per_mm: 32.0,
    }
}

fn tip(flex: &ToolFlex, size: f64, seed: u64) -> Vec<f64> {
    let mut random = noise(80 + seed);
    (flex.origin + Vector3::from_fn(|_, _| size * random())).as_slice().to_vec()
}

pub fn check() {
    for size in SIZES {
        let flex = leaning(size);
        let cases: Vec<Case> = (0..REPEATS as u64)
            .map(|seed| Case {
                label: format!("seed {seed}, size {size:e}"),
                group: 0,
                current: tip(&flex, size, seed),
                step_mm: STEP * size,
            })
            .collect();
        check_effect("tool_flex", &flex, &cases);
    }
}

/// Force of the shaft on whatever holds the tip at `at`.
fn force(flex: &ToolFlex, at: &Vector3<f64>) -> Vector3<f64> {
    let local = Local { current: at.as_slice(), group: 0, predicted: &[] };
    Vector3::from_vec(added(3, |out| flex.add_gradient(&local, out)))
}

#[test]
fn the_guide_may_go_anywhere_and_the_tip_aside_costs_its_stiffness() {
    let flex = leaning(1.0);
    let [first, second] = flex.sides();
    let axis = flex.axis.into_inner();
    for side in [first, second] {
        assert!((side.norm() - 1.0).abs() < ROUNDOFF && side.dot(&axis).abs() < ROUNDOFF);
    }
    assert!(first.dot(&second).abs() < ROUNDOFF);
    for (travel, u, v) in [(0.3, 0.0, 0.0), (-2.0, 0.02, 0.0), (0.1, 0.01, -0.03)] {
        let deflection = first * u + second * v;
        let at = flex.origin + flex.direction.into_inner() * travel + deflection;
        assert!((flex.travel_mm(&at) - travel).abs() < ROUNDOFF);
        assert!((flex.deflection(&at) - deflection).norm() < ROUNDOFF);
        let force = force(&flex, &at);
        // Across the shaft the spring, along the guide's way nothing: that is the force's own.
        assert!((force.dot(&first) - 32.0 * u).abs() < 1e2 * ROUNDOFF);
        assert!((force.dot(&second) - 32.0 * v).abs() < 1e2 * ROUNDOFF);
        assert!(force.dot(&flex.direction).abs() < 1e2 * ROUNDOFF);
        let local = Local { current: at.as_slice(), group: 0, predicted: &[] };
        let expected = 0.5 * 32.0 * (u * u + v * v);
        assert!((flex.energy(&local) - expected).abs() < 1e2 * ROUNDOFF);
    }
    // A tip that is moved along its shaft and not along the guide's way bends it.
    let along = flex.origin + axis * 0.1;
    assert!(force(&flex, &along).norm() > 0.1);
}
