//! The paper's network: derivatives against differences, the trainer against the core, and the faults of the published code.

mod stand_in;

use nalgebra::Vector3;
use retina_core::network::faithful::features::RIGID;
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::tool::TOOL_NODES;
use retina_core::network::faithful::{FaithfulNetwork, Memory, UNIT_MM, WIDTH};
use retina_core::network::softmax::softmax;
use retina_core::patch::{NODE_COUNT, Patch};
use retina_core::surface::Surface;
use retina_models::describe;
use retina_models::faithful::attention::Attention;
use retina_models::faithful::layers::Head;
use retina_models::faithful::learn::FaithfulLearner;
use retina_models::faithful::neighbours::Neighbours;
use retina_models::faithful::network::Network;
use retina_models::faithful::prepared::{Prepared, SYMMETRIES, View, symmetry};
use retina_models::faithful::variant::{Backbone, Seen, Variant};
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
fn every_backbone_is_derived_rightly() {
    for backbone in [Backbone::Tag, Backbone::Gcn, Backbone::Gat] {
        check_derivatives(backbone);
    }
}

fn check_derivatives(backbone: Backbone) {
    let network = Network::new(describe::graph(), backbone);
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
        assert!(norm > 0.0, "{backbone:?} {}: no derivative", tensor.name);
        // Where every sum lies on one side of GAT's kink its softmax takes `here` out: what is left is kinks alone, which the layer's own test steps around.
        if tensor.name.ends_with(".here") || tensor.name.ends_with(".there") {
            continue;
        }
        let step = 2e-3;
        let moved = |sign: f64| {
            let mut parameters = parameters.clone();
            for (p, &g) in parameters[tensor.range.clone()].iter_mut().zip(part) {
                *p += (sign * step * f64::from(g) / norm) as f32;
            }
            value(&parameters)
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
        let off = (difference - norm).abs();
        assert!(off < KINKED * norm, "{backbone:?} {}: {difference} by differences, {norm}", tensor.name);
    }
}

/// GAT's layer alone has no kink but the leaky ReLU's, so it is held against differences more closely than the whole network.
#[test]
fn attention_over_neighbours_is_derived_rightly() {
    let mut random = fastrand::Rng::with_seed(11);
    let mut draw = |count: usize, size: f32| -> Vec<f32> { (0..count).map(|_| size * (random.f32() - 0.5)).collect() };
    let mesh = Neighbours::with_loops(5, &[(0, 1), (1, 0), (1, 2), (2, 1), (3, 1), (1, 3)]);
    let inner = 7;
    let weights = inner * WIDTH;
    let layer = Attention {
        weight: 0..weights,
        bias: weights..weights + WIDTH,
        toward: [weights + WIDTH..weights + 2 * WIDTH, weights + 2 * WIDTH..weights + 3 * WIDTH],
        inner,
    };
    let (parameters, x, along) = (draw(weights + 3 * WIDTH, 0.5), draw(5 * inner, 1.0), draw(5 * WIDTH, 1.0));
    let mut out = Vec::new();
    let kept = layer.forward(&parameters, &mesh, &x, &mut out);
    let mut gradient = vec![0.0; parameters.len()];
    let dx = layer.backward(&parameters, &mesh, &x, &kept, &along, &mut gradient);
    let value = |parameters: &[f32], x: &[f32]| -> f64 {
        let mut out = Vec::new();
        layer.forward(parameters, &mesh, x, &mut out);
        out.iter().zip(&along).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
    };
    let mut parts: Vec<Vec<f32>> = Vec::new();
    for range in [layer.weight.clone(), layer.bias.clone(), layer.toward[0].clone(), layer.toward[1].clone()] {
        let mut part = vec![0.0; parameters.len()];
        part[range.clone()].copy_from_slice(&gradient[range]);
        parts.push(part);
    }
    // Short enough that no sum passes the kink of the leaky ReLU.
    let step = 1e-3;
    let check = |what: &str, norm: f64, difference: f64| {
        assert!(norm > 0.0, "{what}: no derivative");
        assert!((difference - norm).abs() < DERIVATIVE * norm, "{what}: {difference} by differences, {norm}");
    };
    let length = |g: &[f32]| g.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
    let shifted = |from: &[f32], g: &[f32], by: f64| -> Vec<f32> {
        let norm = length(g);
        from.iter().zip(g).map(|(x, g)| x + (by * f64::from(*g) / norm) as f32).collect()
    };
    for (what, part) in ["weight", "bias", "here", "there"].iter().zip(&parts) {
        let at = |by| value(&shifted(&parameters, part, by), &x);
        check(what, length(part), (at(step) - at(-step)) / (2.0 * step));
    }
    let at = |by| value(&parameters, &shifted(&x, &dx, by));
    check("x", length(&dx), (at(step) - at(-step)) / (2.0 * step));
}

/// A variant that is not told something answers the same whatever that is; the paper's own does not.
#[test]
fn what_a_variant_is_not_told_does_not_reach_it() {
    let (here, other) = (view(21), view(22));
    let mut force_elsewhere = here.clone();
    for (node, from) in force_elsewhere.rigid.chunks_exact_mut(RIGID).zip(other.rigid.chunks_exact(RIGID)) {
        node[..4].copy_from_slice(&from[..4]);
    }
    let mut places_elsewhere = here.clone();
    places_elsewhere.soft.iter_mut().for_each(|x| *x += 0.5);
    for (node, from) in places_elsewhere.rigid.chunks_exact_mut(RIGID).zip(other.rigid.chunks_exact(RIGID)) {
        node[4..].copy_from_slice(&from[4..]);
    }
    let hidden = |seen: Seen, view: &View| {
        let mut view = view.clone();
        seen.hide(&mut view);
        view
    };
    for (seen, changed) in [(Seen::Position, &force_elsewhere), (Seen::Physics, &places_elsewhere)] {
        assert_eq!(hidden(seen, &here), hidden(seen, changed));
        assert_ne!(hidden(Seen::Both, &here), hidden(Seen::Both, changed));
        assert!(hidden(seen, &here).rigid.iter().any(|x| *x != 0.0), "{seen:?} hides everything");
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
    let network = Network::new(describe::graph(), Backbone::Tag);
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
    let learner = FaithfulLearner::new(&samples, Variant::PAPER);
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
