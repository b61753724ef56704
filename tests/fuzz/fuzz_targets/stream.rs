//! Messages of a stream: binary poses, and texts.

#![no_main]

use libfuzzer_sys::fuzz_target;
use retina_server::problem::Kind;
use retina_server::read::read;
use retina_server::stream::binary;
use retina_server::wire::stream::StreamCommand;

fuzz_target!(|bytes: &[u8]| {
    if let Err(problem) = binary::pose(bytes) {
        assert_ne!(problem.kind, Kind::Internal);
    }
    if let Err(problem) = read::<StreamCommand>(bytes) {
        assert_ne!(problem.kind, Kind::Internal);
    }
});
