//! What refining the mesh of level `reference` once more changes: the source of `core/src/predict/refinement.rs`.
//!
//! Random requests of the working range over the built-in scenes, as many under each kind of tip, are computed at `reference` and on its mesh divided [`FACTOR`] times as finely in
//! each direction. The change of the worst node is counted in units of [`refinement_unit_um`], and its quantiles are those of `calibrate`, each request a path of its own.
//!
//! Not here: how far the finer mesh is from the exact solution, which this change says for a smooth contact and only hints at under an edge.

use retina_core::comparison::node_errors_um;
use retina_core::predict::expected_error::{TIPS, refinement_unit_um};
use retina_core::predict::finite_element::REFERENCE;
use retina_core::predict::{Level, PredictError, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;
use serde::{Deserialize, Serialize};

use crate::calibrate::{entry, quantiles};

/// How many times as finely every edge of the mesh is divided.
pub const FACTOR: f64 = 4.0 / 3.0;

/// What refinement changed of one answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Kind of the tip.
    pub tip: usize,
    /// Depth of the linear answer (µm).
    pub depth_um: f64,
    /// Change of the worst node (µm).
    pub worst_um: f64,
}

/// A request, and the number of its scene.
pub struct Drawn {
    /// Which draw it was.
    pub index: usize,
    scene: usize,
    request: Request,
}

/// Requests drawn until there are enough under each kind of tip, or all draws are used up: a bevel seldom comes to rest on both meshes.
pub struct Draws {
    scenes: Vec<PreparedScene>,
    ranges: Vec<WorkingRange>,
    workspace: Workspace,
    requests: usize,
    most: usize,
    index: usize,
    kept: Vec<Change>,
}

impl Draws {
    /// At most `most` draws for `requests` requests under each kind of tip.
    ///
    /// # Errors
    /// If a scene cannot be prepared.
    pub fn new(requests: usize, most: usize, seed: u64) -> Result<Self, PredictError> {
        let names = Scene::built_in_names().iter().filter_map(|name| Scene::built_in(name));
        let scenes: Vec<PreparedScene> = names.map(PreparedScene::new).collect::<Result<_, _>>()?;
        let ranges = scenes.iter().zip(seed..).map(|(scene, seed)| WorkingRange::new(&scene.scene().tissue, seed));
        let ranges = ranges.collect();
        Ok(Draws { scenes, ranges, workspace: Workspace::default(), requests, most, index: 0, kept: Vec::new() })
    }

    /// How many are wanted in all.
    pub fn wanted(&self) -> usize {
        TIPS * self.requests
    }

    /// The next request that is wanted; `None` if there are no more.
    pub fn next_wanted(&mut self) -> Option<Drawn> {
        let enough = |tip: usize| self.kept.iter().filter(|change| change.tip == tip).count() >= self.requests;
        let enough: Vec<bool> = (0..TIPS).map(enough).collect();
        while self.index < self.most && !enough.iter().all(|enough| *enough) {
            let (index, scene) = (self.index, self.index % self.scenes.len());
            self.index += 1;
            let request = self.ranges[scene].request(Level::Reference);
            if !enough[request.needle.shape.tip.kind()] {
                return Some(Drawn { index, scene, request });
            }
        }
        None
    }

    /// Counts a change.
    pub fn keep(&mut self, change: Change) {
        self.kept.push(change);
    }

    /// What was counted.
    pub fn kept(&self) -> &[Change] {
        &self.kept
    }
}

/// What refinement changes of the answer to `drawn`; `None` where one of the two meshes has no equilibrium.
pub fn measure(draws: &mut Draws, drawn: &Drawn) -> Option<Change> {
    let Draws { scenes, workspace, .. } = draws;
    let (scene, request) = (&scenes[drawn.scene], &drawn.request);
    let situation = scene.situation(request).ok()?;
    let reference = scene.predict(request, workspace, &mut Silent).ok()?;
    let finer = scene.predict_at(request, &REFERENCE.refined(FACTOR), workspace, &mut Silent).ok()?;
    let worst_um = node_errors_um(&reference.vertices, &finer.vertices).into_iter().fold(0.0, f64::max);
    Some(Change { tip: situation.tip, depth_um: situation.depth_um, worst_um })
}

/// The text of `refinement.rs` from the changes of requests drawn with `seed`, besides which there were some `without` an answer.
pub fn source(changes: &[Change], without: usize, seed: u64) -> String {
    let of_tip = |tip: usize| {
        let of = changes.iter().filter(|change| change.tip == tip);
        let ratios: Vec<(u32, f64)> =
            of.zip(0..).map(|(change, path)| (path, change.worst_um / refinement_unit_um(change.depth_um))).collect();
        format!("    {},\n", entry(&quantiles(&ratios)))
    };
    let entries: String = (0..TIPS).map(of_tip).collect();
    format!(
        "//! Quantiles of what refining the mesh of level `reference` changes at the worst node. Written by `retina-models reference-error`; not by hand.\n//!\n\
         //! Every edge divided {FACTOR:.2} times as finely, {} random requests of seed {seed} and {without} without an answer on one of the two meshes.\n\n\
         use super::expected_error::{{Quantiles, TIPS}};\n\n\
         const fn of(median: f64, p95: f64, samples: usize) -> Quantiles {{\n    Quantiles {{ median, p95, samples }}\n}}\n\n\
         /// In units of `refinement_unit_um`: half balls, flat ends, bevels.\n#[rustfmt::skip]\npub const REFERENCE: [Quantiles; TIPS] = [\n{entries}];\n",
        changes.len()
    )
}
