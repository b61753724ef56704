//! Friction with its history: a face on a spring, dragged to and fro by a flat needle.
//!
//! Closed form, the hysteresis of a spring and a slider: the face follows the needle, short of the creep y with µ N f₁(y) = k X, until its spring bears µ N; there it
//! stays while the needle slides on. Turned back, it sticks again, and slides the other way once the needle has come back by 2 µ N/k and twice the creep. A closed loop
//! of the needle costs 2 µ N times the way slid each way.

use nalgebra::{Rotation3, Vector3};
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::contact::ContactFaces;
use retina_core::effects::friction::{Friction, RubbingPoint};
use retina_core::mesh::element::{FACE_NODES, NODE_OFFSETS, TOP_NODES};

/// ε (mm).
const FULL_SLIP_MM: f64 = 5e-4;
/// Half of the face's edge (mm).
const HALF_EDGE_MM: f64 = 0.1;
/// Stiffness of the spring (mN/mm).
const SPRING_MN_PER_MM: f64 = 20.0;
const NORMAL_MN: f64 = 0.8;

/// A face that only moves as a whole, on its spring.
struct Slider {
    faces: ContactFaces,
    rest: Vec<f64>,
    points: Vec<Vec<RubbingPoint>>,
    /// Where the face is (mm).
    at: Vector3<f64>,
}

impl Slider {
    fn new(coefficient: f64) -> Self {
        let rest: Vec<f64> = TOP_NODES
            .iter()
            .flat_map(|&a| [NODE_OFFSETS[a][0], NODE_OFFSETS[a][1], 1].map(|c| HALF_EDGE_MM * (c as f64 - 1.0)))
            .chain([0.0; 3])
            .collect();
        let vertices = (0..=FACE_NODES as u32).collect();
        let stencils = Stencils { group_size: FACE_NODES + 1, vertices };
        let faces = ContactFaces::new(&stencils, &rest, 3);
        let share = coefficient * NORMAL_MN / faces.areas(0).iter().sum::<f64>();
        let place = |point: usize| -> Vector3<f64> {
            let node = |a: usize| Vector3::from_row_slice(&rest[3 * a..][..3]);
            faces.values(point).iter().enumerate().map(|(a, value)| node(a) * *value).sum()
        };
        let rubbing = |(point, area): (usize, &f64)| RubbingPoint {
            point,
            limit_mn: share * area,
            normal: -Vector3::z(),
            anchor: place(point),
        };
        let points = vec![faces.areas(0).iter().enumerate().map(rubbing).collect()];
        Slider { faces, points, at: Vector3::zeros(), rest }
    }

    /// Positions with the face at `at` and the needle at `needle`, as the effect sees them.
    fn local(&self, at: Vector3<f64>, needle: Vector3<f64>) -> Vec<f64> {
        let n = FACE_NODES + 1;
        let moved = |a: usize, k: usize| if a < FACE_NODES { at[k] } else { needle[k] };
        (0..3 * n).map(|i| self.rest[3 * (i % n) + i / n] + moved(i % n, i / n)).collect()
    }

    /// Moves the needle; the force that it drags the face with (mN) and what the slip lost (µJ). Sticking points are anchored where the last motion left them.
    fn drag(&mut self, needle: Vector3<f64>) -> (Vector3<f64>, f64) {
        let points = self.points.clone();
        let friction = Friction { faces: &self.faces, points, full_slip_mm: FULL_SLIP_MM };
        let n = FACE_NODES + 1;
        let dragging = |current: &[f64]| -> Vector3<f64> {
            let mut out = vec![0.0; 3 * n];
            friction.add_gradient(&Local { current, group: 0, predicted: &[] }, &mut out);
            Vector3::from_fn(|k, _| out[(k + 1) * n - 1])
        };
        // The drag falls and the spring's pull rises with the way of the face, which lies on the needle's: bisection.
        let direction = (needle - self.at).try_normalize(0.0).unwrap_or(Vector3::x());
        let bound = (needle - self.at).norm() + 1.0;
        let (mut low, mut high) = (-bound, bound);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            let at = self.at + direction * middle;
            let free = dragging(&self.local(at, needle)) - at * SPRING_MN_PER_MM;
            if free.dot(&direction) > 0.0 { low = middle } else { high = middle }
        }
        self.at += direction * low;
        let current = self.local(self.at, needle);
        let local = Local { current: &current, group: 0, predicted: &[] };
        let force = dragging(&current);
        let mut lost = 0.0;
        for (rubbing, share) in
            self.points[0].iter_mut().zip(friction.used(&local).map(|(point, used)| point.limit_mn * used))
        {
            let anchor = friction.dragged(&local, rubbing);
            // The anchor gives way against the force on the needle.
            lost += -share * force.normalize().dot(&(anchor - rubbing.anchor));
            rubbing.anchor = anchor;
        }
        (force, lost)
    }
}

/// f₁⁻¹: the creep (mm) at this share of the limit.
fn creep(share: f64) -> f64 {
    FULL_SLIP_MM * (1.0 - (1.0 - share).sqrt())
}

#[test]
fn a_dragged_face_sticks_slips_and_sticks_again_when_turned_back() {
    for (coefficient, step_mm) in [(0.3, 1e-3), (1.0, 7e-4), (0.3, 1e-2)] {
        let limit = coefficient * NORMAL_MN;
        // The path in a plane that is turned, so that no axis is special.
        let along = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.7) * Vector3::x();
        let mut slider = Slider::new(coefficient);
        let furthest = 3.0 * limit / SPRING_MN_PER_MM;
        let (mut way, mut work, mut dissipated) = (0.0_f64, 0.0, 0.0);
        let mut last = 0.0;
        let mut turned_at = None;
        let mut seen = [0usize; 3];
        // Out, back as far the other way, and out again: the second half of it is a closed loop.
        for (target, sign) in [(furthest, 1.0), (-furthest, -1.0), (furthest, 1.0)] {
            while (target - way) * sign > 1e-12 {
                let next = if (target - way).abs() < step_mm { target } else { way + sign * step_mm };
                let (force, lost) = slider.drag(along * next);
                let pull = force.dot(&along);
                assert!((force - along * pull).norm() < 1e-9 * limit, "along the way: {force}");
                assert!(pull.abs() <= limit * (1.0 + 1e-12), "beyond µ N: {pull} of {limit}");
                assert!(lost >= -1e-15, "friction gave back {lost} µJ");
                // Stick from where it turned: the force falls along the spring, short of the creep; then µ N.
                let exact = match turned_at {
                    None => {
                        let held = slider.at.dot(&along) * SPRING_MN_PER_MM;
                        assert!(
                            (next - held / SPRING_MN_PER_MM - creep(held / limit)).abs() < 1e-9
                                || held > 0.9998 * limit
                        );
                        (SPRING_MN_PER_MM * (next - creep((held / limit).min(1.0)))).min(limit)
                    }
                    Some((from, force)) if sign * (next - from) * SPRING_MN_PER_MM < 2.0 * limit => {
                        f64::clamp(force + (next - from) * SPRING_MN_PER_MM, -limit, limit)
                    }
                    Some(_) => sign * limit,
                };
                let blur = 2.5 * FULL_SLIP_MM * SPRING_MN_PER_MM + 2e-4 * limit;
                assert!((pull - exact).abs() < blur, "µ {coefficient}, at {next}: {pull} for {exact}");
                let phase =
                    if (pull.abs() - limit).abs() < 2e-4 * limit { 1 } else { usize::from(turned_at.is_some()) * 2 };
                seen[phase] += 1;
                if turned_at.is_some() {
                    work += 0.5 * (pull + last) * (next - way);
                    dissipated += lost;
                }
                (way, last) = (next, pull);
            }
            turned_at = Some((way, last));
        }
        assert!(seen.iter().all(|&count| count > 0), "stuck, slid and stuck again: {seen:?}");
        let slid = 2.0 * (2.0 * furthest - 2.0 * limit / SPRING_MN_PER_MM);
        let exact = limit * slid;
        println!(
            "µ {coefficient}, steps of {step_mm} mm: loop {work:.6} µJ, dissipated {dissipated:.6}, closed form {exact:.6}"
        );
        let blur = 8.0 * limit * FULL_SLIP_MM + 2.0 * limit * step_mm;
        assert!((work - exact).abs() < blur && (dissipated - exact).abs() < blur, "{work} {dissipated} {exact}");
    }
}

#[test]
fn a_needle_that_stops_is_held_and_one_without_friction_drags_nothing() {
    let mut slider = Slider::new(0.3);
    let drags: Vec<f64> = [0.005, 0.03, 0.03, 0.03].iter().map(|&x| slider.drag(Vector3::x() * x).0.x).collect();
    let limit = 0.3 * NORMAL_MN;
    assert!(drags[0] < 0.9 * limit && (drags[1] / limit - 1.0).abs() < 1e-9, "{drags:?}");
    // It loses one part in ten thousand when it stops, and nothing after.
    assert!((drags[2] / drags[1] - 1.0).abs() < 2e-4 && (drags[3] / drags[2] - 1.0).abs() < 1e-9, "{drags:?}");
    // Turned back by 10 µm it is dragged by what the spring leaves; the paired negative, a face that does not know where it was, by all of µ N.
    let back = slider.drag(Vector3::x() * 0.02).0.x;
    let forgetful = Slider::new(0.3).drag(Vector3::x() * 0.02).0.x;
    assert!((back - (limit - 0.01 * SPRING_MN_PER_MM)).abs() < FULL_SLIP_MM * SPRING_MN_PER_MM, "{back}");
    assert!((forgetful / limit - 1.0).abs() < 1e-9, "{forgetful}");
    let mut smooth = Slider::new(0.0);
    assert_eq!(smooth.drag(Vector3::x() * 0.03).0, Vector3::zeros());
    assert!(smooth.at.norm() < 1e-15, "the bisection ends on its last bit: {}", smooth.at);
}
