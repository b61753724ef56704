//! Training of the paper's network: `retina_core::network::faithful`, with its losses, batch and step.
//!
//! Read `prepared` (what a sample comes to) → `layers` → `network` (forward and backward) → `learn`.

pub mod layers;
pub mod learn;
pub mod network;
pub mod prepared;
