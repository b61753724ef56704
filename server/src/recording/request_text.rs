//! Requests and what became of them as text (Markdown).
//!
//! Contract: the JSON of a sample is a request that `POST /v1/predict` takes and answers as the sample was answered. Units stand
//! beside every number.

use std::fmt::Write as _;

use nalgebra::Vector3;
use retina_core::needle::Tip;
use retina_core::needle::shaft::STIFFNESS;
use retina_core::predict::{Control, Level, Prediction, Request};
use serde_json::{Value, json};

use super::Exchange;
use crate::review::{Compared, Sample};

/// A sample: how far off the prediction is, the two answers in a table, the request.
pub fn sample(sample: &Sample) -> String {
    let level = sample.request.level.name();
    let truth = Level::Reference.name();
    let mut text = format!("# Sample {}: `{level}` beside `{truth}`\n", sample.index);
    let _ = writeln!(text, "{} on `{}`\n", needle_words(&sample.request), sample.scene);
    match &sample.outcome {
        Ok(Compared { predicted, truth, statistics, .. }) => {
            let largest_um = truth.prediction.displacement_um.iter().copied().fold(0.0, f64::max);
            let share = 100.0 * statistics.max_um / largest_um;
            let _ = writeln!(
                text,
                "**`{level}` is off by {:.2} µm on average, {:.2} µm at the worst node** (p99 {:.2} µm), where the retina moves by up to \
                 {largest_um:.1} µm: the worst is {share:.1} % of that.\n",
                statistics.mean_um, statistics.max_um, statistics.p99_um
            );
            let (a, b) = (&predicted.prediction, &truth.prediction);
            let _ = writeln!(text, "| | predicted | ground truth |\n|---|---|---|");
            let mut row = |name: &str, a: String, b: String| {
                let _ = writeln!(text, "| {name} | {a} | {b} |");
            };
            let time = |seconds: f64| {
                if seconds < 0.1 { format!("{:.2} ms", seconds * 1e3) } else { format!("{seconds:.2} s") }
            };
            row("time", time(predicted.took.as_secs_f64()), time(truth.took.as_secs_f64()));
            row("Newton iterations", a.solver.iterations.to_string(), b.solver.iterations.to_string());
            let both = |of: fn(&Prediction) -> f64| (format!("{:.4}", of(a)), format!("{:.4}", of(b)));
            for (name, of) in NUMBERS {
                let (a, b) = both(of);
                row(name, a, b);
            }
        }
        Err(failure) => {
            let _ = writeln!(
                text,
                "**No comparison:** level `{}` says: {}\n",
                failure.level.name(),
                failure.problem.detail
            );
        }
    }
    let _ = writeln!(text, "\n## The request\n\n```json\n{}\n```", request_json(&sample.scene, &sample.request));
    text
}

/// The question in a line.
fn needle_words(request: &Request) -> String {
    let needle = &request.needle;
    let tip = match needle.shape.tip {
        Tip::Hemispherical => "hemispherical",
        Tip::Flat { .. } => "flat",
        Tip::Bevelled { .. } => "bevelled",
    };
    let tilt_deg = needle.direction().angle(&-Vector3::z()).to_degrees();
    let asked = match request.control {
        Control::Force(force_mn) => format!("pushed with {:.3} mN", force_mn.norm()),
        Control::Pose => "held where it is".to_owned(),
    };
    format!("A {tip} needle of {:.3} mm radius, tilted by {tilt_deg:.0}°, {asked}", needle.shape.radius_mm)
}

/// A number of an answer, with its name and unit.
type Number = (&'static str, fn(&Prediction) -> f64);

/// What a table says of an answer besides its cost.
const NUMBERS: [Number; 5] = [
    ("travel (mm)", |answer| answer.needle.travel_mm),
    ("reaction (mN)", |answer| answer.needle.reaction_mn.norm()),
    ("contact area (mm²)", |answer| answer.contact.area_mm2),
    ("largest strain", |answer| answer.contact.max_strain),
    ("largest pressure (kPa)", |answer| answer.contact.max_pressure_kpa),
];

/// A request to a service: how it went, and its text.
pub fn exchange(exchange: &Exchange) -> String {
    let milliseconds = exchange.took.as_secs_f64() * 1e3;
    let mut text = format!("# Request {}\n", exchange.number);
    match &exchange.outcome {
        Ok((_, prediction)) => {
            let largest_um = prediction.displacement_um.iter().copied().fold(0.0, f64::max);
            let level = prediction.level.name();
            let _ =
                writeln!(text, "**`{level}`: the retina moves by up to {largest_um:.1} µm** ({milliseconds:.2} ms)\n");
            let _ = writeln!(text, "| | |\n|---|---|");
            for (name, of) in NUMBERS {
                let _ = writeln!(text, "| {name} | {:.4} |", of(prediction));
            }
            for warning in &prediction.warnings {
                let _ = writeln!(text, "\nWarning: {warning}");
            }
        }
        Err(problem) => {
            let _ = writeln!(text, "**{}:** {} ({milliseconds:.2} ms)", problem.kind.name(), problem.detail);
        }
    }
    let _ = writeln!(text, "\n## Asked\n\n```json\n{}\n```", exchange.asked);
    text
}

/// The request as it crosses the wire, one line for each field.
fn request_json(scene: &str, request: &Request) -> String {
    let shape = &request.needle.shape;
    let tip = match shape.tip {
        Tip::Hemispherical => json!("hemispherical"),
        Tip::Flat { edge_radius_mm } => json!({"flat": {"edge_radius_mm": edge_radius_mm}}),
        Tip::Bevelled { angle_deg, edge_radius_mm } => {
            json!({"bevelled": {"angle_deg": angle_deg, "edge_radius_mm": edge_radius_mm}})
        }
    };
    let force = match request.control {
        Control::Force(force_mn) => ("force_mn", numbers(force_mn)),
        Control::Pose => ("control", json!("pose")),
    };
    let tip_mm = request.needle.tip_mm.coords;
    let orientation: [f64; 4] = request.needle.orientation.coords.into();
    format!(
        "{{\"scene\": {},\n \"needle\": {{\"tip_mm\": {},\n  \"orientation_xyzw\": {},\n  \"radius_mm\": {}, \"stiffness_mn_per_mm\": {}, \"tip\": {tip}}},\n \
         \"{}\": {},\n \"accuracy\": {{\"level\": \"{}\"}}}}",
        json!(scene),
        numbers(tip_mm),
        json!(orientation),
        shape.radius_mm,
        // On the wire a rigid shaft is one of the largest stiffness.
        request.needle.stiffness_mn_per_mm.unwrap_or(STIFFNESS.max),
        force.0,
        force.1,
        request.level.name()
    )
}

fn numbers(vector: Vector3<f64>) -> Value {
    json!([vector.x, vector.y, vector.z])
}
