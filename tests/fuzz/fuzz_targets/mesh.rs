//! Files of meshes: the first byte says which format, the rest is the file. What is read is a sound mesh.

#![no_main]

use libfuzzer_sys::fuzz_target;
use retina_core::surface::TriangleMesh;
use retina_core::surface::mesh_file::{MeshFormat, read_mesh};

fuzz_target!(|bytes: &[u8]| {
    let Some((first, file)) = bytes.split_first() else { return };
    let (_, format) = MeshFormat::ENDINGS[usize::from(*first) % MeshFormat::ENDINGS.len()];
    if let Ok(mesh) = read_mesh(file, format) {
        assert!(!mesh.triangles().is_empty());
        let again = TriangleMesh::new(mesh.vertices().to_vec(), mesh.triangles().to_vec());
        assert_eq!(again.as_ref(), Ok(&mesh), "what is read is a mesh by the strict rules too");
    }
});
