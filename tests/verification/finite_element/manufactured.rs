//! Manufactured displacement fields on the unit cube: the error falls with the third power of the element size.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::block::{Body, Law, Mesh, block, lame};

/// Quadratic elements have order 3 in L2; half the gap to the next lower order is more than the coarse meshes take.
const LEAST_ORDER: f64 = 2.7;

/// Errors on three meshes, and the order between the last two.
fn orders(
    name: &str,
    poisson: f64,
    exact: impl Fn(Vector3<f64>) -> Vector3<f64>,
    force: impl Fn(Vector3<f64>) -> Vector3<f64>,
) {
    let mut errors = Vec::new();
    for cells in [2, 4, 8] {
        let mesh = Mesh::glued(&block([cells; 3], |at| at));
        let body = Body::new(&mesh, Law::Linear, lame(1.0, poisson), |at, _| {
            at.iter().any(|&c| c.abs() < 1e-9 || (c - 1.0).abs() < 1e-9)
        });
        let mut positions = mesh.moved(&exact);
        body.solve(&mut positions, &mesh.body_load(&force), 1.0, 1e-7);
        errors.push(mesh.l2_error(&positions, &exact));
    }
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("{name} ν {poisson}: L2 errors {errors:?}, orders {orders:.2?}, at least {LEAST_ORDER}");
    assert!(orders.iter().all(|&o| o > LEAST_ORDER), "{name} ν {poisson}: orders {orders:?}");
}

#[test]
fn order_with_volume_change() {
    // u = B sin πx sin πy sin πz: body force −µ Δu − (λ + µ) ∇ div u.
    let b = Vector3::new(0.1, 0.05, -0.07);
    let poisson = 0.3;
    let material = lame(1.0, poisson);
    let exact = |at: Vector3<f64>| b * (PI * at).map(f64::sin).product();
    let force = move |at: Vector3<f64>| {
        let (s, c) = ((PI * at).map(f64::sin), (PI * at).map(f64::cos));
        // Second derivatives of sin πx sin πy sin πz.
        let second = |i: usize, j: usize| {
            let other = 3 - i - j;
            if i == j { -s.product() } else { c[i] * c[j] * s[other] }
        };
        let gradient_of_divergence = Vector3::from_fn(|i, _| {
            PI * PI * (0..3).map(|j| b[j] * if i == j { -s.product() } else { second(i, j) }).sum::<f64>()
        });
        b * (3.0 * PI * PI * material.mu * s.product()) - gradient_of_divergence * (material.lambda + material.mu)
    };
    orders("sine bubble", poisson, exact, force);
}

#[test]
fn order_without_volume_change() {
    // div u = 0 and Δu = −3π² u: body force 3π² µ u whatever λ.
    let exact = |at: Vector3<f64>| {
        let (s, c) = ((PI * at).map(f64::sin), (PI * at).map(f64::cos));
        Vector3::new(s.x * c.y * c.z, c.x * s.y * c.z, -2.0 * c.x * c.y * s.z) * 0.1
    };
    for poisson in [0.3, 0.4999] {
        let mu = lame(1.0, poisson).mu;
        orders("solenoidal", poisson, exact, |at| exact(at) * (3.0 * PI * PI * mu));
    }
}
