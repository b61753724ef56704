//! The same request gives the same bits: twice, with another workspace, on another thread, after other requests.

use retina_core::predict::Workspace;
use retina_core::progress::Silent;
use retina_core::scene::Scene;

use crate::support::{FAST, ask, at, built_in, requests};

/// Every number of an answer, to the last bit and the sign of zero.
fn bits(answer: &impl std::fmt::Debug) -> String {
    format!("{answer:?}")
}

#[test]
fn the_same_request_gives_the_same_bits() {
    for (name, seed) in Scene::built_in_names().iter().zip(90..) {
        let scene = built_in(name);
        let requests = requests(&scene, seed, 5);
        for level in FAST {
            let asked: Vec<_> = requests.iter().map(|request| at(request, level)).collect();
            let fresh: Vec<String> = asked.iter().map(|request| bits(&ask(&scene, request))).collect();
            let mut workspace = Workspace::default();
            for round in 0..2 {
                // The second round in another order: each request follows another one.
                let order: Vec<usize> = if round == 0 { (0..5).collect() } else { (0..5).rev().collect() };
                for index in order {
                    let warm = bits(&scene.predict(&asked[index], &mut workspace, &mut Silent));
                    assert_eq!(warm, fresh[index], "{name} {level:?}");
                }
            }
            let elsewhere: Vec<String> = std::thread::scope(|scope| {
                let threads: Vec<_> = asked.iter().map(|r| scope.spawn(|| bits(&ask(&scene, r)))).collect();
                threads.into_iter().map(|thread| thread.join().unwrap()).collect()
            });
            assert_eq!(elsewhere, fresh, "{name} {level:?}: on another thread");
            assert_eq!(bits(&ask(&built_in(name), &asked[0])), fresh[0], "{name} {level:?}: prepared anew");
            assert_ne!(fresh[0], fresh[1], "different requests have different answers");
        }
    }
}
