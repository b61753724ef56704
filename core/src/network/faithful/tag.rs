//! TAGConv: `y = Σ Âᵏ x Wₖ + b` for k = 0 … K, with `Â = D^(−1/2) A D^(−1/2)` (Du et al., *Topology Adaptive Graph Convolutional Networks*, 2017).
//!
//! The hops are written side by side, so the sum is one product of `nodes × (K + 1) inputs` by `(K + 1) inputs × outputs`.

use std::ops::Range;

use super::WIDTH;
use crate::kernel::{Kernel, run_kernel};
use crate::network::dense::fill_rows;
use crate::network::packed::Packed;
use crate::network::weights::{Weights, WeightsError};

/// K: how far a node hears.
pub const HOPS: usize = 3;

/// Columns that are propagated at a time: those of all nodes stay in the nearest memory from hop to hop.
const STRIP: usize = 32;

/// Memory for two strips of columns, kept between propagations.
#[derive(Clone, Debug, Default)]
pub struct Strips([Vec<[f32; STRIP]>; 2]);

impl Strips {
    /// Calls `act` for each strip of `width` columns, with room for it and for its next hop.
    fn each(&mut self, nodes: usize, width: usize, mut act: impl FnMut(Range<usize>, &mut [Vec<[f32; STRIP]>; 2])) {
        self.0.iter_mut().for_each(|strip| strip.resize(nodes, [0.0; STRIP]));
        for first in (0..width).step_by(STRIP) {
            act(first..width.min(first + STRIP), &mut self.0);
        }
    }
}

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

    /// `[x, Âx, Â²x, Â³x]` side by side.
    pub fn hops(&self, x: &[f32], strips: &mut Strips, out: &mut Vec<f32>) {
        let width = x.len() / self.nodes();
        let stride = (HOPS + 1) * width;
        out.resize(self.nodes() * stride, 0.0);
        strips.each(self.nodes(), width, |strip, [near, far]| {
            for (near, row) in near.iter_mut().zip(x.chunks_exact(width)) {
                near[..strip.len()].copy_from_slice(&row[strip.clone()]);
            }
            for k in 0..=HOPS {
                for (near, row) in near.iter().zip(out.chunks_exact_mut(stride)) {
                    row[k * width..][strip.clone()].copy_from_slice(&near[..strip.len()]);
                }
                if k < HOPS {
                    far.fill([0.0; STRIP]);
                    run_kernel(AddHop { mesh: self, x: near, sums: far });
                    std::mem::swap(near, far);
                }
            }
        });
    }

    /// The transposed of [`hops`](Self::hops): derivatives by the hops become derivatives by `x`, added to the first block of each row.
    pub fn gather(&self, strips: &mut Strips, hops: &mut [f32]) {
        let stride = hops.len() / self.nodes();
        let width = stride / (HOPS + 1);
        strips.each(self.nodes(), width, |strip, [near, far]| {
            for k in (0..=HOPS).rev() {
                for (near, row) in near.iter_mut().zip(hops.chunks_exact(stride)) {
                    near[..strip.len()].copy_from_slice(&row[k * width..][strip.clone()]);
                }
                if k < HOPS {
                    // Â is symmetric.
                    run_kernel(AddHop { mesh: self, x: far, sums: near });
                }
                std::mem::swap(near, far);
            }
            for (sum, row) in far.iter().zip(hops.chunks_exact_mut(stride)) {
                row[strip.clone()].copy_from_slice(&sum[..strip.len()]);
            }
        });
    }
}

/// Adds `Â x` to `sums`.
struct AddHop<'a> {
    mesh: &'a Propagation,
    x: &'a [[f32; STRIP]],
    sums: &'a mut [[f32; STRIP]],
}

impl Kernel for AddHop<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Propagation { starts, entries } = self.mesh;
        for (sums, ends) in self.sums.iter_mut().zip(starts.windows(2)) {
            let mut sum = *sums;
            for &(other, weight) in &entries[ends[0]..ends[1]] {
                let x = &self.x[other];
                for column in 0..STRIP {
                    sum[column] += weight * x[column];
                }
            }
            *sums = sum;
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

    /// `out = Σ Âᵏ x Wₖ + b`; `strips` and `hops` are overwritten.
    pub fn forward(&self, mesh: &Propagation, x: &[f32], strips: &mut Strips, hops: &mut Vec<f32>, out: &mut Vec<f32>) {
        mesh.hops(x, strips, hops);
        out.resize(mesh.nodes() * WIDTH, 0.0);
        fill_rows(out, &self.bias);
        self.weight.add_product(out, hops);
    }
}
