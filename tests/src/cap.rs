//! A mesh like a user's: a cap of the eye's ball on an uneven grid.

use nalgebra::Point3;

/// Vertices along each side.
pub const SIDE: usize = 30;
/// Distance between neighbours (mm), give or take half of it.
pub const SPACING_MM: f64 = 0.23;
/// Radius of the ball (mm).
const RADIUS_MM: f64 = 12.0;

/// Vertices and triangles of a cap of a ball of 12 mm radius, seen from inside, on an uneven grid.
pub fn cap() -> (Vec<Point3<f64>>, Vec<[usize; 3]>) {
    let mut random = fastrand::Rng::with_seed(3);
    let mut place = |index: usize| SPACING_MM * (index as f64 - 0.5 * (SIDE - 1) as f64 + 0.5 * (random.f64() - 0.5));
    let vertices = (0..SIDE * SIDE).map(|i| {
        let (x, y) = (place(i % SIDE), place(i / SIDE));
        Point3::new(x, y, RADIUS_MM - (RADIUS_MM * RADIUS_MM - x * x - y * y).sqrt())
    });
    let square = |i: &usize| i % SIDE + 1 < SIDE && i / SIDE + 1 < SIDE;
    let triangles =
        (0..SIDE * SIDE).filter(square).flat_map(|i| [[i, i + 1, i + SIDE + 1], [i, i + SIDE + 1, i + SIDE]]);
    (vertices.collect(), triangles.collect())
}
