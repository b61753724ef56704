//! The linear answer: where the needle touches, how deep it goes, and the surface around it, by layered elasticity.
//!
//! It is a level of its own and the start of every other one: it aims the mesh and gives the first displacements. The bed under the
//! contact is taken as flat, with the retina as thick as it is there; frictionless contact presses along the surface normal, so a force F along
//! d needs the normal force F / (d·n). Patch frame.

use nalgebra::{Point3, Unit, Vector3};

use super::beds::Beds;
use super::types::PredictError;
use crate::approach::{Touch, first_touch};
use crate::equilibrium::{Motion, Tool};
use crate::layered::{Indentation, LayeredError, RigidProfile, SurfaceResponse};
use crate::needle::Tip;
use crate::patch::Patch;

/// Largest angle of needle and force to the inward surface normal (degrees): beyond it the shaft, which has no end here, lies down on
/// the tissue.
pub const MAX_ANGLE_DEG: f64 = 75.0;

/// The needle's first touch, and what it presses with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Where it touches.
    pub touch: Touch,
    /// Cosine between the direction of motion and the inward normal.
    pub cosine: f64,
    /// Normal force (mN) or normal depth (mm).
    pub load: Load,
}

impl Press {
    /// Tangent of the angle between the motion and the inward normal.
    pub fn tangent(&self) -> f64 {
        (1.0 - self.cosine * self.cosine).max(0.0).sqrt() / self.cosine
    }
}

/// What is given along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// Normal force (mN).
    Force(f64),
    /// Depth beyond first touch (mm).
    Depth(f64),
}

/// The part of the needle that a contact is centred on, by a point in needle coordinates.
enum Support {
    /// A round tip's foremost point.
    Ball(Point3<f64>),
    /// The foremost point of an edge: an elongated contact.
    Edge(Point3<f64>),
    /// The middle of the end face.
    Face(Point3<f64>),
}

impl Support {
    fn point(&self) -> &Point3<f64> {
        match self {
            Support::Ball(point) | Support::Edge(point) | Support::Face(point) => point,
        }
    }
}

/// Finds the first touch and checks that the motion makes sense.
///
/// # Errors
/// [`PredictError::PointsAway`], [`PredictError::OutsidePatch`].
pub fn press(patch: &Patch, tool: &Tool, motion: &Motion) -> Result<Press, PredictError> {
    let at = tool.patch_from_needle.translation.vector;
    let inward_near = -patch.surface.normal(at.x, at.y);
    let points = tool.patch_from_needle.rotation * -Vector3::z_axis();
    check_angle("needle.direction", &points, &inward_near)?;
    let moves = if motion.force_mn.is_some() { "force_mn" } else { "needle.direction" };
    check_angle(moves, &motion.direction, &inward_near)?;
    let away = |angle_deg| PredictError::PointsAway { field: moves, angle_deg, max_deg: MAX_ANGLE_DEG };
    let touch = first_touch(&patch.surface, tool.body, &tool.patch_from_needle, &motion.direction)
        .ok_or_else(|| away(angle_deg(&motion.direction, &inward_near)))?;
    check_angle("needle.direction", &points, &touch.inward)?;
    check_angle(moves, &motion.direction, &touch.inward)?;
    let limit_mm = patch.parameters.iter().flatten().fold(0.0_f64, |limit, c| limit.max(c.abs()));
    if touch.parameter.iter().any(|c| c.abs() > limit_mm) {
        let [x_mm, y_mm] = touch.parameter;
        return Err(PredictError::OutsidePatch { x_mm, y_mm, limit_mm });
    }
    let cosine = motion.direction.dot(&touch.inward);
    let load = match motion.force_mn {
        Some(force_mn) => Load::Force(force_mn / cosine),
        None => Load::Depth((motion.travel_mm - touch.travel_mm) * cosine),
    };
    Ok(Press { touch, cosine, load })
}

fn angle_deg(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> f64 {
    a.dot(b).clamp(-1.0, 1.0).acos().to_degrees()
}

fn check_angle(
    field: &'static str,
    along: &Unit<Vector3<f64>>,
    inward: &Unit<Vector3<f64>>,
) -> Result<(), PredictError> {
    let angle_deg = angle_deg(along, inward);
    if angle_deg <= MAX_ANGLE_DEG {
        return Ok(());
    }
    Err(PredictError::PointsAway { field, angle_deg, max_deg: MAX_ANGLE_DEG })
}

fn shaft_first() -> PredictError {
    PredictError::Linear("the shaft touches before the tip".to_owned())
}

/// The bed under one contact, pressed.
pub struct LinearAnswer<'a> {
    /// What presses.
    pub press: Press,
    /// Depth along the normal (mm).
    pub depth_mm: f64,
    /// Normal force (mN).
    pub normal_force_mn: f64,
    /// Contact radius (mm).
    pub contact_radius_mm: f64,
    /// Largest mean pressure of a ring of the contact (kPa).
    pub max_pressure_kpa: f64,
    /// Centre of the contact at equilibrium, patch parameters.
    pub center: [f64; 2],
    pressed: Vec<(f64, SurfaceResponse<'a>)>,
}

impl<'a> LinearAnswer<'a> {
    /// Presses `tool` into the bed under the touch.
    ///
    /// # Errors
    /// [`PredictError::Linear`].
    pub fn new(
        beds: &'a Beds,
        patch: &Patch,
        tool: &Tool,
        tip: Tip,
        press: Press,
        direction: &Unit<Vector3<f64>>,
    ) -> Result<Self, PredictError> {
        let inward = tool.patch_from_needle.inverse_transform_unit_vector(&press.touch.inward);
        let foremost = tool.body.foremost_along(&inward).ok_or_else(shaft_first)?;
        // A tilted flat tip stands on its rim under a light load and on its face under a heavy one: whichever yields less.
        let supports = match tip {
            Tip::Hemispherical => vec![Support::Ball(foremost)],
            Tip::Flat { .. } | Tip::Bevelled { .. } => {
                vec![Support::Edge(foremost), Support::Face(Point3::new(tool.body.axis_x_mm(), 0.0, 0.0))]
            }
        };
        let mut best: Option<Self> = None;
        for support in supports {
            let offset = tool.patch_from_needle.rotation * (support.point() - foremost);
            let answer = match Self::about(beds, patch, tool, press, direction, &inward, &support, &offset) {
                // The second support may have no underside around it (the axis of a bevel seen from its side).
                Err(_) if best.is_some() => continue,
                answer => answer?,
            };
            if best.as_ref().is_none_or(|best| answer.prefers_over(best)) {
                best = Some(answer);
            }
        }
        best.ok_or_else(shaft_first)
    }

    /// Of two supports the one that yields less: less depth for the force, or more force for the depth.
    fn prefers_over(&self, other: &Self) -> bool {
        match self.press.load {
            Load::Force(_) => self.depth_mm < other.depth_mm,
            Load::Depth(_) => self.normal_force_mn > other.normal_force_mn,
        }
    }

    /// The answer for a contact around `support`, which lies `offset` from the foremost point (patch coordinates).
    #[allow(clippy::too_many_arguments)]
    fn about(
        beds: &'a Beds,
        patch: &Patch,
        tool: &Tool,
        press: Press,
        direction: &Unit<Vector3<f64>>,
        inward: &Unit<Vector3<f64>>,
        support: &Support,
        offset: &Vector3<f64>,
    ) -> Result<Self, PredictError> {
        let failed = |error: LayeredError| PredictError::Linear(error.to_string());
        let [x, y] = press.touch.parameter;
        let thinning = patch.surface.column(x, y).retina_thinning_mm;
        let mut answer = LinearAnswer {
            press,
            depth_mm: 0.0,
            normal_force_mn: 0.0,
            contact_radius_mm: 0.0,
            max_pressure_kpa: 0.0,
            center: press.touch.parameter,
            pressed: Vec::new(),
        };
        let beds = beds.around(thinning)?;
        // All beds sample a profile at the same radii.
        let radii_mm = beds.first().map_or(&[][..], |(bed, _)| bed.linear.sample_radii_mm());
        let heights = match support {
            Support::Edge(_) => tool.body.underside_by_area(inward, radii_mm),
            Support::Ball(about) | Support::Face(about) => tool.body.underside_profile(inward, about, radii_mm),
        }
        .ok_or_else(shaft_first)?;
        // The bed counts its depth from the profile's lowest point, this answer from the needle's.
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let profile = RigidProfile { heights_mm: &heights, edge: None };
        for (bed, weight) in beds {
            let linear = &bed.linear;
            let indentation: Indentation = match press.load {
                Load::Force(force) => linear.indent_by_force(&profile, force),
                Load::Depth(depth) => linear.indent_by_depth(&profile, (depth - lowest).max(0.0)),
            }
            .map_err(failed)?;
            answer.depth_mm += weight * (indentation.depth_mm + lowest);
            answer.normal_force_mn += weight * indentation.normal_force_mn;
            answer.contact_radius_mm += weight * indentation.contact_radius_mm;
            let pressure = linear.ring_pressures_kpa(&indentation).into_iter().fold(0.0, f64::max);
            answer.max_pressure_kpa += weight * pressure;
            answer.pressed.push((weight, linear.surface_response(&indentation)));
        }
        let lateral = direction.into_inner() - press.touch.inward.into_inner() * press.cosine;
        let shift = lateral * (answer.depth_mm / press.cosine) + offset;
        answer.center = [x + shift.x, y + shift.y];
        Ok(answer)
    }

    /// Travel of the needle at equilibrium (mm).
    pub fn travel_mm(&self) -> f64 {
        self.press.touch.travel_mm + self.depth_mm / self.press.cosine
    }

    /// Displacement of the surface point with these patch parameters (mm).
    pub fn displacement(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        let inward = self.press.touch.inward.into_inner();
        let offset = Vector3::new(x - self.center[0], y - self.center[1], 0.0);
        let distance = offset.norm();
        let outwards = (offset - inward * offset.dot(&inward)).try_normalize(0.0).unwrap_or_default();
        self.pressed
            .iter()
            .map(|(weight, response)| {
                let (radial, normal) = response.displacement(distance);
                (outwards * radial - inward * normal) * *weight
            })
            .sum()
    }
}
