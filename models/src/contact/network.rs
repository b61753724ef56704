//! Forward and backward pass of the contact network over many samples at once.
//!
//! The formulas are those of `retina_core::network::contact`; here every sample of a chunk is 64 rows of the same matrices, and what the
//! backward pass needs is kept. The derivative of each line stands in `backward`, in reverse order. The quantiles' head learns from the
//! pooled nodes without changing them.

use std::ops::Range;

use retina_core::network::activation::{activate_all, add_activated, times_slope};
use retina_core::network::contact::{MOTION, QUANTILES};
use retina_core::network::features::{BASIS, Features};
use retina_core::network::graph::Graph;
use retina_core::patch::NODE_COUNT;

use super::prepared::Prepared;
use crate::train::layers::Layer;
use crate::train::matrix::{add_product, add_product_transposed, add_row_sum, add_transposed_product};
use crate::train::parameters::{Layout, draw};

/// The form of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// Whether it corrects `coarse`.
    pub coarse: bool,
    /// Width of the trunk.
    pub width: usize,
    /// Blocks of the trunk.
    pub blocks: usize,
    /// How many of them, from the first, hear their neighbours.
    pub messages: usize,
    /// Hidden width of the heads; at most half of `64 × width`.
    pub hidden: usize,
}

struct Block {
    weight: Range<usize>,
    message: Option<Range<usize>>,
    bias: Range<usize>,
}

struct Head {
    weight: Range<usize>,
    bias: Range<usize>,
    out_weight: Range<usize>,
    out_bias: Range<usize>,
    outputs: usize,
}

/// A network's layout: where its parameters lie.
pub struct Network {
    /// Its form.
    pub form: Form,
    /// Its tensors.
    pub layout: Layout,
    /// The patch's mesh.
    pub graph: Graph,
    local: Range<usize>,
    global: Range<usize>,
    bias: Range<usize>,
    blocks: Vec<Block>,
    out: Range<usize>,
    out_bias: Range<usize>,
    motion: Head,
    quantile: Head,
}

/// What a forward pass leaves.
#[derive(Default)]
pub struct Pass {
    local: Vec<f32>,
    global: Vec<f32>,
    /// Before each activation; the input's first.
    sums: Vec<Vec<f32>>,
    /// After each block; the input's first.
    xs: Vec<Vec<f32>>,
    means: Vec<Vec<f32>>,
    pooled: Vec<f32>,
    motion_sum: Vec<f32>,
    motion_hidden: Vec<f32>,
    quantile_sum: Vec<f32>,
    quantile_hidden: Vec<f32>,
    /// Coefficients of the basis vectors, a row a node.
    pub out: Vec<f32>,
    /// Travel and reaction, a row a sample.
    pub motion: Vec<f32>,
    /// Logarithms of the error's quantiles over the depth, a row a sample.
    pub quantile: Vec<f32>,
}

impl Pass {
    /// Every layer of the first sample, as the core's observer is shown them.
    pub fn layers(&self, form: Form) -> Vec<Layer> {
        let Form { width, coarse, .. } = form;
        let (first, pooled) = (NODE_COUNT * width, width + Features::global_width(coarse));
        let mut layers = vec![Layer::new("input", 0, width, &self.xs[0][..first])];
        layers.extend(self.xs[1..].iter().enumerate().map(|(at, x)| Layer::new("block", at, width, &x[..first])));
        layers.extend([
            Layer::new("output", 0, BASIS, &self.out[..NODE_COUNT * BASIS]),
            Layer::new("pooled", 0, pooled, &self.pooled[..pooled]),
            Layer::new("motion", 0, MOTION, &self.motion[..MOTION]),
            Layer::new("quantile", 0, QUANTILES, &self.quantile[..QUANTILES]),
        ]);
        layers
    }
}

/// Derivatives of the loss by what a forward pass answers.
#[derive(Default)]
pub struct Slopes {
    /// By the coefficients.
    pub out: Vec<f32>,
    /// By the motion's numbers.
    pub motion: Vec<f32>,
    /// By the quantiles' logarithms.
    pub quantile: Vec<f32>,
}

impl Network {
    /// The network of that form.
    pub fn new(form: Form, graph: Graph) -> Self {
        let mut layout = Layout::default();
        let Form { coarse, width, hidden, .. } = form;
        let (locals, globals) = (Features::local_width(coarse), Features::global_width(coarse));
        let local = layout.add("input.local", &[locals, width]);
        let global = layout.add("input.global", &[globals, width]);
        let bias = layout.add("input.bias", &[width]);
        let blocks = (0..form.blocks)
            .map(|at| Block {
                weight: layout.add(&format!("block.{at}.weight"), &[width, width]),
                message: (at < form.messages).then(|| layout.add(&format!("block.{at}.message"), &[width, width])),
                bias: layout.add(&format!("block.{at}.bias"), &[width]),
            })
            .collect();
        let out = layout.add("output.weight", &[width, BASIS]);
        let out_bias = layout.add("output.bias", &[BASIS]);
        let mut head = |name: &str, outputs: usize| Head {
            weight: layout.add(&format!("{name}.hidden.weight"), &[width + globals, hidden]),
            bias: layout.add(&format!("{name}.hidden.bias"), &[hidden]),
            out_weight: layout.add(&format!("{name}.output.weight"), &[hidden, outputs]),
            out_bias: layout.add(&format!("{name}.output.bias"), &[outputs]),
            outputs,
        };
        let (motion, quantile) = (head("motion", MOTION), head("quantile", QUANTILES));
        Network { form, layout, graph, local, global, bias, blocks, out, out_bias, motion, quantile }
    }

    /// Parameters to begin with: the answer of such a network is its start.
    pub fn initial(&self, random: &mut fastrand::Rng) -> Vec<f32> {
        let mut parameters = vec![0.0; self.layout.len()];
        let (locals, globals) = (self.locals(), self.globals());
        let width = self.form.width;
        let mut set = |range: &Range<usize>, inner: usize, gain: f32| {
            draw(&mut parameters[range.clone()], inner, gain, random);
        };
        set(&self.local, locals, 1.0);
        set(&self.global, globals, 1.0);
        for block in &self.blocks {
            set(&block.weight, width, 1.0);
            if let Some(message) = &block.message {
                set(message, width, 1.0);
            }
        }
        set(&self.motion.weight, width + globals, 2.0);
        set(&self.quantile.weight, width + globals, 2.0);
        parameters
    }

    fn locals(&self) -> usize {
        Features::local_width(self.form.coarse)
    }

    fn globals(&self) -> usize {
        Features::global_width(self.form.coarse)
    }

    /// The answers for `samples`.
    pub fn forward(&self, parameters: &[f32], samples: &[&Prepared], pass: &mut Pass) {
        let Form { width, hidden, .. } = self.form;
        let (locals, globals) = (self.locals(), self.globals());
        let rows = samples.len() * NODE_COUNT;
        pass.local.clear();
        pass.global.clear();
        for sample in samples {
            pass.local.extend_from_slice(&sample.local);
            pass.global.extend_from_slice(&sample.global);
        }
        pass.sums.resize_with(1 + self.blocks.len(), Vec::new);
        pass.xs.resize_with(1 + self.blocks.len(), Vec::new);
        pass.means.resize_with(self.blocks.len(), Vec::new);

        let mut shared = broadcast(&parameters[self.bias.clone()], samples.len());
        add_product(&mut shared, &pass.global, &parameters[self.global.clone()], globals, width);
        let sum = &mut pass.sums[0];
        sum.clear();
        for shared in shared.chunks_exact(width) {
            for _ in 0..NODE_COUNT {
                sum.extend_from_slice(shared);
            }
        }
        add_product(sum, &pass.local, &parameters[self.local.clone()], locals, width);
        pass.xs[0].resize(rows * width, 0.0);
        activate_all(&mut pass.xs[0], sum);

        for (at, block) in self.blocks.iter().enumerate() {
            let (before, after) = pass.xs.split_at_mut(at + 1);
            let (x, next) = (&before[at], &mut after[0]);
            let mut sum = broadcast(&parameters[block.bias.clone()], rows);
            add_product(&mut sum, x, &parameters[block.weight.clone()], width, width);
            if let Some(message) = &block.message {
                let mean = &mut pass.means[at];
                mean.resize(rows * width, 0.0);
                let patch = NODE_COUNT * width;
                for (mean, x) in mean.chunks_exact_mut(patch).zip(x.chunks_exact(patch)) {
                    self.graph.mean(mean, x, width);
                }
                add_product(&mut sum, mean, &parameters[message.clone()], width, width);
            }
            next.clone_from(x);
            add_activated(next, &sum);
            pass.sums[at + 1] = sum;
        }
        let x = &pass.xs[self.blocks.len()];
        pass.out = broadcast(&parameters[self.out_bias.clone()], rows);
        add_product(&mut pass.out, x, &parameters[self.out.clone()], width, BASIS);

        pass.pooled.clear();
        for (at, sample) in samples.iter().enumerate() {
            let mut pooled = vec![0.0; width];
            for (node, weight) in sample.pool.iter().enumerate() {
                let x = &x[(at * NODE_COUNT + node) * width..][..width];
                pooled.iter_mut().zip(x).for_each(|(pooled, x)| *pooled += weight * x);
            }
            pass.pooled.extend(pooled);
            pass.pooled.extend_from_slice(&sample.global);
        }
        (pass.motion_sum, pass.motion_hidden, pass.motion) =
            self.motion.forward(parameters, &pass.pooled, width + globals, hidden);
        (pass.quantile_sum, pass.quantile_hidden, pass.quantile) =
            self.quantile.forward(parameters, &pass.pooled, width + globals, hidden);
    }

    /// Adds to `gradient` the derivative by the parameters, given those by the answers of `pass`.
    pub fn backward(
        &self,
        parameters: &[f32],
        samples: &[&Prepared],
        pass: &Pass,
        slopes: &Slopes,
        gradient: &mut [f32],
    ) {
        let Form { width, hidden, .. } = self.form;
        let (locals, globals) = (self.locals(), self.globals());
        let inner = width + globals;
        let x = &pass.xs[self.blocks.len()];
        let mut dx = vec![0.0; x.len()];
        add_product_transposed(&mut dx, &slopes.out, &parameters[self.out.clone()], width, BASIS);
        add_transposed_product(&mut gradient[self.out.clone()], x, &slopes.out, width, BASIS);
        add_row_sum(&mut gradient[self.out_bias.clone()], &slopes.out);

        let sizes = (inner, hidden);
        let kept = (pass.motion_sum.as_slice(), pass.motion_hidden.as_slice());
        let dpooled = self.motion.backward(parameters, &pass.pooled, kept, &slopes.motion, gradient, sizes);
        let kept = (pass.quantile_sum.as_slice(), pass.quantile_hidden.as_slice());
        self.quantile.backward(parameters, &pass.pooled, kept, &slopes.quantile, gradient, sizes);
        for (at, (sample, dpooled)) in samples.iter().zip(dpooled.chunks_exact(inner)).enumerate() {
            for (node, weight) in sample.pool.iter().enumerate() {
                let dx = &mut dx[(at * NODE_COUNT + node) * width..][..width];
                dx.iter_mut().zip(dpooled).for_each(|(dx, dpooled)| *dx += weight * dpooled);
            }
        }

        for (at, block) in self.blocks.iter().enumerate().rev() {
            let mut dsum = dx.clone();
            times_slope(&mut dsum, &pass.sums[at + 1]);
            add_transposed_product(&mut gradient[block.weight.clone()], &pass.xs[at], &dsum, width, width);
            add_row_sum(&mut gradient[block.bias.clone()], &dsum);
            add_product_transposed(&mut dx, &dsum, &parameters[block.weight.clone()], width, width);
            if let Some(message) = &block.message {
                add_transposed_product(&mut gradient[message.clone()], &pass.means[at], &dsum, width, width);
                let mut dmean = vec![0.0; dsum.len()];
                add_product_transposed(&mut dmean, &dsum, &parameters[message.clone()], width, width);
                let patch = NODE_COUNT * width;
                for (dx, dmean) in dx.chunks_exact_mut(patch).zip(dmean.chunks_exact(patch)) {
                    self.graph.add_transposed_mean(dx, dmean, width);
                }
            }
        }
        let mut dsum = dx;
        times_slope(&mut dsum, &pass.sums[0]);
        add_transposed_product(&mut gradient[self.local.clone()], &pass.local, &dsum, locals, width);
        let mut dshared = vec![0.0; samples.len() * width];
        for (dshared, dsum) in dshared.chunks_exact_mut(width).zip(dsum.chunks_exact(NODE_COUNT * width)) {
            add_row_sum(dshared, dsum);
        }
        add_transposed_product(&mut gradient[self.global.clone()], &pass.global, &dshared, globals, width);
        add_row_sum(&mut gradient[self.bias.clone()], &dshared);
    }
}

/// `rows` copies of `row`.
fn broadcast(row: &[f32], rows: usize) -> Vec<f32> {
    row.repeat(rows)
}

impl Head {
    fn forward(&self, parameters: &[f32], x: &[f32], inner: usize, hidden: usize) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
        let rows = x.len() / inner;
        let mut sum = broadcast(&parameters[self.bias.clone()], rows);
        add_product(&mut sum, x, &parameters[self.weight.clone()], inner, hidden);
        let mut activated = vec![0.0; sum.len()];
        activate_all(&mut activated, &sum);
        let mut out = broadcast(&parameters[self.out_bias.clone()], rows);
        add_product(&mut out, &activated, &parameters[self.out_weight.clone()], hidden, self.outputs);
        (sum, activated, out)
    }

    /// Adds to `gradient` and answers the derivative by `x`.
    fn backward(
        &self,
        parameters: &[f32],
        x: &[f32],
        (sum, activated): (&[f32], &[f32]),
        dout: &[f32],
        gradient: &mut [f32],
        (inner, hidden): (usize, usize),
    ) -> Vec<f32> {
        add_transposed_product(&mut gradient[self.out_weight.clone()], activated, dout, hidden, self.outputs);
        add_row_sum(&mut gradient[self.out_bias.clone()], dout);
        let mut dsum = vec![0.0; sum.len()];
        add_product_transposed(&mut dsum, dout, &parameters[self.out_weight.clone()], hidden, self.outputs);
        times_slope(&mut dsum, sum);
        add_transposed_product(&mut gradient[self.weight.clone()], x, &dsum, inner, hidden);
        add_row_sum(&mut gradient[self.bias.clone()], &dsum);
        let mut dx = vec![0.0; x.len()];
        add_product_transposed(&mut dx, &dsum, &parameters[self.weight.clone()], inner, hidden);
        dx
    }
}
