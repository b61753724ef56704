//! Scenes: the built-in ones, their ranges, their patches.

use std::sync::Arc;

use nalgebra::Point3;
use retina_core::patch::Patch;
use retina_core::scene::{Scene, SceneSurface};
use retina_core::surface::TriangleMesh;

use crate::meshes::hills;

#[test]
fn built_in_scenes_are_allowed_and_have_a_grid() {
    assert_eq!(Scene::built_in_names(), ["flat", "macula", "fovea"]);
    for name in Scene::built_in_names() {
        let scene = Scene::built_in(name).unwrap();
        assert_eq!(&scene.name, name);
        scene.validate().unwrap();
        let patch = scene.patch(&Point3::new(0.3, 0.0, 5.0)).unwrap();
        assert_eq!((patch.vertices.len(), patch.source_indices), (64, None));
        assert!(patch.surface.column(0.0, 0.0).surface.coords.norm() < 1e-12);
    }
    assert_eq!(Scene::built_in("moon"), None);
}

#[test]
fn the_fovea_leaves_a_tenth_of_a_millimetre() {
    let scene = Scene::built_in("fovea").unwrap();
    let patch = scene.patch(&Point3::origin()).unwrap();
    let floor = scene.tissue.retina_thickness_mm() - patch.surface.column(0.0, 0.0).retina_thinning_mm;
    assert!((floor - 0.10).abs() < 1e-12, "{floor}");
}

#[test]
fn a_scene_outside_its_ranges_is_refused_with_the_field() {
    let mut scene = Scene::built_in("macula").unwrap();
    scene.surface = SceneSurface::Sphere { radius_mm: 1.0 };
    assert_eq!(scene.validate().unwrap_err().field, "surface.radius_mm");
    let mut scene = Scene::built_in("fovea").unwrap();
    scene.tissue.retina[0].thickness_mm = 0.15;
    let error = scene.validate().unwrap_err();
    assert_eq!(error.field, "surface.depth_mm", "a pit must not reach through a thin retina");
    assert!((error.max - 0.10).abs() < 1e-12);
    let mut scene = Scene::built_in("flat").unwrap();
    scene.scene_from_patch.translation.vector.z = f64::NAN;
    assert_eq!(scene.validate().unwrap_err().field, "scene_from_patch.translation_mm[2]");
}

#[test]
fn a_mesh_scene_cuts_its_patch() {
    let (vertices, triangles) = hills(30, 0.25);
    let mesh = Arc::new(TriangleMesh::new(vertices, triangles).unwrap());
    let contact = Point3::new(0.1, 0.2, 0.0);
    let surface = SceneSurface::Mesh(Arc::clone(&mesh));
    let scene = Scene { surface, ..Scene::built_in("flat").unwrap() };
    scene.validate().unwrap();
    assert_eq!(scene.patch(&contact).unwrap(), Patch::cut(&mesh, &contact).unwrap());
}
