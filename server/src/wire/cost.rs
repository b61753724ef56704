//! What accuracy costs in time, as measured and committed with this version.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// `GET /v1/accuracy`: errors and times of levels and settings, over requests of three kinds.
#[derive(Serialize, Deserialize, ToSchema)]
pub struct CostTable {
    /// What the measurement was made with.
    pub circumstances: CostCircumstances,
    /// One panel a kind of request.
    pub panels: Vec<CostPanel>,
}

/// What a measurement was made with.
#[derive(Serialize, Deserialize, ToSchema)]
pub struct CostCircumstances {
    /// Commit of the program.
    pub commit: String,
    /// The processor, of which one core was used.
    pub processor: String,
    /// Version of the program.
    pub version: String,
    /// Seed of the requests.
    pub seed: u64,
    /// Requests of each panel.
    pub requests: usize,
}

/// Requests of one kind.
#[derive(Serialize, Deserialize, ToSchema)]
pub struct CostPanel {
    /// `default`, `hard` or `outside`.
    pub panel: String,
    /// What the requests have in common.
    pub caption: String,
    /// Requests that `reference` answered and the others were held against.
    pub requests: usize,
    /// Error of the truth itself: what refining it once more may move, µm, in the median.
    pub floor_um: f64,
    /// Level `reference`, its error being the floor.
    pub reference: CostStanding,
    /// The other levels and the settings that were tried.
    pub standings: Vec<CostStanding>,
}

/// What the errors and times of a level or a setting come to. Errors are those of a request's worst node.
#[derive(Serialize, Deserialize, ToSchema)]
pub struct CostStanding {
    /// The level or the setting.
    pub name: String,
    /// `level`, or what was turned: `mesh`, `tolerance`, `contact`, `effects`.
    pub knob: String,
    /// Requests without an answer.
    pub failed: usize,
    /// Error: median over the requests, µm.
    pub median_um: f64,
    /// Error: 99 % of the requests are no further off, µm.
    pub p99_um: f64,
    /// Time on one core: median over the requests, ms.
    pub median_ms: f64,
    /// Time on one core: 99 % of the requests take no longer, ms.
    pub p99_ms: f64,
}
