//! What there is to choose from: scenes, levels, gauges; and whether the service is ready.

use serde::Serialize;
use utoipa::ToSchema;

use super::scene::SceneSpec;
use super::stored::{StoreEntry, StoredScene};

/// `GET /v1/scenes`.
#[derive(Serialize, ToSchema)]
pub struct SceneList {
    /// The scene of a request that names none.
    pub default: &'static str,
    /// The built-in scenes.
    pub scenes: Vec<SceneEntry>,
    /// Scenes of one's own, by id; see `POST /v1/scenes`.
    pub stored: Vec<StoredScene>,
    /// Where those are kept.
    pub store: StoreEntry,
    /// The patch that every scene reports.
    pub patch: PatchEntry,
    /// Every number of a scene with its default, its range and their source.
    pub parameters: Vec<ParameterEntry>,
}

/// A built-in scene, written out as a request may write one.
#[derive(Serialize, ToSchema)]
pub struct SceneEntry {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub scene: SceneSpec,
}

/// The nodes that are reported.
#[derive(Serialize, ToSchema)]
pub struct PatchEntry {
    /// Nodes along each side of the grid.
    pub nodes_per_side: usize,
    /// Distance between neighbours of the grid in x and y, mm.
    pub spacing_mm: f64,
    /// Side of the grid, mm.
    pub size_mm: f64,
}

/// A parameter with its default and the values allowed for it.
#[derive(Serialize, ToSchema)]
pub struct ParameterEntry {
    /// Where the parameter stands in a request.
    pub field: String,
    /// What it is.
    pub name: &'static str,
    /// Unit of the numbers; `1` for a pure number.
    pub unit: &'static str,
    /// The value when left out.
    pub default: f64,
    /// Smallest allowed value, included.
    pub min: f64,
    /// Largest allowed value, included.
    pub max: f64,
    /// Where default and bounds come from; `[unverified]` marks what no source was found for.
    pub source: &'static str,
}

/// `GET /v1/levels`.
#[derive(Serialize, ToSchema)]
pub struct LevelList {
    /// The level of a request that names none.
    pub default: &'static str,
    /// The levels, cheapest first.
    pub levels: Vec<LevelEntry>,
}

/// A level.
#[derive(Serialize, ToSchema)]
pub struct LevelEntry {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// The order of its cost on one core.
    pub cost: &'static str,
}

/// `GET /v1/gauges`.
#[derive(Serialize, ToSchema)]
pub struct GaugeList {
    /// The gauge of a request that gives neither gauge nor radius.
    pub default: &'static str,
    /// The gauges, thin to thick.
    pub gauges: Vec<GaugeEntry>,
}

/// A needle size sold under a name.
#[derive(Serialize, ToSchema)]
pub struct GaugeEntry {
    /// The name.
    pub name: &'static str,
    /// Outer diameter, mm.
    pub outer_diameter_mm: f64,
    /// Where the diameter comes from.
    pub source: &'static str,
    /// Force across the shaft that moves the tip by 1 mm, mN/mm: the value of `needle.stiffness_mn_per_mm` when left out.
    pub stiffness_mn_per_mm: f64,
}

/// `GET /v1/about`.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct About {
    /// Name of the program.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The commit that it was built from, where the build was told by the variable `RETINA_COMMIT`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub commit: Option<&'static str>,
    /// Cargo features that it was built with.
    pub features: Vec<&'static str>,
    /// Names of the levels, cheapest first.
    pub levels: Vec<&'static str>,
    /// The weights of the learned levels.
    pub weights: Vec<WeightsEntry>,
    /// Names of the effects; their order is that of the bits in a binary answer.
    pub effects: Vec<&'static str>,
    /// What it allows.
    pub limits: AboutLimits,
}

/// The weights of a learned level.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct WeightsEntry {
    /// The level.
    pub level: &'static str,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Whether they were read; without, the level has no answer.
    pub usable: bool,
}

/// What a service allows.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct AboutLimits {
    /// Numerical threads.
    pub threads: usize,
    /// Jobs that may wait for one.
    pub queue: usize,
    /// How long a prediction may wait for a thread, ms; left out where the queue alone bounds it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_wait_ms: Option<u64>,
    /// How long the work on a prediction may take, ms.
    pub time_limit_ms: u64,
    /// How long a simulation or a batch may take, ms.
    pub simulation_time_limit_ms: u64,
    /// Steps of a simulation.
    pub simulation_steps: usize,
    /// Poses of a batch.
    pub batch_poses: usize,
    /// Streams at once.
    pub streams: usize,
    /// Sessions with memory at once.
    pub stream_memories: usize,
    /// How long a stream's client may be silent, ms.
    pub stream_idle_ms: u64,
    /// Longest message of a stream, bytes.
    pub stream_message_bytes: usize,
    /// Largest body of a request, bytes.
    pub body_bytes: usize,
}

/// `GET /healthz` and `GET /readyz`.
#[derive(Serialize, ToSchema)]
pub struct Readiness {
    /// `ok` or `ready`.
    pub status: &'static str,
}
