//! What is beside the samples: how they were made, in which ranges and units, how many, why some are missing, and the hash of each shard.
//!
//! Nothing in it depends on how many threads made the data, on the time or on the machine.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use retina_core::predict::indentation::EFFECTS;
use retina_core::predict::sampled;
use retina_core::predict::{MAX_DEPTH_SHARE, PUNCTURE_PRESSURE_PER_MODULUS};
use retina_core::range::ParameterRange;
use retina_core::scene::Scene;
use retina_core::tissue::ranges::{CHOROID, LayerRanges, RETINA, SCLERA};
use serde::{Deserialize, Serialize};

use super::blocks::{PathRecord, read_json, write_json};
use super::draw::{Depths, Tips};
use super::error::DatasetError;
use super::shards::ShardRecord;
use super::{draw, path, truth};
use crate::sample::Split;

/// The manifest's file name.
pub const FILE: &str = "manifest.json";
/// Version of the layout and of what is drawn: data of two versions are not mixed.
pub const FORMAT: u32 = 1;

/// What data are made with: two data sets with the same settings hold the same samples as far as both go.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// [`FORMAT`].
    pub format: u32,
    /// The seed.
    pub seed: u64,
    /// Names of the scenes.
    pub scenes: Vec<String>,
    /// Name of the truth's mesh.
    pub truth: String,
    /// Version of this package.
    pub version: String,
    /// How deep the paths go.
    #[serde(default)]
    pub depths: Depths,
    /// Which tips the needles have.
    #[serde(default)]
    pub tips: Tips,
}

/// Paths by how they ended.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Paths that were asked for.
    pub paths: u32,
    /// Paths that are finished and in the shards.
    pub finished: u32,
    /// Of these, paths with all steps.
    pub complete: u32,
    /// Of these, paths that ended early, by cause.
    pub ended_by: BTreeMap<String, u32>,
    /// Samples by split.
    pub samples: BTreeMap<String, usize>,
}

/// A range of what is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Unit.
    pub unit: String,
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Default, where there is one.
    pub default: Option<f64>,
}

/// The manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// What the data are made with.
    pub settings: Settings,
    /// How many there are.
    pub counts: Counts,
    /// The ranges that are drawn from.
    pub ranges: BTreeMap<String, Range>,
    /// Share of the paths in each split, by name.
    pub split_shares: BTreeMap<String, f64>,
    /// Units of the tensors, by the end of their names.
    pub units: BTreeMap<String, String>,
    /// Effects that are simulated.
    pub effects: Vec<String>,
    /// Where the estimated error of the truth comes from.
    pub truth_error: String,
    /// What it is made of, by tip: a distance (µm) and a share of the largest displacement.
    #[serde(default)]
    pub truth_error_by_tip: BTreeMap<String, [f64; 2]>,
    /// The shards.
    pub shards: Vec<ShardRecord>,
}

impl Settings {
    /// Settings of this program for `seed` and the scenes with these indices.
    pub fn new(seed: u64, scenes: &[u8], depths: Depths, tips: Tips) -> Self {
        let names = Scene::built_in_names();
        Settings {
            format: FORMAT,
            seed,
            scenes: scenes.iter().map(|&scene| names[usize::from(scene)].to_owned()).collect(),
            truth: truth::NAME.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            depths,
            tips,
        }
    }

    /// Fails if `folder` holds data made otherwise.
    ///
    /// # Errors
    /// [`DatasetError::OtherSettings`] naming the first setting that differs.
    pub fn check(&self, folder: &Path) -> Result<(), DatasetError> {
        let file = folder.join(FILE);
        let Some(Manifest { settings: found, .. }) = read_json(&file)? else { return Ok(()) };
        let of = |settings: &Self| {
            [
                ("format", settings.format.to_string()),
                ("seed", settings.seed.to_string()),
                ("scenes", settings.scenes.join(", ")),
                ("truth", settings.truth.clone()),
                ("version", settings.version.clone()),
                ("depths", format!("{:?}", settings.depths)),
                ("tips", format!("{:?}", settings.tips)),
            ]
        };
        for ((field, found), (_, wanted)) in of(&found).into_iter().zip(of(self)) {
            if found != wanted {
                return Err(DatasetError::OtherSettings { path: file.display().to_string(), field, found, wanted });
            }
        }
        Ok(())
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            to,
            "{} samples of {} paths, {} of them with all {} steps",
            self.all_samples(),
            self.finished,
            self.complete,
            draw::STEPS
        )?;
        self.ended_by.iter().try_for_each(|(cause, paths)| writeln!(to, "- {paths} paths ended early: {cause}"))
    }
}

impl Counts {
    /// Adds a finished path of `split` (of none if it has no samples).
    pub fn add(&mut self, record: &PathRecord, split: Option<Split>) {
        self.finished += 1;
        match &record.ended_by {
            None => self.complete += 1,
            Some(cause) => *self.ended_by.entry(cause.clone()).or_default() += 1,
        }
        if let Some(split) = split {
            *self.samples.entry(split.name().to_owned()).or_default() += record.samples;
        }
    }

    /// Samples of all splits.
    pub fn all_samples(&self) -> usize {
        self.samples.values().sum()
    }
}

impl Manifest {
    /// The manifest of these shards.
    pub fn new(settings: Settings, counts: Counts, shards: Vec<ShardRecord>) -> Self {
        let split_shares =
            Split::ALL.iter().zip(draw::SPLIT_SHARES).map(|(split, share)| (split.name().to_owned(), share));
        Manifest {
            settings,
            counts,
            ranges: ranges(),
            split_shares: split_shares.collect(),
            units: [("_mm", "mm"), ("_mn", "mN"), ("_kpa", "kPa"), ("_deg", "degrees")]
                .map(|(end, unit)| (end.to_owned(), unit.to_owned()))
                .into(),
            effects: EFFECTS.map(str::to_owned).to_vec(),
            truth_error: truth::ERROR_BASIS.to_owned(),
            truth_error_by_tip: truth::TIPS
                .iter()
                .zip(truth::MEASURED)
                .map(|(tip, of)| ((*tip).to_owned(), of))
                .collect(),
            shards,
        }
    }

    /// The manifest in `folder`.
    ///
    /// # Errors
    /// [`DatasetError`], also if there is none.
    pub fn read(folder: &Path) -> Result<Self, DatasetError> {
        let file = folder.join(FILE);
        read_json(&file)?.ok_or_else(|| DatasetError::malformed(&file, "there is no manifest here"))
    }

    /// Writes it to `folder`.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn write(&self, folder: &Path) -> Result<(), DatasetError> {
        write_json(&folder.join(FILE), self)
    }
}

fn ranges() -> BTreeMap<String, Range> {
    let mut ranges = BTreeMap::new();
    let mut add = |name: &str, unit: &str, [from, to]: [f64; 2], default: Option<f64>| {
        ranges.insert(name.to_owned(), Range { unit: unit.to_owned(), from, to, default });
    };
    add("needle.tilt", "deg", sampled::TILT_DEG, None);
    add("needle.lean_of_direction", "deg", draw::LEAN_DEG, None);
    add("needle.touch_x_and_y", "mm", [-draw::REACH_MM, draw::REACH_MM], None);
    add("needle.clearance", "mm", draw::CLEARANCE_MM, None);
    add("needle.edge_per_radius", "1", sampled::EDGE_SHARE, Some(sampled::EDGE_SHARE[0]));
    add("needle.bevel", "deg", sampled::BEVEL_DEG, None);
    add("outside.tilt", "deg", draw::OUTSIDE_TILT_DEG, None);
    add("outside.lean_of_direction", "deg", draw::OUTSIDE_LEAN_DEG, None);
    add("depth.share_of_limit", "1", draw::DEEPEST_SHARE, None);
    add("depth.light.share_of_limit", "1", draw::LIGHT_SHARE, None);
    add("limit.depth_per_retina_and_choroid", "1", [0.0, MAX_DEPTH_SHARE], None);
    add("limit.pressure_per_modulus", "1", [0.0, PUNCTURE_PRESSURE_PER_MODULUS], None);
    add("limit.newton_iterations", "1", [0.0, path::MOST_ITERATIONS as f64], None);
    let radii = sampled::gauge_radii_mm();
    add("needle.radius", "mm", radii, None);
    add("outside.radius", "mm", [radii[1], draw::OUTSIDE_RADIUS_MM], None);
    let layers: [(&str, &LayerRanges); 3] = [("retina", &RETINA), ("choroid", &CHOROID), ("sclera", &SCLERA)];
    for (layer, of) in layers {
        let numbers: [(&str, &ParameterRange); 3] = [
            ("thickness", &of.thickness),
            ("youngs_modulus", &of.youngs_modulus),
            ("poisson_ratio", &of.poisson_ratio),
        ];
        for (name, range) in numbers {
            add(&format!("{layer}.{name}"), range.unit, [range.min, range.max], Some(range.default));
        }
    }
    ranges
}
