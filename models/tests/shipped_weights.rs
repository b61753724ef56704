//! The weights that ship are those that their cards tell of, and answer in the core what the trainer computed.

use std::collections::BTreeMap;
use std::path::PathBuf;

use retina_core::network::contact::{ContactNetwork, Memory, Start};
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::{self, FaithfulNetwork};
use retina_core::network::weights::hash;
use retina_core::patch::NODE_COUNT;
use retina_models::describe;
use retina_models::faithful::prepared::{Prepared, View};
use retina_models::shard;
use retina_models::train::card::Card;
use retina_models::train::layers::{self, Layer};

/// Two ways to compute the same in single precision, relative to the largest number.
const F32_PARITY: f32 = 1e-5;
/// What all weights together may take in the repository (bytes).
const LARGEST: u64 = 8 << 20;

fn path(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/weights")).join(name)
}

#[test]
fn the_core_answers_what_the_cards_say() {
    // Those of other widths are contestants of the chart; their sample is that of the one that ships.
    let narrow = [(Start::Linear, "contact-24"), (Start::Linear, "contact-64")];
    for (start, name) in [Start::Linear, Start::Coarse].map(|start| (start, start.network())).into_iter().chain(narrow)
    {
        let card: Card = serde_json::from_slice(&std::fs::read(path(&format!("{name}.card.json"))).unwrap()).unwrap();
        let file = std::fs::read(path(&format!("{name}.safetensors"))).unwrap();
        assert_eq!(hash(&file), card.weights_sha256);
        let network = ContactNetwork::new(start, &file).unwrap();
        let sample = shard::read(&path(&format!("{}.parity.safetensors", start.network()))).unwrap()[0];
        let mut memory = Memory::default();
        network.predict(&describe::input(&sample), &describe::graph(), &mut memory).unwrap();
        let (coefficients, motion, quantiles) = memory.answered();
        let parity = card.parity.unwrap();
        for (core, trainer) in
            [(coefficients, &parity.coefficients), (motion, &parity.motion), (quantiles, &parity.quantiles)]
        {
            assert_eq!(core.len(), trainer.len());
            let largest = trainer.iter().fold(1.0_f32, |most, x| most.max(x.abs()));
            for (core, trainer) in core.iter().zip(trainer) {
                assert!((core - trainer).abs() < F32_PARITY * largest, "{name}: {core} in the core, {trainer} trained");
            }
        }
    }
}

/// Holds what `observe` is shown against the committed rows of `name`, layer by layer.
fn check_layers(name: &str, observe: impl FnOnce(&mut dyn FnMut(&str, usize, &[f32]))) {
    let mut committed: BTreeMap<String, (usize, Vec<f32>)> =
        layers::read(&std::fs::read(path(&format!("{name}.layers.safetensors"))).unwrap())
            .unwrap()
            .into_iter()
            .map(|(layer, width, rows)| (layer, (width, rows)))
            .collect();
    let count = committed.len();
    observe(&mut |layer, at, rows| {
        let (width, trainer) = committed.remove(&format!("{layer}.{at}")).unwrap();
        let core = Layer::new(layer, at, width, rows).kept();
        let largest = trainer.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
        assert!(core.len() == trainer.len() && largest > 0.0, "{name} {layer}.{at}: {} numbers", core.len());
        let off = core.iter().zip(&trainer).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / largest;
        println!("{name} {layer}.{at}: {off:.1e} of {largest}");
        assert!(off < F32_PARITY, "{name} {layer}.{at}: off by {off:e} of {largest}");
    });
    assert!(committed.is_empty() && count >= 9, "{name}: {:?} of {count} were not shown", committed.keys());
}

/// The committed layers were computed by the trainer's own pass (`retina-models parity`), which shares neither the folded weights nor the kept parts
/// of the core's.
#[test]
fn the_core_computes_every_layer_as_the_trainer_did() {
    for start in [Start::Linear, Start::Coarse] {
        let name = start.network();
        let network =
            ContactNetwork::new(start, &std::fs::read(path(&format!("{name}.safetensors"))).unwrap()).unwrap();
        let sample = shard::read(&path(&format!("{name}.parity.safetensors"))).unwrap()[0];
        check_layers(name, |seen| {
            let mut memory = Memory::default();
            network.predict_observed(&describe::input(&sample), &describe::graph(), &mut memory, seen).unwrap();
        });
    }
    let network = FaithfulNetwork::new(&std::fs::read(path("faithful.safetensors")).unwrap()).unwrap();
    let sample = shard::read(&path("faithful.parity.safetensors")).unwrap()[0];
    let edges: Vec<_> = describe::graph().edges().collect();
    let mut view = View::default();
    Prepared::new(&sample).view(0, &mut view);
    check_layers("faithful", |seen| {
        let mut memory = faithful::Memory::default();
        let mesh = Propagation::new(NODE_COUNT, &edges);
        let rest = describe::input(&sample).rest_mm;
        let patch = network.encode_patch_observed(&rest, &mesh, &mut memory, seen);
        network.predict_observed(&patch, &view.rigid, &mut memory, seen);
    });
}

#[test]
fn the_weights_are_small() {
    let sizes = std::fs::read_dir(path("")).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len());
    let total: u64 = sizes.sum();
    assert!(total <= LARGEST, "{total} bytes");
}
