//! Efficient classical baselines, fitted to the same training split: what a network has to beat.

pub mod kelvinlet;
pub mod nearest;
pub mod numbers;
pub mod pod;
