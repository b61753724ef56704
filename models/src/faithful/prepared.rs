//! Samples as the paper's network sees them: two point clouds, a force, and where the patch's nodes go.
//!
//! The network knows nothing of left and right, so the square's eight symmetries are further samples; all built-in scenes have them.

use nalgebra::{Matrix3, Point3, Vector3};
use retina_core::network::faithful::UNIT_MM;
use retina_core::network::faithful::features;
use retina_core::network::faithful::tool::{TOOL_NODES, nodes};
use retina_core::network::input::Field;

use crate::describe;
use crate::sample::Sample;

/// Symmetries of the square.
pub const SYMMETRIES: usize = 8;

/// One sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    rest: Field,
    tool: [Vector3<f32>; TOOL_NODES],
    direction: Vector3<f32>,
    force_mn: f32,
    moved: Field,
}

/// A sample's numbers under one symmetry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Numbers of the patch's nodes.
    pub soft: Vec<f32>,
    /// Numbers of the tool's nodes.
    pub rigid: Vec<f32>,
    /// Displacements, in the network's unit, three a node.
    pub target: Vec<f32>,
}

/// One of the square's symmetries: a quarter turn `index % 4` times, mirrored before if `index` is 4 or more.
pub fn symmetry(index: usize) -> Matrix3<f32> {
    let turn = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let mirror = if index >= 4 { Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0)) } else { Matrix3::identity() };
    (0..index % 4).fold(mirror, |map, _| turn * map)
}

impl Prepared {
    /// Of `sample`, the tool where it first touches.
    pub fn new(sample: &Sample) -> Self {
        let input = describe::input(sample);
        let pose = input.pose_after(sample.touch_travel_mm);
        let place = |node: Point3<f64>| (pose * node).coords.cast::<f32>();
        Prepared {
            rest: input.rest_mm,
            tool: nodes(&input.body).map(place),
            direction: input.direction,
            force_mn: input.force_mn,
            moved: sample.truth.displacement_mm.map(Vector3::from),
        }
    }

    /// The sample under a symmetry.
    pub fn view(&self, index: usize, view: &mut View) {
        let map = symmetry(index);
        features::soft(&self.rest.map(|position| map * position), &mut view.soft);
        let tool = self.tool.map(|position| map * position);
        features::rigid(&tool, &(map * self.direction), self.force_mn, &mut view.rigid);
        view.target.clear();
        view.target.extend(self.moved.iter().flat_map(|moved| <[f32; 3]>::from(map * moved / UNIT_MM)));
    }
}
