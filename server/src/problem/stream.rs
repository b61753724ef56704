//! Where the fields of a single prediction stand in a stream.

use super::Problem;

/// The problem of a pose: what the core or a request calls `needle.tip_mm` is `pose.tip_mm`, and what the session was opened with is under
/// `open`.
pub fn of_pose(mut problem: Problem) -> Problem {
    for error in &mut problem.errors {
        let number = error.field.strip_prefix("needle.").unwrap_or(&error.field);
        let of_pose = ["tip_mm", "direction", "orientation_xyzw", "force_mn"].iter().any(|own| number.starts_with(own));
        error.field = if of_pose { format!("pose.{number}") } else { format!("open.{}", error.field) };
    }
    problem
}
