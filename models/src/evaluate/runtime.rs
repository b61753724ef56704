//! What a prediction costs, split into data (from a request to the numbers of nodes) and network, one at a time and four at a time, on one thread.
//!
//! A batch of four is four predictions one after the other: none waits for the others, and nothing is shared but the patch.

use std::fmt::Write as _;
use std::time::Instant;

use nalgebra::{Point3, Vector3};
use retina_core::network::contact::Memory as ContactMemory;
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::{EncodedPatch, FaithfulNetwork, Memory, features, tool};
use retina_core::network::features::Features;
use retina_core::network::graph::Graph;
use retina_core::network::input::{Field, Input};
use retina_core::patch::NODE_COUNT;

use super::errors::quantile;
use super::predictors::Contact;
use crate::describe;

/// Batches that are reported: one, and the paper's.
pub const BATCHES: [usize; 2] = [1, 4];

/// Milliseconds of many runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times {
    /// Each.
    pub ms: Vec<f64>,
}

impl Times {
    /// Adds the time since `start`.
    pub fn since(&mut self, start: Instant) {
        self.ms.push(start.elapsed().as_secs_f64() * 1e3);
    }

    /// The median (ms).
    pub fn median(&self) -> f64 {
        quantile(&self.ms, 0.5)
    }

    /// Where the tenth percent lies (ms).
    pub fn quick(&self) -> f64 {
        quantile(&self.ms, 0.1)
    }

    /// Median, and where the tenth and the ninetieth percent lie.
    pub fn text(&self) -> String {
        format!("{:.3} ({:.3}–{:.3})", self.median(), self.quick(), quantile(&self.ms, 0.9))
    }
}

/// The paper's network with what it keeps.
pub struct Paper {
    /// The network.
    pub network: FaithfulNetwork,
    /// The patch's mesh.
    pub mesh: Propagation,
    /// Its memory.
    pub memory: Memory,
    rigid: Vec<f32>,
}

impl Paper {
    /// Around `network`.
    pub fn new(network: FaithfulNetwork) -> Self {
        let edges: Vec<(usize, usize)> = describe::graph().edges().collect();
        let mesh = Propagation::new(NODE_COUNT, &edges);
        Paper { network, mesh, memory: Memory::default(), rigid: Vec::new() }
    }

    /// Numbers of the tool's nodes at `touch_travel_mm`, where it first touches.
    pub fn tool(&mut self, input: &Input, touch_travel_mm: f32) -> &[f32] {
        let pose = input.pose_after(touch_travel_mm);
        let place = |node: Point3<f64>| -> Vector3<f32> { (pose * node).coords.cast() };
        features::rigid(&tool::nodes(&input.body).map(place), &input.direction, input.force_mn, &mut self.rigid);
        &self.rigid
    }

    /// What depends on the patch alone.
    pub fn patch(&mut self, rest: &Field) -> EncodedPatch {
        self.network.encode_patch(rest, &self.mesh, &mut self.memory)
    }
}

/// The table of data and network, from inputs with the travel to the first touch (mm).
pub fn split(paper: &mut Paper, contacts: &mut [Contact], samples: &[(Input, f32)], turns: usize) -> String {
    let mut text = String::from(
        "| | batch | data, ms: median (10–90 %) | network, ms: median (10–90 %) | both, ms: median |\n|---|---|---|---|---|\n",
    );
    let mut line = |name: &str, batch: usize, data: &Times, network: &Times| {
        let both = Times { ms: data.ms.iter().zip(&network.ms).map(|(a, b)| a + b).collect() };
        // A String takes whatever is written.
        let _ = writeln!(text, "| {name} | {batch} | {} | {} | {:.3} |", data.text(), network.text(), both.median());
    };
    for batch in BATCHES {
        let (mut data, mut network) = (Times::default(), Times::default());
        let Some((first, _)) = samples.first() else { break };
        let patch = paper.patch(&first.rest_mm);
        for samples in (0..turns).flat_map(|_| samples.chunks_exact(batch)) {
            let start = Instant::now();
            let tools: Vec<Vec<f32>> =
                samples.iter().map(|(input, travel)| paper.tool(input, *travel).to_vec()).collect();
            data.since(start);
            let start = Instant::now();
            for tool in &tools {
                std::hint::black_box(paper.network.predict(&patch, tool, &mut paper.memory));
            }
            network.since(start);
        }
        line("the paper's network", batch, &data, &network);
    }
    let graph: Graph = describe::graph();
    for contact in contacts {
        for batch in BATCHES {
            let (mut data, mut network) = (Times::default(), Times::default());
            let (mut features, mut memory) = (Features::default(), ContactMemory::default());
            for samples in (0..turns).flat_map(|_| samples.chunks_exact(batch)) {
                let start = Instant::now();
                for (input, _) in samples {
                    features.describe(input, contact.started_from(input));
                    std::hint::black_box(&features);
                }
                data.since(start);
                let start = Instant::now();
                for (input, _) in samples {
                    std::hint::black_box(contact.network.predict(input, &graph, &mut memory));
                }
                network.since(start);
            }
            // A prediction describes its request itself: what is left is the network's.
            network.ms.iter_mut().zip(&data.ms).for_each(|(whole, data)| *whole -= data);
            line(&contact.label(), batch, &data, &network);
        }
    }
    text
}
