//! The shape of a needle: its radius and its tip, with defaults and allowed values.
//!
//! Contract: the numbers that a caller gives; [`NeedleShape::body`] turns them into the solid whose distance can be asked for.
//! Units: mm, degrees.
//!
//! Not here: where the needle is (`needle`), its bore (the needle is solid to the tissue), its bending (`effect`).

use nalgebra::{Point3, Unit, Vector3};

use super::body::{Body, SignedDistance};
use crate::range::{OutOfRange, ParameterRange};

/// Radius of the shaft.
pub const RADIUS: ParameterRange = ParameterRange {
    name: "needle radius",
    unit: "mm",
    default: 0.257,
    min: 0.01,
    max: 0.5,
    source: "default 25G; 41G cannula 0.05 mm to 20G 0.454 mm, with room for finer ones",
};

/// Radius of the rounded edge between shaft and end face. The upper bound is the radius of the needle at hand.
pub const EDGE_RADIUS: ParameterRange = ParameterRange {
    name: "edge radius",
    unit: "mm",
    default: EDGE_FRACTION_OF_RADIUS * RADIUS.default,
    min: 1e-4,
    max: RADIUS.max,
    source: "[unverified] default 10 % of the radius; below 0.1 um the edge is a knife to any mesh",
};

/// Angle between the plane of the bevel and the axis of the shaft.
pub const BEVEL_ANGLE: ParameterRange = ParameterRange {
    name: "bevel angle",
    unit: "deg",
    default: 30.0,
    min: 15.0,
    max: 75.0,
    source: "[unverified] range of ground needles; beyond 75 deg use a flat tip",
};

/// Edge radius where a scene gives none, as a fraction of the needle's radius (unverified).
pub const EDGE_FRACTION_OF_RADIUS: f64 = 0.1;

/// How the needle ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tip {
    /// Half a ball of the needle's radius.
    Hemispherical,
    /// A plane across the shaft with a rounded edge.
    Flat {
        /// Radius of the rounded edge, mm; at most the needle's radius.
        edge_radius_mm: f64,
    },
    /// A plane oblique to the shaft with a rounded edge; the sharp point lies towards local +x.
    Bevelled {
        /// Angle between the plane of the bevel and the axis of the shaft, degrees.
        angle_deg: f64,
        /// Radius of the rounded edge, mm; at most the needle's radius.
        edge_radius_mm: f64,
    },
}

impl Tip {
    /// Number of kinds.
    pub const KINDS: usize = 3;

    /// Number of its kind: 0 half a ball, 1 flat, 2 bevelled.
    pub fn kind(&self) -> usize {
        match self {
            Self::Hemispherical => 0,
            Self::Flat { .. } => 1,
            Self::Bevelled { .. } => 2,
        }
    }
}

/// Radius and tip of a needle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeedleShape {
    /// Radius of the shaft, mm.
    pub radius_mm: f64,
    /// How it ends.
    pub tip: Tip,
}

impl NeedleShape {
    /// A needle that ends in half a ball.
    pub fn hemispherical(radius_mm: f64) -> Self {
        Self { radius_mm, tip: Tip::Hemispherical }
    }

    /// A needle cut straight across, with the default edge.
    pub fn flat(radius_mm: f64) -> Self {
        let edge_radius_mm = EDGE_FRACTION_OF_RADIUS * radius_mm;
        Self { radius_mm, tip: Tip::Flat { edge_radius_mm } }
    }

    /// A needle cut at the default angle, with the default edge.
    pub fn bevelled(radius_mm: f64) -> Self {
        let edge_radius_mm = EDGE_FRACTION_OF_RADIUS * radius_mm;
        Self { radius_mm, tip: Tip::Bevelled { angle_deg: BEVEL_ANGLE.default, edge_radius_mm } }
    }

    /// Radius of the rounded edge, mm; the needle's own radius where the tip is half a ball.
    pub fn edge_radius_mm(&self) -> f64 {
        match self.tip {
            Tip::Hemispherical => self.radius_mm,
            Tip::Flat { edge_radius_mm } | Tip::Bevelled { edge_radius_mm, .. } => edge_radius_mm,
        }
    }

    /// Holds every number against its range; fails with the first that is outside, as `needle.radius_mm`, `needle.tip.…`.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        RADIUS.check("needle.radius_mm", self.radius_mm)?;
        let edge = ParameterRange { max: self.radius_mm, ..EDGE_RADIUS };
        edge.check("needle.tip.edge_radius_mm", self.edge_radius_mm())?;
        match self.tip {
            Tip::Bevelled { angle_deg, .. } => BEVEL_ANGLE.check("needle.tip.angle_deg", angle_deg),
            Tip::Hemispherical | Tip::Flat { .. } => Ok(()),
        }
    }

    /// The solid of this shape, prepared for many questions. Meaningful for a shape that passes [`validate`](Self::validate).
    pub fn body(&self) -> Body {
        Body::new(self)
    }

    /// [`Body::distance`] for a single question.
    pub fn distance(&self, local: &Point3<f64>) -> f64 {
        self.body().distance(local)
    }

    /// [`Body::signed_distance`] for a single question.
    pub fn signed_distance(&self, local: &Point3<f64>) -> SignedDistance {
        self.body().signed_distance(local)
    }

    /// [`Body::foremost_along`] for a single question.
    pub fn foremost_along(&self, inward_local: &Unit<Vector3<f64>>) -> Option<Point3<f64>> {
        self.body().foremost_along(inward_local)
    }
}
