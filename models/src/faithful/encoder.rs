//! The encoders' graph convolutions, forward and backward: TAGConv as in the paper, and the two that it is compared with.

use retina_core::network::faithful::tag::{HOPS, Propagation, Strips};
use retina_core::network::faithful::{WIDTH, relu};

use super::attention::{Attention, Gathered};
use super::layers::Dense;
use super::neighbours::Neighbours;
use super::variant::Backbone;

/// A mesh as the convolutions need it.
#[derive(Clone, Debug)]
pub struct Mesh {
    tag: Propagation,
    looped: Neighbours,
}

impl Mesh {
    /// Of `nodes` nodes with these directed edges, both directions of each.
    pub fn new(nodes: usize, edges: &[(usize, usize)]) -> Self {
        Mesh { tag: Propagation::new(nodes, edges), looped: Neighbours::with_loops(nodes, edges) }
    }

    /// Number of directed edges, without loops.
    pub fn edges(&self) -> usize {
        self.tag.edges()
    }
}

/// One graph convolution with ReLU.
#[derive(Clone, Debug)]
pub enum Convolution {
    /// The mesh's hops and a dense layer.
    Tag(Dense),
    /// The mean over the neighbours and a dense layer.
    Gcn(Dense),
    /// Attention over the neighbours.
    Gat(Attention),
}

/// What the backward pass needs of a convolution.
#[derive(Clone, Debug, Default)]
pub struct Convolved {
    input: Vec<f32>,
    gathered: Gathered,
    /// What it answered, `nodes × 256`.
    pub out: Vec<f32>,
}

impl Convolution {
    /// Rows of a dense layer for each number of a node.
    pub fn rows(backbone: Backbone) -> usize {
        if backbone == Backbone::Tag { HOPS + 1 } else { 1 }
    }

    /// The rows of `x`, convolved.
    pub fn forward(&self, parameters: &[f32], mesh: &Mesh, x: &[f32]) -> Convolved {
        let mut kept = Convolved::default();
        match self {
            Convolution::Tag(dense) => {
                mesh.tag.hops(x, &mut Strips::default(), &mut kept.input);
                kept.out = dense.forward(parameters, &kept.input);
            }
            Convolution::Gcn(dense) => {
                kept.input = mesh.looped.averaged(x);
                kept.out = dense.forward(parameters, &kept.input);
            }
            Convolution::Gat(attention) => {
                kept.input = x.to_vec();
                kept.gathered = attention.forward(parameters, &mesh.looped, x, &mut kept.out);
                relu(&mut kept.out);
            }
        }
        kept
    }

    /// Adds to `gradient` and answers the derivative by `x`, given that by what `forward` answered.
    pub fn backward(
        &self,
        parameters: &[f32],
        mesh: &Mesh,
        kept: &Convolved,
        mut dout: Vec<f32>,
        gradient: &mut [f32],
    ) -> Vec<f32> {
        match self {
            Convolution::Tag(dense) => {
                let mut dhops = dense.backward(parameters, &kept.input, &kept.out, dout, gradient);
                mesh.tag.gather(&mut Strips::default(), &mut dhops);
                let inputs = dense.inner / (HOPS + 1);
                dhops.chunks_exact(dense.inner).flat_map(|row| row[..inputs].to_vec()).collect()
            }
            // Â is symmetric.
            Convolution::Gcn(dense) => {
                mesh.looped.averaged(&dense.backward(parameters, &kept.input, &kept.out, dout, gradient))
            }
            Convolution::Gat(attention) => {
                dout.iter_mut().zip(&kept.out).filter(|(_, out)| **out <= 0.0).for_each(|(d, _)| *d = 0.0);
                attention.backward(parameters, &mesh.looped, &kept.input, &kept.gathered, &dout, gradient)
            }
        }
    }
}

/// Two convolutions.
#[derive(Clone, Debug)]
pub struct Encoder {
    /// Them.
    pub layers: [Convolution; 2],
}

/// What the backward pass needs of an encoder.
#[derive(Clone, Debug, Default)]
pub struct Encoded {
    /// Of each convolution.
    pub layers: [Convolved; 2],
}

impl Encoded {
    /// What the encoder answered, `nodes × 256`.
    pub fn out(&self) -> &[f32] {
        &self.layers[1].out
    }
}

impl Encoder {
    /// Encodes the numbers of a mesh's nodes.
    pub fn forward(&self, parameters: &[f32], mesh: &Mesh, x: &[f32]) -> Encoded {
        let first = self.layers[0].forward(parameters, mesh, x);
        let second = self.layers[1].forward(parameters, mesh, &first.out);
        Encoded { layers: [first, second] }
    }

    /// Adds to `gradient`, given the derivative by what `forward` answered.
    pub fn backward(&self, parameters: &[f32], mesh: &Mesh, kept: &Encoded, dout: Vec<f32>, gradient: &mut [f32]) {
        let dfirst = self.layers[1].backward(parameters, mesh, &kept.layers[1], dout, gradient);
        debug_assert_eq!(dfirst.len() % WIDTH, 0);
        self.layers[0].backward(parameters, mesh, &kept.layers[0], dfirst, gradient);
    }
}
