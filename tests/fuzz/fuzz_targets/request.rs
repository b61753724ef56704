//! Bodies of the routes that compute: read and understood, or refused with a problem of the caller's.

#![no_main]

use libfuzzer_sys::fuzz_target;
use retina_server::problem::{Kind, Problem};
use retina_server::read::read;
use retina_server::understand;
use retina_server::wire::{BatchRequest, PredictRequest, SimulateRequest};

/// Steps that a sequence may have.
const MOST_STEPS: usize = 2000;

fn refused(problem: &Problem) {
    assert_ne!(problem.kind, Kind::Internal, "{problem:?}");
    let document = problem.document();
    assert!(document.status >= 400 && !document.detail.is_empty(), "{problem:?}");
}

fuzz_target!(|bytes: &[u8]| {
    let Some((first, body)) = bytes.split_first() else { return };
    let outcome = match first % 3 {
        0 => read::<PredictRequest>(body).and_then(|message| {
            understand::budget(message.accuracy.as_ref())?;
            understand::chosen(message.scene.as_ref())?;
            understand::request(&message).map(|_| ())
        }),
        1 => read::<BatchRequest>(body).and_then(|message| {
            let shared = understand::shared(message.accuracy.as_ref(), message.effects.as_ref())?;
            understand::chosen(message.scene.as_ref())?;
            message.poses.iter().try_for_each(|pose| understand::batched(&shared, pose).map(|_| ()))
        }),
        _ => read::<SimulateRequest>(body).and_then(|message| understand::sequence(&message, MOST_STEPS).map(|_| ())),
    };
    if let Err(problem) = outcome {
        refused(&problem);
    }
});
