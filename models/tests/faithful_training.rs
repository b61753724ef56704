//! The paper's network: derivatives against differences, the trainer against the core, and the faults of the published code.

mod stand_in;

use nalgebra::Vector3;
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::tool::TOOL_NODES;
use retina_core::network::faithful::{FaithfulNetwork, Memory, UNIT_MM, WIDTH, softmax};
use retina_core::patch::{NODE_COUNT, Patch};
use retina_core::surface::Surface;
use retina_models::describe;
use retina_models::faithful::layers::Head;
use retina_models::faithful::learn::FaithfulLearner;
use retina_models::faithful::network::Network;
use retina_models::faithful::prepared::{Prepared, SYMMETRIES, View, symmetry};
use retina_models::sample::Split;
use retina_models::train::export;
use stand_in::StandIn;

/// A derivative of a smooth function in single precision by differences: rounding over the step, and the step's square.
const DERIVATIVE: f64 = 3e-3;
/// The same where kinks of ReLU lie within the step: seen to scatter by 2 % with the step's length.
const KINKED: f64 = 4e-2;
/// Two ways to compute the same in single precision, relative to the largest number.
const F32_PARITY: f32 = 1e-5;

fn view(seed: u64) -> View {
    let mut view = View::default();
    Prepared::new(&StandIn::new(seed).sample(0, Split::Train)).view(0, &mut view);
    view
}

#[test]
fn the_network_is_derived_rightly() {
    let network = Network::new(describe::graph());
    let mut random = fastrand::Rng::with_seed(3);
    let mut parameters = network.initial(&mut random);
    parameters.iter_mut().for_each(|p| *p += 0.02 * (random.f32() - 0.5));
    let view = view(21);
    let pass = network.forward(&parameters, &view);
    let weights: Vec<f32> = (0..3 * NODE_COUNT).map(|_| random.f32() - 0.5).collect();
    let mut gradient = vec![0.0; parameters.len()];
    network.backward(&parameters, &pass, weights.clone(), &mut gradient);
    let value = |parameters: &[f32]| {
        let pass = network.forward(parameters, &view);
        let out = &pass.rows[pass.rows.len() - 1];
        out.iter().zip(&weights).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum::<f64>()
    };
    for tensor in &network.layout.tensors {
        let part = &gradient[tensor.range.clone()];
        let norm = part.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
        assert!(norm > 0.0, "{}: no derivative", tensor.name);
        let step = 2e-3;
        let moved = |sign: f64| {
            let mut parameters = parameters.clone();
            for (p, &g) in parameters[tensor.range.clone()].iter_mut().zip(part) {
                *p += (sign * step * f64::from(g) / norm) as f32;
            }
            value(&parameters)
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
        assert!((difference - norm).abs() < KINKED * norm, "{}: {difference} by differences, {norm}", tensor.name);
    }
}

#[test]
fn attention_is_derived_rightly() {
    let mut random = fastrand::Rng::with_seed(5);
    let mut draw = |count: usize, size: f32| -> Vec<f32> { (0..count).map(|_| size * (random.f32() - 0.5)).collect() };
    let (soft, rigid) = (draw(6 * WIDTH, 1.0), draw(9 * WIDTH, 1.0));
    let (parameters, weights) = (draw(WIDTH * WIDTH, 0.3), draw(6 * WIDTH, 1.0));
    let head = Head { weight: 0..WIDTH * WIDTH };
    let kept = head.forward(&parameters, &soft, &rigid);
    let mut gradient = vec![0.0; parameters.len()];
    let (mut dsoft, mut drigid) = (vec![0.0; soft.len()], vec![0.0; rigid.len()]);
    head.backward(&parameters, &soft, &rigid, &kept, &weights, &mut gradient, &mut dsoft, &mut drigid);
    let value = |at: [&[f32]; 3]| -> f64 {
        let out = head.forward(at[0], at[1], at[2]).out;
        out.iter().zip(&weights).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
    };
    for (which, slope) in [&gradient, &dsoft, &drigid].into_iter().enumerate() {
        let norm = slope.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
        assert!(norm > 0.0);
        let step = 2e-2;
        let moved = |sign: f64| {
            let mut at = [parameters.clone(), soft.clone(), rigid.clone()];
            for (x, &g) in at[which].iter_mut().zip(slope) {
                *x += (sign * step * f64::from(g) / norm) as f32;
            }
            value([&at[0], &at[1], &at[2]])
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
        assert!((difference - norm).abs() < DERIVATIVE * norm, "{which}: {difference} by differences, {norm}");
    }
}

#[test]
fn the_loss_is_derived_rightly() {
    let network = Network::new(describe::graph());
    let mut random = fastrand::Rng::with_seed(4);
    let mut draw = || -> Vec<f32> { (0..3 * NODE_COUNT).map(|_| random.f32() - 0.5).collect() };
    let (out, target, along) = (draw(), draw(), draw());
    let (_, slope) = network.loss(&out, &target, 1.0);
    let step = 1e-4;
    let moved = |sign: f32| -> Vec<f32> { out.iter().zip(&along).map(|(x, d)| x + sign * step * d).collect() };
    let value = |sign| network.loss(&moved(sign), &target, 1.0).0.total;
    let difference = (value(1.0) - value(-1.0)) / (2.0 * f64::from(step));
    let expected: f64 = slope.iter().zip(&along).map(|(&s, &d)| f64::from(s) * f64::from(d)).sum();
    assert!(expected != 0.0 && (difference - expected).abs() < KINKED * expected.abs(), "{difference}, {expected}");
}

#[test]
fn the_core_answers_what_the_trainer_computes() {
    let samples: Vec<_> = (0..3).map(|path| StandIn::new(30 + u64::from(path)).sample(path, Split::Train)).collect();
    let learner = FaithfulLearner::new(&samples);
    let parameters = learner.network.initial(&mut fastrand::Rng::with_seed(8));
    let file = export::weights("faithful", &learner.tensors(&parameters), &[]).unwrap();
    let network = FaithfulNetwork::new(&file).unwrap();
    let edges: Vec<_> = describe::graph().edges().collect();
    let mesh = Propagation::new(NODE_COUNT, &edges);
    let mut memory = Memory::default();
    for sample in &samples {
        let mut view = View::default();
        Prepared::new(sample).view(0, &mut view);
        let pass = learner.network.forward(&parameters, &view);
        let trainer = pass.rows[pass.rows.len() - 1].as_chunks::<3>().0;
        let soft = network.encode_patch(&sample.rest_mm.map(Vector3::from), &mesh, &mut memory);
        let core = network.predict(&soft, &view.rigid, &mut memory);
        let largest = trainer.as_flattened().iter().fold(0.0_f32, |most, x| most.max(x.abs()));
        assert!(largest > 0.0);
        for (core, trainer) in core.iter().zip(trainer) {
            let off = (core / UNIT_MM - Vector3::from(*trainer)).amax();
            assert!(off < F32_PARITY * largest, "{core} in the core, {trainer:?} in the trainer");
        }
    }
}

/// The published attention has no mask: the tools of all samples of a batch stand in one softmax.
#[test]
fn a_prediction_does_not_depend_on_the_rest_of_its_batch() {
    let mut random = fastrand::Rng::with_seed(9);
    let mut draw = |rows: usize| -> Vec<f32> { (0..rows * WIDTH).map(|_| random.f32() - 0.5).collect() };
    let (soft, own, other) = (draw(NODE_COUNT), draw(TOOL_NODES), draw(TOOL_NODES));
    let parameters: Vec<f32> = draw(WIDTH);
    let head = Head { weight: 0..WIDTH * WIDTH };
    let alone = head.forward(&parameters, &soft, &own).out;
    let leaking = head.forward(&parameters, &soft, &[own.clone(), other].concat()).out;
    let off = alone.iter().zip(&leaking).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off > 1e-2, "the published attention would not leak");
    assert_eq!(alone, head.forward(&parameters, &soft, &own).out);
    let mut rows = vec![0.0, 1.0, 2.0, -1.0];
    softmax(&mut rows, 2);
    assert!((rows[0] + rows[1] - 1.0).abs() < 1e-6 && rows[1] > rows[0] && rows[2] > rows[3]);
}

/// The published graph takes three directed edges from each triangle, so those of the rim are one-way and inner ones two-way.
#[test]
fn every_edge_counts_in_both_directions() {
    let patch = Patch::grid(Surface::Flat, nalgebra::Isometry3::identity());
    let published: Vec<(usize, usize)> =
        patch.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    let one_way = published.iter().filter(|&&(a, b)| !published.contains(&(b, a))).count();
    assert_eq!(one_way, 28, "the rim of 7 edges on four sides");
    let ours: Vec<(usize, usize)> = describe::graph().edges().collect();
    assert!(ours.iter().all(|&(a, b)| ours.contains(&(b, a))));
    assert_eq!(ours.len(), published.len() + one_way);
}

#[test]
fn a_symmetry_maps_the_square_onto_itself() {
    let corner = Vector3::new(1.05, 0.45, 0.0);
    let mut images: Vec<[i32; 2]> = (0..SYMMETRIES)
        .map(|index| symmetry(index) * corner)
        .map(|image| [(image.x * 1e3).round() as i32, (image.y * 1e3).round() as i32])
        .collect();
    images.sort_unstable();
    images.dedup();
    assert_eq!(images.len(), SYMMETRIES);
    assert!(images.iter().all(|[x, y]| x.abs().max(y.abs()) == 1050 && x.abs().min(y.abs()) == 450));
}
