//! Quadrilaterals over a disc: a rounded square core surrounded by rings.
//!
//! The topology (who is whose neighbour) depends only on the number of core cells and rings, so everything derived from it — sparsity,
//! ordering, symbolic factorisation — is made once; the geometry (where the nodes are) is made for each contact.
//! Nodes lie on a lattice with two steps per cell edge; the cells' centres are lattice points without a node.

use std::f64::consts::PI;

use super::element::ORDER;

/// How finely the disc is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DiscTopology {
    /// Cells along each edge of the square core.
    pub core_cells: usize,
    /// Rings of cells around the core; each has 4 × `core_cells` cells.
    pub rings: usize,
}

/// Sizes of the disc around one contact.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscGeometry {
    /// Centre in patch parameters (x, y) (mm).
    pub center: [f64; 2],
    /// Outer radius of the core and of each ring (mm): `rings` + 1 ascending numbers.
    pub radii: Vec<f64>,
    /// How far the middle of each ring's outer circle lies from the centre (mm); none: all circles have one centre. Circles must not cross.
    pub offsets: Vec<[f64; 2]>,
}

/// How much of the core's outline is the circle's rather than the square's: a full circle would flatten the corner cells.
const CORE_ROUNDING: f64 = 0.5;

impl DiscTopology {
    /// Lattice points along one edge of the core.
    fn core_side(&self) -> usize {
        self.core_cells * ORDER + 1
    }

    /// Lattice points around the core.
    fn around(&self) -> usize {
        4 * self.core_cells * ORDER
    }

    /// Number of lattice points.
    pub fn points(&self) -> usize {
        self.core_side().pow(2) + self.around() * self.rings * ORDER
    }

    /// Whether a lattice point lies on the outer rim.
    pub fn is_rim(&self, point: usize) -> bool {
        self.rings > 0 && point >= self.points() - self.around()
    }

    /// Whether a lattice point lies in the core or on its first `rings` rings, and not on the rim.
    pub fn is_within(&self, point: usize, rings: usize) -> bool {
        point < self.core_side().pow(2) + self.around() * rings * ORDER && !self.is_rim(point)
    }

    /// Lattice index of the core's outline at position `step` (counter-clockwise from the corner (−1, −1)).
    fn outline(&self, step: usize) -> usize {
        let last = self.core_side() - 1;
        let (side, along) = (step / last, step % last);
        let (i, j) = match side % 4 {
            0 => (along, 0),
            1 => (last, along),
            2 => (last - along, last),
            _ => (0, last - along),
        };
        j * self.core_side() + i
    }

    /// Lattice index of ring lattice line `line` (0 is the core's outline) at `step` around.
    fn ring_point(&self, line: usize, step: usize) -> usize {
        let step = step % self.around();
        if line == 0 { self.outline(step) } else { self.core_side().pow(2) + (line - 1) * self.around() + step }
    }

    /// The cells: for each the 3 × 3 lattice points, first direction fastest, counter-clockwise seen from +z.
    pub fn cells(&self) -> Vec<Vec<usize>> {
        let p = ORDER;
        let mut cells = Vec::new();
        for cj in 0..self.core_cells {
            for ci in 0..self.core_cells {
                let at = |i: usize, j: usize| (cj * p + j) * self.core_side() + ci * p + i;
                cells.push((0..=p).flat_map(|j| (0..=p).map(move |i| at(i, j))).collect());
            }
        }
        for ring in 0..self.rings {
            for cell in 0..4 * self.core_cells {
                // First direction outwards, second around: counter-clockwise.
                let points = (0..=p).flat_map(|j| (0..=p).map(move |i| (ring * p + i, cell * p + j)));
                cells.push(points.map(|(line, step)| self.ring_point(line, step)).collect());
            }
        }
        cells
    }

    /// Position of every lattice point for the given sizes, in patch parameters (mm).
    ///
    /// # Panics
    /// If `geometry.radii` does not have one entry per ring and one for the core.
    pub fn positions(&self, geometry: &DiscGeometry) -> Vec<[f64; 2]> {
        assert_eq!(geometry.radii.len(), self.rings + 1, "one radius for the core and one per ring");
        let last = (self.core_side() - 1) as f64;
        let place = |[x, y]: [f64; 2]| [geometry.center[0] + x, geometry.center[1] + y];
        let mut positions = Vec::with_capacity(self.points());
        for j in 0..self.core_side() {
            for i in 0..self.core_side() {
                let square = [2.0 * i as f64 / last - 1.0, 2.0 * j as f64 / last - 1.0];
                positions.push(place(rounded_square(square).map(|c| c * geometry.radii[0])));
            }
        }
        for line in 1..=self.rings * ORDER {
            let (ring, part) = ((line - 1) / ORDER, ((line - 1) % ORDER + 1) as f64 / ORDER as f64);
            for step in 0..self.around() {
                let angle = -0.75 * PI + 2.0 * PI * step as f64 / self.around() as f64;
                let circle = |ring: usize| {
                    let [x, y] =
                        ring.checked_sub(1).and_then(|at| geometry.offsets.get(at)).copied().unwrap_or_default();
                    let radius = geometry.radii[ring];
                    [radius * angle.cos() + x, radius * angle.sin() + y]
                };
                let outer = circle(ring + 1);
                let inner = if ring == 0 {
                    let outline = self.outline(step);
                    let at = positions[outline];
                    [at[0] - geometry.center[0], at[1] - geometry.center[1]]
                } else {
                    circle(ring)
                };
                positions.push(place([0, 1].map(|k| inner[k] + part * (outer[k] - inner[k]))));
            }
        }
        positions
    }
}

/// Maps the square [−1, 1]² to a square with bulging sides whose mid-sides and corners lie near the unit circle.
fn rounded_square([x, y]: [f64; 2]) -> [f64; 2] {
    // The elliptical map takes the square to the disc; the scaled identity takes it to the inscribed square.
    let disc = [x * (1.0 - 0.5 * y * y).sqrt(), y * (1.0 - 0.5 * x * x).sqrt()];
    let square = [x, y].map(|c| c * 0.5_f64.sqrt());
    [0, 1].map(|k| CORE_ROUNDING * disc[k] + (1.0 - CORE_ROUNDING) * square[k])
}
