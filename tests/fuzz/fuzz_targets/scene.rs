//! Scenes to be stored: what is understood has a content, and that content means the same scene and has the same name.

#![no_main]

use libfuzzer_sys::fuzz_target;
use retina_server::library::Id;
use retina_server::library::content::{content, scene};
use retina_server::read::read;
use retina_server::understand;
use retina_server::wire::SceneSpec;

fuzz_target!(|body: &[u8]| {
    let Ok(spec) = read::<SceneSpec>(body) else { return };
    let Ok(understood) = understand::scene(&spec) else { return };
    let stored = content(&understood, spec.pose.as_ref()).expect("numbers are finite");
    let again = scene(Id::of(&stored), &stored).expect("what is stored is understood");
    let spec = read::<SceneSpec>(&stored).expect("what is stored is read");
    assert_eq!(content(&again, spec.pose.as_ref()), Ok(stored), "what is stored again has the same name");
});
