//! Scenes, requests and meshes of the laws.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::finite_element::Resolution;
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::{Scene, SceneSurface};
use retina_core::sequence::{Sequence, Simulation, StepOutcome};
use retina_core::surface::TriangleMesh;
use retina_core::working_range::WorkingRange;
pub use retina_tests::cap::cap;

/// The levels that are fast enough for every law.
pub const FAST: [Level; 2] = [Level::Linear, Level::Coarse];

/// A built-in scene.
pub fn built_in(name: &str) -> Arc<PreparedScene> {
    Arc::new(PreparedScene::new(Scene::built_in(name).unwrap()).unwrap())
}

/// The answer, with a workspace of its own.
pub fn ask(scene: &PreparedScene, request: &Request) -> Result<Prediction, PredictError> {
    scene.predict(request, &mut Workspace::default(), &mut Silent)
}

/// `count` requests of the working range that level `linear` accepts.
pub fn requests(scene: &PreparedScene, seed: u64, count: usize) -> Vec<Request> {
    let mut range = WorkingRange::new(&scene.scene().tissue, seed);
    let mut found = Vec::new();
    while found.len() < count {
        let request = range.request(Level::Linear);
        if ask(scene, &request).is_ok() {
            found.push(request);
        }
    }
    found
}

/// `count` requests that level `linear` accepts, at `level` and with their answers: within the range every level answers.
pub fn answered(scene: &PreparedScene, seed: u64, count: usize, level: Level) -> Vec<(Request, Prediction)> {
    let answer = |request: Request| {
        let request = at(&request, level);
        match ask(scene, &request) {
            Ok(answer) => (request, answer),
            Err(error) => panic!("{}: {error}: {request:?}", scene.scene().name),
        }
    };
    requests(scene, seed, count).into_iter().map(answer).collect()
}

/// The request at another level.
pub fn at(request: &Request, level: Level) -> Request {
    Request { level, ..request.clone() }
}

/// A 25G hemispherical needle over the centre, pushed straight down.
pub fn straight(level: Level, force_mn: f64) -> Request {
    let needle = Needle::pointing(NeedleShape::hemispherical(0.257), Point3::new(0.0, 0.0, 0.1), &-Vector3::z_axis());
    let control = Control::Force(Vector3::new(0.0, 0.0, -force_mn));
    Request { needle, control, level, effects: EffectChoice::Auto }
}

/// The force of a request under force control.
pub fn force(request: &Request) -> Vector3<f64> {
    match request.control {
        Control::Force(force) => force,
        Control::Pose => panic!("not under force control"),
    }
}

/// The outcomes of a sequence's own steps, at its level's resolution or this one.
pub fn outcomes(scene: &Arc<PreparedScene>, sequence: &Sequence, resolution: Option<&Resolution>) -> Vec<StepOutcome> {
    let mut simulation = Simulation::at(scene, sequence, resolution, &mut Silent).unwrap();
    let mut outcomes = Vec::new();
    while let Some(outcome) = simulation.step(&mut Silent).unwrap_or_else(|error| panic!("{error}: {sequence:?}")) {
        outcomes.push(outcome);
    }
    outcomes
}

/// The largest displacement of a node (µm).
pub fn largest_um(answer: &Prediction) -> f64 {
    answer.displacement_um.iter().copied().fold(0.0, f64::max)
}

/// Repeatable rigid motions: any rotation, a few centimetres of translation.
pub fn motion(seed: u64) -> Isometry3<f64> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut within = |size: f64| size * (2.0 * random.f64() - 1.0);
    let translation = Translation3::new(within(40.0), within(40.0), within(40.0));
    let axis = Vector3::new(within(1.0), within(1.0), within(1.0)).normalize();
    Isometry3::from_parts(translation, UnitQuaternion::from_scaled_axis(axis * within(3.1)))
}

/// The request as someone sees it whose frame is moved.
pub fn moved(request: &Request, by: &Isometry3<f64>) -> Request {
    let mut request = request.clone();
    request.needle.tip_mm = by * request.needle.tip_mm;
    request.needle.orientation = by.rotation * request.needle.orientation;
    if let Control::Force(force) = request.control {
        request.control = Control::Force(by * force);
    }
    request
}

/// A scene on a mesh, tissue as in the built-in scenes.
pub fn mesh_scene(vertices: Vec<Point3<f64>>, triangles: Vec<[usize; 3]>) -> PreparedScene {
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let surface = SceneSurface::Mesh(Arc::new(mesh));
    PreparedScene::new(Scene { surface, ..Scene::built_in("macula").unwrap() }).unwrap()
}
