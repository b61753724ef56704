//! Where rays meet the needle: several azimuths side by side, from one radius to the next.
//!
//! The body is convex, so along a ray from the plane that touches it the distance falls to its first zero as a convex function: Newton's method
//! from before the zero never passes it, from just inside it steps back before it, and a distance that stops falling is a miss. From
//! one radius to the next a parabola through the last heights gives the start, so one or two steps are the rule. A ball needs none.
//!
//! Not here: which rays (`underside`).

use nalgebra::{Point3, Vector3};
use pulp::{Simd, WithSimd};

use super::body::Body;

/// A ray has arrived when its step is below this, mm: a tenth of the accuracy promised, for rays that graze and only halve the way.
const STEP_TOLERANCE_MM: f64 = 1e-7;
/// Newton steps after which a grazing ray counts as a miss.
const STEP_LIMIT: usize = 60;
/// As many numbers as a vector holds, at most.
const MOST_LANES: usize = 8;

/// Parallel rays at ascending radii along azimuths; a lane of a vector is an azimuth.
pub(super) struct Rays<'a> {
    /// The needle.
    pub(super) body: &'a Body,
    /// Where radius and height are zero.
    pub(super) base: Point3<f64>,
    /// The rays' direction.
    pub(super) up: Vector3<f64>,
    /// The azimuths.
    pub(super) directions: &'a [Vector3<f64>],
    /// Distances of the rays from `base` (mm).
    pub(super) radii_mm: &'a [f64],
}

impl WithSimd for Rays<'_> {
    /// Along each azimuth the heights at the radii until one misses, mm.
    type Output = Vec<Vec<f64>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        // No closures here or below: one that is not inlined loses the vectors.
        let mut met = Vec::with_capacity(self.directions.len());
        for group in self.directions.chunks(S::F64_LANES) {
            self.follow(simd, group, &mut met);
        }
        met
    }
}

/// The last three radii at which rays met the needle and their heights, mm; the newest last.
struct Hits<S: Simd> {
    radii: [f64; 3],
    heights: [S::f64s; 3],
    count: usize,
}

impl<S: Simd> Hits<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Hits { radii: [0.0; 3], heights: [simd.splat_f64s(0.0); 3], count: 0 }
    }

    /// The heights expected at `radius`, mm: on the parabola through the last three hits.
    #[inline(always)]
    fn guess(&self, simd: S, radius: f64) -> S::f64s {
        let ([r0, r1, r2], [h0, h1, h2]) = (self.radii, self.heights);
        if self.count < 3 || r0 == r1 || r1 == r2 {
            return h2;
        }
        let first = simd.div_f64s(simd.sub_f64s(h1, h0), simd.splat_f64s(r1 - r0));
        let second = simd.div_f64s(simd.sub_f64s(h2, h1), simd.splat_f64s(r2 - r1));
        let bend = simd.mul_f64s(simd.splat_f64s((radius - r1) / (r2 - r0)), simd.sub_f64s(second, first));
        simd.add_f64s(h2, simd.mul_f64s(simd.splat_f64s(radius - r2), simd.add_f64s(second, bend)))
    }

    #[inline(always)]
    fn record(&mut self, radius: f64, heights: S::f64s) {
        self.radii = [self.radii[1], self.radii[2], radius];
        self.heights = [self.heights[1], self.heights[2], heights];
        self.count += 1;
    }
}

/// Three components of points, lane by lane.
type Points<S> = [<S as Simd>::f64s; 3];

impl Rays<'_> {
    /// Adds the heights along as many azimuths as a vector holds, or fewer.
    #[inline(always)]
    fn follow<S: Simd>(&self, simd: S, group: &[Vector3<f64>], met: &mut Vec<Vec<f64>>) {
        let mut lanes = [[0.0; MOST_LANES]; 3];
        for lane in 0..S::F64_LANES {
            let direction = &group[lane.min(group.len() - 1)];
            (lanes[0][lane], lanes[1][lane], lanes[2][lane]) = (direction.x, direction.y, direction.z);
        }
        let (mut directions, mut base, mut up) =
            ([simd.splat_f64s(0.0); 3], [simd.splat_f64s(0.0); 3], [simd.splat_f64s(0.0); 3]);
        for k in 0..3 {
            directions[k] = simd.partial_load_f64s(&lanes[k][..S::F64_LANES]);
            base[k] = simd.splat_f64s(self.base[k]);
            up[k] = simd.splat_f64s(self.up[k]);
        }
        let first = met.len();
        for _ in group {
            met.push(Vec::with_capacity(self.radii_mm.len()));
        }
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let mut going = simd.less_than_f64s(zero, one);
        let mut hits = Hits::none(simd);
        let mut previous = 0.0;
        for &radius in self.radii_mm {
            if radius < previous {
                hits = Hits::none(simd);
            }
            previous = radius;
            let mut origins = base;
            for k in 0..3 {
                origins[k] = simd.add_f64s(base[k], simd.mul_f64s(directions[k], simd.splat_f64s(radius)));
            }
            let (heights, found) = self.heights(simd, &origins, &up, hits.guess(simd, radius), going);
            going = simd.and_m64s(going, found);
            if none(simd, going) {
                break;
            }
            hits.record(radius, heights);
            let (mut lanes, mut goes) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
            simd.partial_store_f64s(&mut lanes[..S::F64_LANES], heights);
            simd.partial_store_f64s(&mut goes[..S::F64_LANES], simd.select_f64s(going, one, zero));
            for (lane, met) in met[first..].iter_mut().enumerate() {
                if goes[lane] > 0.0 {
                    met.push(lanes[lane]);
                }
            }
        }
    }

    /// Heights at which the rays of `going` first meet the needle, and which of them do.
    #[inline(always)]
    fn heights<S: Simd>(
        &self,
        simd: S,
        origins: &Points<S>,
        up: &Points<S>,
        guess: S::f64s,
        going: S::m64s,
    ) -> (S::f64s, S::m64s) {
        let zero = simd.splat_f64s(0.0);
        let (mut heights, mut found) = match self.body.is_round() {
            true => self.heights_on_ball(simd, origins, up),
            false => (zero, simd.less_than_f64s(zero, zero)),
        };
        // A guess may lie beyond the needle, where the distance no longer falls; the touching plane never does.
        for start in [guess, zero] {
            let sought = simd.and_m64s(going, not(simd, found));
            if none(simd, sought) {
                break;
            }
            let (at, arrived) = self.advance(simd, origins, up, start, sought);
            heights = simd.select_f64s(arrived, at, heights);
            found = simd.or_m64s(found, arrived);
        }
        (heights, found)
    }

    /// Heights at which rays meet the ball of a round tip, mm; those that miss it or meet the shaft first are not found.
    #[inline(always)]
    fn heights_on_ball<S: Simd>(&self, simd: S, origins: &Points<S>, up: &Points<S>) -> (S::f64s, S::m64s) {
        let radius = self.body.edge_radius;
        let from_centre = [origins[0], origins[1], simd.sub_f64s(origins[2], simd.splat_f64s(radius))];
        let zero = simd.splat_f64s(0.0);
        let towards = simd.sub_f64s(zero, dot(simd, &from_centre, up));
        let beyond = simd.sub_f64s(dot(simd, &from_centre, &from_centre), simd.splat_f64s(radius * radius));
        let half_chord_squared = simd.sub_f64s(simd.mul_f64s(towards, towards), beyond);
        let height = simd.sub_f64s(towards, simd.sqrt_f64s(simd.max_f64s(half_chord_squared, zero)));
        let above_centre = simd.add_f64s(from_centre[2], simd.mul_f64s(height, up[2]));
        let meets = simd.less_than_or_equal_f64s(zero, half_chord_squared);
        (height, simd.and_m64s(meets, simd.less_than_or_equal_f64s(above_centre, zero)))
    }

    /// Newton's method along the rays that are `sought`, and which of them arrive: not those along which the distance does not fall.
    #[inline(always)]
    fn advance<S: Simd>(
        &self,
        simd: S,
        origins: &Points<S>,
        up: &Points<S>,
        start: S::f64s,
        mut sought: S::m64s,
    ) -> (S::f64s, S::m64s) {
        let zero = simd.splat_f64s(0.0);
        let small = simd.splat_f64s(STEP_TOLERANCE_MM);
        let small_on_edge = simd.splat_f64s(STEP_TOLERANCE_MM * self.body.edge_radius);
        let (mut at, mut found) = (start, simd.less_than_f64s(zero, zero));
        for _ in 0..STEP_LIMIT {
            let mut points = *origins;
            for k in 0..3 {
                points[k] = simd.add_f64s(origins[k], simd.mul_f64s(up[k], at));
            }
            let (distance, slope) = self.body.distances_along(simd, &points, up);
            let steepness = simd.sub_f64s(zero, slope);
            let step = simd.div_f64s(distance, steepness);
            sought = simd.and_m64s(sought, simd.less_than_f64s(zero, steepness));
            at = simd.select_f64s(sought, simd.add_f64s(at, step), at);
            // What a step leaves is half its square times curvature over slope; nothing is curved by more than two edges.
            let arrived = simd.or_m64s(
                simd.less_than_f64s(simd.abs_f64s(step), small),
                simd.less_than_f64s(simd.mul_f64s(step, step), simd.mul_f64s(small_on_edge, steepness)),
            );
            found = simd.or_m64s(found, simd.and_m64s(sought, arrived));
            sought = simd.and_m64s(sought, not(simd, arrived));
            if none(simd, sought) {
                break;
            }
        }
        (at, found)
    }
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &Points<S>, b: &Points<S>) -> S::f64s {
    let xy = simd.add_f64s(simd.mul_f64s(a[0], b[0]), simd.mul_f64s(a[1], b[1]));
    simd.add_f64s(xy, simd.mul_f64s(a[2], b[2]))
}

/// Whether no lane is set.
#[inline(always)]
fn none<S: Simd>(simd: S, mask: S::m64s) -> bool {
    simd.first_true_m64s(mask) == S::F64_LANES
}

/// The lanes that are not set.
#[inline(always)]
fn not<S: Simd>(simd: S, mask: S::m64s) -> S::m64s {
    let zero = simd.splat_f64s(0.0);
    simd.xor_m64s(mask, simd.less_than_or_equal_f64s(zero, zero))
}
