//! That an effect which is off costs nothing: instructions of one prediction that leaves the effect out although the scene has it, against one on a
//! scene that has none of it and leaves the choice to `auto`.
//!
//! `cargo run --release -p retina-tests --bin effect_instructions` prints the table that the README shows. It needs valgrind (Linux), which it runs on itself
//! (`--tool=callgrind`) with one prediction and with two: the difference is one prediction, without the scene's preparation. Some minutes in all. It fails where the
//! two differ by more than [`ALLOWED`].

use std::error::Error;
use std::process::Command;

use nalgebra::{Point3, Unit, Vector3};
use retina_core::effects::{adhesion, contact, finite_strain, friction, inertia, pressure, viscoelasticity};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;

/// Largest difference, relative.
const ALLOWED: f64 = 0.01;
/// Radius of the needle (mm): 25G.
const RADIUS_MM: f64 = 0.257;
/// Force, leaning by about 20 degrees (mN).
const FORCE_MN: [f64; 3] = [0.3, 0.0, -0.8];
/// The line of callgrind's report that holds the count.
const COUNTED: &str = "Collected :";

/// One line of the table.
struct Case {
    effect: &'static str,
    /// What the scene has that the request leaves out.
    present: &'static str,
    has: fn(&mut Scene),
    /// What the other scene has instead.
    absent: &'static str,
    has_not: fn(&mut Scene),
}

const CASES: [Case; 5] = [
    Case {
        effect: friction::NAME,
        present: "µ = 0.3",
        has: |scene| scene.friction_coefficient = 0.3,
        absent: "µ = 0",
        has_not: |_| {},
    },
    Case {
        effect: pressure::NAME,
        present: "2 kPa above rest",
        has: |scene| scene.pressure_kpa = scene.rest_pressure_kpa + 2.0,
        absent: "pressure of rest",
        has_not: |_| {},
    },
    Case {
        effect: adhesion::NAME,
        present: "a bond of 1 kPa",
        has: |scene| scene.tissue.bond.strength_kpa = 1.0,
        absent: "a bond of 100 kPa",
        has_not: |scene| scene.tissue.bond.strength_kpa = 100.0,
    },
    Case {
        effect: viscoelasticity::NAME,
        present: "seven relaxation terms",
        has: |_| {},
        absent: "an elastic retina",
        has_not: |scene| scene.tissue.rate.retina_relaxation.clear(),
    },
    Case {
        effect: inertia::NAME,
        present: "drag of the vitreous",
        has: |_| {},
        absent: "no drag",
        has_not: |scene| scene.tissue.rate.vitreous_drag_kpa_s_per_mm = 0.0,
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [case, side, count] = &arguments[..] {
        return predict(&CASES[case.parse::<usize>()?], side == "present", count.parse()?);
    }
    println!(
        "| effect | the scene has it, the request leaves it out | instructions | the scene has none, `auto` | instructions | difference % |"
    );
    println!("|---|---|---|---|---|---|");
    let mut largest: f64 = 0.0;
    for (index, case) in CASES.iter().enumerate() {
        let [present, absent] = ["present", "absent"].map(|side| -> Result<f64, Box<dyn Error>> {
            Ok(instructions(index, side, 2)? - instructions(index, side, 1)?)
        });
        let (present, absent) = (present?, absent?);
        let difference = present / absent - 1.0;
        largest = largest.max(difference.abs());
        println!(
            "| `{}` | {} | {present:.0} | {} | {absent:.0} | {:+.3} |",
            case.effect,
            case.present,
            case.absent,
            100.0 * difference
        );
    }
    if largest > ALLOWED {
        return Err(format!("an effect that is off costs {:.2} % of a prediction", 100.0 * largest).into());
    }
    Ok(())
}

/// Instructions of a run with `count` predictions.
fn instructions(case: usize, side: &str, count: usize) -> Result<f64, Box<dyn Error>> {
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args([case.to_string(), side.to_owned(), count.to_string()])
        .output()
        .map_err(|error| format!("valgrind cannot be run ({error}); it is needed here, and Linux with it"))?;
    let text = String::from_utf8_lossy(&run.stderr).into_owned();
    let counted = text.lines().find_map(|line| line.split_once(COUNTED)).map(|(_, count)| count.trim().parse());
    match counted {
        Some(Ok(count)) if run.status.success() => Ok(count),
        _ => Err(text.into()),
    }
}

/// What is counted: `count` predictions.
fn predict(case: &Case, present: bool, count: usize) -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::built_in("macula").ok_or("no such scene")?;
    if present {
        (case.has)(&mut scene)
    } else {
        (case.has_not)(&mut scene)
    };
    let scene = PreparedScene::new(scene)?;
    let without = [finite_strain::NAME, contact::NAME].map(str::to_owned).to_vec();
    let effects = if present { EffectChoice::Named(without) } else { EffectChoice::Auto };
    let force = Vector3::from(FORCE_MN);
    let shape = NeedleShape::hemispherical(RADIUS_MM);
    let needle = Needle::pointing(shape, Point3::new(0.0, 0.0, 0.1), &Unit::new_normalize(force));
    let request = Request { needle, control: Control::Force(force), level: Level::Coarse, effects };
    let mut workspace = Workspace::default();
    for _ in 0..count {
        scene.predict(&request, &mut workspace, &mut Silent)?;
    }
    Ok(())
}
