//! What there is to choose from: scenes, levels, gauges; and whether the service is ready.

use serde::Serialize;
use utoipa::ToSchema;

use super::scene::SceneSpec;

/// `GET /v1/scenes`.
#[derive(Serialize, ToSchema)]
pub struct SceneList {
    /// The scene of a request that names none.
    pub default: &'static str,
    /// The built-in scenes.
    pub scenes: Vec<SceneEntry>,
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

/// `GET /healthz` and `GET /readyz`.
#[derive(Serialize, ToSchema)]
pub struct Readiness {
    /// `ok` or `ready`.
    pub status: &'static str,
}
