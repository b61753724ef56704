//! A light touch somewhere on a stored scene: the first answer, which makes ready what depends on the scene alone.

use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use retina_core::needle::shape::RADIUS;
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::budget::Budget;
use retina_core::predict::{Control, EffectChoice, Level, PreparedScene, Request, Workspace};
use retina_core::scene::{Scene, SceneSurface};
use retina_core::surface::TriangleMesh;

use crate::answer::{Question, compute};
use crate::problem::{Kind, Problem};
use crate::stopwatch::Stopwatch;
use crate::times::Times;
use crate::wire::fixed::Vector;
use crate::wire::stored::{TouchNeedle, TouchSpec};

/// Force of the touch, mN: enough for contact, far from any limit.
const FORCE_MN: f64 = 0.1;

/// Vertices of a mesh that are tried beside the one in its middle.
const TRIED: usize = 16;

/// How long one answer may take.
const LIMIT: Duration = Duration::from_secs(30);

/// Where a needle touches, and along which way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    tip: Point3<f64>,
    inward: Vector3<f64>,
}

impl Touch {
    /// The part of a request that asks for it.
    pub fn told(&self) -> TouchSpec {
        TouchSpec {
            needle: TouchNeedle { tip_mm: Vector(self.tip.coords.into()), direction: Vector(self.inward.into()) },
            force_mn: Vector((FORCE_MN * self.inward).into()),
        }
    }

    /// Asks for it.
    ///
    /// # Errors
    /// The problem that a caller would be told of.
    pub fn ask(
        &self,
        scene: &PreparedScene,
        level: Level,
        times: &Times,
        workspace: &mut Workspace,
    ) -> Result<(), Problem> {
        let shape = NeedleShape::hemispherical(RADIUS.default);
        let request = Request {
            needle: Needle::pointing(shape, self.tip, &nalgebra::Unit::new_normalize(self.inward)),
            control: Control::Force(FORCE_MN * self.inward),
            level,
            effects: EffectChoice::Auto,
        };
        let budget = Budget { level: Some(level), ..Budget::default() };
        let mut stopwatch = Stopwatch::start(Instant::now(), LIMIT, &|| false);
        compute(scene, Question { request, budget, times }, workspace, &mut stopwatch).map(|_| ())
    }
}

/// The first touch that level `linear` answers: in the middle of the surface, or else anywhere.
///
/// # Errors
/// Why there is none in the middle.
pub fn first_answered(scene: &PreparedScene, times: &Times, workspace: &mut Workspace) -> Result<Touch, Problem> {
    let mut why = None;
    for contact in contacts(scene.scene()) {
        let answered = at(scene.scene(), contact)
            .and_then(|touch| touch.ask(scene, Level::Linear, times, workspace).map(|()| touch));
        match answered {
            Ok(touch) => return Ok(touch),
            Err(problem) => why = why.or(Some(problem)),
        }
    }
    Err(why.unwrap_or_else(|| Problem::new(Kind::InvalidMesh, "the mesh has no vertices")))
}

fn at(scene: &Scene, contact: Point3<f64>) -> Result<Touch, Problem> {
    let patch = scene.patch(&contact).map_err(|error| {
        let allowed = "a mesh with 64 connected vertices around the contact that face one side";
        Problem::field(Kind::InvalidMesh, "scene.surface", None, allowed, error.to_string())
    })?;
    let tip = match scene.surface {
        SceneSurface::Mesh(_) => contact,
        _ => patch.scene_from_patch * Point3::origin(),
    };
    Ok(Touch { tip, inward: patch.scene_from_patch * -Vector3::z() })
}

/// Points of the surface to try, in order.
fn contacts(scene: &Scene) -> Vec<Point3<f64>> {
    match &scene.surface {
        SceneSurface::Mesh(mesh) => middle_and_others(mesh),
        _ => vec![Point3::origin()],
    }
}

fn middle_and_others(mesh: &TriangleMesh) -> Vec<Point3<f64>> {
    let vertices = mesh.vertices();
    let middle = vertices.iter().map(|vertex| vertex.coords).sum::<Vector3<f64>>() / vertices.len().max(1) as f64;
    let distance = |vertex: &&Point3<f64>| (vertex.coords - middle).norm();
    let nearest = vertices.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let stride = vertices.len().div_ceil(TRIED).max(1);
    nearest.into_iter().chain(vertices.iter().step_by(stride)).copied().collect()
}
