//! The answer moves with the scene, and does not depend on how a mesh is numbered.

use nalgebra::{Isometry3, Point3};
use retina_core::predict::{Level, Prediction, PreparedScene, Request};
use retina_core::scene::Scene;
use retina_tests::tolerance::RIGID_MOTION;

use crate::support::{FAST, answered, ask, at, built_in, cap, largest_um, mesh_scene, motion, moved, requests};

/// The largest difference between `answer` moved by `by` and `other` (mm), nodes and tip; normals and reaction are checked on the way.
fn difference(answer: &Prediction, by: &Isometry3<f64>, other: &Prediction) -> f64 {
    for (normal, other) in answer.normals.iter().zip(&other.normals) {
        assert!((by * normal - other).norm() < 1e-5, "{normal} {other}");
    }
    let (reaction, other_reaction) = (by * answer.needle.reaction_mn, other.needle.reaction_mn);
    assert!((reaction - other_reaction).norm() < 1e-5 * reaction.norm(), "{reaction} {other_reaction}");
    assert_eq!(answer.triangles, other.triangles);
    assert_eq!(answer.vertices.len(), other.vertices.len());
    let nodes = answer.vertices.iter().zip(&other.vertices).map(|(a, b)| (by * a - b).norm());
    nodes.fold((by * answer.needle.tip_mm - other.needle.tip_mm).norm(), f64::max)
}

fn moved_scene(name: &str, by: &Isometry3<f64>) -> PreparedScene {
    let scene = Scene { scene_from_patch: *by, ..Scene::built_in(name).unwrap() };
    PreparedScene::new(scene).unwrap()
}

#[test]
fn a_rigid_motion_of_scene_and_needle_moves_the_answer() {
    let mut worst = [0.0_f64; 2];
    for (name, seed) in Scene::built_in_names().iter().zip(60..) {
        let scene = built_in(name);
        for (level, worst) in FAST.into_iter().zip(&mut worst) {
            for (index, (request, answer)) in answered(&scene, seed, 7, level).iter().enumerate() {
                let by = motion(100 * seed + index as u64);
                let other = moved_scene(name, &by);
                let elsewhere = ask(&other, &moved(request, &by)).unwrap();
                let miss = difference(answer, &by, &elsewhere);
                assert!(miss < RIGID_MOTION, "{name} {level:?}: {miss:e} mm, {request:?}");
                *worst = worst.max(miss);
                // The needle alone moved is another question.
                assert!(ask(&scene, &moved(request, &by)).map_or(true, |a| a.vertices != answer.vertices));
            }
        }
    }
    println!("largest difference under rigid motion: linear {:e} mm, coarse {:e} mm", worst[0], worst[1]);
}

#[test]
fn a_rigid_motion_moves_the_reference() {
    let (scene, by) = (built_in("macula"), motion(5));
    let request = at(&requests(&scene, 71, 1)[0], Level::Reference);
    let answer = ask(&scene, &request).unwrap();
    let elsewhere = ask(&moved_scene("macula", &by), &moved(&request, &by)).unwrap();
    let miss = difference(&answer, &by, &elsewhere);
    assert!(miss < RIGID_MOTION, "{miss:e} mm");
}

/// Requests that meet the cap well inside.
fn mesh_requests(count: usize) -> Vec<Request> {
    requests(&built_in("macula"), 80, count)
}

#[test]
fn a_rigid_motion_of_a_mesh_and_needle_moves_the_answer() {
    let (vertices, triangles) = cap();
    let scene = mesh_scene(vertices.clone(), triangles.clone());
    let mut worst = [0.0_f64; 2];
    for (index, request) in mesh_requests(5).iter().enumerate() {
        let by = motion(500 + index as u64);
        let turned: Vec<Point3<f64>> = vertices.iter().map(|vertex| by * vertex).collect();
        let other = mesh_scene(turned, triangles.clone());
        for (level, worst) in FAST.into_iter().zip(&mut worst) {
            let request = at(request, level);
            let answer = ask(&scene, &request).unwrap_or_else(|e| panic!("{request:?}: {e}"));
            let elsewhere = ask(&other, &moved(&request, &by)).unwrap();
            assert_eq!(answer.source_indices, elsewhere.source_indices);
            assert!(largest_um(&answer) > 0.05, "a mesh that does not move proves little");
            let miss = difference(&answer, &by, &elsewhere);
            assert!(miss < RIGID_MOTION, "{level:?}: {miss:e} mm, {request:?}");
            *worst = worst.max(miss);
        }
    }
    println!("mesh, largest difference under rigid motion: linear {:e} mm, coarse {:e} mm", worst[0], worst[1]);
}

#[test]
fn relabelling_a_mesh_relabels_the_answer() {
    let (vertices, triangles) = cap();
    let scene = mesh_scene(vertices.clone(), triangles.clone());
    let mut random = fastrand::Rng::with_seed(9);
    for request in mesh_requests(4) {
        let mut label: Vec<usize> = (0..vertices.len()).collect();
        random.shuffle(&mut label);
        let mut shuffled = vertices.clone();
        label.iter().zip(&vertices).for_each(|(&label, vertex)| shuffled[label] = *vertex);
        let mut renamed: Vec<[usize; 3]> =
            triangles.iter().map(|corners| corners.map(|corner| label[corner])).collect();
        random.shuffle(&mut renamed);
        let other = mesh_scene(shuffled, renamed);
        for level in FAST {
            let request = at(&request, level);
            let answer = ask(&scene, &request).unwrap_or_else(|e| panic!("{request:?}: {e}"));
            let relabelled = ask(&other, &request).unwrap();
            let sources = relabelled.source_indices.as_ref().unwrap();
            assert_ne!(answer.source_indices.as_ref(), Some(sources), "the labels did change");
            let mut worst = (answer.needle.tip_mm - relabelled.needle.tip_mm).norm();
            for (node, source) in answer.source_indices.as_ref().unwrap().iter().enumerate() {
                let twin = sources.iter().position(|other| *other == label[*source]).unwrap();
                worst = worst.max((answer.vertices[node] - relabelled.vertices[twin]).norm());
                assert!((answer.normals[node] - relabelled.normals[twin]).norm() < 1e-5);
            }
            assert!(worst < RIGID_MOTION, "{level:?}: {worst:e} mm, {request:?}");
        }
    }
}
