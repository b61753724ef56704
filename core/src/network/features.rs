//! What the contact networks see of a request, and the vectors that they answer in.
//!
//! Every number is a ratio of like quantities and a scalar that no rotation or mirror image changes: dot products, lengths, distances to the
//! needle. Every vector of [`Features::basis`] turns and mirrors with the request. A network that maps the first to coefficients of the
//! second is therefore equivariant whatever its weights are, and it knows no units.
//!
//! The correction of a node is a sum of basis vectors times [`Features::scale_mm`], which is a share of the depth: no depth, no motion.

use nalgebra::Vector3;

use super::contact_frame::ContactFrame;
use super::input::{Answer, Input};
use crate::needle::Tip;
use crate::patch::NODE_COUNT;

/// Numbers of each node.
pub const LOCAL: usize = 33;
/// Numbers of each node about `coarse`, besides.
pub const LOCAL_COARSE: usize = 12;
/// Numbers of the whole request.
pub const GLOBAL: usize = 50;
/// Numbers of the whole request about `coarse`, besides.
pub const GLOBAL_COARSE: usize = 4;
/// Vectors that a node's correction is made of.
pub const BASIS: usize = 9;
/// Vectors that the correction of the reaction is made of.
pub const SIDES: usize = 4;

/// What a correction far from the needle may be at most of the depth, per unit of coefficient, at the contact's centre.
const FAR_SHARE: f32 = 0.1;
/// Softening of unit vectors, in contact radii and depths: they vanish smoothly where their direction is lost.
const SOFT: f32 = 0.1;

/// See the module. Memory is kept between requests.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Numbers of each node, `NODE_COUNT × local width`.
    pub local: Vec<f32>,
    /// Numbers of the request.
    pub global: Vec<f32>,
    /// Basis vectors of each node.
    pub basis: Vec<[Vector3<f32>; BASIS]>,
    /// Length of one unit of coefficient at each node (mm).
    pub scale_mm: Vec<f32>,
    /// Weight of each node in what is averaged over the patch; they add up to one.
    pub pool: Vec<f32>,
    /// Vectors of the reaction's correction, pure numbers.
    pub sides: [Vector3<f32>; SIDES],
}

/// `x / (1 + |x|)`: any length becomes a number between −1 and 1.
fn squash(x: f32) -> f32 {
    x / (1.0 + x.abs())
}

/// `x / (unit + |x|)`: the same of a length that may be far larger than its unit.
fn squash_by(x: f32, unit: f32) -> f32 {
    x / (unit + x.abs())
}

impl Features {
    /// Numbers of each node, with or without `coarse`.
    pub fn local_width(coarse: bool) -> usize {
        if coarse { LOCAL + LOCAL_COARSE } else { LOCAL }
    }

    /// Numbers of a request, with or without `coarse`.
    pub fn global_width(coarse: bool) -> usize {
        if coarse { GLOBAL + GLOBAL_COARSE } else { GLOBAL }
    }

    /// Describes `input`; with `coarse`, the correction is one of that answer and it is described too.
    pub fn describe(&mut self, input: &Input, coarse: Option<&Answer>) {
        let frame = ContactFrame::new(input);
        self.global.clear();
        push_global(&mut self.global, input, &frame);
        push_relief(&mut self.global, input, &frame);
        if let Some(coarse) = coarse {
            push_global_coarse(&mut self.global, input, &frame, coarse);
        }
        self.sides = [frame.tilt, frame.drive, frame.bevel_tangent, frame.slope];
        self.local.clear();
        self.basis.clear();
        self.scale_mm.clear();
        self.pool.clear();
        let linear_pose = input.pose_after(input.linear.travel_mm);
        let coarse_pose = coarse.map(|coarse| (coarse, input.pose_after(coarse.travel_mm)));
        for node in 0..NODE_COUNT {
            let start = coarse.unwrap_or(&input.linear).displacement_mm[node];
            let at = Place::new(&frame, input, node);
            at.push(&mut self.local, input, &frame, &linear_pose);
            at.push_relief(&mut self.local, node, input, &frame);
            let moved = input.rest_mm[node] + start;
            let mut gradient = input.distance(&linear_pose, &moved).1;
            if let Some((coarse, pose)) = &coarse_pose {
                gradient = push_coarse(&mut self.local, input, &frame, &at, node, coarse, pose);
            }
            let decay = 1.0 / (1.0 + at.far * at.far);
            self.basis.push([
                frame.inward,
                at.radial,
                frame.tilt,
                frame.drive,
                frame.bevel_tangent,
                start / (start.norm() + SOFT * frame.depth_mm).max(f32::MIN_POSITIVE),
                frame.tangent(&input.rest_normal[node]),
                frame.tangent(&gradient),
                frame.slope,
            ]);
            self.scale_mm.push(start.norm() + FAR_SHARE * frame.depth_mm * decay * decay);
            self.pool.push(decay);
        }
        let total: f32 = self.pool.iter().sum();
        self.pool.iter_mut().for_each(|weight| *weight /= total);
    }
}

/// A node as the contact sees it.
struct Place {
    offset: Vector3<f32>,
    distance_mm: f32,
    radial: Vector3<f32>,
    /// Distance over the thickness of what yields.
    far: f32,
    linear: Vector3<f32>,
    normal: Vector3<f32>,
    rest: Vector3<f32>,
}

impl Place {
    fn new(frame: &ContactFrame, input: &Input, node: usize) -> Self {
        let rest = input.rest_mm[node];
        let offset = rest - frame.center;
        let across = frame.tangent(&offset);
        let distance_mm = across.norm();
        Place {
            offset,
            distance_mm,
            radial: across / distance_mm.hypot(SOFT * frame.contact_mm),
            far: distance_mm / frame.yielding_mm,
            linear: input.linear.displacement_mm[node],
            normal: input.rest_normal[node],
            rest,
        }
    }

    fn push(&self, to: &mut Vec<f32>, input: &Input, frame: &ContactFrame, pose: &nalgebra::Isometry3<f64>) {
        let ContactFrame { inward, tilt, drive, bevel_tangent, contact_mm, radius_mm, yielding_mm, depth_mm, .. } =
            frame;
        let near = self.distance_mm / contact_mm;
        let depth = depth_mm.max(f32::MIN_POSITIVE);
        let moved = self.rest + self.linear;
        let (at_rest, _) = input.distance(pose, &self.rest);
        let (at_moved, gradient) = input.distance(pose, &moved);
        let local = pose.inverse_transform_point(&nalgebra::Point3::from(self.rest.cast::<f64>())).cast::<f32>();
        let bevelled = if *bevel_tangent == Vector3::zeros() { 0.0 } else { 1.0 };
        let axis_x = input.body.axis_x_mm() as f32;
        to.extend([
            near.ln_1p(),
            self.far,
            1.0 / (1.0 + near * near),
            1.0 / (1.0 + self.far * self.far),
            (-self.far).exp(),
            self.offset.dot(inward) / yielding_mm,
            self.radial.dot(tilt),
            self.radial.dot(drive),
            self.radial.dot(bevel_tangent),
            squash(self.offset.dot(tilt) / contact_mm),
            squash(self.offset.dot(drive) / contact_mm),
            squash(self.offset.dot(bevel_tangent) / contact_mm),
            self.linear.dot(inward) / depth,
            self.linear.dot(&self.radial) / depth,
            self.linear.norm() / depth,
            squash(at_rest / radius_mm),
            squash(at_moved / (0.2 * radius_mm)),
            squash(at_rest / yielding_mm),
            gradient.dot(inward),
            gradient.dot(&self.radial),
            1.0 + self.normal.dot(inward),
            self.normal.dot(&self.radial),
            self.normal.dot(tilt),
            squash(local.z / radius_mm),
            squash((local.x - axis_x).hypot(local.y) / radius_mm),
            bevelled * squash(local.x / radius_mm),
            self.normal.dot(drive),
            self.radial.dot(&frame.face),
            squash_by(self.offset.dot(&frame.face), depth),
        ]);
    }

    /// What a pit changes at a node.
    fn push_relief(&self, to: &mut Vec<f32>, node: usize, input: &Input, frame: &ContactFrame) {
        to.extend([
            input.relief.node_mm[node] / frame.yielding_mm,
            frame.slope.dot(&self.radial),
            frame.slope.dot(&self.normal),
            frame.yielding_mm * self.radial.dot(&(input.relief.bend * self.radial)),
        ]);
    }
}

/// What `coarse` says of a node; answers the gradient of the distance to the needle where `coarse` puts both.
fn push_coarse(
    to: &mut Vec<f32>,
    input: &Input,
    frame: &ContactFrame,
    at: &Place,
    node: usize,
    coarse: &Answer,
    pose: &nalgebra::Isometry3<f64>,
) -> Vector3<f32> {
    let depth = frame.depth_mm.max(f32::MIN_POSITIVE);
    let moved = coarse.displacement_mm[node];
    let differs = moved - at.linear;
    let (distance, gradient) = input.distance(pose, &(at.rest + moved));
    let share = moved / depth;
    to.extend([
        share.dot(&frame.inward),
        share.dot(&at.radial),
        share.dot(&frame.tilt),
        share.dot(&frame.drive),
        share.dot(&frame.bevel_tangent),
        share.norm(),
        differs.dot(&frame.inward) / depth,
        differs.dot(&at.radial) / depth,
        squash(distance / frame.contact_mm),
        squash(20.0 * distance / frame.contact_mm),
        gradient.dot(&frame.inward),
        gradient.dot(&at.radial),
    ]);
    gradient
}

fn push_global(to: &mut Vec<f32>, input: &Input, frame: &ContactFrame) {
    let ContactFrame { inward, tilt, drive, bevel_tangent, contact_mm, radius_mm, yielding_mm, depth_mm, .. } = frame;
    let [retina_mm, _, sclera_mm] = input.tissue.thickness_mm;
    let [retina_kpa, choroid_kpa, sclera_kpa] = input.tissue.youngs_modulus_kpa;
    let cross_section = std::f32::consts::PI * radius_mm * radius_mm;
    let pressure = (input.force_mn / (retina_kpa * cross_section)).max(1e-6);
    let bevel = match input.shape.tip {
        Tip::Bevelled { angle_deg, .. } => (angle_deg / 90.0) as f32,
        Tip::Hemispherical | Tip::Flat { .. } => 1.0,
    };
    // The sine of the angle between face and surface: a cosine hardly feels the first degrees, which decide whether a face or its edge presses.
    let leaning = frame.tangent(&frame.face).norm();
    let shift = frame.tangent(&(input.center_mm - input.touch_mm)) / *contact_mm;
    to.extend([
        (contact_mm / radius_mm).ln(),
        (radius_mm / yielding_mm).ln(),
        depth_mm / yielding_mm,
        (depth_mm / radius_mm).max(1e-6).ln(),
        (depth_mm / contact_mm).max(1e-6).ln(),
        depth_mm / retina_mm,
        pressure,
        pressure.ln(),
        input.pressure_kpa / (retina_kpa + input.pressure_kpa),
        (choroid_kpa / retina_kpa).ln(),
        (sclera_kpa / retina_kpa).ln(),
        1.0 - 2.0 * input.tissue.poisson_ratio[0],
        1.0 - 2.0 * input.tissue.poisson_ratio[1],
        1.0 - 2.0 * input.tissue.poisson_ratio[2],
        retina_mm / yielding_mm,
        sclera_mm / yielding_mm,
    ]);
    to.extend((0..Tip::KINDS).map(|kind| if input.shape.tip.kind() == kind { 1.0 } else { 0.0 }));
    to.extend([
        input.shape.edge_radius_mm() as f32 / radius_mm,
        bevel,
        frame.points.dot(inward),
        input.direction.dot(inward),
        tilt.dot(drive),
        drive.norm_squared(),
        frame.bevel.dot(inward),
        frame.face.dot(inward),
        frame.face.dot(&input.direction),
        leaning,
        squash_by(radius_mm * leaning, depth_mm.max(f32::MIN_POSITIVE)),
        tilt.norm(),
        drive.norm(),
        bevel_tangent.norm_squared(),
        bevel_tangent.dot(tilt),
        bevel_tangent.dot(drive),
        squash(shift.norm()),
        squash(shift.dot(tilt)),
        squash(shift.dot(bevel_tangent)),
        curvature(input, frame) * yielding_mm,
        input.linear.reaction_mn.norm() / input.force_mn.max(f32::MIN_POSITIVE),
    ]);
}

/// What a pit changes for the whole request: the retina under the contact, how it thickens and how the surface bends there.
fn push_relief(to: &mut Vec<f32>, input: &Input, frame: &ContactFrame) {
    let ContactFrame { tilt, drive, bevel_tangent, slope, contact_mm, radius_mm, yielding_mm, .. } = frame;
    let bend = input.relief.bend;
    let around = bend.trace();
    let along = |v: &Vector3<f32>| yielding_mm * v.dot(&(bend * v));
    to.extend([
        input.relief.center_mm / yielding_mm,
        slope.norm(),
        slope.dot(tilt),
        slope.dot(drive),
        slope.dot(bevel_tangent),
        yielding_mm * around,
        squash(radius_mm * around),
        contact_mm * contact_mm * around / yielding_mm,
        along(tilt),
        along(bevel_tangent),
    ]);
}

fn push_global_coarse(to: &mut Vec<f32>, input: &Input, frame: &ContactFrame, coarse: &Answer) {
    let force = input.force_mn.max(f32::MIN_POSITIVE);
    to.push((coarse.travel_mm - input.linear.travel_mm) / frame.depth_mm.max(f32::MIN_POSITIVE));
    let sides = [frame.tilt, frame.drive, frame.bevel_tangent];
    to.extend(sides.map(|side| coarse.reaction_mn.dot(&side) / force));
}

/// Mean curvature of the patch about the contact (1/mm): the parabola of revolution that fits the nodes' heights best.
fn curvature(input: &Input, frame: &ContactFrame) -> f32 {
    let (mut above, mut below) = (0.0, 0.0);
    for rest in &input.rest_mm {
        let offset = rest - frame.center;
        let height = offset.dot(&frame.inward);
        let squared = frame.tangent(&offset).norm_squared();
        above += height * squared;
        below += squared * squared;
    }
    2.0 * above / below
}
