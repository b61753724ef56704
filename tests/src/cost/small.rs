//! The small run: the levels and the quick knobs on the held-out sample, whose reference answers are stored.

use std::collections::HashMap;
use std::error::Error;

use retina_core::predict::{Level, Prediction, Workspace};

use super::contestant::{Contestant, contestants};
use super::measure::{Standing, Tally};
use crate::held_out::{HeldOut, PATH, prepare};

/// Knobs that cost no more than a few times level `coarse`.
const QUICK: [&str; 4] = ["level", "width", "tolerance", "contact"];

/// Everybody quick on every held-out request, each answer timed `repeats` times.
///
/// # Errors
/// If the sample cannot be read or a scene not prepared.
pub fn standings(repeats: usize) -> Result<Vec<Standing>, Box<dyn Error>> {
    let sample: HeldOut = serde_json::from_str(&std::fs::read_to_string(PATH)?)?;
    let mut scenes = HashMap::new();
    for stored in &sample.samples {
        if !scenes.contains_key(&stored.scene) {
            scenes.insert(stored.scene.clone(), prepare(&stored.scene)?);
        }
    }
    let motion = sample.samples.iter().flat_map(|stored| stored.reference_um.iter().flatten());
    let motion_um2: f64 = motion.map(|um| um * um).sum();
    let quick: Vec<Contestant> = contestants().into_iter().filter(|c| QUICK.contains(&c.knob)).collect();
    let mut workspace = Workspace::default();
    let standing = |contestant: &Contestant| {
        let mut tally = Tally::default();
        for stored in &sample.samples {
            let (scene, rest) = &scenes[&stored.scene];
            let errors = |answer: &Prediction| stored.errors_um(rest, answer);
            tally.add(contestant, (scene, &stored.request(Level::Linear)), errors, repeats, &mut workspace);
        }
        tally.standing(contestant, motion_um2)
    };
    Ok(quick.iter().map(standing).collect())
}
