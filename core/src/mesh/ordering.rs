//! Fill-reducing order of the disc's lattice points: nested dissection from the geometry.
//!
//! Cells are halved along the direction that leaves the fewest shared points; the shared points are numbered last, the halves
//! before them, recursively. All unknowns of a column through the wall share its point's place.

use super::disc::{DiscGeometry, DiscTopology};

/// Lattice points in elimination order.
pub fn nested_dissection(topology: &DiscTopology) -> Vec<usize> {
    // Rings of equal width: distances then count cells, whatever the grading of the actual mesh.
    let core = topology.core_cells as f64 / 2.0;
    let radii = (0..=topology.rings).map(|ring| core + ring as f64).collect();
    let positions = topology.positions(&DiscGeometry { center: [0.0, 0.0], radii });
    let cells = topology.cells();
    let centers: Vec<[f64; 2]> = cells
        .iter()
        .map(|cell| [0, 1].map(|k| cell.iter().map(|&p| positions[p][k]).sum::<f64>() / cell.len() as f64))
        .collect();
    let mut order = Vec::with_capacity(topology.points());
    let mut dissection = Dissection { cells: &cells, centers: &centers, placed: vec![false; topology.points()] };
    dissection.split((0..cells.len()).collect(), &mut order);
    order.reverse();
    order
}

struct Dissection<'a> {
    cells: &'a [Vec<usize>],
    centers: &'a [[f64; 2]],
    placed: Vec<bool>,
}

impl Dissection<'_> {
    /// Appends the points of `members` to `order`, separators first (the caller reverses the whole).
    fn split(&mut self, members: Vec<usize>, order: &mut Vec<usize>) {
        if members.len() == 1 {
            self.place(self.cells[members[0]].clone(), order);
            return;
        }
        let keys: [fn([f64; 2]) -> f64; 4] = [
            |c| c[0],
            |c| c[1],
            |c| c[0].hypot(c[1]),
            // Oblique, so that four-fold symmetry leaves no ties between the first two.
            |c| c[0] + 0.9 * c[1],
        ];
        let halves = keys.map(|key| {
            let mut sorted = members.clone();
            sorted.sort_by(|&a, &b| key(self.centers[a]).total_cmp(&key(self.centers[b])).then(a.cmp(&b)));
            let right = sorted.split_off(sorted.len() / 2);
            (self.shared(&sorted, &right), sorted, right)
        });
        let (separator, left, right) = halves.into_iter().min_by_key(|(shared, ..)| shared.len()).unwrap_or_default();
        self.place(separator, order);
        self.split(left, order);
        self.split(right, order);
    }

    fn place(&mut self, points: Vec<usize>, order: &mut Vec<usize>) {
        for point in points {
            if !std::mem::replace(&mut self.placed[point], true) {
                order.push(point);
            }
        }
    }

    /// Points of both halves that have no place yet.
    fn shared(&self, left: &[usize], right: &[usize]) -> Vec<usize> {
        let mut in_left = vec![false; self.placed.len()];
        for &cell in left {
            for &point in &self.cells[cell] {
                in_left[point] = true;
            }
        }
        let mut shared: Vec<usize> = right
            .iter()
            .flat_map(|&cell| self.cells[cell].iter().copied())
            .filter(|&point| in_left[point] && !self.placed[point])
            .collect();
        shared.sort_unstable();
        shared.dedup();
        shared
    }
}
