//! No node inside the needle: what is found there is moved to its surface, the shortest way.
//!
//! `x ← x − d ∇d / |∇d|²` while the signed distance `d` is negative. `d` is convex and, but for a bevel's rounded edge, exact, so one step ends on the
//! surface and the others are for the bevel.

use nalgebra::{Point3, Vector3};

use super::input::{Answer, Input};

/// Steps at most.
const STEPS: usize = 8;
/// Depth inside the needle that single precision leaves (mm): 0.01 µm.
pub const LEFT_MM: f64 = 1e-5;

/// Moves the nodes of `answer` out of the needle where it puts both.
pub fn out_of_needle(input: &Input, answer: &mut Answer) {
    let pose = input.pose_after(answer.travel_mm);
    for (rest, moved) in input.rest_mm.iter().zip(&mut answer.displacement_mm) {
        let mut at: Vector3<f64> = (rest + *moved).cast();
        let mut inside = false;
        for _ in 0..STEPS {
            let local = pose.inverse_transform_point(&Point3::from(at));
            let (distance_mm, gradient) = input.body.distance_and_gradient(&local);
            let squared = gradient.norm_squared();
            if distance_mm >= -LEFT_MM || squared == 0.0 {
                break;
            }
            at -= pose.rotation * gradient * (distance_mm / squared);
            inside = true;
        }
        if inside {
            *moved = (at - rest.cast::<f64>()).cast();
        }
    }
}
