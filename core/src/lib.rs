//! The retina patch under a needle: geometry, tissue, effects, finite elements and the predictor that chooses among them.
//!
//! Units everywhere: mm, mN, kPa (= mN/mm²), s, kg, µJ (= mN·mm). Patch frame: right-handed, origin on the inner retinal
//! surface, +z out of the tissue into the vitreous. This crate does no I/O, reads no clock and spawns no thread.

pub mod approach;
pub mod assemble;
pub mod comparison;
pub mod effect;
pub mod effects;
pub mod equilibrium;
pub mod kernel;
pub mod layered;
pub mod mesh;
pub mod needle;
pub mod network;
pub mod patch;
pub mod predict;
pub mod progress;
pub mod range;
pub mod scene;
pub mod sequence;
pub mod solve;
pub mod surface;
pub mod tissue;
pub mod working_range;
