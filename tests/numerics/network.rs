//! The networks' inference: against plain loops, under rotations, mirrors and renumbering, and with damaged weights.

use std::collections::HashMap;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};
use retina_core::needle::NeedleShape;
use retina_core::network::activation::activate;
use retina_core::network::contact::{ContactNetwork, Memory, QUANTILES, STRAIN, Start, strain_bin};
use retina_core::network::features::{BASIS, Features};
use retina_core::network::graph::Graph;
use retina_core::network::input::{Answer, Input, Relief, TissueNumbers};
use retina_core::network::packed::Packed;
use retina_core::network::plain::affine;
use retina_core::network::softmax::{LEAST, exp_of_negative, softmax};
use retina_core::network::weights::{HASH, NETWORK, Weights, WeightsError, hash};
use retina_core::patch::{NODE_COUNT, Patch};
use retina_core::surface::Surface;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};

const CONTACT: &[u8] = include_bytes!("../../models/weights/contact.safetensors");
const CORRECTED: &[u8] = include_bytes!("../../models/weights/corrected.safetensors");
/// Single precision over four layers, relative to the largest number.
const SINGLE: f32 = 2e-5;

fn patch() -> Patch {
    Patch::grid(Surface::Sphere { radius_mm: 12.0 }, Isometry3::identity())
}

/// A leaning bevel in the tissue, beside a pit, with answers that no symmetry simplifies.
fn input(seed: u64) -> Input {
    let patch = patch();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut within = |size: f64| size * (2.0 * random.f64() - 1.0);
    let shape = NeedleShape::bevelled(0.2);
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(within(0.6), within(0.6), within(2.0)));
    let tip = Vector3::new(within(0.4), within(0.4), 0.05);
    let direction = rotation * Unit::new_normalize(Vector3::new(within(0.2), within(0.2), -1.0));
    let column = patch.surface.column(tip.x, tip.y);
    let center = patch.surface.column(tip.x + within(0.1), tip.y + within(0.1)).surface;
    let depth = 0.12;
    let linear = std::array::from_fn(|node| {
        let away = (patch.vertices[node] - center).norm();
        (column.inward.into_inner() * (depth / (1.0 + 20.0 * away * away))
            + Vector3::new(within(2e-3), within(2e-3), 0.0))
        .cast()
    });
    let answer = |displacement_mm, travel_mm| Answer {
        displacement_mm,
        travel_mm,
        reaction_mn: (column.inward.into_inner() * -0.9).cast(),
    };
    let pit = Surface::FovealPit { radius_mm: 12.0, depth_mm: 0.13, sigma_mm: 0.25 };
    let [at_touch, at_center] = [column.surface, center].map(|at| pit.thinning(&(at + Vector3::new(0.2, -0.1, 0.0))));
    let nodes_mm = std::array::from_fn(|node| pit.thinning(&patch.vertices[node]).mm as f32);
    let coarse = linear.map(|moved: Vector3<f32>| moved * 0.9);
    Input {
        rest_mm: std::array::from_fn(|node| patch.vertices[node].coords.cast()),
        rest_normal: std::array::from_fn(|node| {
            let [x, y] = patch.parameters[node];
            patch.surface.normal(x, y).into_inner().cast()
        }),
        shape,
        body: shape.body(),
        patch_from_needle: Isometry3::from_parts(tip.into(), rotation),
        direction: direction.into_inner().cast(),
        force_mn: 0.9,
        tissue: TissueNumbers {
            thickness_mm: [0.24, 0.25, 0.6],
            youngs_modulus_kpa: [18.0, 7.0, 2000.0],
            poisson_ratio: [0.48, 0.2, 0.47],
        },
        relief: Relief::new(&nodes_mm, [at_touch.mm, at_center.mm], &at_center.slope, &at_center.bend),
        touch_mm: column.surface.coords.cast(),
        inward: column.inward.into_inner().cast(),
        center_mm: center.coords.cast(),
        depth_mm: depth as f32,
        contact_radius_mm: 0.15,
        pressure_kpa: 20.0,
        linear: answer(linear, 0.21),
        coarse: Some(answer(coarse, 0.2)),
    }
}

fn networks() -> [ContactNetwork; 2] {
    [ContactNetwork::new(Start::Linear, CONTACT).unwrap(), ContactNetwork::new(Start::Coarse, CORRECTED).unwrap()]
}

/// `input` under an orthogonal map. A mirror keeps the needle's own image: its local y turns over.
fn mapped(input: &Input, map: &Matrix3<f64>) -> Input {
    let single: Matrix3<f32> = map.cast();
    let turn = input.patch_from_needle.rotation;
    let (x, z) = (map * (turn * Vector3::x()), map * (turn * Vector3::z()));
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    let at = map * input.patch_from_needle.translation.vector;
    let answer = |answer: &Answer| Answer {
        displacement_mm: answer.displacement_mm.map(|v| single * v),
        travel_mm: answer.travel_mm,
        reaction_mn: single * answer.reaction_mn,
    };
    Input {
        rest_mm: input.rest_mm.map(|v| single * v),
        rest_normal: input.rest_normal.map(|v| single * v),
        patch_from_needle: Isometry3::from_parts(at.into(), UnitQuaternion::from_rotation_matrix(&rotation)),
        direction: single * input.direction,
        relief: Relief {
            slope: single * input.relief.slope,
            bend: single * input.relief.bend * single.transpose(),
            ..input.relief
        },
        touch_mm: single * input.touch_mm,
        inward: single * input.inward,
        center_mm: single * input.center_mm,
        linear: answer(&input.linear),
        coarse: input.coarse.as_ref().map(answer),
        ..input.clone()
    }
}

#[test]
fn the_answer_turns_and_mirrors_with_all_that_is_asked() {
    let graph = Graph::new(&patch().triangles);
    let mut memory = Memory::default();
    let turn = *Rotation3::from_scaled_axis(Vector3::new(0.7, -1.1, 0.4)).matrix();
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    for network in networks() {
        for (map, seed) in [turn, mirror, turn * mirror].iter().zip(5..) {
            let input = input(seed);
            let here = network.predict(&input, &graph, &mut memory).unwrap();
            let there = network.predict(&mapped(&input, map), &graph, &mut memory).unwrap();
            let single: Matrix3<f32> = map.cast();
            let (mut largest, mut corrected) = (0.0_f32, 0.0_f32);
            let start = [&input.linear, input.coarse.as_ref().unwrap()][usize::from(network.start() == Start::Coarse)];
            for node in 0..NODE_COUNT {
                let [a, b] = [&here, &there].map(|answer| answer.answer.displacement_mm[node]);
                largest = largest.max((single * a - b).norm());
                corrected = corrected.max((a - start.displacement_mm[node]).norm());
            }
            assert!(corrected > 1e-3, "a network that corrects nothing proves nothing");
            assert!(largest < SINGLE, "{largest} mm");
            assert!((single * here.answer.reaction_mn - there.answer.reaction_mn).norm() < SINGLE);
            assert!((here.answer.travel_mm - there.answer.travel_mm).abs() < SINGLE);
            for (a, b) in here.error_mm.iter().zip(there.error_mm) {
                assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
            }
        }
    }
}

#[test]
fn a_pit_beside_the_contact_is_seen() {
    let graph = Graph::new(&patch().triangles);
    let mut memory = Memory::default();
    let level = Relief::new(&[0.0; NODE_COUNT], [0.0; 2], &Vector3::zeros(), &Matrix3::zeros());
    for network in networks() {
        let pitted = input(8);
        let flat = Input { relief: level, ..pitted.clone() };
        let [here, there] = [pitted, flat].map(|input| network.predict(&input, &graph, &mut memory).unwrap().answer);
        let moved = |node: usize| (here.displacement_mm[node] - there.displacement_mm[node]).norm();
        let most = (0..NODE_COUNT).map(moved).fold(0.0, f32::max);
        assert!(most > 1e-3, "{most} mm");
    }
}

#[test]
fn the_order_of_the_nodes_does_not_matter() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut order: Vec<usize> = (0..NODE_COUNT).collect();
    random.shuffle(&mut order);
    let triangles = patch().triangles;
    let place = |node: usize| order.iter().position(|old| *old == node).unwrap();
    let renumbered: Vec<[usize; 3]> = triangles.iter().map(|corners| corners.map(place)).collect();
    let input = input(9);
    let shuffled = |field: &[Vector3<f32>; NODE_COUNT]| std::array::from_fn(|node| field[order[node]]);
    let answer = |answer: &Answer| Answer { displacement_mm: shuffled(&answer.displacement_mm), ..*answer };
    let other = Input {
        rest_mm: shuffled(&input.rest_mm),
        rest_normal: shuffled(&input.rest_normal),
        relief: Relief { node_mm: std::array::from_fn(|node| input.relief.node_mm[order[node]]), ..input.relief },
        linear: answer(&input.linear),
        coarse: input.coarse.as_ref().map(answer),
        ..input.clone()
    };
    let mut memory = Memory::default();
    for network in networks() {
        let here = network.predict(&input, &Graph::new(&triangles), &mut memory).unwrap();
        let there = network.predict(&other, &Graph::new(&renumbered), &mut memory).unwrap();
        for node in 0..NODE_COUNT {
            let off = here.answer.displacement_mm[order[node]] - there.answer.displacement_mm[node];
            assert!(off.norm() < SINGLE, "{off}");
        }
    }
}

#[test]
fn no_depth_is_no_correction_at_all() {
    let mut memory = Memory::default();
    let still =
        Answer { displacement_mm: [Vector3::zeros(); NODE_COUNT], travel_mm: -1.0, reaction_mn: Vector3::zeros() };
    let input = Input { depth_mm: 0.0, linear: still, coarse: Some(still), ..input(4) };
    for network in networks() {
        let answer = network.predict(&input, &Graph::new(&patch().triangles), &mut memory).unwrap();
        assert!(answer.answer.displacement_mm.iter().all(|moved| *moved == Vector3::zeros()));
        assert_eq!((answer.answer.travel_mm, answer.error_mm), (-1.0, [0.0; 2]));
    }
}

/// The trunk again, from the weights themselves, in plain loops and with the normaliser where it was in training.
#[test]
fn the_fast_path_agrees_with_plain_loops() {
    let graph = Graph::new(&patch().triangles);
    for (network, file, name) in networks().iter().zip([CONTACT, CORRECTED]).map(|(n, f)| (n, f, n.start().network())) {
        let weights = Weights::read(name, file).unwrap();
        let take = |name: &str| weights.take(name, weights.shape(name).unwrap()).unwrap();
        let input = input(6);
        let mut memory = Memory::default();
        network.predict(&input, &graph, &mut memory).unwrap();
        let mut features = Features::default();
        let coarse = network.start() == Start::Coarse;
        features.describe(&input, if coarse { input.coarse.as_ref() } else { None });
        let standard = |rows: &[f32], of: &str| -> Vec<f32> {
            let (mean, scale) = (take(&format!("normaliser.{of}.mean")), take(&format!("normaliser.{of}.scale")));
            rows.iter().enumerate().map(|(k, x)| (x - mean[k % mean.len()]) * scale[k % mean.len()]).collect()
        };
        let (local, global) = (standard(&features.local, "local"), standard(&features.global, "global"));
        let bias = affine(&global, &take("input.global"), &take("input.bias"), global.len());
        let width = bias.len();
        let mut x: Vec<f32> =
            affine(&local, &take("input.local"), &bias, local.len() / NODE_COUNT).into_iter().map(activate).collect();
        let mut at = 0;
        while weights.has(&format!("block.{at}.weight")) {
            let bias = take(&format!("block.{at}.bias"));
            let mut sum = affine(&x, &take(&format!("block.{at}.weight")), &bias, width);
            if weights.has(&format!("block.{at}.message")) {
                let mut mean = vec![0.0; x.len()];
                graph.mean(&mut mean, &x, width);
                let heard = affine(&mean, &take(&format!("block.{at}.message")), &vec![0.0; width], width);
                sum.iter_mut().zip(heard).for_each(|(sum, heard)| *sum += heard);
            }
            x.iter_mut().zip(sum).for_each(|(x, sum)| *x += activate(sum));
            at += 1;
        }
        assert!(at > 0);
        let out = affine(&x, &take("output.weight"), &take("output.bias"), width);
        let mut pooled = vec![0.0; width];
        for (node, weight) in features.pool.iter().enumerate() {
            pooled.iter_mut().zip(&x[node * width..]).for_each(|(pooled, x)| *pooled += weight * x);
        }
        pooled.extend(&global);
        let head = |name: &str| {
            let take = |part: &str| take(&format!("{name}.{part}"));
            let hidden = affine(&pooled, &take("hidden.weight"), &take("hidden.bias"), pooled.len());
            let hidden: Vec<f32> = hidden.into_iter().map(activate).collect();
            affine(&hidden, &take("output.weight"), &take("output.bias"), hidden.len())
        };
        let mut quantiles = head("quantile");
        let shift = &take("quantile.shift")[strain_bin(features.global[STRAIN]) * QUANTILES..];
        quantiles.iter_mut().zip(shift).for_each(|(quantile, shift)| *quantile += shift);
        let (coefficients, motion, logarithms) = memory.answered();
        assert_eq!(coefficients.len(), NODE_COUNT * BASIS);
        for (fast, plain) in [(coefficients, &out), (motion, &head("motion")), (logarithms, &quantiles)] {
            let largest = plain.iter().fold(1.0_f32, |most, x| most.max(x.abs()));
            assert!(plain.iter().any(|x| *x != 0.0));
            for (fast, plain) in fast.iter().zip(plain) {
                assert!((fast - plain).abs() < SINGLE * largest, "{name}: {fast} fast, {plain} plain");
            }
        }
    }
}

#[test]
fn nodes_inside_the_needle_are_moved_out() {
    let mut memory = Memory::default();
    let network = &networks()[0];
    // A needle driven so deep that nodes which hardly move stand inside.
    let input = input(7);
    let still = [Vector3::zeros(); NODE_COUNT];
    let deep = Input { linear: Answer { displacement_mm: still, travel_mm: 0.6, ..input.linear }, ..input };
    let answer = network.predict(&deep, &Graph::new(&patch().triangles), &mut memory).unwrap().answer;
    let pose = deep.pose_after(answer.travel_mm);
    let inside = |moved: &Vector3<f32>, rest: &Vector3<f32>| {
        -deep.body.distance(&pose.inverse_transform_point(&Point3::from((rest + moved).cast::<f64>())))
    };
    let at_rest = deep.rest_mm.iter().map(|rest| inside(&Vector3::zeros(), rest)).fold(0.0, f64::max);
    assert!(at_rest > 0.01, "no node stands in the way");
    let left =
        answer.displacement_mm.iter().zip(&deep.rest_mm).map(|(moved, rest)| inside(moved, rest)).fold(0.0, f64::max);
    assert!(left < 2e-5, "{left} mm inside");
}

/// The file of `tensors` with a hash that fits.
fn file(tensors: &[(String, Vec<usize>, Vec<u8>)], network: &str) -> Vec<u8> {
    let views = || {
        let view = |(name, shape, data): &'static (String, Vec<usize>, Vec<u8>)| {
            (name.clone(), TensorView::new(Dtype::F32, shape.clone(), data).unwrap())
        };
        // Leaked: a handful of small files for the time of a test.
        let kept: &'static [(String, Vec<usize>, Vec<u8>)] = tensors.to_vec().leak();
        kept.iter().map(view).collect::<Vec<_>>()
    };
    let bare = safetensors::serialize(views(), None).unwrap();
    let header = u64::from_le_bytes(*bare.first_chunk().unwrap()) as usize;
    let about = HashMap::from([(HASH.to_owned(), hash(&bare[8 + header..])), (NETWORK.to_owned(), network.to_owned())]);
    safetensors::serialize(views(), Some(about)).unwrap()
}

#[test]
fn damaged_weights_are_told_apart() {
    let read = |file: &[u8]| ContactNetwork::new(Start::Linear, file).map(|_| ());
    assert_eq!(read(CONTACT), Ok(()));
    assert_eq!(read(b""), Err(WeightsError::Format));
    assert_eq!(read(&CONTACT[..100]), Err(WeightsError::Format));
    let mut flipped = CONTACT.to_vec();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    assert!(matches!(read(&flipped), Err(WeightsError::Hash { .. })));
    assert!(matches!(read(&CONTACT[..CONTACT.len() - 4]), Err(WeightsError::Hash { .. })));
    assert!(matches!(read(CORRECTED), Err(WeightsError::Network { .. })));
    let parsed = SafeTensors::deserialize(CONTACT).unwrap();
    let whole: Vec<(String, Vec<usize>, Vec<u8>)> =
        parsed.tensors().into_iter().map(|(name, t)| (name, t.shape().to_vec(), t.data().to_vec())).collect();
    assert_eq!(read(&file(&whole, "contact")), Ok(()));
    let missing: Vec<_> = whole.iter().filter(|(name, ..)| name != "output.bias").cloned().collect();
    assert_eq!(read(&file(&missing, "contact")), Err(WeightsError::Missing { name: "output.bias".to_owned() }));
    let mut shaped = whole.clone();
    let bias = shaped.iter_mut().find(|(name, ..)| name == "output.bias").unwrap();
    (bias.1, bias.2) = (vec![BASIS - 1], bias.2[4..].to_vec());
    assert!(matches!(read(&file(&shaped, "contact")), Err(WeightsError::Shape { name, .. }) if name == "output.bias"));
    let mut broken = whole;
    let (name, _, data) = &mut broken[3];
    data[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let expected = WeightsError::NotFinite { name: name.clone(), index: 0 };
    assert_eq!(read(&file(&broken, "contact")), Err(expected));
}

/// Against plain loops, for every number of rows that is left over and for columns that fill no panel.
#[test]
fn a_product_with_packed_weights_is_the_product() {
    let mut random = fastrand::Rng::with_seed(31);
    let mut draw = |count: usize| -> Vec<f32> { (0..count).map(|_| random.f32() - 0.5).collect() };
    for (rows, inner, columns) in
        [(1, 5, 3), (2, 7, 16), (3, 1, 33), (4, 64, 40), (5, 9, 64), (6, 12, 8), (102, 25, 256)]
    {
        let (x, w, before) = (draw(rows * inner), draw(inner * columns), draw(rows * columns));
        let mut out = before.clone();
        Packed::new(&w, columns).add_product(&mut out, &x);
        let plain = affine(&x, &w, &vec![0.0; columns], inner);
        for ((out, before), plain) in out.iter().zip(&before).zip(&plain) {
            assert!((out - before - plain).abs() < SINGLE, "{rows} × {inner} × {columns}: {out} {before} {plain}");
        }
        assert_ne!(out, before);
        let by_columns: Vec<f32> = (0..columns * inner).map(|at| w[at % inner * columns + at / inner]).collect();
        let mut packed = Packed::new(&x, inner);
        packed.pack_transposed(&by_columns, columns);
        assert_eq!(packed, Packed::new(&w, columns));
        packed.product(&mut out, &x);
        assert!(out.iter().zip(&plain).all(|(out, plain)| (out - plain).abs() < SINGLE));
    }
}

/// Against the library's exponential in twice the digits: two units of the last digit, zero where it says so, and no number stays none.
#[test]
fn the_softmax_has_the_exponential_to_its_last_digits() {
    let mut largest = 0.0_f64;
    for at in 0..=800_000 {
        let x = LEAST * (at as f32 / 800_000.0);
        let exact = f64::from(x).exp();
        largest = largest.max((f64::from(exp_of_negative(x)) - exact).abs() / exact);
    }
    assert!(largest < 2.0 * f64::from(f32::EPSILON), "{largest}");
    assert_eq!(exp_of_negative(0.0), 1.0);
    assert_eq!(exp_of_negative(LEAST - 1e-3), 0.0);
    assert_eq!(exp_of_negative(f32::NEG_INFINITY), 0.0);
    assert!(exp_of_negative(f32::NAN).is_nan());
    let mut rows = vec![3.0, -200.0, 4.0, f32::NAN, 1.0, 2.0];
    softmax(&mut rows, 3);
    let e = std::f32::consts::E;
    assert_eq!(rows[1], 0.0);
    assert!((rows[0] - 1.0 / (1.0 + e)).abs() < f32::EPSILON && (rows[2] - e / (1.0 + e)).abs() < f32::EPSILON);
    assert!(rows[3..].iter().any(|x| x.is_nan()), "{rows:?}");
}
