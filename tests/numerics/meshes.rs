//! Meshes that several tests use.

use nalgebra::Point3;

/// Repeatable numbers in −1 to 1.
pub fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A height over the plane with no symmetry, mm: smooth, and steep enough to matter.
pub fn hilly(x: f64, y: f64) -> f64 {
    0.04 * (x * x + y * y) + 0.05 * (1.3 * x + 0.4).sin() * (0.7 * y - 0.2).cos()
}

/// `n` × `n` vertices `spacing` mm apart around the origin, shaken a little, on [`hilly`] ground.
pub fn hills(n: usize, spacing: f64) -> (Vec<Point3<f64>>, Vec<[usize; 3]>) {
    let mut random = noise(17);
    let place = |index: usize, shake: f64| spacing * (index as f64 - 0.5 * (n - 1) as f64 + 0.2 * shake);
    let vertices = (0..n * n)
        .map(|i| {
            let (x, y) = (place(i % n, random()), place(i / n, random()));
            Point3::new(x, y, hilly(x, y))
        })
        .collect();
    (vertices, grid_triangles(n))
}

/// Two triangles for each square of `n` × `n` vertices, counter-clockwise seen from +z.
pub fn grid_triangles(n: usize) -> Vec<[usize; 3]> {
    let square = |i: usize| i % n + 1 < n && i / n + 1 < n;
    (0..n * n).filter(|&i| square(i)).flat_map(|i| [[i, i + 1, i + n + 1], [i, i + n + 1, i + n]]).collect()
}
