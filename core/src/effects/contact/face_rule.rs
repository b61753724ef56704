//! Quadrature on a face that has the needle for one more vertex, and the sums of products of weights that Hessians on it are made of.
//!
//! A point's offset from the needle is Σ wₐ xₐ with the face's shape functions as weights and −1 for the needle, so an energy of it has the Hessian
//! Σ wₐ w_b S with S the 3 × 3 second derivative at the point. The products wₐ w_b are those of the reference face: they are made once for each number of points.
//! Not here: which energy.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Matrix3;

use crate::effect::LOWER_BLOCKS;
use crate::mesh::element::{FACE_NODES, face_shapes, gauss_rule};

/// Vertices of a group: those of the face, then the needle.
pub const GROUP: usize = FACE_NODES + 1;

/// Numbers that are computed side by side.
pub(super) const LANES: usize = 4;

/// Products of two weights, the second vertex not after the first, padded to whole vectors.
const PAIRS: usize = (GROUP * (GROUP + 1) / 2).next_multiple_of(LANES);

/// Shape functions at the quadrature points of the reference face.
#[derive(Debug)]
pub(super) struct FaceRule {
    /// Values of the face's shape functions and −1, for each point.
    pub weights: Vec<[f64; GROUP]>,
    /// Quadrature weight of each point, and the slopes of the shape functions there.
    pub slopes: Vec<(f64, [[f64; 2]; FACE_NODES])>,
    /// Values of each of the face's shape functions at as many points as are computed side by side, then those at the next; zero beyond the last point.
    pub side_by_side: Vec<[[f64; LANES]; FACE_NODES]>,
    pairs: Vec<[f64; PAIRS]>,
}

/// The rules made so far, by points per edge.
static RULES: Mutex<BTreeMap<usize, Arc<FaceRule>>> = Mutex::new(BTreeMap::new());

impl FaceRule {
    /// The rule with `points_per_edge` Gauss points in each direction.
    pub fn shared(points_per_edge: usize) -> Arc<FaceRule> {
        let mut rules = RULES.lock().unwrap_or_else(PoisonError::into_inner);
        rules.entry(points_per_edge).or_insert_with(|| Arc::new(FaceRule::new(points_per_edge))).clone()
    }

    fn new(points_per_edge: usize) -> Self {
        let rule = gauss_rule(points_per_edge);
        let side_by_side = vec![[[0.0; LANES]; FACE_NODES]; rule.len().pow(2).div_ceil(LANES)];
        let mut out = FaceRule { weights: Vec::new(), slopes: Vec::new(), side_by_side, pairs: Vec::new() };
        for &(eta, w_eta) in &rule {
            for &(xi, w_xi) in &rule {
                let shapes = face_shapes([xi, eta]);
                let mut weights = [-1.0; GROUP];
                for (weight, shape) in weights.iter_mut().zip(&shapes) {
                    *weight = shape.value;
                }
                let mut pairs = [0.0; PAIRS];
                let products = (0..GROUP).flat_map(|a| (0..=a).map(move |b| weights[a] * weights[b]));
                pairs.iter_mut().zip(products).for_each(|(pair, product)| *pair = product);
                let point = out.weights.len();
                for (values, value) in out.side_by_side[point / LANES].iter_mut().zip(weights) {
                    values[point % LANES] = value;
                }
                out.weights.push(weights);
                out.slopes.push((w_xi * w_eta, shapes.map(|shape| [shape.gradient[0], shape.gradient[1]])));
                out.pairs.push(pairs);
            }
        }
        out
    }
}

/// The Hessian of one face, summed over its points.
pub struct FaceStiffness<'a> {
    rule: &'a FaceRule,
    sums: [[f64; PAIRS]; LOWER_BLOCKS.len()],
}

impl<'a> FaceStiffness<'a> {
    pub(super) fn new(rule: &'a FaceRule) -> Self {
        FaceStiffness { rule, sums: [[0.0; PAIRS]; LOWER_BLOCKS.len()] }
    }

    /// Adds a point whose energy has the symmetric second derivative `stiffness` (mN/mm) by its offset from the needle.
    pub fn add(&mut self, point: usize, stiffness: &Matrix3<f64>) {
        let pairs = &self.rule.pairs[point];
        for (sums, &(i, j)) in self.sums.iter_mut().zip(&LOWER_BLOCKS) {
            let scale = stiffness[(i, j)];
            for (sum, pair) in sums.iter_mut().zip(pairs) {
                *sum += scale * pair;
            }
        }
    }

    /// Adds the sum to the lower triangle of the group's matrix `out`.
    pub fn add_to(&self, out: &mut [f64]) {
        for (sums, &(i, j)) in self.sums.iter().zip(&LOWER_BLOCKS) {
            let mut pairs = sums.iter();
            for a in 0..GROUP {
                for (b, pair) in (0..=a).zip(&mut pairs) {
                    out[(i * GROUP + a) * 3 * GROUP + j * GROUP + b] += pair;
                    if i != j && a != b {
                        out[(i * GROUP + b) * 3 * GROUP + j * GROUP + a] += pair;
                    }
                }
            }
        }
    }
}
