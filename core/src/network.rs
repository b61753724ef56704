//! Networks that learned what a quicker level gets wrong: inference by hand in f32.
//!
//! [`contact::ContactNetwork`] adds to the linear (or the coarse) answer a correction that turns and mirrors with the request, moves nothing where
//! nothing presses and leaves no node inside the needle. Read in this order: `input` (what is known of one request) → `features` (numbers
//! that no rotation changes, and the vectors that rotate along) → `dense` and `graph` (products) → `contact` (the network) → `projection`.
//! [`faithful`] is the network of the paper that this program started from, for comparison. Weights are read by `weights`, from bytes.
//!
//! Not here: training (`retina-models`), when a level is chosen (`predict`).

pub mod activation;
pub mod contact;
pub mod contact_frame;
pub mod dense;
pub mod faithful;
pub mod features;
pub mod graph;
mod header;
pub mod input;
pub mod observer;
pub mod packed;
pub mod plain;
pub mod projection;
pub mod softmax;
pub mod weights;
