//! Meshes of mapped blocks, their loads, and the solve: what the core offers, without eye, patch and needle. Units mm, mN, kPa.

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};
use retina_core::assemble::{Dofs, Pattern, Scratch, gradient};
use retina_core::effect::{Effect, Stencils, Term};
use retina_core::effects::elasticity::Elasticity;
use retina_core::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use retina_core::effects::solid::SolidGeometry;
use retina_core::mesh::disc::{DiscGeometry, DiscTopology};
use retina_core::mesh::element::{NODE_OFFSETS, NODES, ORDER, gauss_rule, shapes};
use retina_core::progress::Silent;
use retina_core::solve::newton::{Drive, Globalization, NewtonReport, NewtonSettings, System, Workspace};
use retina_core::solve::sparse::{Precision, SymbolicFactor};

/// Rest positions of one element's nodes, in local order.
pub type ElementNodes = [[f64; 3]; NODES];

/// Nodes nearer than this are one node (mm).
const GLUE_MM: f64 = 1e-6;
/// Gauss points along each edge in loads and error norms: exact to degree 7, far beyond the element's own.
const GAUSS_POINTS: usize = 4;

/// Elements whose nodes are glued where they coincide.
pub struct Mesh {
    pub elements: Stencils,
    pub rest: Vec<f64>,
}

/// The elements of a block of `cells` over the unit cube, its lattice mapped by `map` (right-handed).
pub fn block(cells: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<ElementNodes> {
    let mut elements = Vec::new();
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let cell = [i, j, k];
                let node = |offset: [usize; 3]| {
                    map([0, 1, 2].map(|d| (cell[d] * ORDER + offset[d]) as f64 / (cells[d] * ORDER) as f64))
                };
                elements.push(NODE_OFFSETS.map(node));
            }
        }
    }
    elements
}

/// The elements of a slab −thickness ≤ z ≤ 0 over a disc with rings of these radii.
pub fn slab(core_cells: usize, radii: &[f64], levels_mm: &[f64]) -> Vec<ElementNodes> {
    let topology = DiscTopology { core_cells, rings: radii.len() - 1 };
    let places = topology.positions(&DiscGeometry { center: [0.0; 2], radii: radii.to_vec(), offsets: Vec::new() });
    let mut elements = Vec::new();
    for cell in topology.cells() {
        for level in levels_mm.windows(2) {
            elements.push(NODE_OFFSETS.map(|[i, j, k]| {
                let [x, y] = places[cell[j * (ORDER + 1) + i]];
                [x, y, level[0] + (level[1] - level[0]) * k as f64 / ORDER as f64]
            }));
        }
    }
    elements
}

impl Mesh {
    pub fn glued(nodes: &[ElementNodes]) -> Self {
        let mut rest = Vec::new();
        let mut known = HashMap::new();
        let mut elements = Stencils { group_size: NODES, vertices: Vec::new() };
        for at in nodes.iter().flatten() {
            // The offset keeps round numbers away from the rounding's edge.
            let key = at.map(|c| (c / GLUE_MM + 0.317).round() as i64);
            let vertex = *known.entry(key).or_insert_with(|| {
                rest.extend_from_slice(at);
                (rest.len() / 3 - 1) as u32
            });
            elements.vertices.push(vertex);
        }
        Mesh { elements, rest }
    }

    pub fn vertices(&self) -> usize {
        self.rest.len() / 3
    }

    pub fn at(&self, vertex: usize) -> Vector3<f64> {
        Vector3::from_row_slice(&self.rest[3 * vertex..3 * vertex + 3])
    }

    /// The vertex at a rest position.
    pub fn vertex(&self, at: [f64; 3]) -> usize {
        let distance = |&v: &usize| (self.at(v) - Vector3::from(at)).norm();
        let nearest = (0..self.vertices()).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a vertex");
        assert!(distance(&nearest) < GLUE_MM, "no vertex at {at:?}");
        nearest
    }

    /// Rest positions moved by `field`, which sees the rest position.
    pub fn moved(&self, field: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Vec<f64> {
        (0..self.vertices()).flat_map(|v| <[f64; 3]>::from(self.at(v) + field(self.at(v)))).collect()
    }

    /// Moves the corners by `shift` and every mid-edge node to the middle of its edge.
    pub fn distort(&mut self, mut shift: impl FnMut(Vector3<f64>) -> Vector3<f64>) {
        let mut done = vec![false; self.vertices()];
        for corners in [true, false] {
            for element in 0..self.elements.len() {
                let group = self.elements.group(element).to_vec();
                for (a, offset) in NODE_OFFSETS.iter().enumerate() {
                    let vertex = group[a] as usize;
                    let mid = offset.iter().position(|&o| o == 1);
                    if mid.is_none() != corners || std::mem::replace(&mut done[vertex], true) {
                        continue;
                    }
                    let place = match mid {
                        None => self.at(vertex) + shift(self.at(vertex)),
                        Some(axis) => {
                            let end = |o: usize| {
                                let mut wanted = *offset;
                                wanted[axis] = o;
                                let local = NODE_OFFSETS.iter().position(|&other| other == wanted).expect("a corner");
                                self.at(group[local] as usize)
                            };
                            (end(0) + end(ORDER)) * 0.5
                        }
                    };
                    self.rest[3 * vertex..3 * vertex + 3].copy_from_slice(place.as_slice());
                }
            }
        }
    }

    /// Calls `visit(position, area vector, nodes with shape values)` at the Gauss points of the element faces all of whose nodes are `on`;
    /// area vectors point out of the element.
    fn on_faces(
        &self,
        on: impl Fn(Vector3<f64>) -> bool,
        mut visit: impl FnMut(Vector3<f64>, Vector3<f64>, &[(usize, f64)]),
    ) {
        let rule = gauss_rule(GAUSS_POINTS);
        for element in 0..self.elements.len() {
            let group = self.elements.group(element);
            for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, ORDER)]) {
                let face: Vec<usize> = (0..NODES).filter(|&a| NODE_OFFSETS[a][axis] == side).collect();
                if !face.iter().all(|&a| on(self.at(group[a] as usize))) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let sign = side as f64 - 1.0;
                for (&(s, ws), &(t, wt)) in rule.iter().flat_map(|p| rule.iter().map(move |q| (p, q))) {
                    let mut local = [0.0; 3];
                    (local[axis], local[u], local[v]) = (sign, s, t);
                    let shapes = shapes(local);
                    let sum = |weight: &dyn Fn(usize) -> f64| -> Vector3<f64> {
                        face.iter().map(|&a| self.at(group[a] as usize) * weight(a)).sum()
                    };
                    let place = sum(&|a| shapes[a].value);
                    let normal = sum(&|a| shapes[a].gradient[u]).cross(&sum(&|a| shapes[a].gradient[v]));
                    let values: Vec<(usize, f64)> =
                        face.iter().map(|&a| (group[a] as usize, shapes[a].value)).collect();
                    visit(place, normal * (sign * ws * wt), &values);
                }
            }
        }
    }

    /// Nodal forces of a traction per rest area, which sees the rest position and the outward unit normal.
    pub fn surface_load(
        &self,
        on: impl Fn(Vector3<f64>) -> bool,
        traction: impl Fn(Vector3<f64>, Vector3<f64>) -> Vector3<f64>,
    ) -> Vec<f64> {
        let mut load = vec![0.0; self.rest.len()];
        self.on_faces(on, |at, area, values| {
            let force = traction(at, area.normalize()) * area.norm();
            for &(vertex, value) in values {
                for k in 0..3 {
                    load[3 * vertex + k] += value * force[k];
                }
            }
        });
        load
    }

    /// Calls `visit(position, volume, nodes with shape values)` at the Gauss points of every element.
    fn in_volume(&self, mut visit: impl FnMut(Vector3<f64>, f64, &[(usize, f64)])) {
        let rule = gauss_rule(GAUSS_POINTS);
        for element in 0..self.elements.len() {
            let group = self.elements.group(element);
            for &(z, wz) in &rule {
                for &(y, wy) in &rule {
                    for &(x, wx) in &rule {
                        let shapes = shapes([x, y, z]);
                        let mut jacobian = Matrix3::zeros();
                        let mut place = Vector3::zeros();
                        for (shape, &vertex) in shapes.iter().zip(group) {
                            let node = self.at(vertex as usize);
                            place += node * shape.value;
                            jacobian += node * Vector3::from(shape.gradient).transpose();
                        }
                        let values: Vec<(usize, f64)> =
                            shapes.iter().zip(group).map(|(s, &v)| (v as usize, s.value)).collect();
                        visit(place, wx * wy * wz * jacobian.determinant(), &values);
                    }
                }
            }
        }
    }

    /// Nodal forces of a force per rest volume.
    pub fn body_load(&self, force: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Vec<f64> {
        let mut load = vec![0.0; self.rest.len()];
        self.in_volume(|at, volume, values| {
            let force = force(at) * volume;
            for &(vertex, value) in values {
                for k in 0..3 {
                    load[3 * vertex + k] += value * force[k];
                }
            }
        });
        load
    }

    /// Displacement of the plane z = 0 at a rest position in it.
    pub fn interpolate_top(&self, positions: &[f64], at: Vector3<f64>) -> Vector3<f64> {
        const STEPS: usize = 20;
        for element in 0..self.elements.len() {
            let group = self.elements.group(element);
            let near = |v: u32| (self.at(v as usize) - at).norm();
            let reach =
                group.iter().map(|&v| (self.at(v as usize) - self.at(group[0] as usize)).norm()).fold(0.0, f64::max);
            let on_top =
                NODE_OFFSETS.iter().zip(group).all(|(o, &v)| o[2] != ORDER || self.at(v as usize).z.abs() < GLUE_MM);
            if !on_top || near(group[0]) > 1.5 * reach {
                continue;
            }
            let mut local = Vector3::new(0.0, 0.0, 1.0);
            for _ in 0..STEPS {
                let shapes = shapes(local.into());
                let mut place = Vector3::zeros();
                let mut jacobian = Matrix3::zeros();
                for (shape, &v) in shapes.iter().zip(group) {
                    place += self.at(v as usize) * shape.value;
                    jacobian += self.at(v as usize) * Vector3::from(shape.gradient).transpose();
                }
                let Some(inverse) = jacobian.try_inverse() else { break };
                let step = inverse * (at - place);
                local += step;
                if local.amax() > 3.0 {
                    break;
                }
                if step.amax() < 1e-12 && local.amax() < 1.0 + 1e-6 {
                    let moved = |v: usize| Vector3::from_row_slice(&positions[3 * v..3 * v + 3]) - self.at(v);
                    return shapes.iter().zip(group).map(|(s, &v)| moved(v as usize) * s.value).sum();
                }
            }
        }
        panic!("{at:?} lies in no element of the top");
    }

    /// L2 norm over the volume of computed minus exact displacement.
    pub fn l2_error(&self, positions: &[f64], exact: impl Fn(Vector3<f64>) -> Vector3<f64>) -> f64 {
        let mut sum = 0.0;
        self.in_volume(|at, volume, values| {
            let moved: Vector3<f64> = values
                .iter()
                .map(|&(v, value)| (Vector3::from_row_slice(&positions[3 * v..3 * v + 3]) - self.at(v)) * value)
                .sum();
            sum += volume * (moved - exact(at)).norm_squared();
        });
        sum.sqrt()
    }

    /// Vertices in elimination order: elements halved recursively, the vertices that the halves share placed last.
    fn elimination_order(&self) -> Vec<usize> {
        let mut order = Vec::with_capacity(self.vertices());
        let mut placed = vec![false; self.vertices()];
        self.dissect((0..self.elements.len()).collect(), &mut placed, &mut order);
        order.reverse();
        order
    }

    fn dissect(&self, members: Vec<usize>, placed: &mut [bool], order: &mut Vec<usize>) {
        let mut place = |vertices: &mut dyn Iterator<Item = u32>| {
            for vertex in vertices {
                if !std::mem::replace(&mut placed[vertex as usize], true) {
                    order.push(vertex as usize);
                }
            }
        };
        let of = |set: &[usize]| set.iter().flat_map(|&e| self.elements.group(e).to_vec()).collect::<Vec<u32>>();
        if members.len() <= 1 {
            place(&mut of(&members).into_iter());
            return;
        }
        let center = |e: usize| -> Vector3<f64> {
            self.elements.group(e).iter().map(|&v| self.at(v as usize)).sum::<Vector3<f64>>() / NODES as f64
        };
        let keys: [fn(Vector3<f64>) -> f64; 4] = [|c| c.x, |c| c.y, |c| c.z, |c| c.x.hypot(c.y)];
        let halves = keys.map(|key| {
            let mut left = members.clone();
            left.sort_by(|&a, &b| key(center(a)).total_cmp(&key(center(b))));
            let right = left.split_off(left.len() / 2);
            let ours: std::collections::HashSet<u32> = of(&left).into_iter().collect();
            let mut shared: Vec<u32> = of(&right).into_iter().filter(|v| ours.contains(v)).collect();
            shared.sort_unstable();
            shared.dedup();
            (shared, left, right)
        });
        let (shared, left, right) = halves.into_iter().min_by_key(|(shared, ..)| shared.len()).expect("four ways");
        place(&mut shared.into_iter());
        self.dissect(left, placed, order);
        self.dissect(right, placed, order);
    }
}

/// Which energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    Linear,
    NeoHookean(NeoHookean),
}

/// Lamé constants from Young's modulus and Poisson's ratio.
pub fn lame(youngs: f64, poisson: f64) -> Lame {
    Lame { mu: youngs / (2.0 * (1.0 + poisson)), lambda: youngs * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) }
}

/// A mesh of one material with its supports.
pub struct Body<'a> {
    pub mesh: &'a Mesh,
    law: Law,
    geometry: SolidGeometry,
    materials: Vec<Lame>,
    dofs: Dofs,
    pattern: Pattern,
    symbolic: SymbolicFactor,
}

impl<'a> Body<'a> {
    /// `fixed` sees the rest position and the component.
    pub fn new(mesh: &'a Mesh, law: Law, material: Lame, fixed: impl Fn(Vector3<f64>, usize) -> bool) -> Self {
        let geometry = SolidGeometry::new(&mesh.elements, &mesh.rest).expect("valid elements");
        let held = |vertex: usize, component: usize| fixed(mesh.at(vertex), component);
        let dofs = Dofs::new(mesh.vertices(), mesh.elimination_order(), held, None);
        let pattern = Pattern::new(&dofs, &[&mesh.elements]);
        let symbolic = SymbolicFactor::new(&pattern).expect("analysed");
        let materials = vec![material; mesh.elements.len()];
        Body { mesh, law, geometry, materials, dofs, pattern, symbolic }
    }

    pub fn unknowns(&self) -> usize {
        self.dofs.free
    }

    fn with_terms<T>(&self, use_terms: impl FnOnce(&[Term]) -> T) -> T {
        let (geometry, materials) = (&self.geometry, &self.materials[..]);
        let effect: Box<dyn Effect> = match self.law {
            Law::Linear => Box::new(Elasticity { geometry, materials }),
            Law::NeoHookean(law) => Box::new(FiniteStrain { geometry, materials, law }),
        };
        use_terms(&[Term { effect: effect.as_ref(), stencils: &self.mesh.elements, set: 0 }])
    }

    /// Equilibrium under nodal forces from `positions`, in which the fixed components have their final values, to a residual of `tolerance`
    /// times the scale of the forces.
    #[track_caller]
    pub fn solve(&self, positions: &mut [f64], load: &[f64], force_scale_mn: f64, tolerance: f64) -> NewtonReport {
        let mut dead_load = vec![0.0; self.dofs.free];
        for (at, &force) in load.iter().enumerate() {
            if let Some(index) = self.dofs.index(at / 3, at % 3) {
                dead_load[index] = force;
            }
        }
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization: Globalization::PredictedStress,
            force_scale_mn,
            tolerance_mn: tolerance * force_scale_mn,
            max_iterations: 50,
            max_weakened: 50,
            max_travel_mm: 1.0,
        };
        self.with_terms(|terms| {
            let (dofs, pattern, symbolic) = (&self.dofs, &self.pattern, &self.symbolic);
            let system = System { terms, dofs, pattern, symbolic, driven: None, dead_load: &dead_load };
            let mut workspace = Workspace::new(pattern, symbolic);
            system.solve(positions, Drive::Held, &settings, &mut workspace, &mut Silent).expect("an equilibrium")
        })
    }

    /// The nodal forces that hold the body at `positions`.
    pub fn forces(&self, positions: &[f64]) -> Vec<f64> {
        let vertices = self.mesh.vertices();
        let all = Dofs::new(vertices, 0..vertices, |_, _| false, None);
        let mut forces = vec![0.0; 3 * vertices + 3];
        self.with_terms(|terms| gradient(terms, positions, &all, &mut Scratch::default(), &mut forces));
        forces.truncate(3 * vertices);
        forces
    }

    /// Largest nodal force on a free component at `positions`.
    pub fn largest_free_force(&self, positions: &[f64]) -> f64 {
        let forces = self.forces(positions);
        let free = (0..forces.len()).filter(|&at| self.dofs.index(at / 3, at % 3).is_some());
        free.map(|at| forces[at].abs()).fold(0.0, f64::max)
    }

    /// The mean first Piola–Kirchhoff stress, from the nodal forces that hold the body at `positions`.
    pub fn mean_stress(&self, positions: &[f64]) -> Matrix3<f64> {
        let forces = self.forces(positions);
        let mut volume = 0.0;
        self.mesh.in_volume(|_, part, _| volume += part);
        let moment = |v: usize| Vector3::from_row_slice(&forces[3 * v..3 * v + 3]) * self.mesh.at(v).transpose();
        (0..self.mesh.vertices()).map(moment).sum::<Matrix3<f64>>() / volume
    }
}
