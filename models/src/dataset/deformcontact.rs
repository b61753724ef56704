//! Data sets in the layout that the public code of the paper reads (github.com/mahdi-slh/DeformContact, its retina loader and its everyday loader).
//!
//! One folder a scene, because the loaders know one resting mesh: `InitialMesh.ply`, `Rigid.ply`, and for each sample `NAME.ply` (the deformed mesh) and
//! `NAME.json` (a list of one object). Meshes are in the patch frame; positions and directions in the JSON are (X, Y, Z) = (−y, z, x) of it, which the loaders turn
//! back. Units are ours, mm and mN: the loaders scale lengths themselves, and divide forces by the `force_max` of their configuration.
//!
//! The loaders take the first four fifths of the names in alphabetical order for training and the rest for validation. Names begin with the split's number, so
//! training comes first; where their cut does not fall between two splits, it falls between two samples of one path.
//!
//! Not here: mirror images, tissue and tip shape, which that layout has no place for.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use retina_core::patch::Patch;
use retina_core::scene::Scene;
use retina_core::surface::Surface;
use retina_core::surface::mesh_file::{MeshFormat, read_mesh};
use serde_json::{Map, Value, json};

use super::error::DatasetError;
use crate::sample::{Field, NODES, Sample};

/// Length of the shaft from the tip to the point that the layout calls the tool's origin (mm): that of the cylinder which the retina loader draws.
pub const SHAFT_MM: f32 = 5.0;

/// The resting mesh's file.
const REST: &str = "InitialMesh.ply";
/// The tool's file: the retina loader opens it and draws a cylinder of its own.
const RIGID: &str = "Rigid.ply";
/// Vectors that are zero here: nothing moves in an equilibrium, and the object stands at the origin.
const ZERO: [&str; 5] =
    ["objectWorldPos", "velocity", "angularVelocity", "inertiaTensorPosition", "inertiaTensorRotation"];

/// A sample as the layout can say it.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSample {
    /// File name without its ending.
    pub name: String,
    /// Nodes at rest (mm).
    pub rest_mm: Field,
    /// Nodes deformed (mm).
    pub deformed_mm: Field,
    /// Force (mN).
    pub force_mn: f32,
    /// Unit direction of the force.
    pub direction: [f32; 3],
    /// Where the needle first touches (mm).
    pub touch_mm: [f32; 3],
    /// The needle's tip at equilibrium (mm).
    pub tip_mm: [f32; 3],
    /// A point of its shaft (mm).
    pub shaft_mm: [f32; 3],
}

impl ContactSample {
    /// What the layout keeps of `sample`.
    pub fn of(sample: &Sample) -> Self {
        let mut deformed_mm = sample.rest_mm;
        for (node, moved) in deformed_mm.iter_mut().zip(&sample.truth.displacement_mm) {
            (0..3).for_each(|k| node[k] += moved[k]);
        }
        let [x, y, z, w] = sample.orientation_xyzw;
        let points = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)) * -Vector3::z();
        let travel = sample.truth.travel_mm;
        let tip_mm: [f32; 3] = std::array::from_fn(|k| sample.tip_mm[k] + travel * sample.direction[k]);
        ContactSample {
            name: format!("{}-{:06}-{:02}", sample.split as u8, sample.path, sample.step),
            rest_mm: sample.rest_mm,
            deformed_mm,
            force_mn: sample.force_mn,
            direction: sample.direction,
            touch_mm: sample.touch_mm,
            tip_mm,
            shaft_mm: std::array::from_fn(|k| tip_mm[k] - SHAFT_MM * points[k]),
        }
    }
}

/// Writes `samples` below `folder`, a folder for each scene. Returns how many were written.
///
/// # Errors
/// [`DatasetError`].
pub fn export(samples: &[Sample], folder: &Path) -> Result<usize, DatasetError> {
    let names = Scene::built_in_names();
    let triangles = Patch::grid(Surface::Flat, Default::default()).triangles;
    for sample in samples {
        let scene = folder.join(names.get(usize::from(sample.scene)).copied().unwrap_or("other"));
        if !scene.join(REST).exists() {
            std::fs::create_dir_all(&scene).map_err(DatasetError::io(&scene))?;
            write(&scene.join(REST), ply(&sample.rest_mm, &triangles))?;
            write(&scene.join(RIGID), ply(&sample.rest_mm, &triangles))?;
        }
        let contact = ContactSample::of(sample);
        write(&scene.join(format!("{}.ply", contact.name)), ply(&contact.deformed_mm, &triangles))?;
        let rotation = degrees(&sample.orientation_xyzw);
        let text = Value::from(vec![Value::Object(numbers(&contact, rotation))]).to_string();
        write(&scene.join(format!("{}.json", contact.name)), text)?;
    }
    Ok(samples.len())
}

/// The samples in a folder of that layout, in the order of their names.
///
/// # Errors
/// [`DatasetError`] naming the file, and the field that is missing.
pub fn import(folder: &Path) -> Result<Vec<ContactSample>, DatasetError> {
    let rest_mm = nodes(&folder.join(REST))?;
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(DatasetError::io(folder))? {
        let path = entry.map_err(DatasetError::io(folder))?.path();
        if path.extension().is_some_and(|extension| extension == "json") {
            names.extend(path.file_stem().and_then(|name| name.to_str()).map(str::to_owned));
        }
    }
    names.sort();
    names.into_iter().map(|name| read(folder, name, rest_mm)).collect()
}

fn read(folder: &Path, name: String, rest_mm: Field) -> Result<ContactSample, DatasetError> {
    let file: PathBuf = folder.join(format!("{name}.json"));
    let text = std::fs::read_to_string(&file).map_err(DatasetError::io(&file))?;
    let list: Vec<Map<String, Value>> =
        serde_json::from_str(&text).map_err(|error| DatasetError::malformed(&file, error))?;
    let first = list.first().ok_or_else(|| DatasetError::malformed(&file, "the list is empty"))?;
    let number = |field: String| {
        let value = first.get(&field).and_then(Value::as_f64);
        value.map(|value| value as f32).ok_or_else(|| DatasetError::malformed(&file, format!("`{field}` is no number")))
    };
    let vector = |field: &str| -> Result<[f32; 3], DatasetError> {
        let [x, y, z] = ["X", "Y", "Z"].map(|axis| number(format!("{field}{axis}")));
        Ok([z?, -x?, y?])
    };
    Ok(ContactSample {
        rest_mm,
        deformed_mm: nodes(&folder.join(format!("{name}.ply")))?,
        force_mn: number("force".to_owned())?,
        direction: vector("forceDirection")?,
        touch_mm: vector("collisionPosition")?,
        tip_mm: vector("deformerTipCollisionPosition")?,
        shaft_mm: vector("deformerInitialPosition")?,
        name,
    })
}

/// The fields that the loaders read.
fn numbers(contact: &ContactSample, rotation_deg: [f32; 3]) -> Map<String, Value> {
    let mut fields = Map::new();
    let mut vector = |name: &str, [x, y, z]: [f32; 3]| {
        for (axis, value) in [("X", -y), ("Y", z), ("Z", x)] {
            fields.insert(format!("{name}{axis}"), json!(value));
        }
    };
    vector("forceDirection", contact.direction);
    vector("collisionPosition", contact.touch_mm);
    for tip in ["deformerCollisionPosition", "deformerTipCollisionPosition"] {
        vector(tip, contact.tip_mm);
    }
    for origin in ["deformerOrigin", "deformerInitialPosition"] {
        vector(origin, contact.shaft_mm);
    }
    vector("deformerInitialRotation", rotation_deg);
    ZERO.into_iter().for_each(|name| vector(name, [0.0; 3]));
    fields.insert("force".to_owned(), json!(contact.force_mn));
    fields.insert("collisionImpulse".to_owned(), json!(0.0));
    fields.insert("mass".to_owned(), json!(0.0));
    fields.insert("gravity_enabled".to_owned(), json!(false));
    fields
}

/// Rotations about x, y and z, one after another (degrees).
fn degrees(&[x, y, z, w]: &[f32; 4]) -> [f32; 3] {
    let (roll, pitch, yaw) = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).euler_angles();
    [roll, pitch, yaw].map(f32::to_degrees)
}

fn write(file: &Path, text: String) -> Result<(), DatasetError> {
    std::fs::write(file, text).map_err(DatasetError::io(file))
}

fn ply(vertices: &Field, triangles: &[[usize; 3]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment mm, patch frame\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    for [x, y, z] in vertices {
        text += &format!("{x} {y} {z}\n");
    }
    for [a, b, c] in triangles {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

/// The vertices of a mesh of as many nodes as a patch has.
fn nodes(file: &Path) -> Result<Field, DatasetError> {
    let bytes = std::fs::read(file).map_err(DatasetError::io(file))?;
    let mesh = read_mesh(&bytes, MeshFormat::Ply).map_err(|error| DatasetError::malformed(file, error))?;
    let vertices: Vec<[f32; 3]> = mesh.vertices().iter().map(|v| [v.x as f32, v.y as f32, v.z as f32]).collect();
    let count = vertices.len();
    vertices.try_into().map_err(|_| DatasetError::malformed(file, format!("{count} vertices, not {NODES}")))
}
