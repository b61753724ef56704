//! One sample: what a level of prediction may know of a request, and what the reference level answered.
//!
//! Units: mm, mN, kPa. Everything is in the patch frame (origin on the inner surface, +z into the vitreous), of 64 nodes row by row, x fastest.
//! A sample is one load step of an indentation path: the needle is driven from its pose along a unit direction, and the force that the tissue
//! resists with along that direction is the force of the request. Pose control at that travel and force control with that force have the same equilibrium.
//!
//! Not here: how samples are made (`dataset`), what a network makes of them.

/// Nodes of a patch.
pub const NODES: usize = 64;

/// A vector for each node of the patch.
pub type Field = [[f32; 3]; NODES];

/// Which part of a data set a sample belongs to: all samples of a path, together with their mirror images, share one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Split {
    /// Weights are fitted to it.
    Train = 0,
    /// Stops the training and calibrates the expected error.
    Validation = 1,
    /// Measures the error, once.
    Test = 2,
    /// The extremes of the ranges; never trained on.
    Hard = 3,
    /// Beyond the ranges; never trained on.
    Outside = 4,
}

impl Split {
    /// Every split.
    pub const ALL: [Self; 5] = [Self::Train, Self::Validation, Self::Test, Self::Hard, Self::Outside];

    /// Its name in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
            Self::Hard => "hard",
            Self::Outside => "outside",
        }
    }
}

/// How the needle ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipShape {
    /// 0 hemispherical, 1 flat, 2 bevelled.
    pub kind: u8,
    /// Radius of the shaft (mm).
    pub radius_mm: f32,
    /// Radius of the rounded edge; the needle's own where the tip is half a ball (mm).
    pub edge_radius_mm: f32,
    /// Angle between bevel and axis; 90 for the other tips (degrees).
    pub bevel_deg: f32,
}

/// The tissue under the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueNumbers {
    /// Thickness of retina (where the needle touches: a pit thins it), choroid, sclera (mm).
    pub thickness_mm: [f32; 3],
    /// Young's modulus of retina, choroid, sclera (kPa).
    pub youngs_modulus_kpa: [f32; 3],
    /// Poisson's ratio of retina, choroid, sclera.
    pub poisson_ratio: [f32; 3],
}

/// What a level answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelAnswer {
    /// Displacement of each node (mm).
    pub displacement_mm: Field,
    /// Travel of the needle along the direction (mm).
    pub travel_mm: f32,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: [f32; 3],
}

/// One load step of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The path it belongs to.
    pub path: u32,
    /// Load step within the path, from 0.
    pub step: u32,
    /// The part of the data set.
    pub split: Split,
    /// Scene: index among the built-in scenes' names.
    pub scene: u8,
    /// Positions of the nodes at rest (mm).
    pub rest_mm: Field,
    /// Unit normals of the nodes at rest.
    pub rest_normal: Field,
    /// The needle.
    pub tip: TipShape,
    /// Its foremost point before it moves (mm).
    pub tip_mm: [f32; 3],
    /// Rotation from needle-local to patch coordinates, x, y, z, w.
    pub orientation_xyzw: [f32; 4],
    /// Unit direction in which it is driven.
    pub direction: [f32; 3],
    /// Force along the direction (mN).
    pub force_mn: f32,
    /// The tissue.
    pub tissue: TissueNumbers,
    /// Where the needle first touches the surface at rest (mm).
    pub touch_mm: [f32; 3],
    /// Unit inward normal of the surface there.
    pub inward: [f32; 3],
    /// Travel at first touch (mm).
    pub touch_travel_mm: f32,
    /// Centre of the contact as linear elasticity expects it, on the surface at rest (mm).
    pub linear_center_mm: [f32; 3],
    /// Depth of the linear answer along the inward normal (mm).
    pub linear_depth_mm: f32,
    /// Contact radius of the linear answer (mm).
    pub linear_contact_radius_mm: f32,
    /// Largest pressure of the linear answer (kPa).
    pub linear_pressure_kpa: f32,
    /// Level `linear` at this force.
    pub linear: LevelAnswer,
    /// Level `coarse` at this force; `None` where it has no answer.
    pub coarse: Option<LevelAnswer>,
    /// The reference answer.
    pub truth: LevelAnswer,
    /// Estimated error of the reference answer's worst node (mm).
    pub truth_error_mm: f32,
}
