//! The deformed surface is a surface: normals, orientation, symmetry, no node inside the needle.

use nalgebra::{Point3, Vector3};
use retina_core::needle::NeedleShape;
use retina_core::patch::NODES_PER_SIDE;
use retina_core::predict::{Level, Prediction};
use retina_core::scene::Scene;
use retina_tests::tolerance::{RIGID_MOTION, ROUNDOFF};

use crate::support::{FAST, answered, ask, built_in, largest_um, straight};

#[test]
fn surfaces_stay_surfaces_and_out_of_the_needle() {
    let mut deepest = [0.0_f64; 2];
    for (name, seed) in Scene::built_in_names().iter().zip(110..) {
        let scene = built_in(name);
        let mut near = 0;
        for (level, deepest) in FAST.into_iter().zip(&mut deepest) {
            for (request, answer) in answered(&scene, seed, 10, level) {
                assert_eq!((answer.vertices.len(), answer.triangles.len()), (64, 98));
                for normal in &answer.normals {
                    assert!((normal.norm() - 1.0).abs() < ROUNDOFF && normal.z > 0.0, "{name} {level:?} {normal}");
                }
                for &[a, b, c] in &answer.triangles {
                    let [a, b, c] = [a, b, c].map(|corner| answer.vertices[corner]);
                    assert!((b - a).cross(&(c - a)).z > 0.0, "{name} {level:?}: a triangle is turned over");
                }
                let body = request.needle.shape.body();
                let mut pose = request.needle.scene_from_needle();
                pose.translation = answer.needle.tip_mm.into();
                for vertex in &answer.vertices {
                    let distance = body.distance(&pose.inverse_transform_point(vertex));
                    near += usize::from(distance < 0.02);
                    let beyond = -distance - answer.contact.max_penetration_mm;
                    if beyond > ROUNDOFF {
                        println!("{name} {level:?}: {beyond:e} mm inside at {vertex}, {request:?}");
                    }
                    *deepest = deepest.max(beyond);
                }
            }
        }
        assert!(near > 0, "no node near the needle proves nothing");
    }
    println!("deepest node beyond the reported penetration: linear {:e} mm, coarse {:e} mm", deepest[0], deepest[1]);
    for deepest in deepest {
        assert!(deepest <= ROUNDOFF, "{deepest:e}");
    }
}

/// The largest difference between an answer over the grid's centre and its images under the square's symmetries (mm).
fn asymmetry(answer: &Prediction, rest: &[Point3<f64>]) -> f64 {
    let node = |i: usize, j: usize| answer.vertices[j * NODES_PER_SIDE + i] - rest[j * NODES_PER_SIDE + i];
    let last = NODES_PER_SIDE - 1;
    let mut worst = 0.0_f64;
    for (i, j) in (0..NODES_PER_SIDE).flat_map(|i| (0..NODES_PER_SIDE).map(move |j| (i, j))) {
        let here = node(i, j);
        let mirrored = node(last - i, j).component_mul(&Vector3::new(-1.0, 1.0, 1.0));
        let swapped = node(j, i);
        let swapped = Vector3::new(swapped.y, swapped.x, swapped.z);
        // The two reflections generate all eight symmetries.
        worst = worst.max((here - mirrored).norm()).max((here - swapped).norm());
    }
    worst
}

#[test]
fn a_needle_pushed_straight_down_gives_the_symmetry_of_the_square() {
    let scene = built_in("flat");
    let rest = scene.scene().patch(&Point3::origin()).unwrap().vertices;
    for level in FAST {
        for shape in [NeedleShape::hemispherical(0.257), NeedleShape::flat(0.3205), NeedleShape::hemispherical(0.05)] {
            let mut request = straight(level, 15.0 * shape.radius_mm * shape.radius_mm);
            request.needle.shape = shape;
            let answer = ask(&scene, &request).unwrap();
            let worst = asymmetry(&answer, &rest);
            assert!(worst < RIGID_MOTION, "{level:?} {shape:?}: {worst:e} mm");
            assert!(largest_um(&answer) > 0.1, "{level:?} {shape:?}");
            request.needle.tip_mm.x += 0.05;
            assert!(asymmetry(&ask(&scene, &request).unwrap(), &rest) > 1e-5, "off centre it is not symmetric");
        }
    }
}

#[test]
fn the_levels_see_the_same_deformation() {
    let scene = built_in("macula");
    let answers = FAST.map(|level| ask(&scene, &straight(level, 1.0)).unwrap());
    let (linear, coarse) = (largest_um(&answers[0]), largest_um(&answers[1]));
    assert!((linear / coarse - 1.0).abs() < 0.5, "{linear} {coarse}");
    assert_eq!((answers[0].level, answers[1].level), (Level::Linear, Level::Coarse));
}
