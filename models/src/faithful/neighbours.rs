//! A mesh's neighbourhoods with the node itself among them, as GCN and GAT take them.

/// Neighbours of each node and the node itself, ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct Neighbours {
    starts: Vec<usize>,
    others: Vec<usize>,
    /// `1 / √(dᵢ dⱼ)`, the loop counted in both degrees.
    weights: Vec<f32>,
}

impl Neighbours {
    /// Of `nodes` nodes with these directed edges, both directions of each, and a loop at every node.
    pub fn with_loops(nodes: usize, edges: &[(usize, usize)]) -> Self {
        let mut edges: Vec<(usize, usize)> = edges.iter().copied().chain((0..nodes).map(|node| (node, node))).collect();
        edges.sort_unstable();
        edges.dedup();
        let starts: Vec<usize> = (0..=nodes).map(|node| edges.partition_point(|&(from, _)| from < node)).collect();
        let degree = |node: usize| (starts[node + 1] - starts[node]) as f32;
        Neighbours {
            weights: edges.iter().map(|&(a, b)| 1.0 / (degree(a) * degree(b)).sqrt()).collect(),
            others: edges.into_iter().map(|(_, to)| to).collect(),
            starts,
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of directed edges, loops included.
    pub fn edges(&self) -> usize {
        self.others.len()
    }

    /// The edges that leave `node`: number of each, and where it leads.
    pub fn of(&self, node: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        (self.starts[node]..self.starts[node + 1]).map(|edge| (edge, self.others[edge]))
    }

    /// `Â x` with `Â = D^(−1/2) (A + I) D^(−1/2)`.
    pub fn averaged(&self, x: &[f32]) -> Vec<f32> {
        let width = x.len() / self.nodes();
        let mut out = vec![0.0; x.len()];
        for (node, row) in out.chunks_exact_mut(width).enumerate() {
            for (edge, other) in self.of(node) {
                let weight = self.weights[edge];
                row.iter_mut().zip(&x[other * width..][..width]).for_each(|(row, x)| *row += weight * x);
            }
        }
        out
    }
}
