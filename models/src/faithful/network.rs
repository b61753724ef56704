//! Forward and backward pass of the paper's network for one sample, and its loss.
//!
//! The loss is the mean absolute error of the displacements' coordinates plus, with [`CONSISTENCY`] as weight, the mean length by which the mesh's
//! edges are wrong. The public code compares the predicted edges with those at rest, which punishes every deformation; here they are compared with
//! those of the truth.

use retina_core::network::faithful::features::{RIGID, SOFT};
use retina_core::network::faithful::tool::{self, TOOL_NODES};
use retina_core::network::faithful::{DECODER, HEADS, UNIT_MM, WIDTH};
use retina_core::network::graph::Graph;
use retina_core::patch::NODE_COUNT;

use super::attention::Attention;
use super::encoder::{Convolution, Encoded, Encoder, Mesh};
use super::layers::{Attended, Dense, Head};
use super::prepared::View;
use super::variant::Backbone;
use crate::train::layers::Layer;
use crate::train::parameters::{Layout, draw};
use crate::train::score::Score;

/// Weight of the edges against the nodes (λ of the paper).
pub const CONSISTENCY: f32 = 1.0;
/// Micrometres in the network's unit.
const UNIT_UM: f32 = 1e3 * UNIT_MM;
/// An edge wrong by less than this has no direction to be wrong in (network's unit).
const SMALLEST_EDGE: f32 = 1e-6;

/// Variance of a weight before a ReLU times the numbers that it sums: what keeps the size of the activations.
const HIDDEN_GAIN: f32 = 2.0;
/// The same for the last layer, so that training begins with small displacements.
const LAST_GAIN: f32 = 0.1;

/// Where the parameters lie.
pub struct Network {
    /// Its tensors.
    pub layout: Layout,
    graph: Graph,
    patch: Mesh,
    tool: Mesh,
    soft: Encoder,
    rigid: Encoder,
    heads: [Head; HEADS],
    decoder: Vec<Dense>,
}

/// What a forward pass leaves.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// The patch's encoder.
    pub soft: Encoded,
    /// The tool's.
    pub rigid: Encoded,
    /// The heads.
    pub heads: Vec<Attended>,
    /// Input of each layer of the decoder, then the answer: displacements in the network's unit, three a node.
    pub rows: Vec<Vec<f32>>,
}

fn dense(layout: &mut Layout, name: &str, [inner, outer]: [usize; 2], relu: bool) -> Dense {
    Dense {
        weight: layout.add(&format!("{name}.weight"), &[inner, outer]),
        bias: layout.add(&format!("{name}.bias"), &[outer]),
        inner,
        outer,
        relu,
    }
}

fn convolution(layout: &mut Layout, name: &str, inputs: usize, backbone: Backbone) -> Convolution {
    let sizes = [Convolution::rows(backbone) * inputs, WIDTH];
    match backbone {
        Backbone::Tag => Convolution::Tag(dense(layout, name, sizes, true)),
        Backbone::Gcn => Convolution::Gcn(dense(layout, name, sizes, true)),
        Backbone::Gat => Convolution::Gat(Attention {
            weight: layout.add(&format!("{name}.weight"), &sizes),
            bias: layout.add(&format!("{name}.bias"), &[WIDTH]),
            toward: ["here", "there"].map(|side| layout.add(&format!("{name}.{side}"), &[WIDTH])),
            inner: inputs,
        }),
    }
}

impl Pass {
    /// Every layer, as the core's observer is shown them.
    pub fn layers(&self) -> Vec<Layer> {
        let mut layers = Vec::new();
        for (body, encoded) in [("soft", &self.soft), ("rigid", &self.rigid)] {
            let convolved = encoded.layers.iter().enumerate();
            layers.extend(convolved.map(|(at, layer)| Layer::new(body, at, WIDTH, &layer.out)));
        }
        layers.extend(self.heads.iter().enumerate().map(|(at, head)| Layer::new("head", at, WIDTH, &head.out)));
        let decoded = self.rows[1..].iter().zip(DECODER).enumerate();
        layers.extend(decoded.map(|(at, (rows, [_, outer]))| Layer::new("decoder", at, outer, rows)));
        layers
    }
}

impl Network {
    /// The network over the grid's mesh.
    pub fn new(graph: Graph, backbone: Backbone) -> Self {
        let mut layout = Layout::default();
        let mut encoder = |body: &str, inputs: usize| Encoder {
            layers: [(0, inputs), (1, WIDTH)]
                .map(|(at, inputs)| convolution(&mut layout, &format!("{body}.{at}"), inputs, backbone)),
        };
        let (soft, rigid) = (encoder("soft", SOFT), encoder("rigid", RIGID));
        let last = DECODER.len() - 1;
        let decoder = DECODER
            .into_iter()
            .enumerate()
            .map(|(at, sizes)| dense(&mut layout, &format!("decoder.{at}"), sizes, at < last))
            .collect();
        let heads = [0, 1].map(|at| Head { weight: layout.add(&format!("head.{at}"), &[WIDTH, WIDTH]) });
        let edges: Vec<(usize, usize)> = graph.edges().collect();
        let patch = Mesh::new(NODE_COUNT, &edges);
        let tool = Mesh::new(TOOL_NODES, &tool::edges());
        Network { layout, graph, patch, tool, soft, rigid, heads, decoder }
    }

    /// Parameters to begin with.
    pub fn initial(&self, random: &mut fastrand::Rng) -> Vec<f32> {
        let mut parameters = vec![0.0; self.layout.len()];
        for convolution in self.soft.layers.iter().chain(&self.rigid.layers) {
            match convolution {
                Convolution::Tag(dense) | Convolution::Gcn(dense) => {
                    draw(&mut parameters[dense.weight.clone()], dense.inner, HIDDEN_GAIN, random);
                }
                Convolution::Gat(attention) => {
                    draw(&mut parameters[attention.weight.clone()], attention.inner, HIDDEN_GAIN, random);
                    for toward in &attention.toward {
                        draw(&mut parameters[toward.clone()], WIDTH, 1.0, random);
                    }
                }
            }
        }
        for dense in &self.decoder {
            let gain = if dense.relu { HIDDEN_GAIN } else { LAST_GAIN };
            draw(&mut parameters[dense.weight.clone()], dense.inner, gain, random);
        }
        for head in &self.heads {
            draw(&mut parameters[head.weight.clone()], WIDTH, 1.0, random);
        }
        parameters
    }

    /// The answer for one sample.
    pub fn forward(&self, parameters: &[f32], view: &View) -> Pass {
        let soft = self.soft.forward(parameters, &self.patch, &view.soft);
        let rigid = self.rigid.forward(parameters, &self.tool, &view.rigid);
        let heads: Vec<Attended> =
            self.heads.iter().map(|head| head.forward(parameters, soft.out(), rigid.out())).collect();
        let mut joined = Vec::with_capacity(NODE_COUNT * DECODER[0][0]);
        for node in 0..NODE_COUNT {
            for part in std::iter::once(soft.out()).chain(heads.iter().map(|head| head.out.as_slice())) {
                joined.extend_from_slice(&part[node * WIDTH..][..WIDTH]);
            }
        }
        let mut rows = vec![joined];
        for dense in &self.decoder {
            let next = dense.forward(parameters, &rows[rows.len() - 1]);
            rows.push(next);
        }
        Pass { soft, rigid, heads, rows }
    }

    /// Adds to `gradient` the derivative by the parameters, given that by the answer.
    pub fn backward(&self, parameters: &[f32], pass: &Pass, dout: Vec<f32>, gradient: &mut [f32]) {
        let mut d = dout;
        for (at, dense) in self.decoder.iter().enumerate().rev() {
            d = dense.backward(parameters, &pass.rows[at], &pass.rows[at + 1], d, gradient);
        }
        let part = |at: usize| -> Vec<f32> {
            d.chunks_exact(DECODER[0][0]).flat_map(|row| row[at * WIDTH..][..WIDTH].iter().copied()).collect()
        };
        let mut dsoft = part(0);
        let mut drigid = vec![0.0; TOOL_NODES * WIDTH];
        for (at, head) in self.heads.iter().enumerate() {
            head.backward(
                parameters,
                pass.soft.out(),
                pass.rigid.out(),
                &pass.heads[at],
                &part(1 + at),
                gradient,
                &mut dsoft,
                &mut drigid,
            );
        }
        self.soft.backward(parameters, &self.patch, &pass.soft, dsoft, gradient);
        self.rigid.backward(parameters, &self.tool, &pass.rigid, drigid, gradient);
    }

    /// The loss of displacements `out` against `target`, and its derivative times `weight`.
    pub fn loss(&self, out: &[f32], target: &[f32], weight: f32) -> (Score, Vec<f32>) {
        let errors: Vec<f32> = out.iter().zip(target).map(|(out, target)| out - target).collect();
        let per_number = 1.0 / errors.len() as f32;
        let mut total: f64 = errors.iter().map(|error| f64::from(per_number * error.abs())).sum();
        let mut slope: Vec<f32> = errors.iter().map(|error| weight * per_number * error.signum()).collect();
        let edges = self.patch.edges() as f32;
        for (a, b) in self.graph.edges() {
            let wrong = [0, 1, 2].map(|k| errors[3 * a + k] - errors[3 * b + k]);
            let length = wrong.iter().map(|x| x * x).sum::<f32>().sqrt();
            total += f64::from(CONSISTENCY * length / edges);
            if length > SMALLEST_EDGE {
                for k in 0..3 {
                    let push = weight * CONSISTENCY * wrong[k] / (length * edges);
                    slope[3 * a + k] += push;
                    slope[3 * b + k] -= push;
                }
            }
        }
        let distances = errors.as_chunks::<3>().0.iter().map(|e| e.iter().map(|x| x * x).sum::<f32>().sqrt());
        let node_um = f64::from(UNIT_UM * distances.sum::<f32>() / NODE_COUNT as f32);
        (Score { total, node_um, ..Score::default() }, slope)
    }
}
