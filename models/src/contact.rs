//! Training of the contact networks: `contact`, which corrects the linear answer, and `corrected`, which corrects level `coarse`.
//!
//! Read `prepared` (what a sample comes to) → `network` (forward and backward) → `loss` → `bounds` (what errors to expect) → `learn`, `trained`.

pub mod bounds;
pub mod learn;
pub mod loss;
pub mod network;
pub mod prepared;
pub mod trained;
