//! Data, training and evaluation of the learned retina patch.
//!
//! Read in this order: `sample` (one load step of a path, as every program here sees it) → `shard` (samples on disk) → `dataset` (how
//! they are made).

pub mod calibrate;
pub mod commands;
pub mod contact;
pub mod data;
pub mod dataset;
pub mod describe;
pub mod evaluate;
pub mod faithful;
pub mod journal;
pub mod parity;
pub mod reference_error;
pub mod sample;
pub mod shard;
pub mod train;
