//! Surface compliance of a layered bed at one wave number.
//!
//! With y the depth below the surface, u_r = U(y) J₁(kr), downward v = V(y) J₀(kr), and stresses in units of 2µk, the solutions of
//! Navier's equation in a layer that decay downwards are, with q = ky,
//! ```text
//! (U, V, s_ry, s_yy) = (1, 1, −1, −1) e^−q        and   (q, q + 3 − 4ν, −(1 − 2ν) − q, −2(1 − ν) − q) e^−q
//! ```
//! and those that decay upwards are their mirror images (V and s_ry change sign). Amplitudes are referred to the face at which
//! each mode is largest, so only e^{−kh} ever appears: from the base upwards, the reflection matrix R (upward from downward
//! amplitudes) of each layer follows from continuity of displacement and traction at its lower face and is carried to its upper
//! face as P R P, P = e^{−kh} [[1, kh], [0, 1]]. This is stable for every kh, for ν → 0.5 and for large contrasts, and holds for
//! complex k, which [`super::line`] needs.
//!
//! Source: the reflection matrix method of layered media (Kennett 1983, *Seismic Wave Propagation in Stratified Media*, ch. 6), here
//! in its static limit; derived from Navier's equation as above. Units: mm, kPa, 1/mm.

use nalgebra::{Complex, Matrix2, Matrix4, Matrix4x2, Vector2};

use super::bed::{BedBase, BedLayer, LayeredBed};

/// Complex number used for wave numbers.
pub type C64 = Complex<f64>;

/// Surface compliances times the wave number, 1/kPa: for a pressure p̂ J₀(kr), k·v = `normal`·p̂ J₀(kr) downwards and
/// k·u_r = `radial`·p̂ J₁(kr) outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliance<T> {
    /// k C_z(k), 1/kPa.
    pub normal: T,
    /// k C_r(k), 1/kPa.
    pub radial: T,
}

/// Surface compliance of a valid bed at wave number `k` (1/mm), Re k > 0, |arg k| < 90°.
pub fn surface_compliance(bed: &LayeredBed, k: C64) -> Compliance<C64> {
    let mut below: Option<(Matrix4x2<C64>, f64)> = None;
    for layer in bed.layers.iter().rev() {
        let support = match below {
            Some((state, shear)) => scaled_tractions(state, shear / layer.shear_modulus_kpa()),
            None => base_states(&bed.base, layer, k),
        };
        below = Some((top_states(layer, &support, k), layer.shear_modulus_kpa()));
    }
    let (state, shear) = below.expect("a valid bed has a layer");
    let traction = Matrix2::new(state[(2, 0)], state[(2, 1)], state[(3, 0)], state[(3, 1)]);
    let amplitudes = solve2(&traction, Vector2::new(C64::new(0.0, 0.0), C64::new(-0.5 / shear, 0.0)));
    Compliance {
        normal: state[(1, 0)] * amplitudes[0] + state[(1, 1)] * amplitudes[1],
        radial: state[(0, 0)] * amplitudes[0] + state[(0, 1)] * amplitudes[1],
    }
}

/// [`surface_compliance`] at a real wave number `k_per_mm` > 0.
pub fn surface_compliance_real(bed: &LayeredBed, k_per_mm: f64) -> Compliance<f64> {
    let compliance = surface_compliance(bed, C64::new(k_per_mm, 0.0));
    Compliance { normal: compliance.normal.re, radial: compliance.radial.re }
}

/// The two states (U, V, s_ry, s_yy) that the base admits at the lower face of `layer`.
fn base_states(base: &BedBase, layer: &BedLayer, k: C64) -> Matrix4x2<C64> {
    let mut states = Matrix4x2::zeros();
    match *base {
        BedBase::Bonded => {
            states[(2, 0)] = C64::new(1.0, 0.0);
            states[(3, 1)] = C64::new(1.0, 0.0);
        }
        BedBase::Springs { normal_kpa_per_mm, tangential_kpa_per_mm } => {
            let unit = 2.0 * layer.shear_modulus_kpa() * k;
            states[(0, 0)] = C64::new(1.0, 0.0);
            states[(2, 0)] = -tangential_kpa_per_mm / unit;
            states[(1, 1)] = C64::new(1.0, 0.0);
            states[(3, 1)] = -normal_kpa_per_mm / unit;
        }
    }
    states
}

/// The two states at the upper face of `layer`, given the two that `support` admits at its lower face.
fn top_states(layer: &BedLayer, support: &Matrix4x2<C64>, k: C64) -> Matrix4x2<C64> {
    let down = decaying_modes(layer.poisson_ratio, 1.0);
    let up = decaying_modes(layer.poisson_ratio, -1.0);
    let mut system = Matrix4::zeros();
    system.fixed_columns_mut::<2>(0).copy_from(&up);
    for column in 0..2 {
        let scale = support.column(column).iter().fold(0.0_f64, |m, value| m.max(value.norm()));
        system.set_column(column + 2, &(support.column(column) / C64::new(-scale, 0.0)));
    }
    let solution = system.lu().solve(&(-down)).unwrap_or_else(Matrix4x2::zeros);
    let reflection = solution.fixed_rows::<2>(0).into_owned();
    let kh = k * layer.thickness_mm;
    let decay = (-kh).exp();
    let carry = Matrix2::new(decay, decay * kh, C64::new(0.0, 0.0), decay);
    down + up * (carry * reflection * carry)
}

/// Columns: the two modes that decay downwards (`direction` = 1) or upwards (−1), at the face to which they are referred.
fn decaying_modes(poisson_ratio: f64, direction: f64) -> Matrix4x2<C64> {
    let nu = poisson_ratio;
    Matrix4x2::new(
        1.0,
        0.0,
        direction,
        direction * (3.0 - 4.0 * nu),
        -direction,
        -direction * (1.0 - 2.0 * nu),
        -1.0,
        -2.0 * (1.0 - nu),
    )
    .map(|value| C64::new(value, 0.0))
}

/// The same states with tractions in the units of another layer.
fn scaled_tractions(mut states: Matrix4x2<C64>, factor: f64) -> Matrix4x2<C64> {
    for row in 2..4 {
        for column in 0..2 {
            states[(row, column)] *= factor;
        }
    }
    states
}

/// Solves a 2 × 2 system by Cramer's rule.
fn solve2(matrix: &Matrix2<C64>, rhs: Vector2<C64>) -> Vector2<C64> {
    let determinant = matrix[(0, 0)] * matrix[(1, 1)] - matrix[(0, 1)] * matrix[(1, 0)];
    Vector2::new(
        (rhs[0] * matrix[(1, 1)] - matrix[(0, 1)] * rhs[1]) / determinant,
        (matrix[(0, 0)] * rhs[1] - rhs[0] * matrix[(1, 0)]) / determinant,
    )
}
