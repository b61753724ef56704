//! Fill-reducing order of the disc's lattice points: nested dissection from the geometry.
//!
//! Cells are parted along the direction, and at the place near the middle, that leaves the fewest unknowns on shared points; the shared points are
//! numbered last, the parts before them, recursively. All unknowns of a column through the wall share its point's place.

use super::disc::{DiscGeometry, DiscTopology};
use super::element::has_node;

/// The smaller part of a division, as a share of the whole: a shorter separator is worth some imbalance.
const SMALLER_PART: f64 = 0.35;
/// What an imbalance costs: a separator may be this many times longer as the middle is missed by the whole.
const IMBALANCE_COST: f64 = 1.0;

/// Lattice points in elimination order.
pub fn nested_dissection(topology: &DiscTopology) -> Vec<usize> {
    // Rings of equal width: distances then count cells, whatever the grading of the actual mesh.
    let core = topology.core_cells as f64 / 2.0;
    let radii = (0..=topology.rings).map(|ring| core + ring as f64).collect();
    let positions = topology.positions(&DiscGeometry { center: [0.0, 0.0], radii, offsets: Vec::new() });
    let cells = topology.cells();
    let centers: Vec<[f64; 2]> = cells
        .iter()
        .map(|cell| [0, 1].map(|k| cell.iter().map(|&p| positions[p][k]).sum::<f64>() / cell.len() as f64))
        .collect();
    let mut order = Vec::with_capacity(topology.points());
    let placed = vec![false; topology.points()];
    let mut dissection = Dissection { cells: &cells, centers: &centers, loads: loads(topology, &cells), placed };
    dissection.split((0..cells.len()).collect(), &mut order);
    order.reverse();
    order
}

/// Vertices of an element's column above each lattice point, as many as unknowns up to a factor: the corners of cells have mid-edge nodes
/// between the levels, the middles of their edges have none, their centres and the fixed rim nothing at all.
fn loads(topology: &DiscTopology, cells: &[Vec<usize>]) -> Vec<usize> {
    let mut loads = vec![0; topology.points()];
    for cell in cells {
        for (at, &point) in cell.iter().enumerate() {
            let (i, j) = (at % 3, at / 3);
            let nodes = (1..3).filter(|&k| has_node([i, j, k])).count();
            loads[point] = if topology.is_rim(point) { 0 } else { nodes };
        }
    }
    loads
}

struct Dissection<'a> {
    cells: &'a [Vec<usize>],
    centers: &'a [[f64; 2]],
    loads: Vec<usize>,
    placed: Vec<bool>,
}

/// Cells in two parts, and the points that they share.
#[derive(Default)]
struct Division {
    cost: f64,
    separator: Vec<usize>,
    left: Vec<usize>,
    right: Vec<usize>,
}

impl Dissection<'_> {
    /// Appends the points of `members` to `order`, separators first (the caller reverses the whole).
    fn split(&mut self, members: Vec<usize>, order: &mut Vec<usize>) {
        if let [single] = members[..] {
            self.place(&self.cells[single], order);
            return;
        }
        let keys: [fn([f64; 2]) -> f64; 4] = [
            |c| c[0],
            |c| c[1],
            |c| c[0].hypot(c[1]),
            // Oblique, so that four-fold symmetry leaves no ties between the first two.
            |c| c[0] + 0.9 * c[1],
        ];
        let best =
            keys.into_iter().flat_map(|key| self.divisions(&members, key)).min_by(|a, b| a.cost.total_cmp(&b.cost));
        let Division { separator, left, right, .. } = best.unwrap_or_default();
        self.place(&separator, order);
        self.split(left, order);
        self.split(right, order);
    }

    /// The divisions of `members` along `key` near the middle.
    fn divisions(&self, members: &[usize], key: fn([f64; 2]) -> f64) -> Vec<Division> {
        let mut sorted = members.to_vec();
        sorted.sort_by(|&a, &b| key(self.centers[a]).total_cmp(&key(self.centers[b])).then(a.cmp(&b)));
        let count = sorted.len() as f64;
        let smallest = ((SMALLER_PART * count) as usize).max(1);
        let division = |at: usize| {
            let (left, right) = sorted.split_at(at);
            let separator = self.shared(left, right);
            let load: usize = separator.iter().map(|&point| self.loads[point]).sum();
            let off_middle = (at as f64 - 0.5 * count).abs() / count;
            let cost = load as f64 * (1.0 + IMBALANCE_COST * off_middle);
            Division { cost, separator, left: left.to_vec(), right: right.to_vec() }
        };
        (smallest..=sorted.len() - smallest).map(division).collect()
    }

    fn place(&mut self, points: &[usize], order: &mut Vec<usize>) {
        for &point in points {
            if !std::mem::replace(&mut self.placed[point], true) {
                order.push(point);
            }
        }
    }

    /// Points of both parts that have no place yet.
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
