//! Training of the paper's network: `retina_core::network::faithful`, with its losses, batch and step; and the variants of its ablation.
//!
//! Read `prepared` (what a sample comes to) → `layers` → `encoder` → `network` (forward and backward) → `learn` → `variant`.

pub mod attention;
pub mod encoder;
pub mod layers;
pub mod learn;
pub mod neighbours;
pub mod network;
pub mod prepared;
pub mod variant;
