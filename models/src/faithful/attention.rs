//! GAT's layer with one head, forward and backward, before its ReLU.
//!
//! ```text
//! z = x W,   sᵢⱼ = leaky(zᵢ·a + zⱼ·b),   αᵢⱼ = softmax over j of sᵢⱼ,   yᵢ = Σⱼ αᵢⱼ zⱼ + c      j: neighbours of i, and i
//! ```
//!
//! After P. Veličković et al., *Graph Attention Networks* (2018); `leaky(x)` is x above zero and `SLOPE` times x below.

use std::ops::Range;

use retina_core::network::faithful::WIDTH;

use super::neighbours::Neighbours;
use crate::train::matrix::{add_product, add_product_transposed, add_row_sum, add_transposed_product};

/// Slope of the leaky ReLU below zero: that of the publication.
const SLOPE: f32 = 0.2;

/// Where a layer's parameters lie.
#[derive(Clone, Debug)]
pub struct Attention {
    /// W.
    pub weight: Range<usize>,
    /// c.
    pub bias: Range<usize>,
    /// a and b.
    pub toward: [Range<usize>; 2],
    /// Numbers in.
    pub inner: usize,
}

/// What the backward pass needs.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    z: Vec<f32>,
    /// `zᵢ·a + zⱼ·b` of each edge.
    sums: Vec<f32>,
    shares: Vec<f32>,
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add_scaled(to: &mut [f32], x: &[f32], by: f32) {
    to.iter_mut().zip(x).for_each(|(to, x)| *to += by * x);
}

impl Attention {
    /// Writes y to `out`.
    pub fn forward(&self, parameters: &[f32], mesh: &Neighbours, x: &[f32], out: &mut Vec<f32>) -> Gathered {
        let mut z = vec![0.0; mesh.nodes() * WIDTH];
        add_product(&mut z, x, &parameters[self.weight.clone()], self.inner, WIDTH);
        let row = |node: usize| &z[node * WIDTH..][..WIDTH];
        let [a, b] = self.toward.clone().map(|range| &parameters[range]);
        let toward: Vec<[f32; 2]> = (0..mesh.nodes()).map(|node| [dot(row(node), a), dot(row(node), b)]).collect();
        let (mut sums, mut shares) = (vec![0.0; mesh.edges()], vec![0.0; mesh.edges()]);
        *out = parameters[self.bias.clone()].repeat(mesh.nodes());
        for (node, out) in out.chunks_exact_mut(WIDTH).enumerate() {
            let mut largest = f32::NEG_INFINITY;
            for (edge, other) in mesh.of(node) {
                let sum = toward[node][0] + toward[other][1];
                sums[edge] = sum;
                shares[edge] = if sum > 0.0 { sum } else { SLOPE * sum };
                largest = largest.max(shares[edge]);
            }
            let mut total = 0.0;
            for (edge, _) in mesh.of(node) {
                shares[edge] = (shares[edge] - largest).exp();
                total += shares[edge];
            }
            for (edge, other) in mesh.of(node) {
                shares[edge] /= total;
                add_scaled(out, row(other), shares[edge]);
            }
        }
        Gathered { z, sums, shares }
    }

    /// Adds to `gradient` and answers the derivative by `x`, given that by y.
    pub fn backward(
        &self,
        parameters: &[f32],
        mesh: &Neighbours,
        x: &[f32],
        kept: &Gathered,
        dy: &[f32],
        gradient: &mut [f32],
    ) -> Vec<f32> {
        add_row_sum(&mut gradient[self.bias.clone()], dy);
        let row = |node: usize| &kept.z[node * WIDTH..][..WIDTH];
        let mut dz = vec![0.0; kept.z.len()];
        let mut dtoward = vec![[0.0_f32; 2]; mesh.nodes()];
        for (node, dy) in dy.chunks_exact(WIDTH).enumerate() {
            let dshare = |other: usize| dot(dy, row(other));
            let mean: f32 = mesh.of(node).map(|(edge, other)| kept.shares[edge] * dshare(other)).sum();
            for (edge, other) in mesh.of(node) {
                add_scaled(&mut dz[other * WIDTH..][..WIDTH], dy, kept.shares[edge]);
                let slope = if kept.sums[edge] > 0.0 { 1.0 } else { SLOPE };
                let dsum = slope * kept.shares[edge] * (dshare(other) - mean);
                dtoward[node][0] += dsum;
                dtoward[other][1] += dsum;
            }
        }
        for (node, d) in dtoward.iter().enumerate() {
            for (range, d) in self.toward.iter().zip(d) {
                add_scaled(&mut gradient[range.clone()], row(node), *d);
                add_scaled(&mut dz[node * WIDTH..][..WIDTH], &parameters[range.clone()], *d);
            }
        }
        add_transposed_product(&mut gradient[self.weight.clone()], x, &dz, self.inner, WIDTH);
        let mut dx = vec![0.0; x.len()];
        add_product_transposed(&mut dx, &dz, &parameters[self.weight.clone()], self.inner, WIDTH);
        dx
    }
}
