//! `auto` against everything switched on, on one scene: the error of the worst node, what each costs, and what each effect that was left out would
//! have changed.
//!
//! Not here: drawing the scenes (`random_scene`), the tables and the chart (`bin/effect_audit`).

pub mod chart;

use std::fs;
use std::time::Instant;

use retina_core::comparison::node_errors_um;
use retina_core::effects::{EFFECT_NAMES, elasticity};
use retina_core::predict::{EffectChoice, Level, PredictError, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use serde::{Deserialize, Serialize};

use crate::laws::{cause, is_simulated};

/// One scene asked both ways.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Audited {
    /// What kind of scene it is: the names of the classes that it belongs to.
    pub classes: Vec<String>,
    /// Both answers compared, or why one is missing.
    pub outcome: Result<Compared, String>,
}

/// Two answers to one request.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Compared {
    /// Distance of the worst node between `auto` and `all` (µm).
    pub worst_um: f64,
    /// Largest displacement by `all` (µm).
    pub moved_um: f64,
    /// Time of each on the processor, `auto` first (ms).
    pub milliseconds: [f64; 2],
    /// Newton iterations of each.
    pub iterations: [usize; 2],
    /// Largest share of its strength that the retina's bond has lost by `all`, where it can part: a bond that has lost none moves nothing.
    pub bond_damage: Option<f64>,
    /// Each effect that `auto` left out and `all` simulated.
    pub left_out: Vec<LeftOut>,
    /// Each effect that both simulated.
    pub taken: Vec<String>,
}

/// An effect that `auto` left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// How far the worst node moves when it is added to what `auto` took (µm); none where that has no answer.
    pub moved_um: Option<f64>,
    /// The number that `auto` decided on over its threshold.
    pub called: f64,
}

/// What a class of scenes came to.
pub struct Summary {
    /// Its name.
    pub name: String,
    /// Number of scenes compared.
    pub scenes: usize,
    /// Share of scenes whose worst node is within the tolerance.
    pub within: f64,
    /// The worst node of all, in multiples of the tolerance.
    pub worst: f64,
    /// Mean time with `auto` and with `all` (ms).
    pub milliseconds: [f64; 2],
}

impl Summary {
    /// Of these comparisons; none for none.
    pub fn new(name: &str, compared: &[&Compared], tolerance_um: f64) -> Option<Self> {
        let count = compared.len() as f64;
        let mean = |which: usize| compared.iter().map(|one| one.milliseconds[which]).sum::<f64>() / count;
        let within = compared.iter().filter(|one| one.worst_um <= tolerance_um).count() as f64;
        (!compared.is_empty()).then(|| Summary {
            name: name.to_owned(),
            scenes: compared.len(),
            within: within / count,
            worst: compared.iter().map(|one| one.worst_um / tolerance_um).fold(0.0, f64::max),
            milliseconds: [mean(0), mean(1)],
        })
    }
}

fn worst_um(a: &Prediction, b: &Prediction) -> f64 {
    node_errors_um(&a.vertices, &b.vertices).into_iter().fold(0.0, f64::max)
}

/// Longest time of which a second run is made (ms): a short one is mostly warming up.
const SHORT_MS: f64 = 30.0;

/// Time that this thread has spent on a processor so far, where the system tells (Linux), else the time of day, both from some beginning (ms): work beside
/// this counts in the second alone.
fn spent_ms(begun: &Instant) -> f64 {
    let told = fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| begun.elapsed().as_secs_f64() * 1e3, |ns| ns * 1e-6)
}

/// The answer with `effects` and its time (ms), of a short one the second.
fn timed(
    scene: &PreparedScene,
    request: &Request,
    effects: EffectChoice,
    workspace: &mut Workspace,
) -> Result<(Prediction, f64), PredictError> {
    let asked = Request { effects, ..request.clone() };
    let mut run = || -> Result<(Prediction, f64), PredictError> {
        let begun = Instant::now();
        let start_ms = spent_ms(&begun);
        let answer = scene.predict(&asked, workspace, &mut Silent)?;
        Ok((answer, spent_ms(&begun) - start_ms))
    };
    let first = run()?;
    if first.1 > SHORT_MS { Ok(first) } else { run() }
}

/// Asks `request` with `auto` and with `all`; each has a workspace of its own, as a service's threads would.
pub fn compare(scene: &PreparedScene, request: &Request, workspaces: &mut [Workspace; 2]) -> Result<Compared, String> {
    let [mine, other] = workspaces;
    // The scene's beds are made by the first request, whichever that is.
    let _ = scene.predict(&Request { level: Level::Linear, ..request.clone() }, mine, &mut Silent);
    let named = |which: &str, error: PredictError| format!("`{which}`: {}", cause(&error).1);
    let auto = timed(scene, request, EffectChoice::Auto, mine).map_err(|error| named("auto", error))?;
    let all = timed(scene, request, EffectChoice::All, other).map_err(|error| named("all", error))?;
    let (auto, all, milliseconds) = (auto.0, all.0, [auto.1, all.1]);
    let simulated = |answer: &Prediction| -> Vec<&str> {
        EFFECT_NAMES.iter().copied().filter(|name| is_simulated(answer, name)).collect()
    };
    let (in_auto, in_all) = (simulated(&auto), simulated(&all));
    let missing: Vec<&str> = in_all.iter().copied().filter(|name| !in_auto.contains(name)).collect();
    let mut left_out = Vec::new();
    for name in &missing {
        let decision = auto.effects.iter().find(|effect| effect.name == *name);
        let called = decision.and_then(|effect| Some(effect.value? / effect.threshold?)).unwrap_or(f64::NAN);
        // The only one that is missing makes all of the difference.
        let moved_um = if missing.len() == 1 {
            Some(worst_um(&auto, &all))
        } else {
            let solid_only = |n: &&str| *n != elasticity::NAME || !in_auto.contains(&"finite_strain");
            let names = in_auto.iter().copied().filter(solid_only).chain([*name]).map(str::to_owned).collect();
            let asked = Request { effects: EffectChoice::Named(names), ..request.clone() };
            scene.predict(&asked, other, &mut Silent).ok().map(|with| worst_um(&auto, &with))
        };
        left_out.push(LeftOut { name: (*name).to_owned(), moved_um, called });
    }
    Ok(Compared {
        worst_um: worst_um(&auto, &all),
        moved_um: all.displacement_um.iter().copied().fold(0.0, f64::max),
        milliseconds,
        iterations: [auto.solver.iterations, all.solver.iterations],
        bond_damage: all.contact.bond_damage,
        left_out,
        taken: in_auto.iter().filter(|name| in_all.contains(*name)).map(|name| (*name).to_owned()).collect(),
    })
}
