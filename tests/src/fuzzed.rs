//! Whatever reads bytes from outside, and what must hold of it for any bytes: it ends in a value or in an error that is the sender's fault.
//!
//! The same functions are the targets of coverage-guided fuzzing (`tests/fuzz`), of the blind search without a special compiler (`bin/fuzz_blind`)
//! and of a short search in the service tier. A broken promise is a panic that says which.

pub mod mutate;
pub mod seeds;

use retina_core::network::contact::{ContactNetwork, Start};
use retina_core::network::faithful::FaithfulNetwork;
use retina_core::network::weights::{HASH, hash};
use retina_core::surface::TriangleMesh;
use retina_core::surface::mesh_file::{MeshFormat, read_mesh};
use retina_server::library::Id;
use retina_server::library::content::{content, scene as stored_scene};
use retina_server::problem::{Kind, Problem};
use retina_server::read::read;
use retina_server::stream::binary;
use retina_server::understand;
use retina_server::wire::stream::StreamCommand;
use retina_server::wire::{BatchRequest, PredictRequest, SceneSpec, SimulateRequest};

/// Steps that a sequence may have.
const MOST_STEPS: usize = 2000;

/// Bytes of the length of a weight file's header.
const LENGTH_BYTES: usize = 8;

/// What takes any bytes.
pub type Target = fn(&[u8]);

/// Every target by name.
pub const TARGETS: [(&str, Target); 5] =
    [("mesh", mesh), ("request", request), ("scene", scene), ("stream", stream), ("weights", weights)];

/// Files of meshes, the first byte says of which format: what is read is a mesh by the strict rules, too.
pub fn mesh(bytes: &[u8]) {
    let Some((first, file)) = bytes.split_first() else { return };
    let (_, format) = MeshFormat::ENDINGS[usize::from(*first) % MeshFormat::ENDINGS.len()];
    if let Ok(mesh) = read_mesh(file, format) {
        assert!(!mesh.triangles().is_empty(), "a mesh without triangles");
        let again = TriangleMesh::new(mesh.vertices().to_vec(), mesh.triangles().to_vec());
        assert_eq!(again.as_ref(), Ok(&mesh), "what is read is no mesh by the strict rules");
    }
}

/// Bodies of the routes that compute, the first byte says of which: a refusal is the sender's fault and can be written.
pub fn request(bytes: &[u8]) {
    let Some((first, body)) = bytes.split_first() else { return };
    let outcome = match first % 3 {
        0 => read::<PredictRequest>(body).and_then(|message| {
            understand::budget(message.accuracy.as_ref())?;
            understand::chosen(message.scene.as_ref())?;
            understand::request(&message).map(|_| ())
        }),
        1 => read::<BatchRequest>(body).and_then(|message| {
            let shared = understand::shared(message.accuracy.as_ref(), message.effects.as_ref())?;
            understand::chosen(message.scene.as_ref())?;
            message.poses.iter().try_for_each(|pose| understand::batched(&shared, pose).map(|_| ()))
        }),
        _ => read::<SimulateRequest>(body).and_then(|message| understand::sequence(&message, MOST_STEPS).map(|_| ())),
    };
    if let Err(problem) = outcome {
        refused(&problem);
    }
}

/// Bodies of scenes to be stored: what is understood has a content that means the same and has the same name.
pub fn scene(body: &[u8]) {
    let understood = read::<SceneSpec>(body).and_then(|spec| Ok((understand::scene(&spec)?, spec.pose)));
    let (scene, pose) = match understood {
        Ok(understood) => understood,
        Err(problem) => return refused(&problem),
    };
    let stored = content(&scene, pose.as_ref()).expect("the numbers of a scene are finite");
    let again = stored_scene(Id::of(&stored), &stored).expect("what is stored is understood");
    let spec = read::<SceneSpec>(&stored).expect("what is stored is read");
    assert_eq!(content(&again, spec.pose.as_ref()), Ok(stored), "what is stored again has another name");
}

/// Messages of a stream, binary and text.
pub fn stream(bytes: &[u8]) {
    if let Err(problem) = binary::pose(bytes) {
        refused(&problem);
    }
    let opened = read::<StreamCommand>(bytes).and_then(|command| {
        let opening = command.open.map(|spec| understand::opening(&spec, MOST_STEPS));
        opening.transpose().map(|_| ())
    });
    if let Err(problem) = opened {
        refused(&problem);
    }
}

/// Files of weights. A header that names a hash gets the right one, or nothing would come past it.
pub fn weights(file: &[u8]) {
    let whole = with_hash(file);
    let file = whole.as_deref().unwrap_or(file);
    for start in [Start::Linear, Start::Coarse] {
        // A network or an error: both are in order.
        let _ = ContactNetwork::new(start, file);
    }
    let _ = FaithfulNetwork::new(file);
}

fn refused(problem: &Problem) {
    assert_ne!(problem.kind, Kind::Internal, "a fault of the server: {problem:?}");
    let document = problem.document();
    assert!((400..500).contains(&document.status) && !document.detail.is_empty(), "{problem:?}");
    assert!(serde_json::to_vec(&document).is_ok(), "{problem:?} cannot be written");
}

/// The file with the hash of its data in its header, where there is room for one.
fn with_hash(file: &[u8]) -> Option<Vec<u8>> {
    let length = u64::from_le_bytes(file.get(..LENGTH_BYTES)?.try_into().ok()?);
    let end = LENGTH_BYTES.checked_add(usize::try_from(length).ok()?)?;
    let hash = hash(file.get(end..)?);
    let key = format!("\"{HASH}\":\"");
    let at = file[..end].windows(key.len()).position(|window| window == key.as_bytes())? + key.len();
    let mut whole = file.to_vec();
    whole.get_mut(at..at + hash.len())?.copy_from_slice(hash.as_bytes());
    Some(whole)
}
