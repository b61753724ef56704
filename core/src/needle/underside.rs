//! The underside of a needle as a profile: how far above its foremost point the needle stands at a lateral offset.
//!
//! Contract: heights are measured along the outward direction from the plane that touches the needle's foremost point, and averaged
//! around an axis, because a contact law that knows one radius needs one height. Exact to 1e-6 mm. Units: mm.
//!
//! The body is convex, so along a ray from that plane the distance falls to its first zero as a convex function: Newton's method
//! from below never passes the zero, and a distance that stops falling is a miss. Along one azimuth the height is convex too, so the
//! chord through the last two heights, extended, is a start from below for the next.
//!
//! Not here: the contact law.

use nalgebra::{Point3, Unit, Vector3};

use super::body::Body;

/// Azimuths over which a height is averaged.
const AZIMUTHS: usize = 16;

/// Share of the azimuths that must meet the needle for a height to be finite.
const LEAST_HITS: f64 = 0.5;

/// A ray has arrived when its next step is below this, mm; a thousandth of the accuracy promised.
const STEP_TOLERANCE_MM: f64 = 1e-9;

/// Newton steps after which a grazing ray counts as a miss; each at least halves what is left of the way.
const STEP_LIMIT: usize = 60;

/// Two directions closer than this are the same one, two lengths closer than this (mm) too.
const ALIGNED: f64 = 1e-12;

/// The way from one radius to the next along an azimuth.
#[derive(Clone, Copy, Default)]
struct Walk {
    /// Radius and height of the last two hits, mm; the newest last.
    hits: [Option<(f64, f64)>; 2],
    missed: bool,
}

impl Walk {
    /// A height that is not above the needle at `radius`, mm.
    fn start(&self, radius: f64) -> f64 {
        match self.hits {
            [Some((r0, h0)), Some((r1, h1))] if r1 > r0 => {
                let ahead = h1 + (h1 - h0) / (r1 - r0) * (radius - r1);
                // Rounding of two near heights must not lift the start above the needle.
                (ahead - STEP_TOLERANCE_MM * (radius - r0) / (r1 - r0)).max(0.0)
            }
            _ => 0.0,
        }
    }

    fn record(&mut self, radius: f64, height: Option<f64>) {
        match height {
            Some(height) => self.hits = [self.hits[1], Some((radius, height))],
            None => self.missed = true,
        }
    }
}

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
        let lowest = self.foremost_along(inward_local)?;
        let up = -inward_local.into_inner();
        let base = about - up * up.dot(&(about - lowest));
        let across = lateral_axis(&up);
        let azimuths = self.azimuths(&up, &across, &base);
        let mut walks = [Walk::default(); AZIMUTHS];
        let mut previous = 0.0;
        let mut heights = Vec::with_capacity(radii_mm.len());
        for &radius in radii_mm {
            if radius < previous {
                walks = [Walk::default(); AZIMUTHS];
            }
            previous = radius;
            let (mut sum, mut hits) = (0.0, 0.0);
            for (walk, (direction, weight)) in walks.iter_mut().zip(&azimuths) {
                if walk.missed {
                    continue;
                }
                let height =
                    self.height_on_ray(&(base + direction * radius), &up, walk.start(radius));
                walk.record(radius, height);
                if let Some(height) = height {
                    sum += weight * height;
                    hits += weight;
                }
            }
            heights.push(if hits >= LEAST_HITS {
                sum / hits
            } else {
                f64::INFINITY
            });
        }
        Some(heights)
    }

    /// The lateral directions to walk and the share of each in the average; mirrored and equal directions are walked once.
    fn azimuths(
        &self,
        up: &Vector3<f64>,
        across: &Vector3<f64>,
        base: &Point3<f64>,
    ) -> Vec<(Vector3<f64>, f64)> {
        let aside = up.cross(across);
        let revolved = self.plane_normal.0 == 0.0;
        let on_axis = (base.x - self.axis_x).hypot(base.y) < ALIGNED;
        if revolved && on_axis && up.x.hypot(up.y) < ALIGNED {
            return vec![(*across, 1.0)];
        }
        // `across` lies in the plane of the axis and `up`; a bevel is its own mirror image only if that is its own plane.
        let from_axis = Vector3::new(base.x - self.axis_x, base.y, 0.0);
        let mirrored = aside.dot(&from_axis).abs() < ALIGNED
            && (revolved || up.y.abs() < ALIGNED)
            && aside.z.abs() < ALIGNED;
        let walked = if mirrored { AZIMUTHS / 2 + 1 } else { AZIMUTHS };
        (0..walked)
            .map(|index| {
                let (sin, cos) =
                    libm::sincos(index as f64 * std::f64::consts::TAU / AZIMUTHS as f64);
                let twice = mirrored && index != 0 && index != AZIMUTHS / 2;
                let weight = if twice { 2.0 } else { 1.0 } / AZIMUTHS as f64;
                (across * cos + aside * sin, weight)
            })
            .collect()
    }

    /// Height at which the ray from `origin` along `up` meets the needle, mm; `start` is not above it. `None` when it misses.
    fn height_on_ray(&self, origin: &Point3<f64>, up: &Vector3<f64>, start: f64) -> Option<f64> {
        let mut height = start;
        for _ in 0..STEP_LIMIT {
            let (distance, slope) = self.distance_along(&(origin + up * height), up);
            // At or, by rounding, just inside the needle: the start from below was the answer.
            if distance <= 0.0 {
                return Some(height);
            }
            if slope >= 0.0 {
                return None;
            }
            let step = distance / -slope;
            height += step;
            if step < STEP_TOLERANCE_MM {
                return Some(height);
            }
        }
        None
    }
}

/// A unit vector across `up`: towards the shaft's lean, or the needle's own x where the shaft stands upright.
fn lateral_axis(up: &Vector3<f64>) -> Vector3<f64> {
    let leaning = Vector3::z() - up * up.z;
    let towards = if leaning.norm() < ALIGNED {
        Vector3::x() - up * up.x
    } else {
        leaning
    };
    towards.normalize()
}
