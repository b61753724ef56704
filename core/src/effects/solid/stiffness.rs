//! The element matrix of a solid: sums of outer products over quadrature points and pressure modes.
//!
//! The matrix has a block for each pair of components; each block is one sum (`products`). Not here: the coefficients, which are the material's.

use nalgebra::Matrix4;

use super::points::MODE_VALUES;
use super::products::{Block, Products, add_products, add_symmetric_products};
use super::{LANES, SolidGeometry};
use crate::effect::LOWER_BLOCKS;
use crate::mesh::element::{MODES, NODES, POINTS};

/// One number per node for each component at each quadrature point: indexed (component, point, node).
pub type PointRows = [[[f64; NODES]; POINTS]; 3];

/// The second derivative of an energy of the projected dilatation θ.
pub struct Volumetric {
    /// J at each point, or what else of the gradients g makes ∂J/∂x.
    pub dilatation: [f64; POINTS],
    /// Quadrature weight times U″(θ) at each point (mN·mm).
    pub stiffness: [f64; POINTS],
}

/// Coefficients of the point-wise stiffness at each point, quadrature weight included (mN·mm).
#[derive(Clone, Copy, Debug)]
pub struct StiffnessCoefficients {
    /// Multiply δᵢⱼ Gₐ·G_b.
    pub rest: [f64; POINTS],
    /// Multiply gₐⱼ g_bᵢ.
    pub cross: [f64; POINTS],
    /// Multiply gₐᵢ g_bⱼ.
    pub outer: [f64; POINTS],
}

impl StiffnessCoefficients {
    /// No stiffness.
    pub const ZERO: Self = StiffnessCoefficients { rest: [0.0; POINTS], cross: [0.0; POINTS], outer: [0.0; POINTS] };
}

impl SolidGeometry {
    /// Adds the element matrix (lower triangle): its point-wise part for the given coefficients, quadrature weight included, and, of an energy of the projected
    /// dilatation θ, the part Σ_q w U″(θ_q) ∇θ_q ⊗ ∇θ_q.
    ///
    /// Each block of it (component i by component j) is one sum of outer products of rows of numbers per node. What belongs to a base that does not move is left out.
    #[inline(always)]
    pub fn add_stiffness(
        &self,
        element: usize,
        spatial: &PointRows,
        coefficients: &StiffnessCoefficients,
        volumetric: Option<&Volumetric>,
        out: &mut [f64],
    ) {
        let base = self.base(element);
        let StiffnessCoefficients { rest, cross, outer } = coefficients;
        let mut isotropic = [[0.0; NODES]; NODES];
        if rest.iter().any(|c| *c != 0.0) {
            let mut gradients = [[[0.0; NODES]; POINTS]; 3];
            self.rest_gradients(element, &mut gradients);
            let sum = |k: usize| Products { scales: rest, left: &gradients[k], right: &gradients[k] };
            let sums = [sum(0), sum(1), sum(2)];
            add_symmetric_products(base, sums, &mut Block { rows: &mut isotropic, first: 0, step: 1 });
        }
        let mut both = [0.0; POINTS];
        for q in 0..POINTS {
            both[q] = cross[q] + outer[q];
        }
        let outers = if outer.iter().any(|c| *c != 0.0) { POINTS } else { 0 };
        let [weighted, integrals] = match volumetric {
            Some(volumetric) => self.dilatation_modes(element, spatial, volumetric),
            None => [[[[0.0; NODES]; MODES]; 3]; 2],
        };
        let modes = if volumetric.is_some() { MODES } else { 0 };
        let rows = out.as_chunks_mut::<NODES>().0;
        for &(i, j) in &LOWER_BLOCKS {
            let of_modes =
                Products { scales: &[1.0; MODES][..modes], left: &weighted[i][..modes], right: &integrals[j][..modes] };
            let mut block = Block { rows, first: i * NODES * 3 + j, step: 3 };
            if i == j {
                for (a, isotropic) in isotropic.iter().enumerate().skip(base.nodes()) {
                    let row = block.row(a).as_chunks_mut::<LANES>().0;
                    for (row, isotropic) in row.iter_mut().zip(isotropic.as_chunks::<LANES>().0) {
                        for lane in 0..LANES {
                            row[lane] += isotropic[lane];
                        }
                    }
                }
                let of_points = Products { scales: &both, left: &spatial[i], right: &spatial[i] };
                add_symmetric_products(base, [of_points, of_modes], &mut block);
            } else {
                let of_cross = Products { scales: cross, left: &spatial[j], right: &spatial[i] };
                let of_outer =
                    Products { scales: &outer[..outers], left: &spatial[i][..outers], right: &spatial[j][..outers] };
                add_products(base, [of_cross, of_outer, of_modes], &mut block);
            }
        }
    }

    /// The gradients of the dilatation's pressure modes (component, mode), M⁻¹ C M⁻¹ times them and as they are: the volumetric stiffness is the sum of their outer
    /// products, with C the stiffness w U″ between modes.
    #[inline(always)]
    fn dilatation_modes(
        &self,
        element: usize,
        spatial: &PointRows,
        volumetric: &Volumetric,
    ) -> [[[[f64; NODES]; MODES]; 3]; 2] {
        let mut core = Matrix4::zeros();
        let modes = &*MODE_VALUES;
        for m in 0..MODES {
            for l in 0..MODES {
                for (q, stiffness) in volumetric.stiffness.iter().enumerate() {
                    core[(m, l)] += stiffness * modes[m][q] * modes[l][q];
                }
            }
        }
        let core = self.mode_inverse[element] * core * self.mode_inverse[element];
        let mut scales = [[0.0; MODES]; POINTS];
        for (q, weight) in self.weights(element).iter().enumerate() {
            for m in 0..MODES {
                scales[q][m] = weight * volumetric.dilatation[q] * modes[m][q];
            }
        }
        let (mut integrals, mut scaled) = ([[[0.0; NODES]; MODES]; 3], [[[0.0; NODES]; MODES]; 3]);
        for k in 0..3 {
            for chunk in self.base(element).nodes() / LANES..NODES / LANES {
                let mut sum = [[0.0; LANES]; MODES];
                for q in 0..POINTS {
                    let gradient = &spatial[k][q].as_chunks::<LANES>().0[chunk];
                    for m in 0..MODES {
                        for lane in 0..LANES {
                            sum[m][lane] = scales[q][m].mul_add(gradient[lane], sum[m][lane]);
                        }
                    }
                }
                let mut product = [[0.0; LANES]; MODES];
                for m in 0..MODES {
                    for l in 0..MODES {
                        for lane in 0..LANES {
                            product[m][lane] = core[(m, l)].mul_add(sum[l][lane], product[m][lane]);
                        }
                    }
                }
                for m in 0..MODES {
                    integrals[k][m].as_chunks_mut::<LANES>().0[chunk] = sum[m];
                    scaled[k][m].as_chunks_mut::<LANES>().0[chunk] = product[m];
                }
            }
        }
        [scaled, integrals]
    }
}
