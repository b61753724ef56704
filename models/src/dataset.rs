//! How samples are made: random indentation paths, computed in blocks, kept in shards.
//!
//! Read in this order: `draw` (what a path is) → `path` (its equilibria) → `truth` (how fine they are, and how far off they may be) → `blocks` (finished work on disk) →
//! `shards` (the samples by split) → `manifest` (what is beside them) → `run` (threads, progress, resuming) and `part` (several runs in one folder) → `report` (what a data set is worth).
//! `deformcontact` writes and reads the layout of the public code of the paper. The file layout is that of [`run::generate`].

pub mod blocks;
pub mod deformcontact;
pub mod draw;
pub mod error;
pub mod manifest;
pub mod part;
pub mod path;
pub mod report;
pub mod run;
pub mod shards;
pub mod truth;

pub use error::DatasetError;
