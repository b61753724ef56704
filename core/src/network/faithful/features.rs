//! The paper's features: positions with log-frequency encoding, and the force on every node of the tool.
//!
//! `[x, sin(2ᵏ π x), cos(2ᵏ π x)]` for k = 0, 1, 2 and each coordinate: 21 numbers. The tool's nodes have the force's direction and magnitude
//! before them: 25. Positions are divided by [`REACH_MM`], the largest coordinate of a patch, as everything is there.

use std::f32::consts::PI;

use nalgebra::Vector3;

use crate::network::input::Field;

/// Numbers of a node of the patch.
pub const SOFT: usize = 21;
/// Numbers of a node of the tool.
pub const RIGID: usize = 25;
/// Bands of the encoding.
const BANDS: usize = 3;
/// Largest coordinate of a grid patch (mm).
pub const REACH_MM: f32 = 1.05;

fn push_position(to: &mut Vec<f32>, position: &Vector3<f32>) {
    let x = position / REACH_MM;
    to.extend(x.iter());
    for band in 0..BANDS {
        let phase = x * (PI * (1 << band) as f32);
        to.extend(phase.map(f32::sin).iter());
        to.extend(phase.map(f32::cos).iter());
    }
}

/// Numbers of the patch's nodes.
pub fn soft(rest: &Field, to: &mut Vec<f32>) {
    to.clear();
    rest.iter().for_each(|position| push_position(to, position));
}

/// Numbers of the tool's nodes: where they are (mm), and the force (unit direction, mN).
pub fn rigid(nodes: &[Vector3<f32>], direction: &Vector3<f32>, force_mn: f32, to: &mut Vec<f32>) {
    to.clear();
    for position in nodes {
        to.extend(direction.iter());
        to.push(force_mn);
        push_position(to, position);
    }
}
