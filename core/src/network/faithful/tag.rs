//! TAGConv: `y = Σ Âᵏ x Wₖ + b` for k = 0 … K, with `Â = D^(−1/2) A D^(−1/2)` (Du et al., *Topology Adaptive Graph Convolutional Networks*, 2017).
//!
//! The hops are written side by side, so the sum is one product of `nodes × (K + 1) inputs` by `(K + 1) inputs × outputs`.

use pulp::Arch;

use super::WIDTH;
use crate::network::dense::fill_rows;
use crate::network::packed::Packed;
use crate::network::weights::{Weights, WeightsError};

/// K: how far a node hears.
pub const HOPS: usize = 3;

/// `Â` of a mesh, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Propagation {
    starts: Vec<usize>,
    entries: Vec<(usize, f32)>,
}

impl Propagation {
    /// Of `nodes` nodes with these directed edges, both directions of each.
    pub fn new(nodes: usize, edges: &[(usize, usize)]) -> Self {
        let mut edges = edges.to_vec();
        edges.sort_unstable();
        edges.dedup();
        let degree = |node: usize| edges.iter().filter(|(from, _)| *from == node).count() as f32;
        let degrees: Vec<f32> = (0..nodes).map(degree).collect();
        let weight = |a: usize, b: usize| 1.0 / (degrees[a] * degrees[b]).sqrt();
        Propagation {
            starts: (0..=nodes).map(|node| edges.partition_point(|&(from, _)| from < node)).collect(),
            entries: edges.iter().map(|&(a, b)| (b, weight(a, b))).collect(),
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of directed edges.
    pub fn edges(&self) -> usize {
        self.entries.len()
    }

    /// Adds `Â x` to the numbers that stand at `to`: rows are `stride` apart, `width` numbers long, and those of x begin at `from` within them.
    fn hop(&self, rows: &mut [f32], stride: usize, width: usize, from: usize, to: usize) {
        let mut sum = [0.0; WIDTH];
        let sum = &mut sum[..width];
        // With the widest vectors of this processor.
        Arch::new().dispatch(|| {
            for node in 0..self.nodes() {
                sum.copy_from_slice(&rows[node * stride + to..][..width]);
                for &(other, weight) in &self.entries[self.starts[node]..self.starts[node + 1]] {
                    let x = &rows[other * stride + from..][..width];
                    sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += weight * x);
                }
                rows[node * stride + to..][..width].copy_from_slice(sum);
            }
        });
    }

    /// `[x, Âx, Â²x, Â³x]` side by side.
    pub fn hops(&self, x: &[f32], out: &mut Vec<f32>) {
        let width = x.len() / self.nodes();
        let stride = (HOPS + 1) * width;
        out.resize(self.nodes() * stride, 0.0);
        for (row, x) in out.chunks_exact_mut(stride).zip(x.chunks_exact(width)) {
            row[..width].copy_from_slice(x);
            row[width..].fill(0.0);
        }
        for k in 0..HOPS {
            self.hop(out, stride, width, k * width, (k + 1) * width);
        }
    }

    /// The transposed of [`hops`](Self::hops): derivatives by the hops become derivatives by `x`, added to the first block of each row.
    pub fn gather(&self, hops: &mut [f32]) {
        let stride = hops.len() / self.nodes();
        let width = stride / (HOPS + 1);
        for k in (0..HOPS).rev() {
            // Â is symmetric.
            self.hop(hops, stride, width, (k + 1) * width, k * width);
        }
    }
}

/// One layer.
pub struct TagConv {
    weight: Packed,
    bias: Vec<f32>,
}

impl TagConv {
    /// The layer `name` with `inputs` numbers a node.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn new(weights: &Weights, name: &str, inputs: usize) -> Result<Self, WeightsError> {
        Ok(TagConv {
            weight: Packed::new(&weights.take(&format!("{name}.weight"), &[(HOPS + 1) * inputs, WIDTH])?, WIDTH),
            bias: weights.take(&format!("{name}.bias"), &[WIDTH])?,
        })
    }

    /// `out = Σ Âᵏ x Wₖ + b`; `hops` is overwritten.
    pub fn forward(&self, mesh: &Propagation, x: &[f32], hops: &mut Vec<f32>, out: &mut Vec<f32>) {
        mesh.hops(x, hops);
        out.resize(mesh.nodes() * WIDTH, 0.0);
        fill_rows(out, &self.bias);
        self.weight.add_product(out, hops);
    }
}
