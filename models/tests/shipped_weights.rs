//! The weights that ship are those that their cards tell of, and answer in the core what the trainer computed.

use std::path::PathBuf;

use retina_core::network::contact::{ContactNetwork, Memory, Start};
use retina_core::network::weights::hash;
use retina_models::describe;
use retina_models::shard;
use retina_models::train::card::Card;

/// Two ways to compute the same in single precision, relative to the largest number.
const F32_PARITY: f32 = 1e-5;
/// What all weights together may take in the repository (bytes).
const LARGEST: u64 = 8 << 20;

fn path(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/weights")).join(name)
}

#[test]
fn the_core_answers_what_the_cards_say() {
    for start in [Start::Linear, Start::Coarse] {
        let name = start.network();
        let card: Card = serde_json::from_slice(&std::fs::read(path(&format!("{name}.card.json"))).unwrap()).unwrap();
        let file = std::fs::read(path(&format!("{name}.safetensors"))).unwrap();
        assert_eq!(hash(&file), card.weights_sha256);
        let network = ContactNetwork::new(start, &file).unwrap();
        let sample = shard::read(&path(&format!("{name}.parity.safetensors"))).unwrap()[0];
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

#[test]
fn the_weights_are_small() {
    let sizes = std::fs::read_dir(path("")).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len());
    let total: u64 = sizes.sum();
    assert!(total <= LARGEST, "{total} bytes");
}
