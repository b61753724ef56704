//! The contact network: what a level's answer lacks, from invariants of each node.
//!
//! ```text
//! x⁰ = a(local W + global V + b)
//! xⁿ = xⁿ⁻¹ + a(xⁿ⁻¹ Wₙ + mean(xⁿ⁻¹) Mₙ + bₙ)         mean over the neighbours in the mesh; some blocks have no Mₙ
//! u  = start + scale Σ cₖ basisₖ,   c = x W + b
//! p  = Σ poolᵢ xᵢ
//! travel, reaction = those of the start, corrected by m = a([p, global] W + b) W' + b'
//! error quantiles  = depth exp(q),   q = a([p, global] W + b) W' + b' + shift of the mean strain's bin
//! ```
//!
//! Inputs are standardised; the normaliser is folded into the first layer when the weights are read. The reaction keeps what equilibrium
//! demands of it: along the direction it is the force. After that, `projection` moves the nodes out of the needle.
//!
//! Two networks have this form: `contact` corrects the linear answer, `corrected` that of level `coarse`.

use nalgebra::Vector3;

use super::activation::{activate_all, add_activated};
use super::dense::{Into, fill_rows, product};
use super::features::{BASIS, Features, SIDES};
use super::graph::Graph;
use super::input::{Answer, Field, Input};
use super::observer::Observer;
use super::projection;
use super::weights::{Weights, WeightsError};
use crate::patch::NODE_COUNT;

/// Which answer a network corrects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The linear one.
    Linear,
    /// That of level `coarse`.
    Coarse,
}

impl Start {
    /// The network's name in its weights.
    pub fn network(self) -> &'static str {
        match self {
            Start::Linear => "contact",
            Start::Coarse => "corrected",
        }
    }
}

/// One block of the trunk.
#[derive(Clone, Debug, PartialEq)]
struct Block {
    weight: Vec<f32>,
    message: Option<Vec<f32>>,
    bias: Vec<f32>,
}

/// Two dense layers on the pooled patch.
#[derive(Clone, Debug, PartialEq)]
struct Head {
    hidden: usize,
    weight: Vec<f32>,
    bias: Vec<f32>,
    out_weight: Vec<f32>,
    out_bias: Vec<f32>,
}

/// A trained network.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactNetwork {
    start: Start,
    width: usize,
    local: Vec<f32>,
    global: Vec<f32>,
    bias: Vec<f32>,
    blocks: Vec<Block>,
    out: Vec<f32>,
    out_bias: Vec<f32>,
    motion: Head,
    quantile: Head,
    /// What the quantiles' logarithms lack on the validation, by bins of strain.
    shift: Vec<f32>,
    /// Quantiles of the error over the depth by bins of tip and strain, and the strains of the training.
    prior: Vec<f32>,
    /// Means and inverse deviations of the request's numbers.
    global_mean: Vec<f32>,
    global_scale: Vec<f32>,
    /// Between which they lay in training.
    low: Vec<f32>,
    high: Vec<f32>,
}

/// Memory that one thread keeps between predictions.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// The request's description.
    pub features: Features,
    x: Vec<f32>,
    mean: Vec<f32>,
    sum: Vec<f32>,
    shared: Vec<f32>,
    out: Vec<f32>,
    pooled: Vec<f32>,
    motion: Vec<f32>,
    quantiles: Vec<f32>,
}

impl Memory {
    /// Coefficients, motion and logarithms of the error's quantiles over the depth, of the last prediction.
    pub fn answered(&self) -> (&[f32], &[f32], &[f32]) {
        (&self.out, &self.motion, &self.quantiles)
    }
}

/// What a network answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// Displacements, travel and reaction.
    pub answer: Answer,
    /// Expected error of the worst node (mm): median and 95 % bound.
    pub error_mm: [f32; 2],
    /// Whether the request lies between the extremes of the training.
    pub known: bool,
}

/// Numbers that the motion's head answers: travel and the reaction's sides.
pub const MOTION: usize = 1 + SIDES;
/// Numbers that the quantiles' head answers.
pub const QUANTILES: usize = 2;
/// Upper ends of the bins of mean strain in which bounds are set right and [`ContactNetwork::prior`] is kept; the last bin has none.
const STRAIN_ENDS: [f32; 2] = [0.1, 0.3];
/// Number of these bins.
pub const STRAIN_BINS: usize = STRAIN_ENDS.len() + 1;
/// Tips with and without an edge.
pub const TIP_BINS: usize = 2;
/// Place of the mean strain among a request's numbers.
pub const STRAIN: usize = 2;

/// The bin of a mean strain.
pub fn strain_bin(strain: f32) -> usize {
    STRAIN_ENDS.iter().filter(|&&end| strain >= end).count()
}

/// A request is known where its numbers leave the extremes of the training by at most this share of their range.
const MARGIN: f32 = 0.02;

impl ContactNetwork {
    /// The network with these weights.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn new(start: Start, file: &[u8]) -> Result<Self, WeightsError> {
        let weights = Weights::read(start.network(), file)?;
        let coarse = start == Start::Coarse;
        let (locals, globals) = (Features::local_width(coarse), Features::global_width(coarse));
        let width = weights.shape("input.bias")?.first().copied().unwrap_or(0);
        let mut local = weights.take("input.local", &[locals, width])?;
        let mut global = weights.take("input.global", &[globals, width])?;
        let mut bias = weights.take("input.bias", &[width])?;
        let global_mean = weights.take("normaliser.global.mean", &[globals])?;
        let global_scale = weights.take("normaliser.global.scale", &[globals])?;
        let local_mean = weights.take("normaliser.local.mean", &[locals])?;
        let local_scale = weights.take("normaliser.local.scale", &[locals])?;
        fold(&mut local, &mut bias, &local_mean, &local_scale);
        fold(&mut global, &mut bias, &global_mean, &global_scale);
        let mut blocks = Vec::new();
        while weights.has(&format!("block.{}.weight", blocks.len())) {
            let name = |part: &str| format!("block.{}.{part}", blocks.len());
            let message = name("message");
            blocks.push(Block {
                weight: weights.take(&name("weight"), &[width, width])?,
                message: if weights.has(&message) { Some(weights.take(&message, &[width, width])?) } else { None },
                bias: weights.take(&name("bias"), &[width])?,
            });
        }
        Ok(ContactNetwork {
            start,
            width,
            local,
            global,
            bias,
            blocks,
            out: weights.take("output.weight", &[width, BASIS])?,
            out_bias: weights.take("output.bias", &[BASIS])?,
            motion: Head::new(&weights, "motion", width + globals, MOTION)?,
            quantile: Head::new(&weights, "quantile", width + globals, QUANTILES)?,
            shift: weights.take("quantile.shift", &[STRAIN_BINS, QUANTILES])?,
            prior: weights.take("prior", &[TIP_BINS, STRAIN_BINS, QUANTILES])?,
            low: weights.take("range.global.low", &[globals])?,
            high: weights.take("range.global.high", &[globals])?,
            global_mean,
            global_scale,
        })
    }

    /// Which answer it corrects.
    pub fn start(&self) -> Start {
        self.start
    }

    /// Quantiles of the worst node's error over the depth before anything is computed: those of the validation in the bin of tip and strain.
    pub fn prior(&self, edged: bool, strain: f32) -> [f32; QUANTILES] {
        let bin = usize::from(edged) * STRAIN_BINS + strain_bin(strain);
        [0, 1].map(|k| self.prior[bin * QUANTILES + k])
    }

    /// Whether a mean strain (depth over what yields) lies between the extremes of the training.
    pub fn knows_depth(&self, strain: f32) -> bool {
        (self.low[STRAIN]..=self.high[STRAIN]).contains(&strain)
    }

    /// Memory that it holds (bytes).
    pub fn memory_bytes(&self) -> usize {
        let block = |block: &Block| block.weight.len() + block.message.as_ref().map_or(0, Vec::len) + block.bias.len();
        let head = |head: &Head| head.weight.len() + head.out_weight.len();
        let numbers = self.local.len()
            + self.global.len()
            + self.blocks.iter().map(block).sum::<usize>()
            + self.out.len()
            + head(&self.motion)
            + head(&self.quantile);
        size_of::<f32>() * numbers
    }

    /// Corrects the answer that `input` brings; `None` where it lacks the one that this network starts from.
    pub fn predict(&self, input: &Input, graph: &Graph, memory: &mut Memory) -> Option<Corrected> {
        self.predict_observed(input, graph, memory, &mut |_, _, _| {})
    }

    /// The same, layer by layer shown to `seen`.
    pub fn predict_observed(
        &self,
        input: &Input,
        graph: &Graph,
        memory: &mut Memory,
        seen: Observer,
    ) -> Option<Corrected> {
        let coarse = match self.start {
            Start::Linear => None,
            Start::Coarse => Some(input.coarse.as_ref()?),
        };
        memory.features.describe(input, coarse);
        self.forward(graph, memory, seen);
        let start = coarse.unwrap_or(&input.linear);
        let mut answer = self.assemble(input, start, memory);
        projection::out_of_needle(input, &mut answer);
        let error_mm = [0, 1].map(|k| input.depth_mm * memory.quantiles[k].exp());
        Some(Corrected { answer, error_mm, known: self.knows(&memory.features.global) })
    }

    /// Whether a request's numbers lie between the extremes of the training.
    fn knows(&self, global: &[f32]) -> bool {
        global.iter().zip(&self.low).zip(&self.high).all(|((number, low), high)| {
            let margin = MARGIN * (high - low) + f32::EPSILON * high.abs();
            (low - margin..=high + margin).contains(number)
        })
    }

    /// Coefficients into `memory.out`, the motion's numbers into `memory.motion`, the quantiles' logarithms into `memory.quantiles`.
    fn forward(&self, graph: &Graph, memory: &mut Memory, seen: Observer) {
        let Memory { features, x, mean, sum, shared, out, pooled, motion, quantiles } = memory;
        let (width, size) = (self.width, NODE_COUNT * self.width);
        for buffer in [&mut *x, mean, sum] {
            buffer.resize(size, 0.0);
        }
        let globals = features.global.len();
        shared.resize(width, 0.0);
        product(shared, &features.global, &self.global, globals, width, Into::Place);
        shared.iter_mut().zip(&self.bias).for_each(|(shared, bias)| *shared += bias);
        fill_rows(sum, shared);
        product(sum, &features.local, &self.local, features.local.len() / NODE_COUNT, width, Into::Sum);
        activate_all(x, sum);
        seen("input", 0, x);
        for (at, block) in self.blocks.iter().enumerate() {
            fill_rows(sum, &block.bias);
            product(sum, x, &block.weight, width, width, Into::Sum);
            if let Some(message) = &block.message {
                graph.mean(mean, x, width);
                product(sum, mean, message, width, width, Into::Sum);
            }
            add_activated(x, sum);
            seen("block", at, x);
        }
        out.resize(NODE_COUNT * BASIS, 0.0);
        fill_rows(out, &self.out_bias);
        product(out, x, &self.out, width, BASIS, Into::Sum);
        seen("output", 0, out);
        pooled.resize(width + globals, 0.0);
        product(&mut pooled[..width], &features.pool, x, NODE_COUNT, width, Into::Place);
        let standard = features.global.iter().zip(&self.global_mean).zip(&self.global_scale);
        for (to, ((number, mean), scale)) in pooled[width..].iter_mut().zip(standard) {
            *to = (number - mean) * scale;
        }
        seen("pooled", 0, pooled);
        self.motion.forward(pooled, sum, motion);
        self.quantile.forward(pooled, sum, quantiles);
        let shift = &self.shift[strain_bin(features.global[STRAIN]) * QUANTILES..];
        quantiles.iter_mut().zip(shift).for_each(|(quantile, shift)| *quantile += shift);
        seen("motion", 0, motion);
        seen("quantile", 0, quantiles);
    }

    /// Displacements, travel and reaction from what `forward` left.
    fn assemble(&self, input: &Input, start: &Answer, memory: &Memory) -> Answer {
        let Memory { features, out, motion, .. } = memory;
        let mut displacement_mm: Field = start.displacement_mm;
        for (node, moved) in displacement_mm.iter_mut().enumerate() {
            let coefficients = &out[node * BASIS..][..BASIS];
            let correction: Vector3<f32> =
                features.basis[node].iter().zip(coefficients).map(|(vector, coefficient)| vector * *coefficient).sum();
            *moved += correction * features.scale_mm[node];
        }
        let sides: Vector3<f32> = features.sides.iter().zip(&motion[1..]).map(|(side, c)| side * *c).sum();
        let reaction = start.reaction_mn + sides * input.force_mn;
        Answer {
            displacement_mm,
            travel_mm: start.travel_mm + input.depth_mm * motion[0],
            reaction_mn: balanced(&reaction, input),
        }
    }
}

/// `reaction` with the part along the direction that equilibrium demands: minus the force.
pub fn balanced(reaction: &Vector3<f32>, input: &Input) -> Vector3<f32> {
    reaction - input.direction * (reaction.dot(&input.direction) + input.force_mn)
}

/// Folds `(x − mean) scale` into the weights that follow it.
fn fold(weight: &mut [f32], bias: &mut [f32], mean: &[f32], scale: &[f32]) {
    for (row, (mean, scale)) in weight.chunks_exact_mut(bias.len()).zip(mean.iter().zip(scale)) {
        for (weight, bias) in row.iter_mut().zip(bias.iter_mut()) {
            *weight *= scale;
            *bias -= mean * *weight;
        }
    }
}

impl Head {
    fn new(weights: &Weights, name: &str, inner: usize, outputs: usize) -> Result<Self, WeightsError> {
        let hidden = weights.shape(&format!("{name}.hidden.bias"))?.first().copied().unwrap_or(0);
        Ok(Head {
            hidden,
            weight: weights.take(&format!("{name}.hidden.weight"), &[inner, hidden])?,
            bias: weights.take(&format!("{name}.hidden.bias"), &[hidden])?,
            out_weight: weights.take(&format!("{name}.output.weight"), &[hidden, outputs])?,
            out_bias: weights.take(&format!("{name}.output.bias"), &[outputs])?,
        })
    }

    /// `out = a(x W + b) W' + b'`; `scratch` is overwritten and at least twice the hidden width long.
    fn forward(&self, x: &[f32], scratch: &mut [f32], out: &mut Vec<f32>) {
        let (sum, rest) = scratch.split_at_mut(self.hidden);
        let activated = &mut rest[..self.hidden];
        sum.copy_from_slice(&self.bias);
        product(sum, x, &self.weight, x.len(), self.hidden, Into::Sum);
        activate_all(activated, sum);
        out.clear();
        out.extend_from_slice(&self.out_bias);
        product(out, activated, &self.out_weight, self.hidden, self.out_bias.len(), Into::Sum);
    }
}
