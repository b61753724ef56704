//! `bleb`: derivatives, the volume between two sides, and the balance of the fluid's forces.

use nalgebra::{Rotation3, Vector3};
use retina_core::effect::{Effect, Local, Multiplier};
use retina_core::effects::adhesion::GROUP;
use retina_core::effects::bleb::{Fluid, Holds};
use retina_core::mesh::element::{FACE_NODES, NODE_OFFSETS, ORDER, TOP_NODES};
use retina_tests::tolerance::ROUNDOFF;

use super::{Case, REPEATS, SIZES, STEP, added, check_effect, largest};
use crate::meshes::noise;

/// Fluid of this pressure in the one group.
fn fluid(pressure_kpa: f64) -> Fluid<'static> {
    Fluid { detached: &[true], holds: Holds::Volume(Multiplier::new(pressure_kpa, 1.0, 1.0)) }
}

/// Component-major nodes of a lower and an upper face over the square [−½, ½]², each bent by `bend`.
fn sides(bend: impl Fn(usize, Vector3<f64>) -> Vector3<f64>) -> Vec<f64> {
    let node = |a: usize| {
        let at = NODE_OFFSETS[TOP_NODES[a % FACE_NODES]];
        let flat = Vector3::new(at[0] as f64 / ORDER as f64 - 0.5, at[1] as f64 / ORDER as f64 - 0.5, 0.0);
        bend(a / FACE_NODES, flat)
    };
    let nodes: Vec<Vector3<f64>> = (0..GROUP).map(node).collect();
    (0..3).flat_map(|k| nodes.iter().map(move |node| node[k]).collect::<Vec<_>>()).collect()
}

fn random(size: f64, seed: u64) -> Vec<f64> {
    let mut random = noise(120 + seed);
    let turn = Rotation3::from_euler_angles(random(), random(), random());
    let noise: Vec<Vector3<f64>> = (0..GROUP).map(|_| Vector3::from_fn(|_, _| 0.1 * random())).collect();
    let at = std::cell::Cell::new(0);
    sides(|side, flat| {
        let index = at.replace(at.get() + 1);
        (turn * (flat + Vector3::new(0.0, 0.0, 0.3 * side as f64) + noise[index]) + Vector3::repeat(0.4)) * size
    })
}

pub fn check() {
    for size in SIZES {
        for (effect, what) in
            [(fluid(1.7), "volume held"), (Fluid { detached: &[true], holds: Holds::Pressure(-0.4) }, "pressure held")]
        {
            let cases: Vec<Case> = (0..REPEATS as u64)
                .map(|seed| Case {
                    label: format!("{what}, seed {seed}, size {size:e}"),
                    group: 0,
                    current: random(size, seed),
                    step_mm: STEP * size,
                })
                .collect();
            check_effect("bleb", &effect, &cases);
        }
    }
}

fn volume(current: &[f64]) -> f64 {
    fluid(1.0).volume(&Local { current, group: 0, predicted: &[] })
}

#[test]
fn the_volume_is_that_between_the_sides_wherever_they_are() {
    assert!(
        (volume(&sides(|side, at| at + Vector3::new(0.0, 0.0, 0.3 * side as f64))) - 0.3).abs() < ROUNDOFF,
        "a box"
    );
    assert!(volume(&sides(|_, at| at)).abs() < ROUNDOFF, "closed");
    // A lid that is a paraboloid over the square: ∫ (1/4 − x²)(1/4 − y²) = 1/36, exact for nodes of a biquadratic face but for its missing middle: x² y² is not in it.
    let lid = |at: Vector3<f64>| 0.2 + 0.4 * at.x - 0.3 * at.x * at.x + 0.25 * at.y * at.y + 0.1 * at.x * at.x * at.y;
    let exact = 0.2 - 0.3 / 12.0 + 0.25 / 12.0;
    let bent = sides(|side, at| at + Vector3::z() * (lid(at) * side as f64));
    assert!((volume(&bent) - exact).abs() < ROUNDOFF, "{} {exact}", volume(&bent));
    // Another place, another turn, a common shear: the same volume; a stretch is not.
    let moved = |stretch: f64| {
        let turn = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        sides(|side, at| {
            let at = at + Vector3::z() * (lid(at) * side as f64);
            turn * Vector3::new(at.x + 0.4 * at.z, stretch * at.y, at.z) + Vector3::new(30.0, -20.0, 10.0)
        })
    };
    assert!((volume(&moved(1.0)) - exact).abs() < 1e3 * ROUNDOFF, "{}", volume(&moved(1.0)));
    assert!((volume(&moved(1.1)) - 1.1 * exact).abs() < 1e3 * ROUNDOFF);
}

#[test]
fn the_fluid_pushes_its_sides_apart_with_forces_that_balance() {
    for seed in 0..REPEATS as u64 {
        let current = random(1.0, seed);
        let effect = fluid(2.0);
        let local = Local { current: &current, group: 0, predicted: &[] };
        let forces = added(current.len(), |out| effect.add_gradient(&local, out));
        let on = |from: usize| {
            Vector3::from_fn(|k, _| forces[k * GROUP + from..k * GROUP + from + FACE_NODES].iter().sum::<f64>())
        };
        let (below, above) = (on(0), on(FACE_NODES));
        let size = largest(&forces);
        assert!((below + above).norm() < 1e2 * ROUNDOFF * size, "{below} {above}");
        // The energy falls where the upper side rises: about pressure times area.
        assert!(above.norm() > 1.0, "{above}");
        let dry = Fluid { detached: &[false], ..fluid(2.0) };
        assert!(!dry.is_active(&local) && dry.volume(&local) == 0.0);
    }
}

#[test]
fn the_slope_of_what_is_held_is_the_gradient_for_each_kpa_and_the_hessian_takes_the_predicted_pressure() {
    let current = random(1.0, 7);
    let n = current.len();
    let local = Local { current: &current, group: 0, predicted: &[] };
    let effect = fluid(2.0);
    let slope = added(n, |out| effect.add_held_slope(&local, out));
    let gradient = added(n, |out| effect.add_gradient(&local, out));
    let size = largest(&gradient);
    assert!(size > 0.1, "a gradient of {size} proves nothing");
    for (slope, gradient) in slope.iter().zip(&gradient) {
        assert!((gradient + 2.0 * slope).abs() <= ROUNDOFF * size);
    }
    assert!((effect.energy(&local) + 2.0 * effect.held(&local)).abs() < ROUNDOFF);
    let mut predicted = [0.0];
    effect.predict_stress(&local, &vec![0.0; n], &mut predicted);
    assert_eq!(predicted, [2.0]);
    let hessian = |predicted: &[f64]| {
        added(n * n, |out| effect.add_hessian(&Local { current: &current, group: 0, predicted }, out))
    };
    assert_eq!(hessian(&[2.0]), hessian(&[]));
    let (whole, half) = (hessian(&[2.0]), hessian(&[1.0]));
    let size = largest(&whole);
    assert!(size > 0.1 && whole.iter().zip(&half).all(|(whole, half)| (whole - 2.0 * half).abs() <= ROUNDOFF * size));
    // Only what holds a volume has an unknown of its own.
    assert!(effect.multiplier().is_some());
    assert!(Fluid { detached: &[true], holds: Holds::Pressure(2.0) }.multiplier().is_none());
}
