//! Why there is no equilibrium.

use thiserror::Error;

use crate::solve::newton::NewtonError;

/// Why no equilibrium was found.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EquilibriumError {
    /// A solve failed.
    #[error(transparent)]
    Newton(#[from] NewtonError),
    /// The contact pressures that friction is made from kept changing.
    #[error(
        "`friction`: the contact pressures did not settle in {rounds} rounds (they change by {change:.2e} of their sum, allowed {allowed:.0e})"
    )]
    NotSettled {
        /// Rounds made.
        rounds: usize,
        /// Change of the pressures in the last round, relative to their sum.
        change: f64,
        /// Allowed change.
        allowed: f64,
    },
    /// The tissue gives way instead of coming to rest.
    #[error(
        "the tissue punctures before it bears the load: not at rest after {iterations} Newton iterations, it is strained by {strain:.2}, and bears {limit:.2}"
    )]
    Torn {
        /// Newton iterations made.
        iterations: usize,
        /// Largest |principal stretch − 1| then.
        strain: f64,
        /// What the tissue bears.
        limit: f64,
    },
}

impl EquilibriumError {
    /// Whether the caller asked to stop.
    pub fn is_interrupted(&self) -> bool {
        matches!(self, Self::Newton(NewtonError::Interrupted { .. }))
    }

    /// Newton iterations spent before the failure, as far as it knows them.
    pub fn iterations(&self) -> usize {
        match self {
            Self::Newton(cause) => cause.iterations(),
            Self::NotSettled { .. } => 0,
            Self::Torn { iterations, .. } => *iterations,
        }
    }
}
