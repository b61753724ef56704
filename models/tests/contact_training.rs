//! The contact networks' training: derivatives against differences, the trainer against the core, and that something is learned.

mod stand_in;

use retina_core::network::contact::{ContactNetwork, MOTION, Memory, QUANTILES, Start};
use retina_core::network::features::BASIS;
use retina_models::contact::learn::ContactLearner;
use retina_models::contact::loss::{of_motion, of_quantiles};
use retina_models::contact::network::{Form, Network, Pass, Slopes};
use retina_models::contact::prepared::Prepared;
use retina_models::describe;
use retina_models::sample::{Sample, Split};
use retina_models::train::export;
use retina_models::train::run::{Settings, train};
use stand_in::StandIn;

/// A derivative in single precision, taken by differences of sums in double precision: rounding of the forward pass (1e-7) over the
/// step (1e-2) and the step's square.
const DERIVATIVE: f64 = 2e-3;
/// Two ways to compute the same in single precision, relative to the largest number.
const F32_PARITY: f32 = 1e-5;

fn samples(count: u32, seed: u64) -> Vec<Sample> {
    let mut stand_in = StandIn::new(seed);
    let split = |path| if path % 5 == 4 { Split::Validation } else { Split::Train };
    (0..count).map(|path| stand_in.sample(path, split(path))).collect()
}

fn form(coarse: bool) -> Form {
    Form { coarse, width: 16, blocks: 2, messages: 1, hidden: 8 }
}

/// Parameters none of which is zero.
fn scattered(network: &Network, random: &mut fastrand::Rng) -> Vec<f32> {
    let mut parameters = network.initial(random);
    parameters.iter_mut().for_each(|p| *p += 0.2 * (random.f32() - 0.5));
    parameters
}

/// Holds every tensor's part of `gradient` against a central difference of `value` along it.
fn check_tensors(
    network: &Network,
    parameters: &[f32],
    gradient: &[f32],
    chosen: impl Fn(&str) -> bool,
    value: impl Fn(&[f32]) -> f64,
) {
    let mut checked = 0;
    for tensor in network.layout.tensors.iter().filter(|tensor| chosen(&tensor.name)) {
        let part = &gradient[tensor.range.clone()];
        let norm = part.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
        assert!(norm > 0.0, "{}: no derivative", tensor.name);
        let step = 1e-2;
        let moved = |sign: f64| {
            let mut parameters = parameters.to_vec();
            for (p, &g) in parameters[tensor.range.clone()].iter_mut().zip(part) {
                *p += (sign * step * f64::from(g) / norm) as f32;
            }
            value(&parameters)
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
        assert!((difference - norm).abs() < DERIVATIVE * norm, "{}: {difference} by differences, {norm}", tensor.name);
        checked += 1;
    }
    assert!(checked > 0);
}

#[test]
fn the_network_is_derived_rightly() {
    let mut random = fastrand::Rng::with_seed(5);
    for coarse in [false, true] {
        let prepared: Vec<Prepared> = samples(3, 11).iter().filter_map(|s| Prepared::new(s, coarse)).collect();
        let chosen: Vec<&Prepared> = prepared.iter().collect();
        let network = Network::new(form(coarse), describe::graph());
        let parameters = scattered(&network, &mut random);
        let mut pass = Pass::default();
        network.forward(&parameters, &chosen, &mut pass);
        let mut weights = |count: usize| -> Vec<f32> { (0..count).map(|_| random.f32() - 0.5).collect() };
        let (out, motion, quantile) =
            (weights(pass.out.len()), weights(pass.motion.len()), weights(pass.quantile.len()));
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum::<f64>();
        let value = |parameters: &[f32], quantiles: bool| {
            let mut pass = Pass::default();
            network.forward(parameters, &chosen, &mut pass);
            if quantiles { dot(&pass.quantile, &quantile) } else { dot(&pass.out, &out) + dot(&pass.motion, &motion) }
        };
        let slopes = Slopes { out: out.clone(), motion: motion.clone(), quantile: quantile.clone() };
        let mut gradient = vec![0.0; parameters.len()];
        network.backward(&parameters, &chosen, &pass, &slopes, &mut gradient);
        let of_head = |name: &str| name.starts_with("quantile.");
        check_tensors(&network, &parameters, &gradient, |name| !of_head(name), |p| value(p, false));
        check_tensors(&network, &parameters, &gradient, of_head, |p| value(p, true));
    }
}

#[test]
fn the_loss_is_derived_rightly() {
    let prepared: Vec<Prepared> = samples(2, 12).iter().filter_map(|s| Prepared::new(s, false)).collect();
    let chosen: Vec<&Prepared> = prepared.iter().collect();
    let mut random = fastrand::Rng::with_seed(6);
    let mut draw = |count: usize| -> Vec<f32> { (0..count).map(|_| 0.3 * (random.f32() - 0.5)).collect() };
    let mut pass = Pass::default();
    (pass.out, pass.motion, pass.quantile) = (draw(128 * BASIS), draw(2 * MOTION), draw(2 * QUANTILES));
    let mut slopes = Slopes::default();
    of_motion(&chosen, &pass, 1.0, &mut slopes);
    of_quantiles(&chosen, &pass, 1.0, &mut slopes);
    let kept = (slopes.out.clone(), slopes.motion.clone(), slopes.quantile.clone());
    let step = 1e-3_f32;
    let mut check = |pick: fn(&mut Pass) -> &mut Vec<f32>, expected: &[f32], quantiles: bool| {
        let largest = expected.iter().fold(0.0_f32, |most, g| most.max(g.abs()));
        assert!(largest > 0.0);
        for at in 0..expected.len().min(64) {
            let mut value = |sign: f32| {
                pick(&mut pass)[at] += sign * step;
                let mut scratch = Slopes::default();
                let value = if quantiles {
                    of_quantiles(&chosen, &pass, 1.0, &mut scratch)
                } else {
                    of_motion(&chosen, &pass, 1.0, &mut scratch).total
                };
                pick(&mut pass)[at] -= sign * step;
                value
            };
            let difference = (value(1.0) - value(-1.0)) / (2.0 * f64::from(step));
            let off = (difference - f64::from(expected[at])).abs();
            assert!(off < 1e-2 * f64::from(largest), "{at}: {difference} by differences, {}", expected[at]);
        }
    };
    check(|pass| &mut pass.out, &kept.0, false);
    check(|pass| &mut pass.motion, &kept.1, false);
    check(|pass| &mut pass.quantile, &kept.2, true);
}

#[test]
fn the_core_answers_what_the_trainer_computes() {
    for coarse in [false, true] {
        let samples = samples(30, 13);
        let learner = ContactLearner::new(form(coarse), &samples);
        let parameters = scattered(&learner.network, &mut fastrand::Rng::with_seed(7));
        let start = if coarse { Start::Coarse } else { Start::Linear };
        let file = export::weights(start.network(), &learner.tensors(&parameters), &[]).unwrap();
        let network = ContactNetwork::new(start, &file).unwrap();
        let mut memory = Memory::default();
        let mut pass = Pass::default();
        for (prepared, sample) in
            learner.validation().iter().zip(samples.iter().filter(|s| s.split == Split::Validation))
        {
            learner.network.forward(&parameters, &[prepared], &mut pass);
            let input = describe::input(sample);
            let answer = network.predict(&input, &describe::graph(), &mut memory).unwrap();
            assert!(answer.known || sample.split == Split::Validation);
            let (coefficients, motion, _) = memory.answered();
            for (core, trainer) in [(coefficients, &pass.out), (motion, &pass.motion)] {
                let largest = trainer.iter().fold(1.0_f32, |most, c| most.max(c.abs()));
                for (core, trainer) in core.iter().zip(trainer) {
                    assert!(
                        (core - trainer).abs() < F32_PARITY * largest,
                        "{core} in the core, {trainer} in the trainer"
                    );
                }
            }
        }
    }
}

#[test]
fn training_learns_repeats_and_goes_on() {
    let samples = samples(60, 14);
    let learner = ContactLearner::new(form(false), &samples);
    let folder = |name: &str| std::env::temp_dir().join(format!("retina-models-{}-{name}", std::process::id()));
    let settings = Settings { seed: 1, epochs: 24, batch: 16, chunk: 4, rate: 3e-3, decay: 1e-2, patience: 100 };
    let (whole, again, parts) = (folder("whole"), folder("again"), folder("parts"));
    let first = train(&learner, &settings, &whole).unwrap();
    let [begin, end] = [first.curve[0], first.curve[23]].map(|epoch| epoch.train.total);
    assert!(end < 0.7 * begin, "the loss went from {begin} to {end}");
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let second = one_thread.install(|| train(&learner, &settings, &again)).unwrap();
    assert_eq!(first.parameters, second.parameters, "the number of threads shows");
    let third = train(&learner, &Settings { patience: 0, ..settings.clone() }, &parts);
    assert!(third.is_ok(), "a run that its validation stops ends well");
    std::fs::remove_dir_all(&parts).unwrap();
    let stopped = retina_models::train::run::State { curve: first.curve[..20].to_vec(), ..first.clone() };
    retina_models::train::checkpoint::write(&parts, &learner, &settings, &stopped).unwrap();
    let resumed = train(&learner, &settings, &parts).unwrap();
    assert_eq!(resumed.curve.len(), 24);
    assert!(train(&learner, &Settings { seed: 2, ..settings }, &parts).is_err(), "another run's checkpoint is refused");
    for folder in [whole, again, parts] {
        std::fs::remove_dir_all(folder).unwrap();
    }
}
