//! The rigid flat punches: for each punch radius a, the punch equation and the surface that it gives.
//!
//! A unit depth under a punch of radius a means W(x) = 1 on [0, a] ([`super::abel`]), with c = 2(1 − ν²)/E of the top layer and K of
//! [`super::line`]:
//! ```text
//! W(x) = (π/2) c φ(x) + ½ ∫₀ᵃ [K(x − t) + K(x + t)] φ(t) dt = 1,        force F = 2π ∫₀ᵃ φ dt
//! ```
//! On a half-space K = 0, φ is constant and F = 2aE*, exactly. φ is taken piecewise linear on the grid and the equation is
//! weighted with the same functions (Galerkin), which makes the matrix symmetric and positive definite, as the bed's energy is, and
//! the stiffness second-order accurate. Results are per unit force. Units: mm, mN, kPa.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_PI_2, TAU};

use super::abel::surface_from_line;
use super::bed::LayeredBed;
use super::error::LayeredError;
use super::grid::{PUNCHES, RadialGrid};
use super::operators::{ElementWeights, GAUSS_4, Operators};

/// A flat punch pressed with 1 mN.
#[derive(Debug, Clone)]
pub struct Punch {
    /// Depth, mm/mN.
    pub depth: f64,
    /// Part of W that jumps at the punch's edge, (π/2) c φ(a), mm/mN: u_z has −`edge_normal`·(2/π) asin(a/r) in it.
    pub edge_normal: f64,
    /// c_r φ(a), mm²/mN: u_r has `edge_radial`·(a − √(a² − r²))/r in it.
    pub edge_radial: f64,
    /// u_z at all grid nodes, mm/mN (negative: into the bed).
    pub normal: Vec<f64>,
    /// u_r at all grid nodes, mm/mN.
    pub radial: Vec<f64>,
    /// Force outside of each grid node, mN/mN.
    pub force_beyond: Vec<f64>,
}

/// Solves all punches of a valid bed on the grid.
///
/// # Errors
/// [`LayeredError::NotPositiveDefinite`] if rounding destroys the punch equation (extreme contrasts).
pub fn solve_punches(bed: &LayeredBed, grid: &RadialGrid) -> Result<Vec<Punch>, LayeredError> {
    let nodes = &grid.nodes_mm;
    let operators = Operators::new(bed, grid);
    let half_space_radial = bed.layers[0].half_space_radial();
    let diagonal = FRAC_PI_2 * bed.layers[0].half_space_normal();
    (0..PUNCHES)
        .map(|punch| {
            let edge = RadialGrid::punch_node(punch);
            let (phi, depth) = solve_phi(&operators.inside, nodes, edge, diagonal)
                .ok_or(LayeredError::NotPositiveDefinite { radius_mm: nodes[edge] })?;
            Ok(surface(&operators, &phi, depth, diagonal, half_space_radial, nodes))
        })
        .collect()
}

/// φ (1/mm) and depth (mm) per unit force of the punch whose edge is node `edge`; `None` if the matrix is not positive definite.
fn solve_phi(inside: &ElementWeights, nodes: &[f64], edge: usize, diagonal: f64) -> Option<(Vec<f64>, f64)> {
    let mut matrix = DMatrix::<f64>::zeros(edge + 1, edge + 1);
    let mut unit = DVector::<f64>::zeros(edge + 1);
    for element in 0..edge {
        let width = nodes[element + 1] - nodes[element];
        for (point, (at, weight)) in GAUSS_4.into_iter().enumerate() {
            let column = 4 * element + point;
            for (test, value) in [(element, 1.0 - at), (element + 1, at)] {
                let weight = weight * width * value;
                for source in 0..edge {
                    matrix[(source, test)] += weight * inside.left[(source, column)];
                    matrix[(source + 1, test)] += weight * inside.right[(source, column)];
                }
                matrix[(element, test)] += weight * diagonal * (1.0 - at);
                matrix[(element + 1, test)] += weight * diagonal * at;
            }
        }
        unit[element] += 0.5 * width;
        unit[element + 1] += 0.5 * width;
    }
    let symmetric = 0.5 * (&matrix + matrix.transpose());
    let phi = symmetric.cholesky()?.solve(&unit);
    let force = TAU * phi.dot(&unit);
    Some(((phi / force).as_slice().to_vec(), 1.0 / force))
}

/// The punch with line density `phi` and depth `depth`: its surface and its forces.
fn surface(
    operators: &Operators,
    phi: &[f64],
    depth: f64,
    diagonal: f64,
    half_space_radial: f64,
    nodes: &[f64],
) -> Punch {
    let edge = phi.len() - 1;
    let mut outside: Vec<f64> = (edge..nodes.len()).map(|node| operators.line.apply(node, 0, phi)).collect();
    if edge < operators.inside.left.nrows() {
        // Just outside of the edge W may fall within a membrane's thickness; what counts is its trend over the element.
        let [near, far] = [1, 2].map(|point| operators.inside.apply(4 * edge + point, 0, phi));
        let slope = (far - near) / (GAUSS_4[2].0 - GAUSS_4[1].0);
        outside[0] = near - GAUSS_4[1].0 * slope;
    }
    let shear: Vec<f64> = (0..nodes.len()).map(|node| operators.sine.apply(node, 0, phi)).collect();
    let beyond: Vec<f64> = (0..nodes.len()).map(|node| operators.force.apply(node, 0, phi)).collect();
    let downward = |(node, &r): (usize, &f64)| {
        if node <= edge {
            return depth;
        }
        surface_from_line(r, 0.0, nodes[edge], depth, depth) + operators.surface.apply(node, edge, &outside)
    };
    let outward = |(node, &r): (usize, &f64)| {
        if node == 0 {
            return 0.0;
        }
        operators.radial.apply(node, 0, &shear) + half_space_radial / r * (beyond[0] - beyond[node])
    };
    Punch {
        depth,
        edge_normal: diagonal * phi[edge],
        edge_radial: half_space_radial * phi[edge],
        normal: nodes.iter().enumerate().map(|at| -downward(at)).collect(),
        radial: nodes.iter().enumerate().map(outward).collect(),
        force_beyond: beyond.iter().map(|z| TAU * z).collect(),
    }
}
