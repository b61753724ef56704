//! A surface as heights over the plane, from triangles.
//!
//! Contract: inside a triangle (seen along z) the height is that of its plane; outside all of them it is the height at the nearest
//! point of the rim, nearest in the plane, so the surface goes on level across the rim. Units: mm, patch frame.
//!
//! Not here: overhanging surfaces. A triangle that does not face +z is refused.

use nalgebra::{Point2, Point3, Vector2};
use thiserror::Error;

use super::triangle_mesh::doubled_area_normal;

/// Triangles per cell of the grid, on average, that the search aims at.
const TRIANGLES_PER_CELL: f64 = 2.0;

/// How often a triangle may stand in the lists of the cells, on average; one cell for all needs four at most.
const LISTED_LIMIT: usize = 16;

/// A point counts as inside a triangle up to this much outside, in barycentric coordinates: no gap along shared edges.
const EDGE_SLACK: f64 = 1e-9;

/// A triangle that does not face +z: over its points the surface has more than one height, or none.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("triangle {triangle} does not face +z: the surface is folded over itself in this frame")]
pub struct Folded {
    /// Index of the triangle in the input.
    pub triangle: usize,
}

/// Heights over the plane from triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[usize; 3]>,
    rim: Vec<[usize; 2]>,
    grid: Grid,
}

/// Square cells over the extent of the triangles, each with the triangles that reach into its bounding box.
#[derive(Debug, Clone, PartialEq)]
struct Grid {
    low: Point2<f64>,
    cell_mm: f64,
    columns: usize,
    cells: Vec<Vec<usize>>,
}

impl HeightField {
    /// Heights over the given triangles (at least one, indices in range, counter-clockwise seen from +z).
    ///
    /// Fails with the first triangle that does not face +z.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[usize; 3]>) -> Result<Self, Folded> {
        // NaN must not pass, hence not `<=`.
        let faces_up = |corners: &[usize; 3]| doubled_area_normal(&vertices, corners).z > 0.0;
        if let Some(triangle) = triangles.iter().position(|corners| !faces_up(corners)) {
            return Err(Folded { triangle });
        }
        let grid = Grid::new(&vertices, &triangles);
        let rim = rim(&triangles);
        Ok(Self { vertices, triangles, rim, grid })
    }

    /// Height over (x, y), mm.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let candidates = self.grid.cell(x, y);
        let inside = candidates.iter().find_map(|&triangle| self.height_in(triangle, x, y));
        inside.unwrap_or_else(|| self.height_of_nearest_rim(x, y))
    }

    fn height_in(&self, triangle: usize, x: f64, y: f64) -> Option<f64> {
        let [a, b, c] = self.triangles[triangle].map(|corner| self.vertices[corner]);
        let area = cross(b.xy() - a.xy(), c.xy() - a.xy());
        let p = Point2::new(x, y);
        let weight_b = cross(p - a.xy(), c.xy() - a.xy()) / area;
        let weight_c = cross(b.xy() - a.xy(), p - a.xy()) / area;
        let inside = weight_b.min(weight_c).min(1.0 - weight_b - weight_c) >= -EDGE_SLACK;
        inside.then(|| a.z + weight_b * (b.z - a.z) + weight_c * (c.z - a.z))
    }

    /// How far (x, y) is from the rim, in the plane (mm); 0 where no triangle is over it.
    pub fn rim_distance_mm(&self, x: f64, y: f64) -> f64 {
        let covered = self.grid.cell(x, y).iter().any(|&triangle| self.height_in(triangle, x, y).is_some());
        if covered { self.nearest_rim(x, y).0.sqrt() } else { 0.0 }
    }

    fn height_of_nearest_rim(&self, x: f64, y: f64) -> f64 {
        self.nearest_rim(x, y).1
    }

    /// Squared distance of the nearest point of the rim, in the plane (mm²), and its height (mm).
    fn nearest_rim(&self, x: f64, y: f64) -> (f64, f64) {
        let p = Point2::new(x, y);
        let mut nearest = (f64::INFINITY, 0.0);
        for &[from, to] in &self.rim {
            let (a, b) = (self.vertices[from], self.vertices[to]);
            let along = b.xy() - a.xy();
            let t = ((p - a.xy()).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            let distance_squared = (p - (a.xy() + along * t)).norm_squared();
            if distance_squared < nearest.0 {
                nearest = (distance_squared, a.z + t * (b.z - a.z));
            }
        }
        nearest
    }
}

impl Grid {
    fn new(vertices: &[Point3<f64>], triangles: &[[usize; 3]]) -> Self {
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
        for corner in triangles.iter().flatten() {
            low = low.inf(&vertices[*corner].xy());
            high = high.sup(&vertices[*corner].xy());
        }
        let extent = high - low;
        let per_side = (triangles.len() as f64 / TRIANGLES_PER_CELL).sqrt().ceil().max(1.0);
        let boxes: Vec<[Vector2<f64>; 2]> = triangles
            .iter()
            .map(|corners| corners.map(|corner| vertices[corner].xy() - low))
            .map(|[a, b, c]| [a.inf(&b).inf(&c), a.sup(&b).sup(&c)])
            .collect();
        // Long slivers each reach into many cells, so the cells grow until the lists are in proportion to the triangles.
        let mut cell_mm = extent.max() / per_side;
        while boxes.iter().map(|bounds| cells_covered(bounds, cell_mm)).sum::<usize>() > LISTED_LIMIT * triangles.len()
        {
            cell_mm *= 2.0;
        }
        // One more, because a point on the upper border falls into the cell after the last.
        let count = |length: f64| (length / cell_mm) as usize + 1;
        let (columns, rows) = (count(extent.x), count(extent.y));
        let mut cells = vec![Vec::new(); columns * rows];
        for (triangle, [from, to]) in boxes.iter().enumerate() {
            let (from, to) = (from / cell_mm, to / cell_mm);
            for row in from.y as usize..=to.y as usize {
                for column in from.x as usize..=to.x as usize {
                    cells[row * columns + column].push(triangle);
                }
            }
        }
        Self { low, cell_mm, columns, cells }
    }

    fn cell(&self, x: f64, y: f64) -> &[usize] {
        let (column, row) = ((x - self.low.x) / self.cell_mm, (y - self.low.y) / self.cell_mm);
        if column < 0.0 || row < 0.0 || column as usize >= self.columns {
            return &[];
        }
        self.cells.get(row as usize * self.columns + column as usize).map_or(&[], Vec::as_slice)
    }
}

/// How many cells of a size a bounding box reaches into.
fn cells_covered([from, to]: &[Vector2<f64>; 2], cell_mm: f64) -> usize {
    let span = |from: f64, to: f64| (to / cell_mm) as usize - (from / cell_mm) as usize + 1;
    span(from.x, to.x) * span(from.y, to.y)
}

/// Edges that belong to one triangle only.
fn rim(triangles: &[[usize; 3]]) -> Vec<[usize; 2]> {
    let mut edges: Vec<[usize; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[from, to]| [from.min(to), from.max(to)])
        .collect();
    edges.sort_unstable();
    let alone = edges.chunk_by(|one, other| one == other).filter(|group| group.len() == 1);
    alone.map(|group| group[0]).collect()
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}
