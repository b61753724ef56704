//! What there is to choose from, told from the core's own tables.

use std::time::Duration;

use retina_core::effects::EFFECT_NAMES;
use retina_core::needle::shaft::{STIFFNESS, stiffness_mn_per_mm};
use retina_core::needle::shape::{BEVEL_ANGLE, EDGE_RADIUS, RADIUS};
use retina_core::needle::{GAUGES, TIP_COORDINATE};
use retina_core::patch::{NODES_PER_SIDE, SPACING_MM};
use retina_core::predict::Level;
use retina_core::predict::budget::DEFAULT_LEVEL;
use retina_core::predict::networks::Networks;
use retina_core::range::ParameterRange;
use retina_core::scene::bleb;
use retina_core::scene::conditions::{EYE_PRESSURE, FRICTION_COEFFICIENT};
use retina_core::scene::puncture::{MAX_FORCE, MAX_STRAIN, PRESSURE_PER_MODULUS, Puncture, PunctureForce};
use retina_core::scene::{Scene, SceneSurface};
use retina_core::sequence::TIME_STEP;
use retina_core::surface::{EYE_RADIUS, PIT_DEPTH, PIT_SIGMA};
use retina_core::tissue::ranges::{
    BOND_RATE_EXPONENT, BOND_REFERENCE_SPEED, BOND_STRENGTH, CHOROID, FRACTURE_ENERGY, INNER_LIMITING_MEMBRANE,
    LayerRanges, RETINA, RETINA_SUBLAYER, SCLERA,
};
use retina_core::tissue::rate::{DENSITY, PronyTerm, RELAXATION_SHARE, RELAXATION_TIME, RateProperties, VITREOUS_DRAG};
use retina_core::tissue::{Layer, Tissue};

use crate::body::LIMIT_BYTES;
use crate::config::Config;
use crate::stream::LONGEST_MESSAGE;
use crate::understand::{DEFAULT_GAUGE, DEFAULT_SCENE, FORCE, MAX_ERROR, MAX_TIME};
use crate::wire::catalog::{
    About, AboutLimits, GaugeEntry, GaugeList, LevelEntry, LevelList, ParameterEntry, PatchEntry, SceneEntry,
    SceneList, WeightsEntry,
};
use crate::wire::cost::CostTable;
use crate::wire::fixed::Vector;
use crate::wire::scene::{
    BlebSpec, BondSpec, LayerSpec, PronyTermSpec, PunctureSpec, RateSpec, RetinaSpec, SceneSpec, SurfaceKind,
    SurfaceSpec, TissueSpec,
};
use crate::wire::stored::{StoreEntry, StoredScene};

/// The built-in scenes, those that are stored, and every parameter with its range.
pub fn scenes((stored, store): (Vec<StoredScene>, StoreEntry)) -> SceneList {
    let entry = |&name: &&'static str| Some(SceneEntry { name, scene: spec(&Scene::built_in(name)?) });
    SceneList {
        default: DEFAULT_SCENE,
        scenes: Scene::built_in_names().iter().filter_map(entry).collect(),
        stored,
        store,
        patch: PatchEntry {
            nodes_per_side: NODES_PER_SIDE,
            spacing_mm: SPACING_MM,
            size_mm: SPACING_MM * (NODES_PER_SIDE - 1) as f64,
        },
        parameters: parameters(),
    }
}

/// The levels, cheapest first.
pub fn levels() -> LevelList {
    let entry = |level: Level| {
        let (what, cost) = match level {
            Level::Linear => {
                ("layered linear elasticity and a contact law, prepared once per scene", "tens of microseconds")
            }
            Level::Network => {
                ("the linear answer with what a network learned that it lacks", "tenths of a millisecond")
            }
            Level::Corrected => ("`coarse` with what a network learned about its error", "milliseconds"),
            Level::Coarse => ("finite elements on a mesh that fits in milliseconds", "milliseconds"),
            Level::Reference => ("finite elements on the converged mesh", "seconds"),
        };
        LevelEntry { name: level.name(), what, cost }
    };
    LevelList { default: DEFAULT_LEVEL.name(), levels: Level::ALL.map(entry).into() }
}

/// What accuracy costs in time, as the program `accuracy` measured it.
///
/// # Errors
/// When the committed measurement does not have the form that this version knows.
pub fn accuracy() -> Result<CostTable, serde_json::Error> {
    serde_json::from_str(include_str!("../../docs/accuracy/results.json"))
}

/// The gauges, thin to thick.
pub fn gauges() -> GaugeList {
    let gauges = GAUGES.map(|gauge| GaugeEntry {
        name: gauge.name,
        outer_diameter_mm: gauge.outer_diameter_mm,
        source: gauge.source,
        stiffness_mn_per_mm: stiffness_mn_per_mm(gauge.radius_mm()),
    });
    GaugeList { default: DEFAULT_GAUGE, gauges: gauges.into() }
}

/// What the service is and what it allows.
pub fn about(config: &Config) -> About {
    let millis = |time: Duration| time.as_millis() as u64;
    About {
        name: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        commit: option_env!("RETINA_COMMIT"),
        features: features(),
        levels: Level::ALL.map(Level::name).into(),
        weights: weights(),
        effects: EFFECT_NAMES.into(),
        limits: AboutLimits {
            threads: config.threads(),
            queue: config.queue.into(),
            max_wait_ms: config.max_wait().map(millis),
            time_limit_ms: millis(config.time_limit()),
            simulation_time_limit_ms: millis(config.simulation_time_limit()),
            simulation_steps: config.simulation_steps.into(),
            batch_poses: config.batch_poses.into(),
            streams: config.streams.into(),
            stream_memories: config.stream_memories.into(),
            stream_idle_ms: millis(config.stream_idle()),
            stream_message_bytes: LONGEST_MESSAGE,
            body_bytes: LIMIT_BYTES,
        },
    }
}

fn weights() -> Vec<WeightsEntry> {
    let shipped = Networks::shipped();
    let entry = |(level, sha256): (Level, String)| WeightsEntry {
        level: level.name(),
        sha256,
        usable: shipped.of(level).is_ok(),
    };
    Networks::shipped_hashes().map(entry).into()
}

/// Cargo features of this program.
fn features() -> Vec<&'static str> {
    let all = [("otlp", cfg!(feature = "otlp")), ("rerun", cfg!(feature = "rerun")), ("s3", cfg!(feature = "s3"))];
    all.into_iter().filter(|(_, built)| *built).map(|(name, _)| name).collect()
}

/// A scene as a request would write it out, but for the vertices and triangles of a mesh and for where the patch stands.
pub fn spec(scene: &Scene) -> SceneSpec {
    let mut surface = SurfaceSpec::of_kind(SurfaceKind::Flat);
    match scene.surface {
        SceneSurface::Flat => {}
        SceneSurface::Sphere { radius_mm } => {
            (surface.kind, surface.radius_mm) = (SurfaceKind::Sphere, Some(radius_mm));
        }
        SceneSurface::FovealPit { radius_mm, depth_mm, sigma_mm } => {
            (surface.kind, surface.radius_mm) = (SurfaceKind::FovealPit, Some(radius_mm));
            (surface.depth_mm, surface.sigma_mm) = (Some(depth_mm), Some(sigma_mm));
        }
        SceneSurface::Mesh(_) => surface.kind = SurfaceKind::Mesh,
    }
    SceneSpec {
        surface: Some(surface),
        tissue: Some(tissue(&scene.tissue)),
        pose: None,
        friction_coefficient: Some(scene.friction_coefficient),
        pressure_kpa: Some(scene.pressure_kpa),
        rest_pressure_kpa: Some(scene.rest_pressure_kpa),
        puncture: Some(puncture(&scene.puncture)),
        bleb: scene.bleb.as_ref().map(|fluid| BlebSpec {
            volume_mm3: match fluid.filling {
                bleb::Filling::Volume(volume_mm3) => Some(volume_mm3),
                bleb::Filling::Pressure(_) => None,
            },
            pressure_kpa: match fluid.filling {
                bleb::Filling::Volume(_) => None,
                bleb::Filling::Pressure(pressure_kpa) => Some(pressure_kpa),
            },
            center_mm: Some(Vector(fluid.center_mm.coords.into())),
            radius_mm: Some(fluid.radius_mm),
        }),
    }
}

fn puncture(puncture: &Puncture) -> PunctureSpec {
    let (pressure_per_modulus, max_force_mn) = match puncture.force {
        PunctureForce::PressurePerModulus(share) => (Some(share), None),
        PunctureForce::Force(force_mn) => (None, Some(force_mn)),
    };
    PunctureSpec { pressure_per_modulus, max_force_mn, max_strain: Some(puncture.max_strain) }
}

fn tissue(tissue: &Tissue) -> TissueSpec {
    let layer = |layer: &Layer| LayerSpec {
        thickness_mm: Some(layer.thickness_mm),
        youngs_modulus_kpa: Some(layer.youngs_modulus_kpa),
        poisson_ratio: Some(layer.poisson_ratio),
    };
    let retina = match tissue.retina.as_slice() {
        [whole] => RetinaSpec::Whole(layer(whole)),
        sublayers => RetinaSpec::Sublayers(sublayers.iter().map(layer).collect()),
    };
    TissueSpec {
        inner_limiting_membrane: tissue.inner_limiting_membrane.as_ref().map(layer),
        retina: Some(retina),
        choroid: Some(layer(&tissue.choroid)),
        sclera: Some(layer(&tissue.sclera)),
        bond: Some(BondSpec {
            strength_kpa: Some(tissue.bond.strength_kpa),
            fracture_energy_mn_per_mm: Some(tissue.bond.fracture_energy_mn_per_mm),
            rate_exponent: Some(tissue.bond.rate_exponent),
            reference_speed_mm_per_s: Some(tissue.bond.reference_speed_mm_per_s),
        }),
        rate: Some(rate(&tissue.rate)),
    }
}

fn rate(rate: &RateProperties) -> RateSpec {
    let term = |term: &PronyTerm| PronyTermSpec { relaxation_time_s: term.relaxation_time_s, share: term.share };
    RateSpec {
        retina_relaxation: Some(rate.retina_relaxation.iter().map(term).collect()),
        density_kg_per_mm3: Some(rate.density_kg_per_mm3),
        vitreous_drag_kpa_s_per_mm: Some(rate.vitreous_drag_kpa_s_per_mm),
    }
}

fn parameters() -> Vec<ParameterEntry> {
    let single = [
        ("force_mn", &FORCE),
        ("accuracy.max_error_um", &MAX_ERROR),
        ("accuracy.max_time_ms", &MAX_TIME),
        ("needle.tip_mm", &TIP_COORDINATE),
        ("needle.radius_mm", &RADIUS),
        ("needle.stiffness_mn_per_mm", &STIFFNESS),
        ("needle.tip.flat.edge_radius_mm", &EDGE_RADIUS),
        ("needle.tip.bevelled.edge_radius_mm", &EDGE_RADIUS),
        ("needle.tip.bevelled.angle_deg", &BEVEL_ANGLE),
        ("scene.surface.radius_mm", &EYE_RADIUS),
        ("scene.surface.depth_mm", &PIT_DEPTH),
        ("scene.surface.sigma_mm", &PIT_SIGMA),
        ("scene.pose.position_mm", &TIP_COORDINATE),
        ("scene.tissue.bond.strength_kpa", &BOND_STRENGTH),
        ("scene.tissue.bond.fracture_energy_mn_per_mm", &FRACTURE_ENERGY),
        ("scene.tissue.bond.rate_exponent", &BOND_RATE_EXPONENT),
        ("scene.tissue.bond.reference_speed_mm_per_s", &BOND_REFERENCE_SPEED),
        ("scene.tissue.rate.retina_relaxation[].relaxation_time_s", &RELAXATION_TIME),
        ("scene.tissue.rate.retina_relaxation[].share", &RELAXATION_SHARE),
        ("scene.tissue.rate.density_kg_per_mm3", &DENSITY),
        ("scene.tissue.rate.vitreous_drag_kpa_s_per_mm", &VITREOUS_DRAG),
        ("steps[].time_s", &TIME_STEP),
        ("scene.friction_coefficient", &FRICTION_COEFFICIENT),
        ("scene.pressure_kpa", &EYE_PRESSURE),
        ("scene.rest_pressure_kpa", &EYE_PRESSURE),
        ("scene.puncture.pressure_per_modulus", &PRESSURE_PER_MODULUS),
        ("scene.puncture.max_force_mn", &MAX_FORCE),
        ("scene.puncture.max_strain", &MAX_STRAIN),
        ("scene.bleb.volume_mm3", &bleb::VOLUME),
        ("scene.bleb.pressure_kpa", &bleb::PRESSURE),
        ("scene.bleb.radius_mm", &bleb::RADIUS),
    ];
    let layers = [
        ("inner_limiting_membrane", &INNER_LIMITING_MEMBRANE),
        ("retina", &RETINA),
        ("retina[]", &RETINA_SUBLAYER),
        ("choroid", &CHOROID),
        ("sclera", &SCLERA),
    ];
    let single = single.into_iter().map(|(field, range)| parameter(field.to_owned(), range));
    single.chain(layers.into_iter().flat_map(|(name, ranges)| layer_parameters(name, ranges))).collect()
}

fn layer_parameters(layer: &str, ranges: &LayerRanges) -> [ParameterEntry; 3] {
    [
        ("thickness_mm", &ranges.thickness),
        ("youngs_modulus_kpa", &ranges.youngs_modulus),
        ("poisson_ratio", &ranges.poisson_ratio),
    ]
    .map(|(number, range)| parameter(format!("scene.tissue.{layer}.{number}"), range))
}

fn parameter(field: String, range: &ParameterRange) -> ParameterEntry {
    ParameterEntry {
        field,
        name: range.name,
        unit: range.unit,
        default: range.default,
        min: range.min,
        max: range.max,
        source: range.source,
    }
}
