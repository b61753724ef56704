//! A reduced basis with a small regression: the proper orthogonal modes of what the linear answer lacks, their amounts by ridge regression on a request's numbers
//! and their squares.
//!
//! With `Y` the training samples' lacks over depth, the modes are the leading eigenvectors of `YᵀY`; the amounts solve `(XᵀX + λ I) B = XᵀA`.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use nalgebra::Vector3;
use retina_core::network::input::{Field, Input};

use super::nearest::lack;
use super::numbers;
use crate::contact::prepared::Normaliser;
use crate::evaluate::predictors::Predictor;
use crate::sample::{NODES, Sample};

/// Modes kept.
const MODES: usize = 30;
/// λ over the number of samples.
const RIDGE: f64 = 1e-2;
/// Coordinates of all nodes.
const COORDINATES: usize = 3 * NODES;

/// See the module.
pub struct Pod {
    normaliser: Normaliser,
    /// From a request's numbers to the lacks' coordinates.
    map: Mat<f64>,
}

/// One, the numbers, their squares.
fn terms(row: &[f32]) -> Vec<f64> {
    let numbers = row.iter().map(|&x| f64::from(x));
    std::iter::once(1.0).chain(numbers.clone()).chain(numbers.map(|x| x * x)).collect()
}

impl Pod {
    /// Fits the samples; `None` if the regression has no solution.
    pub fn new(samples: &[&Sample]) -> Option<Self> {
        let (rows, normaliser) = numbers::standardised(samples);
        let lacks: Vec<Field> = samples.iter().map(|sample| lack(sample)).collect();
        let y = Mat::from_fn(samples.len(), COORDINATES, |at, k| f64::from(lacks[at][k / 3][k % 3]));
        let square = y.transpose() * &y;
        let eigen = square.self_adjoint_eigen(Side::Lower).ok()?;
        // Ascending eigenvalues: the last modes lead.
        let modes = eigen.U().subcols(COORDINATES - MODES, MODES).to_owned();
        let terms: Vec<Vec<f64>> = rows.iter().map(|row| terms(row)).collect();
        let width = terms.first()?.len();
        let x = Mat::from_fn(samples.len(), width, |at, k| terms[at][k]);
        let mut normal = x.transpose() * &x;
        for k in 0..width {
            normal[(k, k)] += RIDGE * samples.len() as f64;
        }
        let right = x.transpose() * (&y * &modes);
        let amounts = normal.llt(Side::Lower).ok()?.solve(&right);
        Some(Pod { normaliser, map: amounts * modes.transpose() })
    }
}

impl Predictor for Pod {
    fn name(&self) -> String {
        format!("POD, {MODES} modes, ridge, on `linear`")
    }

    fn displacement(&mut self, sample: &Sample, input: &Input) -> Option<Field> {
        let mut row = numbers::of(sample);
        self.normaliser.apply(&mut row);
        let terms = terms(&row);
        let lack = |k: usize| terms.iter().enumerate().map(|(at, term)| term * self.map[(at, k)]).sum::<f64>();
        Some(std::array::from_fn(|node| {
            let off = Vector3::new(lack(3 * node), lack(3 * node + 1), lack(3 * node + 2)).cast::<f32>();
            input.linear.displacement_mm[node] + off * sample.linear_depth_mm
        }))
    }
}
