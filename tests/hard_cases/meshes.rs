//! User meshes with faults: each is refused by name, or answered as the surface that is there.
//!
//! A mesh is a cap of the eye's ball with vertices every 0.23 mm, give or take; a case changes it. Iterations: kinks of a coarse mesh cost the default needle a few more than a smooth ball.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::needle::NeedleShape;
use retina_core::predict::{Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::{Scene, SceneSurface};
use retina_core::surface::TriangleMesh;
use retina_tests::cap::{SIDE, cap};
use retina_tests::laws::broken;

use crate::table::{Expect, Expect::*, at, built_in, push};

type Mesh = (Vec<Point3<f64>>, Vec<[usize; 3]>);

/// A faulty mesh, asked where the needle stands over (x, y), and what must come of it.
struct Case {
    name: &'static str,
    change: fn(&mut Mesh),
    at_mm: [f64; 2],
    expect: Expect,
}

const fn case(name: &'static str, change: fn(&mut Mesh), at_mm: [f64; 2], expect: Expect) -> Case {
    Case { name, change, at_mm, expect }
}

/// The vertex in the middle.
const MIDDLE: usize = SIDE / 2 * SIDE + SIDE / 2;

/// A fifth vertex on the diagonal of the square beside the middle, a share of it off the diagonal: two of the four triangles are slivers.
fn sliver(mesh: &mut Mesh, share: f64) {
    let [a, b, c] = [MIDDLE, MIDDLE + 1, MIDDLE + SIDE + 1];
    let (p, q, r) = (mesh.0[a], mesh.0[c], mesh.0[b]);
    let middle = p + (q - p) * 0.5;
    mesh.0.push(middle + (r - middle) * share);
    let new = mesh.0.len() - 1;
    let place = mesh.1.iter().position(|t| *t == [a, b, c]).expect("the triangle");
    mesh.1.splice(place..=place, [[a, b, new], [b, c, new], [c, a, new]]);
}

/// Takes away every triangle whose corners fulfil `gone`.
fn remove(mesh: &mut Mesh, gone: impl Fn(&Point3<f64>) -> bool) {
    let (vertices, triangles) = mesh;
    triangles.retain(|corners| !corners.iter().all(|&corner| gone(&vertices[corner])));
}

fn flip(mesh: &mut Mesh, which: impl Fn(usize) -> bool) {
    mesh.1.iter_mut().enumerate().filter(|(index, _)| which(*index)).for_each(|(_, corners)| corners.swap(1, 2));
}

fn scale(mesh: &mut Mesh, by: f64) {
    mesh.0.iter_mut().for_each(|vertex| *vertex *= by);
}

/// The middle vertex twice: once for the first of its triangles, once for the others.
fn split_middle(mesh: &mut Mesh) {
    mesh.0.push(mesh.0[MIDDLE]);
    let twin = mesh.0.len() - 1;
    let first = mesh.1.iter().position(|corners| corners.contains(&MIDDLE)).expect("a triangle");
    mesh.1[first].iter_mut().filter(|corner| **corner == MIDDLE).for_each(|corner| *corner = twin);
}

const CASES: &[Case] = &[
    case("sound", |_| {}, [0.1, 0.05], Answer(12)),
    case("a sliver of 1e-3", |m| sliver(m, 1e-3), [0.1, 0.05], Answer(12)),
    case("a sliver of 1e-7", |m| sliver(m, 1e-7), [0.1, 0.05], Answer(12)),
    case("a sliver without area", |m| sliver(m, 1e-12), [0.1, 0.05], Refusal("has no area")),
    case("two vertices in one place", split_middle, [0.1, 0.05], Refusal("are the same point: weld them")),
    case("a triangle flipped", |m| flip(m, |index| index == 700), [0.1, 0.05], Refusal("one is turned over")),
    case(
        "every other triangle flipped",
        |m| flip(m, |index| index % 2 == 0),
        [0.1, 0.05],
        Refusal("one is turned over"),
    ),
    case("the whole mesh inside out", |m| flip(m, |_| true), [0.1, 0.05], Refusal("from the inward surface normal")),
    case("a triangle twice", |m| m.1.push(m.1[700]), [0.1, 0.05], Refusal("one is turned over")),
    case("a vertex that is not there", |m| m.1.push([0, 1, 100_000]), [0.1, 0.05], Refusal("refers to vertex 100000")),
    case("a vertex that is not a number", |m| m.0[MIDDLE].z = f64::NAN, [0.1, 0.05], Refusal("not finite")),
    case("vertices without a triangle", |m| m.0.extend([Point3::new(0.05, 0.05, 3.0); 1]), [0.1, 0.05], Answer(12)),
    case(
        "a hole under the needle",
        |m| remove(m, |p| p.coords.xy().norm() < 0.4),
        [0.1, 0.05],
        Warned(12, "has a hole, 0.00 mm from"),
    ),
    case(
        "a hole of 5 mm under the needle",
        |m| remove(m, |p| p.coords.xy().norm() < 2.5),
        [0.1, 0.05],
        Refusal("from the surface, more than"),
    ),
    case("a boundary through the patch", |m| remove(m, |p| p.x > 0.3), [0.1, 0.05], Warned(12, "the mesh ends")),
    case("the needle beyond the boundary", |m| remove(m, |p| p.x > 0.0), [0.6, 0.0], Warned(12, "the mesh ends")),
    case("a strip 0.6 mm wide", |m| remove(m, |p| p.x.abs() > 0.3), [0.1, 0.05], Warned(12, "the mesh ends")),
    case("a spike of 0.1 mm", |m| m.0[MIDDLE].z += 0.1, [0.1, 0.05], Answer(20)),
    case("a spike of 2 mm beside the needle", |m| m.0[MIDDLE + 3].z += 2.0, [0.1, 0.05], Answer(20)),
    case("folded over itself", |m| m.0[MIDDLE].x += 0.6, [0.1, 0.05], Refusal("folded over itself")),
    case("a second sheet 0.2 mm below", second_sheet, [0.1, 0.05], Answer(12)),
    case("given in metres", |m| scale(m, 1e-3), [0.1, 0.05], Refusal("outside of the patch")),
    case("given in micrometres", |m| scale(m, 1e3), [0.1, 0.05], Refusal("further than 1000 mm")),
    case("no triangles", |m| m.1.clear(), [0.1, 0.05], Refusal("from the surface, more than")),
    case("nothing at all", |m| *m = Mesh::default(), [0.1, 0.05], Refusal("from the surface, more than")),
];

fn second_sheet(mesh: &mut Mesh) {
    let count = mesh.0.len();
    mesh.0.extend_from_within(..);
    mesh.0[count..].iter_mut().for_each(|vertex| vertex.z -= 0.2);
    let below: Vec<[usize; 3]> = mesh.1.iter().map(|corners| corners.map(|corner| corner + count)).collect();
    mesh.1.extend(below);
}

fn scene(mesh: TriangleMesh) -> Scene {
    Scene { surface: SceneSurface::Mesh(Arc::new(mesh)), ..built_in("macula") }
}

fn pressed([x, y]: [f64; 2]) -> Request {
    at(push(NeedleShape::hemispherical(0.257), 0.5), x, y, 0.1)
}

#[test]
fn faulty_meshes_are_refused_by_name_or_answered() {
    let mut wrong = Vec::new();
    for case in CASES {
        let mut mesh = cap();
        (case.change)(&mut mesh);
        let request = pressed(case.at_mm);
        let answer = TriangleMesh::new(mesh.0, mesh.1).map_err(|error| error.to_string()).and_then(|mesh| {
            let scene = PreparedScene::new(scene(mesh)).map_err(|error| error.to_string())?;
            let mut answer = Err(String::new());
            for level in [Level::Linear, Level::Coarse] {
                let request = Request { level, ..request.clone() };
                answer =
                    scene.predict(&request, &mut Workspace::default(), &mut Silent).map_err(|error| error.to_string());
                if let Ok(answer) = &answer {
                    wrong.extend(
                        broken(scene.scene(), &request, answer).iter().map(|law| format!("{}: {law}", case.name)),
                    );
                }
            }
            answer
        });
        match (&answer, case.expect) {
            (Ok(answer), Answer(limit)) if answer.solver.iterations <= limit => {
                println!("| meshes | {} | {} iterations |", case.name, answer.solver.iterations);
            }
            (Ok(answer), Warned(limit, word))
                if answer.solver.iterations <= limit
                    && answer.warnings.iter().any(|warning| warning.contains(word)) =>
            {
                println!("| meshes | {} | {} iterations, {word} |", case.name, answer.solver.iterations);
            }
            (Err(error), Refusal(word)) if error.contains(word) => println!("| meshes | {} | {error} |", case.name),
            (Ok(answer), _) => {
                wrong.push(format!("{}: answered in {}, {:?}", case.name, answer.solver.iterations, answer.warnings));
            }
            (Err(error), _) => wrong.push(format!("{}: {error}", case.name)),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_split_vertex_that_is_welded_changes_nothing() {
    let answer = |mesh: TriangleMesh| {
        let scene = PreparedScene::new(scene(mesh)).unwrap();
        scene.predict(&pressed([0.1, 0.05]), &mut Workspace::default(), &mut Silent).unwrap()
    };
    let mut mesh = cap();
    let sound = answer(TriangleMesh::new(mesh.0.clone(), mesh.1.clone()).unwrap());
    split_middle(&mut mesh);
    let welded = answer(TriangleMesh::welded(mesh.0, mesh.1).unwrap());
    assert_eq!(welded, sound);
    assert!(sound.displacement_um.iter().any(|&moved| moved > 1.0));
    // A mesh that is not the same must not give the same.
    let mut mesh = cap();
    mesh.0[MIDDLE] += Vector3::new(0.0, 0.0, 1e-3);
    assert_ne!(answer(TriangleMesh::new(mesh.0, mesh.1).unwrap()).vertices, sound.vertices);
}
