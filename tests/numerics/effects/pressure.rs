//! `pressure`: derivatives, and the balance of its forces on a closed surface.

use nalgebra::{Rotation3, Vector3};
use retina_core::effect::{Effect, Local};
use retina_core::effects::pressure::Pressure;
use retina_core::mesh::element::{FACE_NODES, NODE_OFFSETS, ORDER, TOP_NODES};
use retina_tests::tolerance::ROUNDOFF;

use super::{Case, RADIUS, REPEATS, SIZES, STEP, added, check_effect, face, largest};
use crate::meshes::noise;

/// A bent face somewhere near the origin, with the needle's vertex last.
fn bent(size: f64, seed: u64) -> Vec<f64> {
    let (stencils, rest) = face(size);
    let mut random = noise(50 + seed);
    let mut current = vec![0.0; 3 * (FACE_NODES + 1)];
    stencils.gather(0, &rest, &mut current);
    let turn = Rotation3::from_euler_angles(random(), random(), random());
    let n = FACE_NODES + 1;
    for a in 0..n {
        let shift = Vector3::from_fn(|_, _| 0.1 * size * RADIUS * random());
        let at = turn * Vector3::from_fn(|k, _| current[k * n + a]) + shift + Vector3::repeat(0.5 * size * RADIUS);
        (0..3).for_each(|k| current[k * n + a] = at[k]);
    }
    current
}

pub fn check() {
    for size in SIZES {
        for pressure_kpa in [8.0, -2.0] {
            let cases: Vec<Case> = (0..REPEATS as u64)
                .map(|seed| Case {
                    label: format!("bent face, {pressure_kpa} kPa, seed {seed}, size {size:e}"),
                    group: 0,
                    current: bent(size, seed),
                    step_mm: STEP * RADIUS * size,
                })
                .collect();
            check_effect("pressure", &Pressure { pressure_kpa }, &cases);
        }
    }
}

/// Nodes of the six faces of a cube of edge 1, each in the order and the orientation of a top face.
fn cube() -> Vec<Vec<f64>> {
    let turns = [(0.0, 0.0), (90.0, 0.0), (180.0, 0.0), (270.0, 0.0), (0.0, 90.0), (0.0, 270.0)];
    let face = |(roll, pitch): (f64, f64)| {
        let turn = Rotation3::from_euler_angles(f64::to_radians(roll), f64::to_radians(pitch), 0.0);
        let node = |&a: &usize| turn * Vector3::from_fn(|k, _| NODE_OFFSETS[a][k] as f64 / ORDER as f64 - 0.5);
        let nodes: Vec<Vector3<f64>> = TOP_NODES.iter().map(node).collect();
        (0..3).flat_map(|k| nodes.iter().map(move |node| node[k]).collect::<Vec<_>>()).collect()
    };
    turns.map(face).to_vec()
}

#[test]
fn a_closed_surface_is_neither_pushed_nor_turned_and_an_open_one_is_pushed() {
    // The cube bulged by a smooth map, so that its faces are curved and still fit together.
    let bulge = |v: Vector3<f64>| v * (1.0 + 0.3 * v.x - 0.2 * v.y * v.z + 0.1 * v.z) + Vector3::new(3.0, -2.0, 1.0);
    let effect = Pressure { pressure_kpa: 2.0 };
    let (mut force, mut moment, mut volume, mut first) = (Vector3::zeros(), Vector3::zeros(), 0.0, Vector3::zeros());
    for (index, nodes) in cube().iter().enumerate() {
        let moved: Vec<Vector3<f64>> =
            (0..FACE_NODES).map(|a| bulge(Vector3::from_fn(|k, _| nodes[k * FACE_NODES + a]))).collect();
        let current: Vec<f64> = (0..3).flat_map(|k| moved.iter().map(move |at| at[k])).collect();
        let local = Local { current: &current, group: 0, predicted: &[] };
        let forces = added(current.len(), |out| effect.add_gradient(&local, out));
        volume += effect.energy(&local) / effect.pressure_kpa;
        for (a, at) in moved.iter().enumerate() {
            let on_node = Vector3::from_fn(|k, _| forces[k * FACE_NODES + a]);
            force += on_node;
            moment += at.cross(&on_node);
            first += if index == 0 { on_node } else { Vector3::zeros() };
        }
    }
    assert!(volume > 0.5 && volume < 2.0, "a cube of edge 1, bulged: {volume}");
    let size = largest(first.as_slice());
    assert!(size > 0.5, "one face alone is pushed: {first}");
    assert!(force.norm() < 1e2 * ROUNDOFF * size && moment.norm() < 1e3 * ROUNDOFF * size, "{force} {moment}");
}
