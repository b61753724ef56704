//! Whether `auto` may be trusted: random scenes over the whole ranges at level `coarse`, the effects that `auto` chooses against all of them.
//!
//! `cargo run --release -p retina-tests --bin effect_audit [-- SCENES [SEED]]` writes `docs/effect_audit.md` and `docs/effect_audit.svg`. What is known is kept in
//! `target/effect_audit-SEED.jsonl`, so an interrupted run goes on where it stopped. A scene is drawn until the needle presses and no limit refuses it.
//!
//! `-- show SEED INDEX` prints scene, request and comparison of one.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::Write as _;

use indicatif::{ProgressBar, ProgressStyle};
use retina_core::comparison::quantile;
use retina_core::effects::EFFECT_NAMES;
use retina_core::predict::choice::AUTO_TOLERANCE_UM;
use retina_core::predict::{ContactState, Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_tests::audit::chart::svg;
use retina_tests::audit::{Audited, Compared, Summary, compare};
use retina_tests::random_scene::{REQUEST_UNITS, RequestNumbers, SCENE_UNITS, SceneNumbers, units};
use serde::{Deserialize, Serialize};

/// Scenes unless told.
const SCENES: u64 = 300;
/// The seed unless told.
const SEED: u64 = 1;
/// Requests drawn for a tissue before it is given up.
const DRAWS: u64 = 64;
/// The streams that scenes and requests are drawn from.
const STREAMS: [u64; 2] = [3, 4];
/// Strength of the bond (kPa) that counts as weak: what a needle can exert by shear.
const WEAK_KPA: f64 = 5.0;
/// Where the report goes.
const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs");

#[derive(Serialize, Deserialize)]
struct Line {
    scene: u64,
    audited: Audited,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut workspaces: [Workspace; 2] = Default::default();
    if let [word, seed, index] = &arguments[..]
        && word == "show"
    {
        let (scene, request) = draw(seed.parse()?, index.parse()?)?;
        println!("{}\n{}", serde_json::to_string(&scene)?, serde_json::to_string(&request)?);
        println!("{:#?}", audit(&scene, &request, &mut workspaces)?);
        return Ok(());
    }
    let scenes: u64 = arguments.first().map_or(Ok(SCENES), |a| a.parse())?;
    let seed: u64 = arguments.get(1).map_or(Ok(SEED), |a| a.parse())?;
    let path = format!("{}/../target/effect_audit-{seed}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let mut known: BTreeMap<u64, Audited> = BTreeMap::new();
    for line in fs::read_to_string(&path).unwrap_or_default().lines() {
        // A line cut short by an interruption is asked again.
        if let Ok(line) = serde_json::from_str::<Line>(line) {
            known.insert(line.scene, line.audited);
        }
    }
    let mut journal = OpenOptions::new().create(true).append(true).open(&path)?;
    let bar = ProgressBar::new(scenes).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {eta}")?);
    for index in 0..scenes {
        if let std::collections::btree_map::Entry::Vacant(place) = known.entry(index) {
            let (scene, request) = draw(seed, index)?;
            let audited = audit(&scene, &request, &mut workspaces)?;
            // A line of its own even after one cut short.
            writeln!(journal, "\n{}", serde_json::to_string(&Line { scene: index, audited: audited.clone() })?)?;
            place.insert(audited);
        }
        bar.inc(1);
    }
    bar.finish();
    known.retain(|index, _| *index < scenes);
    let (report, chart) = report(&known, seed);
    print!("{report}");
    fs::write(format!("{DOCS}/effect_audit.md"), report)?;
    fs::write(format!("{DOCS}/effect_audit.svg"), chart)?;
    Ok(())
}

/// Scene and request of number `index`: the first of a random tissue that level `linear` answers with a contact.
fn draw(seed: u64, index: u64) -> Result<(SceneNumbers, RequestNumbers), Box<dyn Error>> {
    for tissue in 0.. {
        let numbers = SceneNumbers::draw(&units(seed, STREAMS[0], index + (tissue << 32), SCENE_UNITS));
        let scene = PreparedScene::new(numbers.scene())?;
        for draw in 0..DRAWS {
            let request = RequestNumbers::draw(
                &units(seed, STREAMS[1], index + (tissue << 32) + (draw << 48), REQUEST_UNITS),
                &numbers,
            );
            let asked = Request { effects: Default::default(), ..request.request(Level::Linear) };
            let answer = scene.predict(&asked, &mut Workspace::default(), &mut Silent);
            if answer.is_ok_and(|answer| answer.contact.state != ContactState::Clear) {
                return Ok((numbers, request));
            }
        }
    }
    Err("no scene".into())
}

fn audit(
    numbers: &SceneNumbers,
    request: &RequestNumbers,
    workspaces: &mut [Workspace; 2],
) -> Result<Audited, Box<dyn Error>> {
    let scene = PreparedScene::new(numbers.scene())?;
    let outcome = compare(&scene, &request.request(Level::Coarse), workspaces);
    let [rest, now] = numbers.pressures_kpa;
    let tip = match (request.edge_radius_mm, request.bevel_deg) {
        (None, _) => "round tip",
        (_, None) => "flat tip",
        _ => "bevelled tip",
    };
    let rough = if numbers.friction_coefficient > 0.0 { "µ above 0" } else { "µ = 0" };
    let pressed = if now == rest { "pressure of rest" } else { "pressure changed" };
    let bond = if numbers.bond[0] < WEAK_KPA { "bond below 5 kPa" } else { "bond above 5 kPa" };
    Ok(Audited { classes: [tip, rough, pressed, bond].map(str::to_owned).to_vec(), outcome })
}

fn report(audited: &BTreeMap<u64, Audited>, seed: u64) -> (String, String) {
    let compared: Vec<(&u64, &Audited, &Compared)> =
        audited.iter().filter_map(|(index, one)| Some((index, one, one.outcome.as_ref().ok()?))).collect();
    let everything: Vec<&Compared> = compared.iter().map(|(_, _, one)| *one).collect();
    let mut classes: Vec<&String> = audited.values().flat_map(|one| &one.classes).collect();
    classes.sort();
    classes.dedup();
    let of = |name: &str| {
        let here = compared.iter().filter(|(_, one, _)| one.classes.iter().any(|class| class == name));
        Summary::new(name, &here.map(|(_, _, one)| *one).collect::<Vec<_>>(), AUTO_TOLERANCE_UM)
    };
    let summaries: Vec<Summary> = Summary::new("all scenes", &everything, AUTO_TOLERANCE_UM)
        .into_iter()
        .chain(classes.iter().filter_map(|name| of(name)))
        .collect();
    let mut text = format!(
        "# `auto` against `all`\n\nWritten by `cargo run --release -p retina-tests --bin effect_audit -- {} {seed}`; not by hand. Level `coarse`, one thread, both ways in \
         turn, a short answer the second time it is asked. Times are those on the processor, on a busy machine: read their ratios. The tolerance is {AUTO_TOLERANCE_UM} µm.\n\n\
         ![Errors and costs](effect_audit.svg)\n\n## By class of scene\n\n\
         | scenes with | compared | within the tolerance | worst node, multiples of it | `auto` ms | `all` ms | `auto` / `all` |\n|---|---|---|---|---|---|---|\n",
        audited.len()
    );
    for summary in &summaries {
        let [auto, all] = summary.milliseconds;
        let _ = writeln!(
            text,
            "| {} | {} | {:.1} % | {:.2} | {auto:.1} | {all:.1} | {:.2} |",
            summary.name,
            summary.scenes,
            100.0 * summary.within,
            summary.worst,
            auto / all
        );
    }
    effects(&mut text, &everything);
    without(&mut text, audited, &compared);
    let multiples: Vec<f64> = everything.iter().map(|one| one.worst_um / AUTO_TOLERANCE_UM).collect();
    (text, svg(&multiples, &summaries))
}

/// What leaving each effect out has cost.
fn effects(text: &mut String, everything: &[&Compared]) {
    text.push_str(
        "\n## By effect\n\nAdded to what `auto` took, the effect that it left out moves the worst node by:\n\n\
         | effect | taken by both | left out by `auto` | median µm | p95 µm | largest µm | beyond the tolerance | no answer with it |\n|---|---|---|---|---|---|---|---|\n",
    );
    for name in EFFECT_NAMES {
        let taken = everything.iter().filter(|one| one.taken.iter().any(|t| t == name)).count();
        let left: Vec<Option<f64>> = everything
            .iter()
            .flat_map(|one| one.left_out.iter().filter(|left| left.name == name).map(|left| left.moved_um))
            .collect();
        if taken + left.len() == 0 {
            continue;
        }
        let moved: Vec<f64> = left.iter().copied().flatten().collect();
        let beyond = moved.iter().filter(|moved| **moved > AUTO_TOLERANCE_UM).count();
        let [median, most, all] = [0.5, 0.95, 1.0].map(|share| match moved.is_empty() {
            true => "–".to_owned(),
            false => format!("{:.3}", quantile(&moved, share)),
        });
        let _ = writeln!(
            text,
            "| `{name}` | {taken} | {} | {median} | {most} | {all} | {beyond} | {} |",
            left.len(),
            left.len() - moved.len()
        );
    }
}

/// Scenes that could not be compared, and those furthest off.
fn without(text: &mut String, audited: &BTreeMap<u64, Audited>, compared: &[(&u64, &Audited, &Compared)]) {
    let mut causes: BTreeMap<&str, Vec<&u64>> = BTreeMap::new();
    for (index, one) in audited {
        if let Err(cause) = &one.outcome {
            causes.entry(cause).or_default().push(index);
        }
    }
    text.push_str("\n## Not compared\n\n| why | scenes | which |\n|---|---|---|\n");
    for (cause, scenes) in causes {
        let shown: Vec<String> = scenes.iter().take(8).map(|index| index.to_string()).collect();
        let _ = writeln!(text, "| {cause} | {} | {} |", scenes.len(), shown.join(", "));
    }
    let mut worst: Vec<&(&u64, &Audited, &Compared)> = compared.iter().collect();
    worst.sort_by(|a, b| b.2.worst_um.total_cmp(&a.2.worst_um));
    text.push_str("\n## Furthest off\n\n| scene | classes | worst node µm | largest displacement µm | left out, what each moves µm, and its number over its threshold | damage of the bond by `all` |\n|---|---|---|---|---|---|\n");
    for (index, one, found) in worst.iter().take(10) {
        let left: Vec<String> = found
            .left_out
            .iter()
            .map(|left| {
                let moved = left.moved_um.map_or("–".to_owned(), |moved| format!("{moved:.2}"));
                format!("`{}` {moved} (called for {:.2})", left.name, left.called)
            })
            .collect();
        let _ = writeln!(
            text,
            "| {index} | {} | {:.2} | {:.1} | {} | {} |",
            one.classes.join(", "),
            found.worst_um,
            found.moved_um,
            left.join(", "),
            found.bond_damage.map_or("–".to_owned(), |damage| format!("{damage:.2}"))
        );
    }
}
