//! Dense layers and the attention between the bodies, forward and backward.

use std::ops::Range;

use retina_core::network::faithful::{WIDTH, relu};
use retina_core::network::softmax::softmax;

use crate::train::matrix::{add_product, add_product_transposed, add_row_sum, add_transposed_product};

/// `y = x W + b`, with a ReLU behind it or not.
#[derive(Clone, Debug)]
pub struct Dense {
    /// Where the weights lie.
    pub weight: Range<usize>,
    /// Where the bias lies.
    pub bias: Range<usize>,
    /// Numbers in.
    pub inner: usize,
    /// Numbers out.
    pub outer: usize,
    /// Whether negative sums become zero.
    pub relu: bool,
}

impl Dense {
    /// The rows of `x`, mapped.
    pub fn forward(&self, parameters: &[f32], x: &[f32]) -> Vec<f32> {
        let mut y = parameters[self.bias.clone()].repeat(x.len() / self.inner);
        add_product(&mut y, x, &parameters[self.weight.clone()], self.inner, self.outer);
        if self.relu {
            relu(&mut y);
        }
        y
    }

    /// Adds to `gradient`, and answers the derivative by `x`, given that by `y` (what `forward` answered).
    pub fn backward(
        &self,
        parameters: &[f32],
        x: &[f32],
        y: &[f32],
        mut dy: Vec<f32>,
        gradient: &mut [f32],
    ) -> Vec<f32> {
        if self.relu {
            dy.iter_mut().zip(y).for_each(|(dy, y)| {
                if *y <= 0.0 {
                    *dy = 0.0;
                }
            });
        }
        add_transposed_product(&mut gradient[self.weight.clone()], x, &dy, self.inner, self.outer);
        add_row_sum(&mut gradient[self.bias.clone()], &dy);
        let mut dx = vec![0.0; x.len()];
        add_product_transposed(&mut dx, &dy, &parameters[self.weight.clone()], self.inner, self.outer);
        dx
    }
}

/// One head: `softmax(S W (R W)ᵀ / √256) R`.
#[derive(Clone, Debug)]
pub struct Head {
    /// Where the projection lies.
    pub weight: Range<usize>,
}

/// What the backward pass needs of a head.
#[derive(Clone, Debug, Default)]
pub struct Attended {
    query: Vec<f32>,
    key: Vec<f32>,
    scores: Vec<f32>,
    /// What it answered, `soft nodes × 256`.
    pub out: Vec<f32>,
}

impl Head {
    /// What the rows of `soft` gather from those of `rigid`.
    pub fn forward(&self, parameters: &[f32], soft: &[f32], rigid: &[f32]) -> Attended {
        let weight = &parameters[self.weight.clone()];
        let project = |x: &[f32]| {
            let mut projected = vec![0.0; x.len()];
            add_product(&mut projected, x, weight, WIDTH, WIDTH);
            projected
        };
        let (query, key) = (project(soft), project(rigid));
        let (rows, columns) = (soft.len() / WIDTH, rigid.len() / WIDTH);
        let mut scores = vec![0.0; rows * columns];
        add_product_transposed(&mut scores, &query, &key, columns, WIDTH);
        scores.iter_mut().for_each(|score| *score /= (WIDTH as f32).sqrt());
        softmax(&mut scores, columns);
        let mut out = vec![0.0; soft.len()];
        add_product(&mut out, &scores, rigid, columns, WIDTH);
        Attended { query, key, scores, out }
    }

    /// Adds to `gradient` and to the derivatives by `soft` and `rigid`, given that by what `forward` answered.
    #[allow(clippy::too_many_arguments)]
    pub fn backward(
        &self,
        parameters: &[f32],
        soft: &[f32],
        rigid: &[f32],
        kept: &Attended,
        dout: &[f32],
        gradient: &mut [f32],
        dsoft: &mut [f32],
        drigid: &mut [f32],
    ) {
        let columns = rigid.len() / WIDTH;
        let mut dscores = vec![0.0; kept.scores.len()];
        add_product_transposed(&mut dscores, dout, rigid, columns, WIDTH);
        add_transposed_product(drigid, &kept.scores, dout, columns, WIDTH);
        // Softmax: dz = a (da − Σ a da).
        for (d, a) in dscores.chunks_exact_mut(columns).zip(kept.scores.chunks_exact(columns)) {
            let mean: f32 = d.iter().zip(a).map(|(d, a)| d * a).sum();
            d.iter_mut().zip(a).for_each(|(d, a)| *d = a * (*d - mean) / (WIDTH as f32).sqrt());
        }
        let (mut dquery, mut dkey) = (vec![0.0; soft.len()], vec![0.0; rigid.len()]);
        add_product(&mut dquery, &dscores, &kept.key, columns, WIDTH);
        add_transposed_product(&mut dkey, &dscores, &kept.query, columns, WIDTH);
        let weight = &parameters[self.weight.clone()];
        let part = &mut gradient[self.weight.clone()];
        for (x, dprojected, dx) in [(soft, &dquery, dsoft), (rigid, &dkey, drigid)] {
            add_transposed_product(part, x, dprojected, WIDTH, WIDTH);
            add_product_transposed(dx, dprojected, weight, WIDTH, WIDTH);
        }
    }
}
