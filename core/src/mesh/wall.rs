//! The eye wall under the disc: quadrilaterals extruded through the tissue layers.
//!
//! [`WallTopology`] is what depends on counts alone (vertices, elements, faces, unknowns, sparsity, symbolic factorisation) and is
//! made once per level and number of layers; [`WallGeometry`] is one contact's rest positions. Vertices are numbered in elimination order. The
//! outer face of the sclera and the rim do not move; the needle is one more vertex, after all others.

use std::collections::HashMap;

use thiserror::Error;

use super::disc::{DiscGeometry, DiscTopology};
use super::element::{NODE_OFFSETS, NODES, ORDER, TOP_NODES};
use super::ordering::nested_dissection;
use crate::assemble::{Dofs, Pattern};
use crate::effect::{Effect, Stencils, Term};
use crate::effects::solid::{Base, SolidGeometry, SolidGeometryError};
use crate::solve::sparse::{LinearSolveError, SymbolicFactor};
use crate::surface::Column;

/// How finely the wall is divided.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct WallDivision {
    /// Cells along each edge of the core.
    pub core_cells: usize,
    /// Rings around the core.
    pub rings: usize,
    /// Elements through each tissue layer, inner layer first.
    pub elements_per_layer: Vec<usize>,
    /// How many layers, counted from the inner one, stand on an interface of their own: the vertices below them are there twice. `None`: all layers are
    /// one body.
    pub layers_above_interface: Option<usize>,
}

impl WallDivision {
    /// Elements from the base up to the interface; all of them where there is none.
    fn elements_below_interface(&self) -> usize {
        let above = self.layers_above_interface.unwrap_or(0);
        self.elements_per_layer.iter().skip(above).sum()
    }
}

/// Rings around the core whose inner surface the needle may touch: numbered last, so that what touches can be solved for on its own. It mostly touches no more than the first
/// of them, and then what is left to solve is smaller.
const TOUCHED_RINGS: [usize; 2] = [1, 2];

/// A mesh that could not be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WallError {
    /// The surface and layers leave no room for an element.
    #[error("the tissue cannot be meshed here: {0}")]
    Geometry(#[from] SolidGeometryError),
    /// The sparsity pattern was not analysed.
    #[error(transparent)]
    Linear(#[from] LinearSolveError),
}

/// Stencils of a wall that an effect can act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The elements, [`WallTopology::elements`].
    Elements,
    /// The inner surface and the needle, [`WallTopology::faces`].
    Faces,
    /// The needle alone, [`WallTopology::tip`].
    Tip,
    /// The two sides of the interface, [`WallTopology::interface`].
    Interface,
}

/// Everything that depends on the division alone.
#[derive(Debug)]
pub struct WallTopology {
    /// The division it was made for.
    pub division: WallDivision,
    /// The disc's topology.
    pub disc: DiscTopology,
    /// The elements.
    pub elements: Stencils,
    /// Tissue layer of each element, inner layer 0.
    pub element_layer: Vec<usize>,
    /// What each element stands on: the lowest ones on the fixed face.
    pub bases: Vec<Base>,
    /// Inner-surface faces: face nodes, then the needle.
    pub faces: Stencils,
    /// The needle.
    pub tip: Stencils,
    /// The interface's faces: nodes of the lower side, then those of the upper one in the same order; none without an interface.
    pub interface: Stencils,
    /// For each disc cell, its face's vertices in face-node order.
    pub face_points: Vec<Vec<usize>>,
    /// For each vertex (without the needle): its lattice point of the disc and its level (0 at the base).
    pub vertices: Vec<(usize, usize)>,
    /// Unknowns.
    pub dofs: Dofs,
    /// Sparsity of effects on each [`Place`].
    pub pattern: Pattern,
    /// The analysed factorisation.
    pub symbolic: SymbolicFactor,
}

impl WallTopology {
    /// `effect` at `place`.
    pub fn term<'a>(&'a self, place: Place, effect: &'a dyn Effect) -> Term<'a> {
        match place {
            Place::Elements => Term { effect, stencils: &self.elements, set: 0 },
            Place::Faces => Term { effect, stencils: &self.faces, set: 1 },
            Place::Tip => Term { effect, stencils: &self.tip, set: 2 },
            Place::Interface => Term { effect, stencils: &self.interface, set: 3 },
        }
    }

    /// Builds the topology of `division`.
    ///
    /// # Errors
    /// If the sparsity pattern cannot be analysed.
    pub fn new(division: WallDivision) -> Result<Self, WallError> {
        let disc = DiscTopology { core_cells: division.core_cells, rings: division.rings };
        let cells = disc.cells();
        let layers: Vec<usize> = division
            .elements_per_layer
            .iter()
            .enumerate()
            .rev()
            .flat_map(|(layer, &count)| std::iter::repeat_n(layer, count))
            .collect();

        let offsets = &*NODE_OFFSETS;
        let below = division.elements_below_interface();
        // Above an interface every level counts one more: the interface has two.
        let lattice = |cell: &[usize], layer: usize, [i, j, k]: [usize; 3]| {
            (cell[j * (ORDER + 1) + i], layer * ORDER + k + usize::from(layer >= below))
        };
        let mut used: HashMap<usize, Vec<usize>> = HashMap::new();
        for cell in &cells {
            for layer in 0..layers.len() {
                for &offset in offsets {
                    let (point, level) = lattice(cell, layer, offset);
                    used.entry(point).or_default().push(level);
                }
            }
        }
        let mut vertices = Vec::new();
        let mut index = HashMap::new();
        let top = layers.len() * ORDER + usize::from(layers.len() > below);
        let mut touched = TOUCHED_RINGS.map(|_| Vec::new());
        for point in nested_dissection(&disc) {
            let mut levels = used.remove(&point).unwrap_or_default();
            levels.sort_unstable();
            levels.dedup();
            for level in levels {
                let rings = TOUCHED_RINGS.iter().position(|&rings| level == top && disc.is_within(point, rings));
                rings.map_or(&mut vertices, |rings| &mut touched[rings]).push((point, level));
            }
        }
        let mut tails = Vec::new();
        for within in &touched {
            tails.push(tails.last().unwrap_or(&0) + 3 * within.len());
        }
        vertices.extend(touched.into_iter().rev().flatten());
        index.extend(vertices.iter().enumerate().map(|(vertex, &place)| (place, vertex)));
        let needle = vertices.len();

        let mut elements = Stencils { group_size: NODES, vertices: Vec::new() };
        let mut element_layer = Vec::new();
        let mut bases = Vec::new();
        let mut faces = Stencils { group_size: 0, vertices: Vec::new() };
        let mut face_points = Vec::new();
        let mut interface = Stencils { group_size: 2 * TOP_NODES.len(), vertices: Vec::new() };
        for cell in &cells {
            for (at, &layer) in layers.iter().enumerate() {
                elements.vertices.extend(offsets.iter().map(|&o| index[&lattice(cell, at, o)] as u32));
                element_layer.push(layer);
                let on_level = lattice(cell, at, [0; 3]).1;
                bases.push(if on_level == 0 { Base::Fixed } else { Base::Free });
            }
            let face: Vec<usize> =
                TOP_NODES.iter().map(|&a| index[&lattice(cell, layers.len() - 1, offsets[a])]).collect();
            faces.group_size = face.len() + 1;
            faces.vertices.extend(face.iter().map(|&v| v as u32));
            faces.vertices.push(needle as u32);
            face_points.push(face);
            if (1..layers.len()).contains(&below) {
                let side = |layer: usize, k: usize| {
                    TOP_NODES.map(|a| index[&lattice(cell, layer, [offsets[a][0], offsets[a][1], k])] as u32)
                };
                interface.vertices.extend(side(below - 1, ORDER).into_iter().chain(side(below, 0)));
            }
        }
        let fixed = |vertex: usize, _| vertices[vertex].1 == 0 || disc.is_rim(vertices[vertex].0);
        let dofs = Dofs::new(needle + 1, 0..needle, fixed, Some(needle)).condensed_to(tails);
        let tip = Stencils { group_size: 1, vertices: vec![needle as u32] };
        let mut sets = vec![&elements, &faces, &tip];
        if !interface.is_empty() {
            sets.push(&interface);
        }
        let pattern = Pattern::new(&dofs, &sets);
        let symbolic = SymbolicFactor::new(&pattern)?;
        Ok(WallTopology {
            division,
            disc,
            elements,
            element_layer,
            bases,
            faces,
            tip,
            interface,
            face_points,
            vertices,
            dofs,
            pattern,
            symbolic,
        })
    }

    /// Lattice levels from the base up to the lower side of the interface, it included.
    pub fn levels_below_interface(&self) -> usize {
        self.division.elements_below_interface() * ORDER + 1
    }

    /// Index of the needle's vertex.
    pub fn needle(&self) -> usize {
        self.vertices.len()
    }
}

/// One tissue layer as the mesh sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerThickness {
    /// Thickness at rest (mm).
    pub thickness_mm: f64,
    /// Whether the layer belongs to the retina and thins with it.
    pub thins: bool,
    /// Thickness of the innermost element, the others growing geometrically; the layer's thickness over the number of elements
    /// where that is less (mm).
    pub first_element_mm: f64,
}

/// Rest positions of one contact's mesh.
#[derive(Clone, Debug)]
pub struct WallGeometry {
    /// Position of each disc lattice point in patch parameters (mm).
    pub parameters: Vec<[f64; 2]>,
    /// Rest positions of all vertices, x, y, z each, the needle's (zero here) last (mm).
    pub rest: Vec<f64>,
    /// Depth of each vertex but the needle's in layers: 1.5 is the middle of the second layer.
    pub layer_coordinates: Vec<f64>,
    /// Rest geometry of the elements.
    pub solid: SolidGeometry,
}

impl WallGeometry {
    /// Extrudes the disc along the surface's columns.
    ///
    /// # Errors
    /// If an element is inverted at rest (the surface is too rough or the layers too thick for its curvature).
    pub fn new(
        topology: &WallTopology,
        disc: &DiscGeometry,
        layers: &[LayerThickness],
        column: impl Fn(f64, f64) -> Column,
    ) -> Result<Self, WallError> {
        let parameters = topology.disc.positions(disc);
        let columns: Vec<Column> = parameters.iter().map(|p| column(p[0], p[1])).collect();
        let levels = levels(topology, layers);
        let retina: f64 = layers.iter().filter(|l| l.thins).map(|l| l.thickness_mm).sum();
        let mut rest = Vec::with_capacity(3 * topology.vertices.len() + 3);
        for &(point, level) in &topology.vertices {
            let column = &columns[point];
            let level = levels[level];
            let scale = if retina > 0.0 { (retina - column.retina_thinning_mm) / retina } else { 1.0 };
            let depth = level.thinning * scale + level.full;
            let position = column.surface + column.inward.into_inner() * depth;
            rest.extend_from_slice(position.coords.as_slice());
        }
        rest.extend_from_slice(&[0.0; 3]);
        let solid = SolidGeometry::new(&topology.elements, &rest)?.on(topology.bases.clone());
        let layer_coordinates = topology.vertices.iter().map(|&(_, level)| levels[level].layer_coordinate).collect();
        Ok(WallGeometry { parameters, rest, layer_coordinates, solid })
    }
}

/// Where a lattice level lies at full thickness.
#[derive(Clone, Copy, Debug, Default)]
struct Level {
    /// Depth within layers that thin (mm).
    thinning: f64,
    /// Depth within the others (mm).
    full: f64,
    /// Layers above it, the last one in part: 1.5 is the middle of the second layer.
    layer_coordinate: f64,
}

/// Every lattice level, from the base to the surface.
fn levels(topology: &WallTopology, layers: &[LayerThickness]) -> Vec<Level> {
    let mut from_surface = vec![Level::default()];
    let mut top = Level::default();
    for (index, (layer, &count)) in layers.iter().zip(&topology.division.elements_per_layer).enumerate() {
        if topology.division.layers_above_interface == Some(index) {
            from_surface.push(top);
        }
        let ratio = growth(layer, count);
        let total: f64 = (0..count).map(|element| ratio.powi(element as i32)).sum();
        let mut share = 0.0;
        for element in 0..count {
            let part = ratio.powi(element as i32) / total;
            for step in 1..=ORDER {
                let mut level = top;
                let reached = share + part * step as f64 / ORDER as f64;
                level.layer_coordinate += reached;
                let depth = if layer.thins { &mut level.thinning } else { &mut level.full };
                *depth += reached * layer.thickness_mm;
                from_surface.push(level);
            }
            share += part;
        }
        top = from_surface[from_surface.len() - 1];
        top.layer_coordinate = top.layer_coordinate.round();
    }
    from_surface.reverse();
    from_surface
}

/// Largest thickness ratio of neighbouring elements: beyond it the outer ones are too flat a start for the inner ones' accuracy.
const LARGEST_GROWTH: f64 = 3.0;

/// Ratio of each element's thickness to the one inside of it.
fn growth(layer: &LayerThickness, count: usize) -> f64 {
    if count < 2 || layer.first_element_mm >= layer.thickness_mm / count as f64 {
        return 1.0;
    }
    let thickness = |ratio: f64| (0..count).map(|e| layer.first_element_mm * ratio.powi(e as i32)).sum::<f64>();
    let (mut low, mut high) = (1.0, LARGEST_GROWTH);
    for _ in 0..GROWTH_BISECTIONS {
        let middle = 0.5 * (low + high);
        if thickness(middle) < layer.thickness_mm {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Bisections for the growth ratio: far below what a mesh can feel.
const GROWTH_BISECTIONS: usize = 30;
