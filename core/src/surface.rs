//! The inner surface of the retina at rest, as columns that the layers are stacked on.
//!
//! Contract: in the patch frame (origin on the surface at (x, y) = (0, 0), +z into the vitreous) every (x, y) has one [`Column`]: a
//! point of the surface and the direction in which the layers follow it. Units: mm.
//!
//! Not here: which (x, y) carry nodes (`patch`), how thick the layers are (`tissue`), deformation.

pub mod height_field;
pub mod mesh_file;
mod obj;
mod ply;
mod stl;
pub mod thinning;
pub mod triangle_mesh;

use nalgebra::{Point3, Unit, Vector3};

pub use height_field::{Folded, HeightField};
pub use triangle_mesh::{MeshError, TriangleMesh};

use crate::range::ParameterRange;

/// Radius of the eye at the inner surface of the retina.
pub const EYE_RADIUS: ParameterRange = ParameterRange {
    name: "eye radius",
    unit: "mm",
    default: 12.0,
    min: 8.0,
    max: 20.0,
    source: "axial length 23.5 mm on average (PMC4276342) gives 11.75-12 mm; bounds [unverified] from infant to highly myopic eyes",
};

/// How much thinner the retina is at the floor of the foveal pit.
pub const PIT_DEPTH: ParameterRange = ParameterRange {
    name: "depth of the foveal pit",
    unit: "mm",
    default: 0.13,
    min: 0.0,
    max: 0.22,
    source: "foveola 0.10 mm in a retina of 0.23 mm (AAO Basic and Clinical Science Course)",
};

/// Width of the foveal pit: the standard deviation of its bell.
pub const PIT_SIGMA: ParameterRange = ParameterRange {
    name: "width of the foveal pit",
    unit: "mm",
    default: 0.25,
    min: 0.1,
    max: 0.6,
    source: "the fovea's diameter of 1.5 mm taken as six standard deviations; bounds [unverified]",
};

/// Half the distance over which the height of a mesh is differenced for its normal, mm: far above rounding, far below a triangle.
const DIFFERENCE_MM: f64 = 1e-3;

/// The rest state over one (x, y) of the patch frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Point of the inner surface, patch frame, mm.
    pub surface: Point3<f64>,
    /// Direction from the vitreous through the layers, unit length, patch frame.
    pub inward: Unit<Vector3<f64>>,
    /// How much thinner the retina is here than the tissue says, mm; the layers below are where they would be without.
    pub retina_thinning_mm: f64,
}

/// The shape of the inner surface at rest.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// The plane z = 0, layers along −z.
    Flat,
    /// A ball seen from inside, its centre over the origin; layers along its radii.
    Sphere {
        /// Radius at the inner surface, mm.
        radius_mm: f64,
    },
    /// A ball seen from inside with a bell-shaped pit under the origin, which lies on the pit's floor.
    FovealPit {
        /// Radius at the inner surface without the pit, mm.
        radius_mm: f64,
        /// Depth of the pit, mm: how much thinner the retina is at its floor.
        depth_mm: f64,
        /// Standard deviation of the bell, mm, over the distance from the axis.
        sigma_mm: f64,
    },
    /// A height field over (x, y) from triangles; layers along −z.
    Mesh(HeightField),
}

/// A ball seen from inside over one (x, y), with a pit in it.
struct PittedBall {
    inward: Vector3<f64>,
    radius_mm: f64,
    sigma_mm: f64,
    thinning_mm: f64,
}

impl PittedBall {
    /// Beyond the radius the column is that of the ball's rim, lying flat.
    fn at(x: f64, y: f64, radius_mm: f64, depth_mm: f64, sigma_mm: f64) -> Self {
        let lateral_squared = x * x + y * y;
        let down = (radius_mm * radius_mm - lateral_squared).max(0.0).sqrt();
        let thinning_mm = depth_mm * (-lateral_squared / (2.0 * sigma_mm * sigma_mm)).exp();
        Self { inward: Vector3::new(x, y, -down).normalize(), radius_mm, sigma_mm, thinning_mm }
    }

    fn column(&self, depth_mm: f64) -> Column {
        // The origin lies on the surface, so the centre stands as far above it as the floor of the pit lies below the centre.
        let centre = Point3::new(0.0, 0.0, self.radius_mm + depth_mm);
        Column {
            surface: centre + self.inward * (self.radius_mm + self.thinning_mm),
            inward: Unit::new_unchecked(self.inward),
            retina_thinning_mm: self.thinning_mm,
        }
    }

    /// With n inwards, t its derivative by the angle from the axis and r(angle) the distance from the centre, the surface r n has
    /// the tangent r t + r' n, hence the normal −r n + r' t into the vitreous.
    fn normal(&self) -> Unit<Vector3<f64>> {
        let n = self.inward;
        let cos = -n.z;
        // r' = -(rho / sigma²) thinning R cos, and t = (cos n_xy / sin, sin); their product needs no division by sin.
        let slope = -self.radius_mm * self.radius_mm * cos * self.thinning_mm / (self.sigma_mm * self.sigma_mm);
        let sin_squared = n.x * n.x + n.y * n.y;
        let along = Vector3::new(cos * n.x, cos * n.y, sin_squared) * slope;
        Unit::new_normalize(along - n * (self.radius_mm + self.thinning_mm))
    }
}

impl Surface {
    /// The column over (x, y) of the patch frame, mm. Defined for all finite x and y: a ball ends at its equator, a mesh is continued
    /// as [`HeightField`] says.
    pub fn column(&self, x: f64, y: f64) -> Column {
        match self {
            Self::Flat => straight(Point3::new(x, y, 0.0)),
            Self::Sphere { radius_mm } => PittedBall::at(x, y, *radius_mm, 0.0, 1.0).column(0.0),
            Self::FovealPit { radius_mm, depth_mm, sigma_mm } => {
                PittedBall::at(x, y, *radius_mm, *depth_mm, *sigma_mm).column(*depth_mm)
            }
            Self::Mesh(field) => straight(Point3::new(x, y, field.height(x, y))),
        }
    }

    /// Unit normal of the inner surface at the column over (x, y), out of the tissue, patch frame.
    ///
    /// A mesh's is taken by differences over 2 µm: that of the triangle, or between two near their edge.
    pub fn normal(&self, x: f64, y: f64) -> Unit<Vector3<f64>> {
        match self {
            Self::Flat => Vector3::z_axis(),
            Self::Sphere { radius_mm } => PittedBall::at(x, y, *radius_mm, 0.0, 1.0).normal(),
            Self::FovealPit { radius_mm, depth_mm, sigma_mm } => {
                PittedBall::at(x, y, *radius_mm, *depth_mm, *sigma_mm).normal()
            }
            Self::Mesh(field) => {
                let h = DIFFERENCE_MM;
                let slope_x = (field.height(x + h, y) - field.height(x - h, y)) / (2.0 * h);
                let slope_y = (field.height(x, y + h) - field.height(x, y - h)) / (2.0 * h);
                Unit::new_normalize(Vector3::new(-slope_x, -slope_y, 1.0))
            }
        }
    }
}

fn straight(surface: Point3<f64>) -> Column {
    Column { surface, inward: -Vector3::z_axis(), retina_thinning_mm: 0.0 }
}
