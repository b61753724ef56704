//! The patch's mesh as a graph: both directions of every edge, and the mean over a node's neighbours.
//!
//! A triangle list gives each inner edge twice and each edge of the rim once; here every edge counts once in either direction.

use crate::patch::NODE_COUNT;

/// Neighbours of each node, one list after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    starts: Vec<usize>,
    neighbours: Vec<usize>,
}

impl Graph {
    /// The graph of `triangles` over the nodes of a patch.
    pub fn new(triangles: &[[usize; 3]]) -> Self {
        let sides = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]);
        let mut edges: Vec<(usize, usize)> = sides.collect();
        edges.sort_unstable();
        edges.dedup();
        let starts = (0..=NODE_COUNT).map(|node| edges.partition_point(|&(from, _)| from < node)).collect();
        Graph { starts, neighbours: edges.into_iter().map(|(_, to)| to).collect() }
    }

    /// The neighbours of `node`, ascending.
    pub fn neighbours(&self, node: usize) -> &[usize] {
        &self.neighbours[self.starts[node]..self.starts[node + 1]]
    }

    /// Every directed edge.
    pub fn edges(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..NODE_COUNT).flat_map(|node| self.neighbours(node).iter().map(move |&other| (node, other)))
    }

    /// `out` = mean of `x` over each node's neighbours, both of `NODE_COUNT × width`; zero where there is none.
    pub fn mean(&self, out: &mut [f32], x: &[f32], width: usize) {
        for (node, out) in out.chunks_exact_mut(width).enumerate() {
            out.fill(0.0);
            let neighbours = self.neighbours(node);
            let share = 1.0 / neighbours.len().max(1) as f32;
            for &other in neighbours {
                for (out, x) in out.iter_mut().zip(&x[other * width..][..width]) {
                    *out += share * x;
                }
            }
        }
    }

    /// The transposed mean, added: how a derivative by the means becomes one by the nodes.
    pub fn add_transposed_mean(&self, out: &mut [f32], means: &[f32], width: usize) {
        for (node, mean) in means.chunks_exact(width).enumerate() {
            let neighbours = self.neighbours(node);
            let share = 1.0 / neighbours.len().max(1) as f32;
            for &other in neighbours {
                for (out, mean) in out[other * width..][..width].iter_mut().zip(mean) {
                    *out += share * mean;
                }
            }
        }
    }
}
