//! The underside of a needle as a profile: how far above its foremost point the needle stands at a lateral offset.
//!
//! Contract: heights are measured along the outward direction from the plane that touches the needle's foremost point, and averaged
//! around an axis, because a contact law that knows one radius needs one height. Exact to 1e-6 mm. Units: mm.
//!
//! Not here: the contact law, where a ray meets the needle (`rays`).

use nalgebra::{Point3, Unit, Vector3};
use pulp::Arch;

use super::body::Body;
use super::rays::Rays;

/// Azimuths over which a height is averaged.
const AZIMUTHS: usize = 16;

/// Share of the azimuths that must meet the needle for a height to be finite.
const LEAST_HITS: f64 = 0.5;

/// Two directions closer than this are the same one, two lengths closer than this (mm) too.
const ALIGNED: f64 = 1e-12;

impl Body {
    /// The needle's height above its foremost point at each of `radii_mm` from the line through `about` along `inward_local`,
    /// averaged over 16 azimuths; one height for each radius, mm.
    ///
    /// `inward_local` is the surface normal into the tissue and `about` a point, both needle-local; the usual point is
    /// [`foremost_along`](Self::foremost_along) the same direction, another (on the axis of a tilted flat tip) keeps the profile
    /// from jumping with it. Radii are not negative and fastest in ascending order. A height is the average over the azimuths
    /// that meet the needle, and infinite when fewer than half do. `None` when the direction does not point forwards.
    pub fn underside_profile(
        &self,
        inward_local: &Unit<Vector3<f64>>,
        about: &Point3<f64>,
        radii_mm: &[f64],
    ) -> Option<Vec<f64>> {
        let walked = self.walk(inward_local, about, radii_mm)?;
        let height = |index: usize| match mean_height(&walked, index) {
            Some((height, share)) if share >= LEAST_HITS => height,
            _ => f64::INFINITY,
        };
        Some((0..radii_mm.len()).map(height).collect())
    }

    /// The needle's height above its foremost point as that of the solid of revolution with the same area at each height; one height
    /// for each of `radii_mm` (ascending), mm, infinite where the needle has not that much area.
    ///
    /// A tilted edge touches along an ellipse, and a ball of the geometric mean of its two radii of curvature, which has the same
    /// areas, yields about as much under the same force (Johnson, *Contact Mechanics*, §4.2); the mean height would be that of
    /// the sharper curvature. `None` when the direction does not point forwards.
    pub fn underside_by_area(&self, inward_local: &Unit<Vector3<f64>>, radii_mm: &[f64]) -> Option<Vec<f64>> {
        let walked = self.walk(inward_local, &self.foremost_along(inward_local)?, radii_mm)?;
        // Squared radius of equal area up to the heights of a mean section; along each azimuth r² is linear between samples,
        // which is exact for a parabola.
        let mut sections = Vec::with_capacity(radii_mm.len());
        let mut at = vec![0; walked.len()];
        for index in 0..radii_mm.len() {
            let Some((height, _)) = mean_height(&walked, index) else { break };
            let mut area = 0.0;
            for ((weight, heights), at) in walked.iter().zip(&mut at) {
                while *at + 1 < heights.len() && heights[*at + 1] <= height {
                    *at += 1;
                }
                let squared = radii_mm[*at] * radii_mm[*at];
                let rest = match heights.get(*at + 1) {
                    Some(next) if *next > heights[*at] => {
                        let part = (height - heights[*at]) / (next - heights[*at]);
                        part * (radii_mm[*at + 1] * radii_mm[*at + 1] - squared)
                    }
                    _ => 0.0,
                };
                area += weight * (squared + rest);
            }
            if sections.last().is_none_or(|&(before, _)| area > before) {
                sections.push((area, height));
            }
        }
        let mut upper = 0;
        let profile = radii_mm.iter().map(|radius| {
            let area = radius * radius;
            while upper < sections.len() && sections[upper].0 < area {
                upper += 1;
            }
            match (upper.checked_sub(1).map(|lower| sections[lower]), sections.get(upper)) {
                // The outermost section's area is the outermost radius's but for rounding where the needle is round.
                (Some((last, height)), None) if area <= last * (1.0 + ALIGNED) => height,
                (_, None) => f64::INFINITY,
                (None, Some(&(_, height))) => height,
                (Some((a0, h0)), Some(&(a1, h1))) => h0 + (area - a0) / (a1 - a0) * (h1 - h0),
            }
        });
        Some(profile.collect())
    }

    /// Along each azimuth: its share in an average, and its heights above the foremost point at `radii_mm` until it misses, mm.
    fn walk(
        &self,
        inward_local: &Unit<Vector3<f64>>,
        about: &Point3<f64>,
        radii_mm: &[f64],
    ) -> Option<Vec<(f64, Vec<f64>)>> {
        let lowest = self.foremost_along(inward_local)?;
        let up = -inward_local.into_inner();
        let base = about - up * up.dot(&(about - lowest));
        let across = lateral_axis(&up);
        // A ball about its foremost point is the same along every azimuth, until the one towards the shaft's lean comes to the shaft.
        let centred = self.is_round() && (about - lowest).norm() < ALIGNED;
        let ball = radii_mm.iter().map_while(|&radius| self.height_on_ball(&(base + across * radius), &up));
        let ball: Vec<f64> = ball.take(if centred { radii_mm.len() } else { 0 }).collect();
        let (directions, weights): (Vec<_>, Vec<_>) = self.azimuths(&up, &across, &base).into_iter().unzip();
        let rest = Rays { body: self, base, up, directions: &directions, radii_mm: &radii_mm[ball.len()..] };
        let met = Arch::new().dispatch(rest);
        Some(weights.into_iter().zip(met).map(|(weight, met)| (weight, [ball.as_slice(), &met].concat())).collect())
    }

    /// The height at which the ray from `origin` along `up` meets the ball of a round tip, mm; `None` where it misses it or meets the shaft first.
    fn height_on_ball(&self, origin: &Point3<f64>, up: &Vector3<f64>) -> Option<f64> {
        let from_centre = origin - Point3::new(0.0, 0.0, self.edge_radius);
        let towards = -from_centre.dot(up);
        let half_chord_squared = towards * towards - (from_centre.norm_squared() - self.edge_radius * self.edge_radius);
        let height = towards - half_chord_squared.max(0.0).sqrt();
        (half_chord_squared >= 0.0 && from_centre.z + height * up.z <= 0.0).then_some(height)
    }

    /// The lateral directions to walk and the share of each in the average; mirrored and equal directions are walked once.
    fn azimuths(&self, up: &Vector3<f64>, across: &Vector3<f64>, base: &Point3<f64>) -> Vec<(Vector3<f64>, f64)> {
        let aside = up.cross(across);
        let revolved = self.plane_normal.0 == 0.0;
        let on_axis = (base.x - self.axis_x).hypot(base.y) < ALIGNED;
        if revolved && on_axis && up.x.hypot(up.y) < ALIGNED {
            return vec![(*across, 1.0)];
        }
        // `across` lies in the plane of the axis and `up`; a bevel is its own mirror image only if that is its own plane.
        let from_axis = Vector3::new(base.x - self.axis_x, base.y, 0.0);
        let mirrored =
            aside.dot(&from_axis).abs() < ALIGNED && (revolved || up.y.abs() < ALIGNED) && aside.z.abs() < ALIGNED;
        let walked = if mirrored { AZIMUTHS / 2 + 1 } else { AZIMUTHS };
        (0..walked)
            .map(|index| {
                let (sin, cos) = libm::sincos(index as f64 * std::f64::consts::TAU / AZIMUTHS as f64);
                let twice = mirrored && index != 0 && index != AZIMUTHS / 2;
                let weight = if twice { 2.0 } else { 1.0 } / AZIMUTHS as f64;
                (across * cos + aside * sin, weight)
            })
            .collect()
    }
}

/// Mean height at one radius over the azimuths that meet the needle there, and their share.
fn mean_height(walked: &[(f64, Vec<f64>)], index: usize) -> Option<(f64, f64)> {
    let hits = walked.iter().filter_map(|(weight, heights)| Some((weight, heights.get(index)?)));
    let (sum, share) = hits.fold((0.0, 0.0), |(sum, share), (w, height)| (sum + w * height, share + w));
    (share > 0.0).then(|| (sum / share, share))
}

/// A unit vector across `up`: towards the shaft's lean, or the needle's own x where the shaft stands upright.
fn lateral_axis(up: &Vector3<f64>) -> Vector3<f64> {
    let leaning = Vector3::z() - up * up.z;
    let towards = if leaning.norm() < ALIGNED { Vector3::x() - up * up.x } else { leaning };
    towards.normalize()
}
