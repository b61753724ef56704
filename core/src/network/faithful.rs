//! The network of the paper: two bodies as graphs, attention from the soft one to the rigid one, a decoder that gives each node's displacement.
//!
//! ```text
//! S = relu(tag(relu(tag(soft))))      64 × 256, TAGConv with K = 3 over the patch's mesh
//! R = relu(tag(relu(tag(rigid))))    102 × 256, the same over the tool's mesh
//! Aₕ = softmax(S Wₕ (R Wₕ)ᵀ / √256)   two heads; one projection serves query and key, the values are R itself
//! u  = decoder([S, A₁ R, A₂ R])       768 → 256 → 256 → 256 → 3 with ReLU, a residual on the positions at rest
//! ```
//!
//! After M. Saleh et al., *Physics-Encoded Graph Neural Networks for Deformation Prediction under Contact* (ICRA 2024). Where the public description is
//! silent, this program chose: the softmax's scale, no bias in the projections, displacements in units of [`UNIT_MM`], and the tool at first touch,
//! its forward end following the tip. A prediction attends to its own tool alone, and every edge counts in both directions.
//!
//! Not here: the comparison with other networks, training (`retina-models`).

pub mod features;
pub mod tag;
pub mod tool;

use nalgebra::Vector3;

use super::dense::{Into, fill_rows, product, product_transposed};
use super::input::Field;
use super::observer::Observer;
use super::packed::Packed;
use super::softmax::softmax;
use super::weights::{Weights, WeightsError};
use crate::patch::NODE_COUNT;
use features::{RIGID, SOFT};
use tag::{HOPS, Propagation, Strips, TagConv};
use tool::TOOL_NODES;

/// Width of the encoders and of the decoder.
pub const WIDTH: usize = 256;
/// Heads of the attention.
pub const HEADS: usize = 2;
/// Layers of the decoder.
pub const DECODER: [[usize; 2]; 4] = [[WIDTH * (1 + HEADS), WIDTH], [WIDTH, WIDTH], [WIDTH, WIDTH], [WIDTH, 3]];
/// Unit of the learned displacements (mm).
pub const UNIT_MM: f32 = 0.1;
/// Name in the weights.
pub const NAME: &str = "faithful";

struct Dense {
    weight: Packed,
    bias: Vec<f32>,
}

/// The network with its weights.
pub struct FaithfulNetwork {
    soft: [TagConv; 2],
    rigid: [TagConv; 2],
    /// `W Wᵀ / √256` of each head: query times key in one matrix.
    heads: [Vec<f32>; HEADS],
    /// The decoder's first layer: the patch's rows with the bias, then those of each head.
    first: Dense,
    joined: [Packed; HEADS],
    /// Its other layers.
    decoder: Vec<Dense>,
    tool: Propagation,
}

/// What depends on the patch alone: it is computed once and kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodedPatch {
    /// `S Wₕ Wₕᵀ / √256`, 64 × 256, of one head after the other.
    queries: Vec<f32>,
    /// S times its rows of the decoder's first layer, and that layer's bias, 64 × 256.
    first: Vec<f32>,
}

/// Memory that one thread keeps between predictions.
#[derive(Default)]
pub struct Memory {
    strips: Strips,
    hops: Vec<f32>,
    layer: Vec<f32>,
    rigid: Vec<f32>,
    keys: Packed,
    values: Packed,
    scores: Vec<f32>,
    attended: Vec<f32>,
    decoded: Vec<f32>,
    next: Vec<f32>,
}

/// `x = max(x, 0)`.
pub fn relu(x: &mut [f32]) {
    x.iter_mut().for_each(|x| *x = x.max(0.0));
}

impl FaithfulNetwork {
    /// The network with these weights.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn new(file: &[u8]) -> Result<Self, WeightsError> {
        let weights = Weights::read(NAME, file)?;
        let encoder = |body: &str, inputs: usize| -> Result<[TagConv; 2], WeightsError> {
            let layer = |at: usize, inputs: usize| TagConv::new(&weights, &format!("{body}.{at}"), inputs);
            Ok([layer(0, inputs)?, layer(1, WIDTH)?])
        };
        let head = |at: usize| -> Result<Vec<f32>, WeightsError> {
            let weight = weights.take(&format!("head.{at}"), &[WIDTH, WIDTH])?;
            let mut folded = vec![0.0; WIDTH * WIDTH];
            product_transposed(&mut folded, &weight, &weight, WIDTH, WIDTH);
            folded.iter_mut().for_each(|x| *x /= (WIDTH as f32).sqrt());
            Ok(folded)
        };
        let weight = |at: usize| weights.take(&format!("decoder.{at}.weight"), &DECODER[at]);
        let bias = |at: usize| weights.take(&format!("decoder.{at}.bias"), &DECODER[at][1..]);
        let dense = |at: usize| -> Result<Dense, WeightsError> {
            Ok(Dense { weight: Packed::new(&weight(at)?, DECODER[at][1]), bias: bias(at)? })
        };
        let first = weight(0)?;
        let body = |at: usize| Packed::new(&first[at * WIDTH * WIDTH..][..WIDTH * WIDTH], WIDTH);
        Ok(FaithfulNetwork {
            soft: encoder("soft", SOFT)?,
            rigid: encoder("rigid", RIGID)?,
            heads: [head(0)?, head(1)?],
            first: Dense { weight: body(0), bias: bias(0)? },
            joined: [body(1), body(2)],
            decoder: (1..DECODER.len()).map(dense).collect::<Result<_, _>>()?,
            tool: Propagation::new(TOOL_NODES, &tool::edges()),
        })
    }

    /// What depends on the patch alone.
    pub fn encode_patch(&self, rest: &Field, mesh: &Propagation, memory: &mut Memory) -> EncodedPatch {
        self.encode_patch_observed(rest, mesh, memory, &mut |_, _, _| {})
    }

    /// The same, layer by layer shown to `seen`.
    pub fn encode_patch_observed(
        &self,
        rest: &Field,
        mesh: &Propagation,
        memory: &mut Memory,
        seen: Observer,
    ) -> EncodedPatch {
        let (mut features, mut soft) = (Vec::new(), Vec::new());
        features::soft(rest, &mut features);
        encode((&self.soft, "soft"), mesh, &features, memory, &mut soft, seen);
        let mut queries = vec![0.0; HEADS * soft.len()];
        for (queries, head) in queries.chunks_exact_mut(soft.len()).zip(&self.heads) {
            product(queries, &soft, head, WIDTH, WIDTH, Into::Place);
        }
        let mut first = vec![0.0; soft.len()];
        fill_rows(&mut first, &self.first.bias);
        self.first.weight.add_product(&mut first, &soft);
        EncodedPatch { queries, first }
    }

    /// Displacement of each node (mm), given the encoded patch and the numbers of the tool's nodes (`features::rigid`).
    pub fn predict(&self, patch: &EncodedPatch, tool: &[f32], memory: &mut Memory) -> Field {
        self.predict_observed(patch, tool, memory, &mut |_, _, _| {})
    }

    /// The same, layer by layer shown to `seen`.
    pub fn predict_observed(&self, patch: &EncodedPatch, tool: &[f32], memory: &mut Memory, seen: Observer) -> Field {
        let mut rigid = std::mem::take(&mut memory.rigid);
        encode((&self.rigid, "rigid"), &self.tool, tool, memory, &mut rigid, seen);
        let Memory { keys, values, scores, attended, decoded, next, .. } = memory;
        keys.pack_transposed(&rigid, TOOL_NODES);
        values.pack(&rigid, WIDTH);
        memory.rigid = rigid;
        keys.product(scores, &patch.queries);
        softmax(scores, TOOL_NODES);
        values.product(attended, scores);
        // The patch's part of the first layer is known; what is left are the heads' rows.
        decoded.clone_from(&patch.first);
        for (at, (attended, joined)) in attended.chunks_exact(NODE_COUNT * WIDTH).zip(&self.joined).enumerate() {
            seen("head", at, attended);
            joined.add_product(decoded, attended);
        }
        relu(decoded);
        seen("decoder", 0, decoded);
        for (at, dense) in (1..).zip(&self.decoder) {
            next.resize(NODE_COUNT * dense.bias.len(), 0.0);
            fill_rows(next, &dense.bias);
            dense.weight.add_product(next, decoded);
            if at + 1 < DECODER.len() {
                relu(next);
            }
            seen("decoder", at, next);
            std::mem::swap(decoded, next);
        }
        let rows = decoded.as_chunks::<3>().0;
        std::array::from_fn(|node| Vector3::from(rows[node]) * UNIT_MM)
    }
}

/// Two layers of TAGConv, each followed by ReLU; named after the body.
fn encode(
    (layers, body): (&[TagConv; 2], &str),
    mesh: &Propagation,
    features: &[f32],
    memory: &mut Memory,
    out: &mut Vec<f32>,
    seen: Observer,
) {
    let Memory { strips, hops, layer, .. } = memory;
    layers[0].forward(mesh, features, strips, hops, layer);
    relu(layer);
    seen(body, 0, layer);
    layers[1].forward(mesh, layer, strips, hops, out);
    relu(out);
    seen(body, 1, out);
}

const _: () = assert!(HOPS == 3, "K of the paper");
