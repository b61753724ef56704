//! How well parameters do over some samples.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Parts of a loss, summed over samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// What is minimised.
    pub total: f64,
    /// Mean distance of nodes (µm).
    pub node_um: f64,
    /// Absolute error of the travel (µm).
    pub travel_um: f64,
    /// Error of the reaction over the force.
    pub reaction: f64,
}

impl AddAssign for Score {
    fn add_assign(&mut self, other: Self) {
        self.total += other.total;
        self.node_um += other.node_um;
        self.travel_um += other.travel_um;
        self.reaction += other.reaction;
    }
}

impl Score {
    /// All parts over `count`.
    pub fn over(&self, count: usize) -> Self {
        let n = count as f64;
        Score {
            total: self.total / n,
            node_um: self.node_um / n,
            travel_um: self.travel_um / n,
            reaction: self.reaction / n,
        }
    }
}
