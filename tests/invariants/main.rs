//! Laws that every answer keeps, whatever its numbers: equilibrium, exact zeros, rigid motion, relabelling, symmetry, repeatability.
//!
//! Contract: laws are checked through [`PreparedScene::predict`](retina_core::predict::PreparedScene::predict) at levels `linear` and
//! `coarse` (`learned`: at the learned levels), in a few cases at `reference`, which takes seconds. Every law has a paired negative: what must change the answer does.
//!
//! Not here: values (`verification`), errors (`accuracy`).

mod auto;
mod bleb;
mod bleb_sequences;
mod effects;
mod equilibrium;
mod frames;
mod learned;
mod paths;
mod puncture;
mod pushed;
mod refusals;
mod repeatability;
mod sequences;
mod shape;
mod support;
mod tool_flex;
mod zeros;
