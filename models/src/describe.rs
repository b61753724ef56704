//! A stored sample as a network sees a request: the same facts, described by the same code as in a prediction.

use std::sync::OnceLock;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use retina_core::needle::{NeedleShape, Tip};
use retina_core::network::graph::Graph;
use retina_core::network::input::{Answer, Field, Input, Relief, TissueNumbers};
use retina_core::patch::{NODE_COUNT, Patch};
use retina_core::scene::Scene;
use retina_core::surface::Surface;

use crate::sample::{self, LevelAnswer, Sample};

/// The shape of a sample's needle.
pub fn shape(tip: &sample::TipShape) -> NeedleShape {
    let edge_radius_mm = f64::from(tip.edge_radius_mm);
    let tip_kind = match tip.kind {
        0 => Tip::Hemispherical,
        1 => Tip::Flat { edge_radius_mm },
        _ => Tip::Bevelled { angle_deg: f64::from(tip.bevel_deg), edge_radius_mm },
    };
    NeedleShape { radius_mm: f64::from(tip.radius_mm), tip: tip_kind }
}

fn field(field: &sample::Field) -> Field {
    field.map(Vector3::from)
}

/// A level's answer.
pub fn answer(answer: &LevelAnswer) -> Answer {
    Answer {
        displacement_mm: field(&answer.displacement_mm),
        travel_mm: answer.travel_mm,
        reaction_mn: answer.reaction_mn.into(),
    }
}

/// Surface of every built-in scene, and how much thinner the retina is under its nodes than the tissue says (mm).
fn surfaces() -> &'static [(Surface, [f32; NODE_COUNT])] {
    static SURFACES: OnceLock<Vec<(Surface, [f32; NODE_COUNT])>> = OnceLock::new();
    SURFACES.get_or_init(|| {
        let scenes = Scene::built_in_names().iter().filter_map(|name| Scene::built_in(name));
        let patches = scenes.filter_map(|scene| scene.patch(&Point3::origin()).ok());
        patches
            .map(|Patch { surface, vertices, .. }| {
                let thinning_mm = std::array::from_fn(|node| surface.thinning(&vertices[node]).mm as f32);
                (surface, thinning_mm)
            })
            .collect()
    })
}

/// How the retina's thickness changes about a sample's contact: its scene's surface says, whatever its tissue is.
fn relief(sample: &Sample) -> Relief {
    let (surface, nodes_mm) = &surfaces()[usize::from(sample.scene)];
    let [touch, center] =
        [sample.touch_mm, sample.linear_center_mm].map(|at| surface.thinning(&Point3::from(at).cast::<f64>()));
    Relief::new(nodes_mm, [touch.mm, center.mm], &center.slope, &center.bend)
}

/// What a network may know of `sample`: everything but the truth.
pub fn input(sample: &Sample) -> Input {
    let shape = shape(&sample.tip);
    let turn = Quaternion::from(nalgebra::Vector4::from(sample.orientation_xyzw)).cast::<f64>();
    let at = Vector3::from(sample.tip_mm).cast::<f64>();
    Input {
        rest_mm: field(&sample.rest_mm),
        rest_normal: field(&sample.rest_normal),
        body: shape.body(),
        shape,
        patch_from_needle: Isometry3::from_parts(Translation3::from(at), UnitQuaternion::from_quaternion(turn)),
        direction: sample.direction.into(),
        force_mn: sample.force_mn,
        tissue: TissueNumbers {
            thickness_mm: sample.tissue.thickness_mm,
            youngs_modulus_kpa: sample.tissue.youngs_modulus_kpa,
            poisson_ratio: sample.tissue.poisson_ratio,
        },
        relief: relief(sample),
        touch_mm: sample.touch_mm.into(),
        inward: sample.inward.into(),
        center_mm: sample.linear_center_mm.into(),
        depth_mm: sample.linear_depth_mm,
        contact_radius_mm: sample.linear_contact_radius_mm,
        pressure_kpa: sample.linear_pressure_kpa,
        linear: answer(&sample.linear),
        coarse: sample.coarse.as_ref().map(answer),
    }
}

/// The mesh of a stored sample's patch: the grid.
pub fn graph() -> Graph {
    Graph::new(&Patch::grid(Surface::Flat, Isometry3::identity()).triangles)
}
