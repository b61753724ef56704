//! The contact networks' training: derivatives against differences, the trainer against the core, and that something is learned.

mod stand_in;

use retina_core::network::contact::{ContactNetwork, MOTION, Memory, QUANTILES, Start};
use retina_core::network::features::BASIS;
use retina_models::contact::learn::ContactLearner;
use retina_models::contact::loss::loss;
use retina_models::contact::network::{Form, Network, Pass, Slopes};
use retina_models::contact::prepared::Prepared;
use retina_models::describe;
use retina_models::sample::{Sample, Split};
use retina_models::train::export;
use retina_models::train::run::{Learner, Settings, train};
use stand_in::StandIn;

fn samples(count: u32, seed: u64) -> Vec<Sample> {
    let mut stand_in = StandIn::new(seed);
    let split = |path| if path % 5 == 4 { Split::Validation } else { Split::Train };
    (0..count).map(|path| stand_in.sample(path, split(path))).collect()
}

#[test]
#[ignore]
fn write_stand_in() {
    let mut all = samples(1500, 3);
    for s in &mut all { if s.path % 10 == 9 { s.split = Split::Test; } }
    std::fs::create_dir_all("/tmp/standin").unwrap();
    retina_models::shard::write(std::path::Path::new("/tmp/standin/all.safetensors"), &all).unwrap();
}
