//! Meshes and what is built on them: reference element, disc, order of unknowns, sampling, assembly, factorisation.

use nalgebra::{DMatrix, DVector, Vector3};
use retina_core::assemble::{Dofs, Pattern, Predicted, Scratch, gradient, hessian};
use retina_core::effect::{Effect, Local, Stencils, Term};
use retina_core::mesh::disc::{DiscGeometry, DiscTopology};
use retina_core::mesh::element::{NODE_OFFSETS, QUADRATURE, TOP_NODES, face_shapes, gauss_rule, shapes};
use retina_core::mesh::ordering::nested_dissection;
use retina_core::mesh::sample::SurfaceLocator;
use retina_core::mesh::wall::{LayerThickness, WallDivision, WallGeometry, WallTopology};
use retina_core::solve::sparse::SymbolicFactor;
use retina_core::surface::Surface;
use retina_tests::tolerance::{DERIVATIVE, ROUNDOFF};

use crate::meshes::noise;

#[test]
fn quadrature_is_exact_to_degree_five() {
    let mut beyond = 0.0_f64;
    for (i, j, k) in (0..7).flat_map(|i| (0..7).flat_map(move |j| (0..7).map(move |k| (i, j, k)))) {
        if i + j + k > 6 {
            continue;
        }
        let along = |p: i32| if p % 2 == 0 { 2.0 / f64::from(p + 1) } else { 0.0 };
        let exact = along(i) * along(j) * along(k);
        let value = |p: &[f64; 4]| p[1].powi(i) * p[2].powi(j) * p[3].powi(k);
        let sum: f64 = QUADRATURE.iter().map(|point| point.weight * value(&point.modes)).sum();
        if i + j + k <= 5 {
            assert!((sum - exact).abs() < ROUNDOFF, "degree ({i}, {j}, {k}): {sum} {exact}");
        } else {
            beyond = beyond.max((sum - exact).abs());
        }
    }
    assert!(beyond > 1e-3, "a rule of degree six would make this check idle: {beyond}");
}

#[test]
fn gauss_rules_are_exact_to_twice_their_points_less_one() {
    for points in 2..=5 {
        for degree in 0..=2 * points as i32 {
            let sum: f64 = gauss_rule(points).iter().map(|(x, w)| w * x.powi(degree)).sum();
            let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
            let error = (sum - exact).abs();
            let within = degree < 2 * points as i32;
            assert!(if within { error < ROUNDOFF } else { error > 1e-4 }, "{points} points, degree {degree}: {error}");
        }
    }
}

#[test]
fn shapes_of_a_face_are_those_of_its_element() {
    let mut random = noise(43);
    for _ in 0..50 {
        let [xi, eta] = [random(), random()];
        let (of_face, of_element) = (face_shapes([xi, eta]), shapes([xi, eta, 1.0]));
        for (face, element) in of_face.iter().zip(TOP_NODES.map(|node| of_element[node])) {
            assert!((face.value - element.value).abs() < ROUNDOFF, "({xi}, {eta}): {face:?}, {element:?}");
            for k in 0..2 {
                assert!((face.gradient[k] - element.gradient[k]).abs() < ROUNDOFF, "({xi}, {eta}): {face:?}");
            }
        }
    }
}

#[test]
fn shapes_sum_to_one_are_one_at_their_node_and_reproduce_quadratics() {
    for (a, offset) in NODE_OFFSETS.iter().enumerate() {
        for (b, shape) in shapes(offset.map(|o| o as f64 - 1.0)).iter().enumerate() {
            assert_eq!(shape.value, if a == b { 1.0 } else { 0.0 });
        }
    }
    let quadratic =
        |[x, y, z]: [f64; 3]| 0.3 + x - 2.0 * y + 0.5 * z + x * y - y * z + 0.7 * z * x + x * x - 2.0 * z * z;
    let mut random = noise(41);
    for _ in 0..50 {
        let at = [random(), random(), random()];
        let here = shapes(at);
        assert!((here.iter().map(|s| s.value).sum::<f64>() - 1.0).abs() < ROUNDOFF);
        let nodal = |a: usize| quadratic(NODE_OFFSETS[a].map(|o| o as f64 - 1.0));
        let value: f64 = here.iter().enumerate().map(|(a, s)| s.value * nodal(a)).sum();
        assert!((value - quadratic(at)).abs() < ROUNDOFF);
        let mut largest = 0.0_f64;
        for k in 0..3 {
            let h = 1e-5;
            let moved = |by: f64| shapes([0, 1, 2].map(|l| at[l] + if l == k { by } else { 0.0 }));
            for ((low, high), shape) in moved(-h).iter().zip(&moved(h)).zip(&here) {
                let slope = (high.value - low.value) / (2.0 * h);
                assert!((slope - shape.gradient[k]).abs() < DERIVATIVE);
                largest = largest.max(slope.abs());
            }
        }
        assert!(largest > 0.1);
    }
}

fn division() -> WallDivision {
    WallDivision { core_cells: 2, rings: 3, elements_per_layer: vec![1, 1], layers_above_interface: None }
}

fn disc_geometry(rings: usize, center: [f64; 2]) -> DiscGeometry {
    let radii = (0..=rings).map(|ring| 0.15 * 1.7_f64.powi(ring as i32)).collect();
    DiscGeometry { center, radii, offsets: Vec::new() }
}

fn wall(topology: &WallTopology, center: [f64; 2]) -> WallGeometry {
    let layers = [(0.25, true), (0.2, false)].map(|(thickness_mm, thins)| LayerThickness {
        thickness_mm,
        thins,
        first_element_mm: f64::INFINITY,
    });
    let surface = Surface::FovealPit { radius_mm: 12.0, depth_mm: 0.1, sigma_mm: 0.25 };
    WallGeometry::new(topology, &disc_geometry(3, center), &layers, |x, y| surface.column(x, y)).unwrap()
}

#[test]
fn the_disc_has_positive_cells_that_fill_it() {
    for (core_cells, rings) in [(1, 1), (1, 4), (2, 3), (4, 8)] {
        let topology = DiscTopology { core_cells, rings };
        let geometry = disc_geometry(rings, [0.3, -0.2]);
        let positions = topology.positions(&geometry);
        assert_eq!(positions.len(), topology.points());
        let rule = gauss_rule(4);
        let mut area = 0.0;
        for cell in topology.cells() {
            for (x, wx) in &rule {
                for (y, wy) in &rule {
                    // The lattice's eight outer points with the top face's shape functions.
                    let mut jacobian = [[0.0; 2]; 2];
                    for (offset, shape) in NODE_OFFSETS.iter().zip(shapes([*x, *y, 1.0])).filter(|(o, _)| o[2] == 2) {
                        let at = positions[cell[3 * offset[1] + offset[0]]];
                        for i in 0..2 {
                            for k in 0..2 {
                                jacobian[i][k] += at[i] * shape.gradient[k];
                            }
                        }
                    }
                    let determinant = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0];
                    assert!(determinant > 0.0, "{core_cells} {rings}: a cell is turned over");
                    area += wx * wy * determinant;
                }
            }
        }
        let radius = geometry.radii[rings];
        let share = area / (std::f64::consts::PI * radius * radius);
        assert!((share - 1.0).abs() < 0.02, "{core_cells} {rings}: {share} of the disc");
        let rim = (0..topology.points()).filter(|&p| topology.is_rim(p));
        assert!(rim.clone().count() == 8 * core_cells);
        for point in rim {
            let distance = (positions[point][0] - 0.3).hypot(positions[point][1] + 0.2);
            assert!((distance - radius).abs() < ROUNDOFF);
        }
    }
}

/// A stand-in effect: an energy that is quadratic in the positions, with a different symmetric matrix for each group.
pub struct Springs {
    /// Vertices of a group.
    pub size: usize,
}

impl Springs {
    /// Diagonally dominant, hence positive definite.
    fn matrix(&self, group: usize) -> DMatrix<f64> {
        let n = 3 * self.size;
        let mut random = noise(group as u64 + 77);
        let half = DMatrix::from_fn(n, n, |_, _| random());
        &half + half.transpose() + DMatrix::identity(n, n) * (3.0 * n as f64)
    }
}

impl Effect for Springs {
    fn name(&self) -> &'static str {
        "springs"
    }

    fn energy(&self, local: &Local) -> f64 {
        let x = DVector::from_column_slice(local.current);
        0.5 * x.dot(&(self.matrix(local.group) * &x))
    }

    fn add_gradient(&self, local: &Local, out: &mut [f64]) {
        let force = self.matrix(local.group) * DVector::from_column_slice(local.current);
        out.iter_mut().zip(force.iter()).for_each(|(out, force)| *out += force);
    }

    fn add_hessian(&self, local: &Local, out: &mut [f64]) {
        let matrix = self.matrix(local.group);
        let n = matrix.nrows();
        for row in 0..n {
            for column in 0..=row {
                out[row * n + column] += matrix[(row, column)];
            }
        }
    }
}

/// Overlapping groups of three and two among nine vertices; the last vertex is driven, the first fixed, the second held in y.
pub fn small() -> (Dofs, [Stencils; 2]) {
    let threes = Stencils { group_size: 3, vertices: vec![0, 1, 2, 2, 3, 4, 4, 5, 6, 6, 7, 1, 3, 5, 7] };
    let twos = Stencils { group_size: 2, vertices: vec![1, 8, 4, 8, 0, 8, 6, 2] };
    let dofs = Dofs::new(9, [5, 2, 7, 1, 0, 3, 6, 4], |vertex, k| vertex == 0 || (vertex == 1 && k == 1), Some(8));
    (dofs, [threes, twos])
}

#[test]
fn assembly_equals_a_dense_sum() {
    let (dofs, stencils) = small();
    assert_eq!(dofs.free, 3 * 7 - 1);
    assert_eq!((dofs.index(0, 2), dofs.index(1, 1), dofs.index(8, 1)), (None, None, Some(dofs.free + 1)));
    let pattern = Pattern::new(&dofs, &[&stencils[0], &stencils[1]]);
    let effects = [Springs { size: 3 }, Springs { size: 2 }];
    let terms = [0, 1].map(|t| Term { effect: &effects[t], stencils: &stencils[t], set: t });
    let mut random = noise(9);
    let positions: Vec<f64> = (0..27).map(|_| random()).collect();
    let n = dofs.free + 3;
    let (mut dense, mut force): (DMatrix<f64>, DVector<f64>) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (effect, stencils) in effects.iter().zip(&stencils) {
        for group in 0..stencils.len() {
            let vertices = stencils.group(group);
            let index = |at: usize| dofs.index(vertices[at % vertices.len()] as usize, at / vertices.len());
            let mut local = vec![0.0; 3 * vertices.len()];
            stencils.gather(group, &positions, &mut local);
            let matrix = effect.matrix(group);
            let local_force = &matrix * DVector::from_column_slice(&local);
            for row in 0..local.len() {
                let Some(i) = index(row) else { continue };
                force[i] += local_force[row];
                for column in 0..local.len() {
                    if let Some(j) = index(column) {
                        dense[(i, j)] += matrix[(row, column)];
                    }
                }
            }
        }
    }
    let mut scratch = Scratch::default();
    let mut values = vec![7.0; pattern.len()];
    hessian(&terms, &positions, &Predicted::default(), &pattern, &mut scratch, &mut values);
    let mut out = vec![7.0; n];
    gradient(&terms, &positions, &dofs, &mut scratch, &mut out);
    assert!((DVector::from_vec(out) - &force).amax() < ROUNDOFF * force.amax());
    let mut read: DMatrix<f64> = DMatrix::zeros(n, n);
    for column in 0..dofs.free {
        let range = pattern.column_starts[column] as usize..pattern.column_starts[column + 1] as usize;
        assert!(pattern.rows[range.clone()].is_sorted());
        for at in range {
            read[(pattern.rows[at] as usize, column)] = values[at];
        }
    }
    for k in 0..3 {
        for free in 0..dofs.free {
            read[(dofs.free + k, free)] = values[pattern.stored() + k * dofs.free + free];
        }
        for l in 0..=k {
            read[(dofs.free + k, dofs.free + l)] = values[pattern.stored() + 3 * dofs.free + 3 * k + l];
        }
    }
    let error = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|at| (read[at] - dense[at]).abs());
    assert!(error.fold(0.0, f64::max) < ROUNDOFF * dense.amax());
    assert!(pattern.stored() < dofs.free * (dofs.free + 1) / 2, "a full matrix is not sparse");
    let mut moved = positions.clone();
    let step: Vec<f64> = (0..n).map(|at| at as f64 + 1.0).collect();
    dofs.advance(&mut moved, &step, 0.5);
    assert_eq!(moved[..3], positions[..3]);
    assert_eq!(moved[25], positions[25] + 0.5 * step[dofs.free + 1]);
}

#[test]
fn nested_dissection_is_a_permutation_with_less_fill() {
    for division in [
        division(),
        WallDivision { core_cells: 4, rings: 6, elements_per_layer: vec![1], layers_above_interface: None },
    ] {
        let topology = WallTopology::new(division.clone()).unwrap();
        let mut rank = vec![usize::MAX; topology.disc.points()];
        nested_dissection(&topology.disc).into_iter().enumerate().for_each(|(at, point)| rank[point] = at);
        assert!(!rank.contains(&usize::MAX), "a permutation");
        let stored = |key: &dyn Fn(usize, usize) -> (usize, usize)| {
            let mut vertices: Vec<usize> = (0..topology.needle()).collect();
            vertices.sort_by_key(|&vertex| key(topology.vertices[vertex].0, topology.vertices[vertex].1));
            let fixed = |vertex: usize, _| topology.dofs.index(vertex, 0).is_none();
            let dofs = Dofs::new(topology.needle() + 1, vertices, fixed, Some(topology.needle()));
            let pattern = Pattern::new(&dofs, &[&topology.elements, &topology.faces]);
            SymbolicFactor::new(&pattern).unwrap().stored()
        };
        let fill = stored(&|point, level| (rank[point], level));
        let natural = stored(&|point, level| (point, level));
        assert!((fill as f64) < 0.9 * natural as f64, "{division:?}: {fill} of {natural} entries");
    }
}

#[test]
fn samples_lie_where_they_were_asked_for() {
    let topology = WallTopology::new(division()).unwrap();
    let center = [0.2, -0.1];
    let geometry = wall(&topology, center);
    let rim = disc_geometry(3, center).radii[3];
    let mut parameters = vec![0.0; geometry.rest.len()];
    for (vertex, &(point, _)) in topology.vertices.iter().enumerate() {
        let [x, y] = geometry.parameters[point];
        parameters[3 * vertex..3 * vertex + 3].copy_from_slice(&[x, y, 1.0]);
    }
    let (surface, mut random) = (SurfaceLocator::new(&topology, &geometry), noise(53));
    let (mut inside, mut outside) = (0, 0);
    while inside < 300 {
        let at = [center[0] + 1.2 * rim * random(), center[1] + 1.2 * rim * random()];
        let distance = (at[0] - center[0]).hypot(at[1] - center[1]);
        match surface.locate(at) {
            Some(sample) => {
                // Quadratic edges stray from the rim's circle by less than a percent.
                assert!(distance < 1.01 * rim);
                let found = sample.interpolate(&parameters);
                let error = (found - Vector3::new(at[0], at[1], 1.0)).amax();
                assert!(error < 1e-9, "{at:?}: {error:e} mm");
                inside += 1;
            }
            None => {
                assert!(distance > 0.98 * rim, "{at:?} is inside and was not found");
                outside += 1;
            }
        }
    }
    assert!(outside > 20);
    // At a node of the surface, the node alone.
    for &vertex in &topology.face_points[0] {
        let sample = surface.locate(geometry.parameters[topology.vertices[vertex].0]).unwrap();
        let weight: f64 = sample.weights.iter().filter(|(v, _)| *v == vertex).map(|(_, w)| w).sum();
        assert!((weight - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_wall_is_as_thick_as_its_layers_and_thins_under_the_pit() {
    let topology = WallTopology::new(division()).unwrap();
    let geometry = wall(&topology, [0.0, 0.0]);
    let volume: f64 = (0..topology.elements.len()).flat_map(|e| geometry.solid.weights(e)).sum();
    assert!(volume > 0.0);
    for (vertex, &(point, level)) in topology.vertices.iter().enumerate() {
        let [x, y] = geometry.parameters[point];
        let thinning = 0.1 * (-(x * x + y * y) / (2.0 * 0.0625f64)).exp();
        let surface = Surface::FovealPit { radius_mm: 12.0, depth_mm: 0.1, sigma_mm: 0.25 }.column(x, y).surface;
        let depth = (Vector3::from_row_slice(&geometry.rest[3 * vertex..3 * vertex + 3]) - surface.coords).norm();
        let layers = geometry.layer_coordinates[vertex];
        let expected = layers.min(1.0) * (0.25 - thinning) + (layers - 1.0).max(0.0) * 0.2;
        assert!((depth - expected).abs() < 1e-12, "{depth} {expected}");
        assert_eq!(layers, 2.0 - 0.5 * level as f64);
    }
}

#[test]
fn an_interface_doubles_its_vertices_and_changes_nothing_else() {
    let whole = WallTopology::new(division()).unwrap();
    let split = WallTopology::new(WallDivision { layers_above_interface: Some(1), ..division() }).unwrap();
    assert!(whole.interface.is_empty() && split.interface.len() == whole.faces.len());
    let disc = DiscGeometry { center: [0.1, -0.2], radii: vec![0.2, 0.5, 0.9, 1.5], offsets: Vec::new() };
    let layer = |thickness_mm, thins| LayerThickness { thickness_mm, thins, first_element_mm: f64::INFINITY };
    let layers = [layer(0.25, true), layer(0.3, false)];
    let column = |x: f64, y: f64| Surface::Sphere { radius_mm: 12.0 }.column(x, y);
    let [whole_at, split_at] =
        [&whole, &split].map(|topology| WallGeometry::new(topology, &disc, &layers, column).unwrap());
    // The same elements at the same places, and the interface's two sides on each other.
    let places = |stencils: &Stencils, rest: &[f64]| -> Vec<f64> {
        stencils.vertices.iter().flat_map(|&v| rest[3 * v as usize..][..3].to_vec()).collect()
    };
    assert_eq!(places(&whole.elements, &whole_at.rest), places(&split.elements, &split_at.rest));
    let mut pairs = std::collections::HashSet::new();
    for group in 0..split.interface.len() {
        let (below, above) = split.interface.group(group).split_at(8);
        for (&low, &high) in below.iter().zip(above) {
            assert_ne!(low, high);
            pairs.insert((low, high));
            assert_eq!(split_at.rest[3 * low as usize..][..3], split_at.rest[3 * high as usize..][..3]);
        }
    }
    assert_eq!(split.vertices.len(), whole.vertices.len() + pairs.len());
}
