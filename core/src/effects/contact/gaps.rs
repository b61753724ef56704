//! How far the quadrature points of a face are from the needle, all of a face's points side by side.
//!
//! Not here: what a gap presses with (`contact`).

use nalgebra::{Point3, Vector3};

use super::face_rule::{FaceRule, LANES};
use crate::kernel::{Kernel, run_kernel};
use crate::mesh::element::{FACE_NODES, MOST_GAUSS_POINTS};
use crate::needle::Body;

/// Quadrature points of a face at most, in whole vectors.
const MOST: usize = (MOST_GAUSS_POINTS * MOST_GAUSS_POINTS).next_multiple_of(LANES);

/// The points of one face; what lies beyond the last one means nothing.
pub(super) struct Gaps {
    /// Positions in needle coordinates (mm), component by component.
    at: [[f64; MOST]; 3],
    /// Signed distances to the needle (mm).
    mm: [f64; MOST],
}

impl Gaps {
    /// Those of a face with `nodes` (needle coordinates, mm).
    pub fn new(rule: &FaceRule, nodes: &[Vector3<f64>; FACE_NODES], shape: &Body) -> Self {
        let mut gaps = Gaps { at: [[0.0; MOST]; 3], mm: [0.0; MOST] };
        run_kernel(Measure { rule, nodes, shape, gaps: &mut gaps });
        gaps
    }

    /// Position of a point in needle coordinates (mm).
    pub fn at(&self, point: usize) -> Point3<f64> {
        Point3::new(self.at[0][point], self.at[1][point], self.at[2][point])
    }

    /// Its signed distance to the needle (mm).
    pub fn mm(&self, point: usize) -> f64 {
        self.mm[point]
    }
}

struct Measure<'a> {
    rule: &'a FaceRule,
    nodes: &'a [Vector3<f64>; FACE_NODES],
    shape: &'a Body,
    gaps: &'a mut Gaps,
}

impl Kernel for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Gaps { at, mm } = self.gaps;
        let [x, y, z] = at.each_mut().map(|at| at.as_chunks_mut::<LANES>().0);
        let mm = mm.as_chunks_mut::<LANES>().0;
        for (chunk, weights) in self.rule.side_by_side.iter().enumerate() {
            let mut sums = [[0.0; LANES]; 3];
            for (node, weights) in self.nodes.iter().zip(weights) {
                for k in 0..3 {
                    for lane in 0..LANES {
                        sums[k][lane] += node[k] * weights[lane];
                    }
                }
            }
            mm[chunk] = self.shape.distances(&sums);
            [x[chunk], y[chunk], z[chunk]] = sums;
        }
    }
}
