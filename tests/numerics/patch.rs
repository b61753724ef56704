//! Patches: the grid's order, normals, and cutting from a mesh whatever its place and numbering.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use retina_core::patch::{Patch, PatchError, vertex_normals};
use retina_core::surface::{Surface, TriangleMesh};

use crate::meshes::{hills, noise};

fn cut(vertices: Vec<Point3<f64>>, triangles: Vec<[usize; 3]>, contact: &Point3<f64>) -> Result<Patch, PatchError> {
    Patch::cut(&TriangleMesh::new(vertices, triangles).unwrap(), contact)
}

const CONTACT: Point3<f64> = Point3::new(0.13, -0.21, 0.05);

#[test]
fn the_grid_runs_row_by_row_with_x_fastest() {
    let patch = Patch::grid(Surface::Flat, Isometry3::identity());
    assert_eq!((patch.vertices.len(), patch.triangles.len()), (64, 98));
    for (node, expected) in [(0, [-1.05, -1.05]), (1, [-0.75, -1.05]), (8, [-1.05, -0.75]), (63, [1.05, 1.05])] {
        let found = patch.parameters[node];
        assert!((found[0] - expected[0]).abs() + (found[1] - expected[1]).abs() < 1e-12, "{node} {found:?}");
        assert!((patch.vertices[node] - Point3::new(expected[0], expected[1], 0.0)).norm() < 1e-12);
    }
    assert_eq!(patch.triangles[..3], [[0, 1, 9], [0, 9, 8], [1, 2, 10]]);
    assert_eq!(patch.triangles[97], [54, 63, 62]);
}

#[test]
fn grid_triangles_cover_the_square_once_and_face_the_vitreous() {
    for surface in [Surface::Flat, Surface::Sphere { radius_mm: 12.0 }] {
        let patch = Patch::grid(surface, Isometry3::identity());
        let area = |&[a, b, c]: &[usize; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| patch.vertices[corner].xy());
            0.5 * (b - a).perp(&(c - a))
        };
        assert!(patch.triangles.iter().all(|corners| area(corners) > 0.04));
        let sum: f64 = patch.triangles.iter().map(area).sum();
        assert!((sum - 2.1 * 2.1).abs() < 1e-12, "{sum}");
    }
}

#[test]
fn normals_are_unit_length_area_weighted_and_point_out_of_the_tissue() {
    let patch = Patch::grid(Surface::Sphere { radius_mm: 12.0 }, Isometry3::identity());
    let normals = vertex_normals(&patch.vertices, &patch.triangles);
    for (node, normal) in normals.iter().enumerate() {
        let [x, y] = patch.parameters[node];
        assert!((normal.norm() - 1.0).abs() < 1e-12);
        // A rim node has triangles on one side only, which leans its normal by half a spacing over the radius.
        assert!((normal - patch.surface.normal(x, y).into_inner()).norm() < 0.02, "{node} {normal}");
    }
    assert!(normals[0].x > 0.05 && normals[0].y > 0.05, "seen from inside, normals lean to the axis: {}", normals[0]);
    // Three times the area, three times the weight.
    let points =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -3.0], [9.0, 9.0, 9.0]].map(Point3::from);
    let normals = vertex_normals(&points, &[[0, 1, 2], [0, 3, 2]]);
    assert!((normals[0] - Vector3::new(3.0, 0.0, 1.0).normalize()).norm() < 1e-12, "{}", normals[0]);
    assert_eq!(normals[4], Vector3::z());
}

#[test]
fn a_cut_patch_keeps_the_nearest_vertices_in_the_order_of_the_mesh() {
    let (vertices, triangles) = hills(30, 0.25);
    let patch = cut(vertices.clone(), triangles.clone(), &CONTACT).unwrap();
    let nodes = patch.source_indices.as_ref().unwrap();
    assert!(nodes.len() == 64 && nodes.is_sorted());
    let distance = |vertex: usize| (vertices[vertex] - CONTACT).norm();
    let furthest = nodes.iter().map(|&vertex| distance(vertex)).fold(0.0, f64::max);
    let others = (0..vertices.len()).filter(|vertex| nodes.binary_search(vertex).is_err());
    assert!(others.map(distance).fold(f64::INFINITY, f64::min) >= furthest);
    for (node, &vertex) in nodes.iter().enumerate() {
        assert!((patch.scene_from_patch * patch.vertices[node] - vertices[vertex]).norm() < 1e-12);
        let [x, y] = patch.parameters[node];
        assert!((patch.surface.column(x, y).surface - patch.vertices[node]).norm() < 1e-7);
    }
    let kept = |corners: &[usize; 3]| corners.iter().all(|corner| nodes.binary_search(corner).is_ok());
    let expected: Vec<[usize; 3]> = triangles.into_iter().filter(kept).collect();
    let found: Vec<[usize; 3]> = patch.triangles.iter().map(|corners| corners.map(|node| nodes[node])).collect();
    assert!(found == expected && found.len() > 80, "{}", found.len());
}

#[test]
fn the_frame_of_a_cut_stands_on_the_surface_with_z_out_of_it() {
    let (vertices, triangles) = hills(30, 0.25);
    let patch = cut(vertices, triangles, &CONTACT).unwrap();
    assert!(patch.surface.column(0.0, 0.0).surface.coords.norm() < 1e-9);
    let contact = patch.scene_from_patch.inverse_transform_point(&CONTACT);
    assert!(contact.coords.norm() < 0.2 && contact.z > 0.0, "{contact}");
    let mean = vertex_normals(&patch.vertices, &patch.triangles).iter().sum::<Vector3<f64>>() / 64.0;
    assert!((mean.normalize() - Vector3::z()).norm() < 0.05, "{mean}");
    let centroid = patch.vertices.iter().map(|vertex| vertex.coords).sum::<Vector3<f64>>() / 64.0;
    assert!(centroid.x > 1e-3 && centroid.y.abs() < 1e-12, "{centroid}");
}

#[test]
fn a_cut_moves_with_the_mesh() {
    let (vertices, triangles) = hills(30, 0.25);
    let still = cut(vertices.clone(), triangles.clone(), &CONTACT).unwrap();
    let mut random = noise(9);
    for _ in 0..8 {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(random(), random(), random()) * 3.0);
        let motion = Isometry3::from_parts(Translation3::new(20.0 * random(), 5.0 * random(), random()), turn);
        let moved: Vec<Point3<f64>> = vertices.iter().map(|vertex| motion * vertex).collect();
        let moved = cut(moved, triangles.clone(), &(motion * CONTACT)).unwrap();
        assert_eq!((&moved.source_indices, &moved.triangles), (&still.source_indices, &still.triangles));
        for (one, other) in moved.vertices.iter().zip(&still.vertices) {
            assert!((one - other).norm() < 1e-10, "{one} {other}");
        }
        for (x, y) in [(0.0, 0.0), (0.4, -0.7), (2.0, 1.5), (-6.0, 3.0)] {
            let (one, other) = (moved.surface.column(x, y).surface, still.surface.column(x, y).surface);
            assert!((one - other).norm() < 1e-9, "{one} {other}");
        }
    }
}

#[test]
fn a_cut_is_renumbered_with_the_mesh() {
    let (vertices, triangles) = hills(30, 0.25);
    let count = vertices.len();
    // 7 has no divisor in common with 900, so this visits every number once.
    let renumber = |old: usize| (7 * old + 13) % count;
    let mut renumbered = vec![Point3::origin(); count];
    for (old, vertex) in vertices.iter().enumerate() {
        renumbered[renumber(old)] = *vertex;
    }
    let changed: Vec<[usize; 3]> = triangles.iter().rev().map(|corners| corners.map(renumber)).collect();
    let plain = cut(vertices, triangles, &CONTACT).unwrap();
    let other = cut(renumbered, changed, &CONTACT).unwrap();
    let other_nodes = other.source_indices.as_ref().unwrap();
    assert_ne!(&plain.source_indices, &other.source_indices);
    for (node, &old) in plain.source_indices.as_ref().unwrap().iter().enumerate() {
        let place = other_nodes.binary_search(&renumber(old)).expect("the same vertices are kept");
        assert!((plain.vertices[node] - other.vertices[place]).norm() < 1e-12);
    }
}

#[test]
fn equally_near_vertices_are_told_apart_by_their_place_and_not_their_number() {
    // A plain grid with the contact on a vertex: the 64th place is shared by several.
    let place = |i: usize| Point3::new(0.25 * (i % 15) as f64, 0.25 * (i / 15) as f64, 0.0);
    let vertices: Vec<Point3<f64>> = (0..225).map(place).collect();
    let triangles = crate::meshes::grid_triangles(15);
    let contact = vertices[112];
    let plain = cut(vertices.clone(), triangles.clone(), &contact).unwrap();
    let reversed: Vec<Point3<f64>> = vertices.into_iter().rev().collect();
    let turned = triangles.iter().map(|corners| corners.map(|corner| 224 - corner)).collect();
    let other = cut(reversed, turned, &contact).unwrap();
    let mut expected: Vec<usize> = other.source_indices.unwrap().iter().map(|node| 224 - node).collect();
    expected.sort_unstable();
    assert_eq!(plain.source_indices.unwrap(), expected);
}

#[test]
fn what_cannot_be_cut_says_why() {
    let (vertices, triangles) = hills(30, 0.25);
    let mesh = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
    let refused = |contact: [f64; 3]| Patch::cut(&mesh, &Point3::from(contact)).unwrap_err();
    assert!(matches!(refused([f64::NAN, 0.0, 0.0]), PatchError::ContactNotFinite { .. }));
    assert!(matches!(refused([0.0, 0.0, 2.0]), PatchError::ContactTooFar { distance_mm } if distance_mm > 1.0));
    assert!(
        matches!(refused([100.0, 0.0, 0.0]), PatchError::ContactTooFar { distance_mm } if distance_mm.is_infinite())
    );
    let (few, few_triangles) = hills(7, 0.25);
    assert_eq!(cut(few, few_triangles, &CONTACT).unwrap_err(), PatchError::TooFewVertices { found: 49 });
    let mut folded = vertices;
    folded[435].x += 0.9;
    match cut(folded, triangles.clone(), &CONTACT).unwrap_err() {
        PatchError::Folded { triangle } => {
            assert!(triangles[triangle].contains(&435), "{triangle}")
        }
        other => panic!("{other}"),
    }
}

#[test]
fn another_sheet_nearby_is_not_part_of_the_patch() {
    let (mut vertices, mut triangles) = hills(30, 0.25);
    let alone = cut(vertices.clone(), triangles.clone(), &CONTACT).unwrap();
    let count = vertices.len();
    vertices.extend(vertices.clone().iter().map(|vertex| vertex - Vector3::z() * 0.25));
    triangles.extend(triangles.clone().iter().map(|corners| corners.map(|corner| corner + count)));
    assert_eq!(cut(vertices, triangles, &CONTACT).unwrap(), alone);
}
