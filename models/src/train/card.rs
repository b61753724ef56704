//! The card of trained weights: what they are, what they were made from, how far they may be trusted, and numbers to check them by.
//!
//! The parity numbers are what the trainer computes for one sample of the validation split, which lies beside the card as a shard; the core's inference
//! must answer the same.

use serde::{Deserialize, Serialize};

/// See the module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Which network.
    pub network: String,
    /// What goes in and comes out, and in which units.
    pub what: String,
    /// Where it must not be trusted.
    pub limits: String,
    /// SHA-256 over the data set's shards.
    pub data_sha256: String,
    /// Samples of the training and of the validation split.
    pub samples: [usize; 2],
    /// The seed.
    pub seed: u64,
    /// Epochs of the schedule, and the one that was kept (from 0).
    pub epochs: [usize; 2],
    /// Parameters.
    pub parameters: usize,
    /// SHA-256 of the weight file.
    pub weights_sha256: String,
    /// Mean distance of nodes on the validation split (µm), before nodes are moved out of the needle.
    pub validation_node_um: f64,
    /// What the trainer computes for the sample beside the card.
    pub parity: Option<Parity>,
}

/// What a contact network computes for one sample.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parity {
    /// Sum of the standardised numbers of the nodes, and of the request.
    pub features: [f64; 2],
    /// Coefficients of every node's basis vectors, node by node.
    pub coefficients: Vec<f32>,
    /// Travel and reaction.
    pub motion: Vec<f32>,
    /// Logarithms of the error's quantiles over the depth, shifts included.
    pub quantiles: Vec<f32>,
}

/// What the contact networks take and answer.
pub const CONTACT: &str = "In: ratios of like quantities and scalar products that describe each node and the request (retina_core::network::features; \
lengths mm, forces mN, moduli kPa before the ratios are taken), standardised with the file's normaliser. Out: coefficients of vectors that turn with the request, \
in units of a share of the depth; travel in depths; reaction in forces; logarithms of the worst node's error over the depth.";

/// Where the contact networks must not be trusted.
pub const CONTACT_LIMITS: &str = "One layer of retina on choroid and sclera, a rigid needle without friction, the pressure of rest, an intact bond. A request \
whose numbers leave the extremes of the training (range.global.low, range.global.high) is answered and not called calibrated, as is a patch cut from a mesh.";

/// What the paper's network takes and answers.
pub const FAITHFUL: &str = "In: 21 numbers of each node of the patch and 25 of each of the tool's 102 (positions over 1.05 mm with three bands of encoding; \
direction and mN). Out: displacements in units of 0.1 mm.";

/// Where the paper's network must not be trusted.
pub const FAITHFUL_LIMITS: &str =
    "It is not told the tissue. It is here to be compared with, and no level of the service.";
