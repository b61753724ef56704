//! Surfaces at rest: columns, normals, height fields, sound meshes.

use nalgebra::{Point2, Point3, Vector3};
use retina_core::surface::thinning::Thinning;
use retina_core::surface::{HeightField, MeshError, Surface, TriangleMesh};

use crate::meshes::{grid_triangles, hills, hilly, noise};

const PIT: Surface = Surface::FovealPit { radius_mm: 12.0, depth_mm: 0.13, sigma_mm: 0.25 };

fn field(n: usize, spacing: f64) -> Surface {
    let (vertices, triangles) = hills(n, spacing);
    Surface::Mesh(HeightField::new(vertices, triangles).unwrap())
}

#[test]
fn every_surface_passes_through_the_origin_or_its_height() {
    for surface in [Surface::Flat, Surface::Sphere { radius_mm: 12.0 }, PIT] {
        let column = surface.column(0.0, 0.0);
        assert!(column.surface.coords.norm() < 1e-12, "{surface:?} {}", column.surface);
        assert!((column.inward.into_inner() + Vector3::z()).norm() < 1e-15);
        assert!((surface.normal(0.0, 0.0).into_inner() - Vector3::z()).norm() < 1e-15);
    }
}

#[test]
fn the_ball_is_seen_from_inside() {
    let ball = Surface::Sphere { radius_mm: 12.0 };
    let centre = Point3::new(0.0, 0.0, 12.0);
    for (x, y) in [(1.05, -1.05), (3.0, 4.0), (-11.0, 0.0)] {
        let column = ball.column(x, y);
        assert!(((column.surface - centre).norm() - 12.0).abs() < 1e-12);
        assert!(column.surface.z > 0.04, "the rim rises: {}", column.surface);
        assert!((column.surface.xy() - Point2::new(x, y)).norm() < 1e-12);
        assert!((column.inward.into_inner() - (column.surface - centre) / 12.0).norm() < 1e-12);
        assert!((ball.normal(x, y).into_inner() + column.inward.into_inner()).norm() < 1e-12);
    }
    assert!(ball.column(20.0, 0.0).surface.coords.iter().all(|coordinate| coordinate.is_finite()));
}

#[test]
fn the_pit_thins_the_retina_and_leaves_the_layers_below_on_a_ball() {
    let centre = Point3::new(0.0, 0.0, 12.13);
    assert_eq!(PIT.column(0.0, 0.0).retina_thinning_mm, 0.13);
    for (x, y) in [(0.0, 0.0), (0.25, 0.0), (0.3, -0.4), (1.05, 1.05)] {
        let column = PIT.column(x, y);
        // The outer face of a 0.23 mm retina lies on one ball, whatever the pit takes away above it.
        let outer = column.surface + column.inward.into_inner() * (0.23 - column.retina_thinning_mm);
        assert!(((outer - centre).norm() - 12.23).abs() < 1e-12, "{x} {y}");
        let expected = 0.13 * (-(x * x + y * y) / 0.125f64).exp();
        assert!((column.retina_thinning_mm - expected).abs() < 1e-15);
    }
}

#[test]
fn the_thinning_under_a_point_is_its_columns_and_is_derived_rightly() {
    let thinning = |x: f64, y: f64| PIT.column(x, y).retina_thinning_mm;
    for (x, y) in [(0.0, 0.0), (0.1, 0.0), (0.2, -0.15), (-0.4, 0.3), (0.7, 0.2)] {
        let here = PIT.thinning(&PIT.column(x, y).surface);
        assert!((here.mm - thinning(x, y)).abs() < 1e-14, "{x} {y}");
        // A millimetre of x or y is one along the ball, but for (x / R)² and the pit's floor, which is R + 0.13 from the centre: 1 % of a slope, 2 % of a bend.
        let h = 1e-4;
        let along = [Vector3::x(), Vector3::y()];
        let slopes = [thinning(x + h, y) - thinning(x - h, y), thinning(x, y + h) - thinning(x, y - h)];
        for (axis, slope) in along.iter().zip(slopes.map(|d| d / (2.0 * h))) {
            assert!(
                (here.slope.dot(axis) - slope).abs() < 0.02 * (0.01 + slope.abs()),
                "{x} {y}: {} {slope}",
                here.slope
            );
        }
        let (xs, ys) = (thinning(x + h, y) + thinning(x - h, y), thinning(x, y + h) + thinning(x, y - h));
        let trace = (xs + ys - 4.0 * here.mm) / (h * h);
        assert!(
            (here.bend.trace() - trace).abs() < 0.03 * (0.1 + trace.abs()),
            "{x} {y}: {} {trace}",
            here.bend.trace()
        );
        let mixed = thinning(x + h, y + h) - thinning(x + h, y - h) - thinning(x - h, y + h) + thinning(x - h, y - h);
        assert!((here.bend.m12 - mixed / (4.0 * h * h)).abs() < 0.03 * (0.1 + mixed.abs() / (4.0 * h * h)), "{x} {y}");
    }
    for surface in [Surface::Flat, Surface::Sphere { radius_mm: 12.0 }, field(5, 0.5)] {
        assert_eq!(surface.thinning(&Point3::new(0.1, -0.2, 0.0)), Thinning::none());
    }
}

#[test]
fn normals_stand_on_the_tangents() {
    let mut tilted = 0;
    for surface in [Surface::Sphere { radius_mm: 12.0 }, PIT] {
        for (x, y) in [(0.0, 0.0), (0.1, 0.0), (0.2, -0.15), (-0.4, 0.3), (1.0, 1.0), (5.0, -2.0)] {
            let normal = surface.normal(x, y);
            let h = 1e-5;
            let tangent_x = (surface.column(x + h, y).surface - surface.column(x - h, y).surface) / (2.0 * h);
            let tangent_y = (surface.column(x, y + h).surface - surface.column(x, y - h).surface) / (2.0 * h);
            let expected = tangent_x.cross(&tangent_y).normalize();
            assert!((normal.into_inner() - expected).norm() < 1e-8, "{surface:?} {x} {y} {normal:?} {expected}");
            tilted += usize::from(expected.z < 0.99);
        }
    }
    assert!(tilted >= 4, "level ground proves nothing: {tilted}");
}

#[test]
fn a_height_field_is_linear_inside_triangles_and_close_to_what_it_samples() {
    let (vertices, triangles) = hills(24, 0.2);
    let heights = HeightField::new(vertices.clone(), triangles.clone()).unwrap();
    for [a, b, c] in triangles {
        let [a, b, c] = [a, b, c].map(|corner| vertices[corner]);
        let p = a.coords * 0.5 + b.coords * 0.2 + c.coords * 0.3;
        assert!((heights.height(p.x, p.y) - p.z).abs() < 1e-12);
        assert!((heights.height(a.x, a.y) - a.z).abs() < 1e-7);
    }
    let surface = Surface::Mesh(heights);
    let mut random = noise(2);
    for _ in 0..200 {
        let (x, y) = (2.0 * random(), 2.0 * random());
        let column = surface.column(x, y);
        assert!((column.surface.z - hilly(x, y)).abs() < 3e-3, "{x} {y}");
        assert_eq!((column.inward.into_inner(), column.retina_thinning_mm), (-Vector3::z(), 0.0));
        let h = 1e-4;
        let slopes = ((hilly(x + h, y) - hilly(x - h, y)) / (2.0 * h), (hilly(x, y + h) - hilly(x, y - h)) / (2.0 * h));
        let expected = Vector3::new(-slopes.0, -slopes.1, 1.0).normalize();
        assert!((surface.normal(x, y).into_inner() - expected).norm() < 0.03, "{x} {y}");
    }
}

#[test]
fn a_height_field_goes_on_level_beyond_its_rim() {
    let vertices = [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0]].map(Point3::from).to_vec();
    let heights = HeightField::new(vertices, vec![[0, 1, 2]]).unwrap();
    for (x, y, expected) in [(-5.0, -5.0, 1.0), (9.0, 0.0, 2.0), (0.25, -3.0, 1.25), (1.0, 1.0, 2.5), (-1.0, 0.5, 2.0)]
    {
        assert!((heights.height(x, y) - expected).abs() < 1e-12, "{x} {y} {}", heights.height(x, y));
    }
    assert!(field(12, 0.3).column(1e6, -1e6).surface.z.is_finite());
}

#[test]
fn a_fold_is_refused_with_its_triangle() {
    let (mut vertices, triangles) = hills(6, 0.3);
    vertices[14].x += 0.9;
    let folded = HeightField::new(vertices, triangles.clone()).unwrap_err();
    assert!(triangles[folded.triangle].contains(&14), "{folded}");
}

#[test]
fn slivers_do_not_blow_up_the_grid() {
    let n = 3000;
    let mut vertices = vec![Point3::origin()];
    vertices.extend((0..=n).map(|i| {
        let (sin, cos) = (0.7 + 0.1 * i as f64 / n as f64).sin_cos();
        Point3::new(cos, sin, 0.5)
    }));
    let heights = HeightField::new(vertices, (1..=n).map(|i| [0, i, i + 1]).collect()).unwrap();
    let (sin, cos) = 0.75f64.sin_cos();
    assert!((heights.height(0.6 * cos, 0.6 * sin) - 0.3).abs() < 1e-6);
}

/// A fault put into a sound mesh.
type Change = fn(&mut Vec<Point3<f64>>, &mut Vec<[usize; 3]>);

#[test]
fn unsound_meshes_are_refused_with_what_is_wrong() {
    let (vertices, triangles) = hills(4, 0.3);
    TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
    let refused = |change: Change| {
        let (mut vertices, mut triangles) = (vertices.clone(), triangles.clone());
        change(&mut vertices, &mut triangles);
        TriangleMesh::new(vertices, triangles).unwrap_err()
    };
    assert!(matches!(refused(|v, _| v[3].y = f64::NAN), MeshError::Vertex { vertex: 3, .. }));
    assert!(matches!(refused(|v, _| v[2].z = 1e9), MeshError::Vertex { vertex: 2, .. }));
    assert_eq!(refused(|v, _| v[5] = v[1]), MeshError::DuplicateVertex { first: 1, second: 5 });
    assert_eq!(refused(|_, t| t[4][2] = 16), MeshError::IndexOutOfRange { triangle: 4, vertex: 16, vertex_count: 16 });
    assert_eq!(refused(|_, t| t[7] = [1, 1, 2]), MeshError::NoArea { triangle: 7 });
    assert_eq!(
        refused(|v, t| {
            v.push(v[0] + (v[1] - v[0]) * 0.5);
            t.push([0, 16, 1])
        }),
        MeshError::NoArea { triangle: 18 }
    );
    assert!(matches!(refused(|_, t| t[3].swap(0, 1)), MeshError::InconsistentOrientation { .. }));
}

#[test]
fn welding_merges_equal_vertices_and_drops_what_loses_its_area() {
    let (mut vertices, mut triangles) = hills(4, 0.3);
    let sound = TriangleMesh::new(vertices.clone(), grid_triangles(4)).unwrap();
    vertices.push(vertices[6]);
    for corners in &mut triangles[4..] {
        *corners = corners.map(|corner| if corner == 6 { 16 } else { corner });
    }
    triangles.push([6, 16, 2]);
    assert!(TriangleMesh::new(vertices.clone(), triangles.clone()).is_err());
    assert_eq!(TriangleMesh::welded(vertices, triangles).unwrap(), sound);
}
