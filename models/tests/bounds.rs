//! The bounds of the contact networks: they hold in every bin of strain, and can be set right anew from weights alone.

mod stand_in;

use retina_core::network::contact::{QUANTILES, STRAIN_BINS, Start, strain_bin};
use retina_core::network::weights::Weights;
use retina_models::contact::learn::ContactLearner;
use retina_models::contact::loss::{LEVELS, worst_um};
use retina_models::contact::network::{Form, Pass};
use retina_models::contact::prepared::Prepared;
use retina_models::contact::trained::Trained;
use retina_models::sample::{Sample, Split};
use retina_models::train::export;
use stand_in::StandIn;

/// Fewer samples in a bin say nothing of a share of 5 %.
const ENOUGH: usize = 40;

fn samples(count: u32, seed: u64) -> Vec<Sample> {
    let mut stand_in = StandIn::new(seed);
    (0..count).map(|path| stand_in.sample(path, if path % 2 == 0 { Split::Validation } else { Split::Train })).collect()
}

/// An untrained network of `samples` as a weight file, and the network.
fn untrained(samples: &[Sample]) -> (Vec<u8>, ContactLearner, Vec<f32>) {
    let form = Form { coarse: false, width: 16, blocks: 2, messages: 0, hidden: 8 };
    let learner = ContactLearner::new(form, samples);
    let mut random = fastrand::Rng::with_seed(3);
    let mut parameters = learner.network.initial(&mut random);
    parameters.iter_mut().for_each(|p| *p += 0.2 * (random.f32() - 0.5));
    let file = export::weights(Start::Linear.network(), &learner.tensors(&parameters), &[]).unwrap();
    (file, learner, parameters)
}

fn shifts(file: &[u8]) -> Vec<f32> {
    let weights = Weights::read(Start::Linear.network(), file).unwrap();
    weights.take("quantile.shift", &[STRAIN_BINS, QUANTILES]).unwrap()
}

/// In each bin: how many samples there are, and the shares of them below median and bound.
fn held(learner: &ContactLearner, parameters: &[f32], shifts: &[f32], samples: &[Prepared]) -> Vec<(usize, [f64; 2])> {
    let mut bins = vec![(0, [0.0; QUANTILES]); STRAIN_BINS];
    let mut pass = Pass::default();
    for sample in samples {
        learner.network.forward(parameters, &[sample], &mut pass);
        let bin = strain_bin(sample.strain);
        bins[bin].0 += 1;
        for k in 0..QUANTILES {
            let bound = (pass.quantile[k] + shifts[bin * QUANTILES + k]).exp();
            bins[bin].1[k] += f64::from(worst_um(sample, &pass.out) / sample.depth_um <= bound * (1.0 + f32::EPSILON));
        }
    }
    bins.into_iter().map(|(count, held)| (count, held.map(|held| held / count as f64))).collect()
}

#[test]
fn bounds_hold_in_every_bin_of_strain() {
    let samples = samples(900, 21);
    let (file, learner, parameters) = untrained(&samples);
    let own = shifts(&file);
    let bins = held(&learner, &parameters, &own, learner.validation());
    assert!(bins.iter().filter(|(count, _)| *count >= ENOUGH).count() >= 2, "{bins:?}");
    for (count, shares) in bins.iter().filter(|(count, _)| *count >= ENOUGH) {
        for (share, level) in shares.iter().zip(LEVELS.map(f64::from)) {
            let more = 2.0 / *count as f64;
            assert!(*share >= level && *share <= level + more, "{shares:?} of {count} for {LEVELS:?}");
        }
    }
    // One shift for all of them, that of the last bin, is right for that bin alone.
    let last: Vec<f32> = own[own.len() - QUANTILES..].repeat(STRAIN_BINS);
    let pooled = held(&learner, &parameters, &last, learner.validation());
    let off = |(count, [_, share]): &(usize, [f64; 2])| *count >= ENOUGH && (share - 0.95).abs() > 0.04;
    assert!(pooled.iter().any(off), "{pooled:?}");
}

#[test]
fn bounds_are_set_right_anew_from_weights_alone() {
    let first = samples(400, 22);
    let (file, learner, parameters) = untrained(&first);
    let trained = Trained::read(Start::Linear, &Weights::read(Start::Linear.network(), &file).unwrap()).unwrap();
    let anew = |samples: &[Sample]| {
        let validation = samples.iter().filter(|sample| sample.split == Split::Validation);
        let prepared: Vec<Prepared> = validation.filter_map(|sample| trained.prepare(sample)).collect();
        (trained.with_bounds(Start::Linear, &file, &prepared, "other").unwrap(), prepared)
    };
    // The same samples give the same bounds, and nothing else changes.
    let (same, prepared) = anew(&first);
    assert_eq!(prepared, learner.validation());
    assert_eq!(shifts(&same), shifts(&file));
    // Others give their own, which hold on them.
    let (other, prepared) = anew(&samples(900, 23));
    assert_ne!(shifts(&other), shifts(&file));
    for (count, [_, share]) in held(&learner, &parameters, &shifts(&other), &prepared) {
        assert!(count < ENOUGH || share >= 0.95, "{share} of {count}");
    }
    let numbers =
        |file: &[u8]| Trained::read(Start::Linear, &Weights::read("contact", file).unwrap()).unwrap().parameters;
    assert_eq!(numbers(&other), parameters);
}
