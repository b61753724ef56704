//! Error bounds of a trained network, set right on the validation split.
//!
//! A bound for requests of all strains would hold for all of them together and fail for the light ones, whose errors are shares of another kind of
//! motion: so they are set right by bins of mean strain, as Mondrian conformal prediction does (Vovk, Lindsay, Nouretdinov & Gammerman 2003).

use retina_core::network::contact::{QUANTILES, STRAIN_BINS, TIP_BINS, strain_bin};

use super::loss::{LEVELS, worst_um};
use super::network::{Network, Pass};
use super::prepared::Prepared;
use crate::train::export::Named;

/// What the network made of one sample.
pub struct Judged {
    edged: bool,
    strain_bin: usize,
    /// The worst node's error over the depth.
    ratio: f32,
    /// What the quantiles' head says of its logarithm.
    quantiles: [f32; QUANTILES],
}

/// The network's errors on `samples`, and what it expected of them.
pub fn judge(network: &Network, parameters: &[f32], samples: &[Prepared]) -> Vec<Judged> {
    let mut pass = Pass::default();
    let judged = |sample: &Prepared| {
        network.forward(parameters, &[sample], &mut pass);
        Judged {
            edged: sample.edged,
            strain_bin: strain_bin(sample.strain),
            ratio: worst_um(sample, &pass.out) / sample.depth_um,
            quantiles: std::array::from_fn(|k| pass.quantile[k]),
        }
    };
    samples.iter().map(judged).collect()
}

/// Of n numbers the ⌈p (n + 1)⌉-th smallest, where there are as many.
fn conformal(mut numbers: Vec<f32>, level: f32) -> Option<f32> {
    numbers.sort_by(f32::total_cmp);
    let rank = (f64::from(level) * (numbers.len() + 1) as f64).ceil() as usize;
    numbers.get(rank.wrapping_sub(1)).copied()
}

/// What has to be added to the quantiles' logarithms so that they hold in each bin of strain (conformalised quantile regression: Romano, Patterson &
/// Candès 2019). A bin with too few samples has the largest surprise of all.
pub fn shifts(judged: &[Judged]) -> Vec<f32> {
    let surprise = |one: &Judged, k: usize| one.ratio.ln() - one.quantiles[k];
    let shift = |bin: usize, k: usize| {
        let inside = judged.iter().filter(|one| one.strain_bin == bin).map(|one| surprise(one, k)).collect();
        let largest = judged.iter().map(|one| surprise(one, k)).fold(f32::NEG_INFINITY, f32::max);
        conformal(inside, LEVELS[k]).unwrap_or(largest)
    };
    (0..STRAIN_BINS).flat_map(|bin| (0..QUANTILES).map(move |k| (bin, k))).map(|(bin, k)| shift(bin, k)).collect()
}

/// Quantiles of the worst node's error over the depth, in the core's bins of tip and strain, conformal as the shifts are. A bin with too few samples for
/// a bound has that of all samples twice over.
fn prior(judged: &[Judged]) -> Vec<f32> {
    let mut bins = vec![Vec::new(); TIP_BINS * STRAIN_BINS];
    for one in judged {
        bins[usize::from(one.edged) * STRAIN_BINS + one.strain_bin].push(one.ratio);
    }
    let all: Vec<f32> = bins.concat();
    bins.into_iter()
        .flat_map(|ratios| {
            LEVELS.map(|level| conformal(ratios.clone(), level).or(conformal(all.clone(), level).map(|q| 2.0 * q)))
        })
        .map(|quantile| quantile.unwrap_or(1.0))
        .collect()
}

/// The bounds as the weights have them.
pub fn tensors(judged: &[Judged]) -> [Named; 2] {
    [
        ("quantile.shift".to_owned(), vec![STRAIN_BINS, QUANTILES], shifts(judged)),
        ("prior".to_owned(), vec![TIP_BINS, STRAIN_BINS, QUANTILES], prior(judged)),
    ]
}
