//! The paper's network as core evaluates it, for holding other programs' versions of it against.

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Gauge, NeedleShape, Tip};
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::{FaithfulNetwork, Memory, features, tool};
use retina_core::network::graph::Graph;
use retina_core::network::input::Field;
use retina_core::scene::Scene;

/// The weights that `models` has trained.
const WEIGHTS: &[u8] = include_bytes!("../../models/weights/faithful.safetensors");

/// Length of each node's displacement (µm) in the macula, under a hemispherical 25G needle that points straight down above (x, y) (mm).
///
/// # Panics
/// If the weights or the scene of this repository are not in order.
pub fn displacement_um(x_mm: f64, y_mm: f64, force_mn: Vector3<f32>) -> Vec<f64> {
    let network = FaithfulNetwork::new(WEIGHTS).expect("weights");
    let patch = Scene::built_in("macula").expect("scene").patch(&Point3::origin()).expect("patch");
    let rest: Field = std::array::from_fn(|node| patch.vertices[node].coords.cast());
    let edges: Vec<(usize, usize)> = Graph::new(&patch.triangles).edges().collect();
    let mut memory = Memory::default();
    let soft = network.encode_patch(&rest, &Propagation::new(rest.len(), &edges), &mut memory);
    let gauge = Gauge::from_name("25G").expect("gauge");
    let body = NeedleShape { radius_mm: gauge.radius_mm(), tip: Tip::Hemispherical }.body();
    let eye_mm = retina_core::surface::EYE_RADIUS.default;
    let touch_mm = eye_mm - (eye_mm * eye_mm - x_mm * x_mm - y_mm * y_mm).sqrt();
    let place = |node: Point3<f64>| (node.coords + Vector3::new(x_mm, y_mm, touch_mm)).cast::<f32>();
    let mut rigid = Vec::new();
    features::rigid(&tool::nodes(&body).map(place), &force_mn.normalize(), force_mn.norm(), &mut rigid);
    let moved = network.predict(&soft, &rigid, &mut memory);
    moved.iter().map(|moved| 1e3 * f64::from(moved.norm())).collect()
}
