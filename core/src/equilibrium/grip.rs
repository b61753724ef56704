//! What friction remembers from one motion of the needle to the next: where on the needle each point of the tissue is held.
//!
//! A point that sticks keeps its anchor. One that slips drags it along, so that it ends just short of the slip at which friction is at its limit
//! ([`Friction::dragged`]): the return to the cone of Coulomb's law, as of an elastic–plastic spring (Wriggers, *Computational Contact Mechanics*, section 10.5). A
//! needle that is then held meets the same force, and one that turns back meets tissue that sticks, until the slip is as large the other way. The work
//! that a slip loses is its length times the force, and never negative.
//!
//! A point that the needle had not touched meets it on its way of this motion, from where the tissue was left; the needle is taken to have come straight from
//! there. One that has lost the needle forgets its anchor.
//! Not here: the energy (`effects::friction`), the repetition (`friction`).

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::friction::{FULL_SLIP_MM, Pressed};
use super::{Load, Wall};
use crate::effect::Local;
use crate::effects::friction::{Friction, anchor};

/// Where the needle holds the tissue at the end of a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grip {
    /// Anchor in needle coordinates (mm) of each quadrature point of the inner surface, face after face; `None` where the needle does not touch. Empty:
    /// nowhere.
    anchors: Vec<Option<Point3<f64>>>,
    /// Positions at the end of the motion, the needle's tip last (mm); empty: those without contact.
    positions: Vec<f64>,
    /// What pressed there.
    pressed: Pressed,
}

impl Grip {
    /// Tissue at `positions` (mm; the needle's tip last) that the needle does not touch.
    pub fn free(positions: Vec<f64>) -> Self {
        Grip { positions, ..Grip::default() }
    }

    /// Normal forces and normals at the end of the motion.
    pub(super) fn pressed(&self) -> &Pressed {
        &self.pressed
    }

    /// Whether the needle holds the tissue anywhere.
    pub fn holds(&self) -> bool {
        self.anchors.iter().any(Option::is_some)
    }
}

/// How the needle comes to what it had not touched.
pub(super) struct Approach<'a> {
    grip: &'a Grip,
    /// Positions of the tissue before the motion (mm).
    start: Vec<f64>,
    /// The needle's pose somewhere on its way.
    pose: Isometry3<f64>,
    /// Its way, in needle coordinates.
    direction: Unit<Vector3<f64>>,
}

impl Approach<'_> {
    /// The anchor of a point of the surface, from the tip, in the patch's frame (mm): where it is held, or where the needle meets it.
    pub fn anchor(&self, wall: &Wall, group: usize, point: usize) -> Vector3<f64> {
        let faces = &wall.faces;
        let held = self.grip.anchors.get(group * faces.points + point).copied().flatten();
        let at = held.unwrap_or_else(|| {
            let node = |vertex: u32| Vector3::from_row_slice(&self.start[3 * vertex as usize..][..3]);
            let vertices = wall.topology.faces.group(group);
            let place = faces.values(point).iter().zip(vertices).map(|(v, &n)| node(n) * *v).sum::<Vector3<f64>>();
            anchor(wall.tool.body, &self.pose.inverse_transform_point(&Point3::from(place)), &self.direction)
        });
        self.pose.rotation * at.coords
    }
}

impl Wall<'_> {
    /// The needle's way under `load` after `grip`, where it is expected to end with its tip at `tip`.
    pub(super) fn approach<'a>(&self, load: &Load, grip: &'a Grip, tip: &Vector3<f64>) -> Approach<'a> {
        let mut pose = self.tool.patch_from_needle;
        let start = if grip.positions.is_empty() { self.start() } else { grip.positions.clone() };
        let mut way = load.motion.direction;
        if grip.holds() {
            let moved = tip - Vector3::from_row_slice(&start[3 * self.topology.needle()..]);
            // A needle that stays where it is meets what comes to it along its own direction.
            if moved.norm() > FULL_SLIP_MM {
                way = Unit::new_normalize(moved);
            }
            pose.translation.vector = *tip;
        }
        Approach { grip, start, pose, direction: pose.inverse_transform_unit_vector(&way) }
    }

    /// Where the needle holds the tissue at `positions`, rubbed as `friction` says.
    pub(super) fn grip(&self, friction: &Friction, positions: &[f64]) -> Grip {
        let stencils = &self.topology.faces;
        let mut current = vec![0.0; 3 * stencils.group_size];
        let mut anchors = vec![None; stencils.len() * self.faces.points];
        let needle_from_patch = self.tool.patch_from_needle.rotation.inverse();
        for (group, points) in friction.points.iter().enumerate() {
            stencils.gather(group, positions, &mut current);
            let local = Local { current: &current, group, predicted: &[] };
            for rubbing in points {
                let anchor = needle_from_patch * friction.dragged(&local, rubbing);
                anchors[group * self.faces.points + rubbing.point] = Some(Point3::from(anchor));
            }
        }
        Grip { anchors, positions: positions.to_vec(), pressed: self.pressed(positions) }
    }
}
