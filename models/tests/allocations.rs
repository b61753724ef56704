//! A prediction allocates nothing: what it needs of memory a thread keeps from the one before.
//!
//! Allocations are counted on the thread that predicts, by an allocator around the system's.

use allocation_counter::measure;
use retina_core::network::contact::{ContactNetwork, Memory, Start};
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::{self, FaithfulNetwork};
use retina_core::patch::NODE_COUNT;
use retina_models::describe;
use retina_models::faithful::prepared::{Prepared, View};
use retina_models::sample::Sample;
use retina_models::shard;

fn weights(name: &str) -> Vec<u8> {
    std::fs::read(format!("{}/weights/{name}.safetensors", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn sample() -> Sample {
    shard::read(concat!(env!("CARGO_MANIFEST_DIR"), "/weights/corrected.parity.safetensors").as_ref()).unwrap()[0]
}

#[test]
fn the_counter_counts() {
    let counted = measure(|| {
        std::hint::black_box(vec![1_u8; 100]);
    });
    assert_eq!(counted.count_total, 1);
}

#[test]
fn a_prediction_of_the_contact_networks_allocates_nothing() {
    let (input, graph) = (describe::input(&sample()), describe::graph());
    for start in [Start::Linear, Start::Coarse] {
        let network = ContactNetwork::new(start, &weights(start.network())).unwrap();
        let mut memory = Memory::default();
        let first = network.predict(&input, &graph, &mut memory).unwrap();
        let mut again = None;
        let counted = measure(|| again = network.predict(&input, &graph, &mut memory));
        assert_eq!(again, Some(first));
        assert_eq!(counted.count_total, 0, "{}: {counted:?}", start.network());
    }
}

#[test]
fn a_prediction_of_the_papers_network_allocates_nothing() {
    let sample = sample();
    let network = FaithfulNetwork::new(&weights("faithful")).unwrap();
    let edges: Vec<_> = describe::graph().edges().collect();
    let mut memory = faithful::Memory::default();
    let mesh = Propagation::new(NODE_COUNT, &edges);
    let patch = network.encode_patch(&describe::input(&sample).rest_mm, &mesh, &mut memory);
    let mut view = View::default();
    Prepared::new(&sample).view(0, &mut view);
    let first = network.predict(&patch, &view.rigid, &mut memory);
    let mut again = None;
    let counted = measure(|| again = Some(network.predict(&patch, &view.rigid, &mut memory)));
    assert_eq!(again, Some(first));
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
