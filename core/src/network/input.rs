//! What a network knows of one request: rest nodes, needle, force, tissue, the linear answer, and `coarse`'s where there is one.
//!
//! Everything is in the patch frame; lengths mm, forces mN, moduli kPa. The same facts as a stored sample's, so that what was trained
//! on and what is asked later are described by the same code.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::needle::{Body, NeedleShape};
use crate::patch::NODE_COUNT;

/// A vector for each node.
pub type Field = [Vector3<f32>; NODE_COUNT];

/// The tissue under the contact; retina, choroid, sclera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TissueNumbers {
    /// Thickness, the retina's where the needle touches (mm).
    pub thickness_mm: [f32; 3],
    /// Young's moduli (kPa).
    pub youngs_modulus_kpa: [f32; 3],
    /// Poisson's ratios.
    pub poisson_ratio: [f32; 3],
}

/// How the retina's thickness changes about the contact: zeros everywhere but in a pit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relief {
    /// How much thicker the retina is under each node than where the needle touches (mm).
    pub node_mm: [f32; NODE_COUNT],
    /// The same under the centre of the contact (mm).
    pub center_mm: f32,
    /// Derivative of the thickness along the surface there (mm per mm).
    pub slope: Vector3<f32>,
    /// Second derivative (1/mm).
    pub bend: Matrix3<f32>,
}

impl Relief {
    /// From how much thinner the retina is than the tissue says under the nodes, where the needle touches and under the contact's centre (mm), and the derivatives
    /// of that thinning at the centre.
    pub fn new(
        nodes_mm: &[f32; NODE_COUNT],
        [touch_mm, center_mm]: [f64; 2],
        slope: &Vector3<f64>,
        bend: &Matrix3<f64>,
    ) -> Self {
        Relief {
            node_mm: nodes_mm.map(|thinning_mm| touch_mm as f32 - thinning_mm),
            center_mm: (touch_mm - center_mm) as f32,
            slope: -slope.cast::<f32>(),
            bend: -bend.cast::<f32>(),
        }
    }
}

/// What a level answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Displacement of each node (mm).
    pub displacement_mm: Field,
    /// Travel of the needle along the direction (mm).
    pub travel_mm: f32,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: Vector3<f32>,
}

/// One request, as a network sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Nodes at rest (mm).
    pub rest_mm: Field,
    /// Unit normals of the surface at rest at the nodes, into the vitreous.
    pub rest_normal: Field,
    /// The needle's shape.
    pub shape: NeedleShape,
    /// Its solid.
    pub body: Body,
    /// Where it is before it moves (mm).
    pub patch_from_needle: Isometry3<f64>,
    /// Unit direction in which it is driven.
    pub direction: Vector3<f32>,
    /// Force along the direction (mN).
    pub force_mn: f32,
    /// The tissue.
    pub tissue: TissueNumbers,
    /// How the retina's thickness changes.
    pub relief: Relief,
    /// Where it first touches (mm).
    pub touch_mm: Vector3<f32>,
    /// Unit inward normal of the surface there.
    pub inward: Vector3<f32>,
    /// Centre of the contact as linear elasticity expects it, on the surface at rest (mm).
    pub center_mm: Vector3<f32>,
    /// Depth of the linear answer along the inward normal (mm).
    pub depth_mm: f32,
    /// Its contact radius (mm).
    pub contact_radius_mm: f32,
    /// Its largest pressure (kPa).
    pub pressure_kpa: f32,
    /// Level `linear`.
    pub linear: Answer,
    /// Level `coarse`, for the network that corrects it.
    pub coarse: Option<Answer>,
}

impl Input {
    /// Where the needle is after `travel_mm`.
    pub fn pose_after(&self, travel_mm: f32) -> Isometry3<f64> {
        let mut pose = self.patch_from_needle;
        pose.translation.vector += self.direction.cast::<f64>() * f64::from(travel_mm);
        pose
    }

    /// Signed distance (mm) of a point to the needle at `pose`, and its gradient there.
    pub fn distance(&self, pose: &Isometry3<f64>, point: &Vector3<f32>) -> (f32, Vector3<f32>) {
        let local = pose.inverse_transform_point(&Point3::from(point.cast::<f64>()));
        let (distance_mm, gradient) = self.body.distance_and_gradient(&local);
        (distance_mm as f32, (pose.rotation * gradient).cast::<f32>())
    }
}
