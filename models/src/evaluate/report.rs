//! The whole evaluation as one Markdown text.

use std::fmt::Write as _;
use std::time::Instant;

use nalgebra::Vector3;
use retina_core::network::input::{Field, Input};
use retina_core::scene::Scene;

use super::baselines::kelvinlet::Kelvinlet;
use super::baselines::nearest::Nearest;
use super::baselines::pod::Pod;
use super::coverage::coverage;
use super::errors::{Errors, Mesh, mean, published_mean, quantile};
use super::predictors::{Coarse, Contact, Faithful, Linear, Predictor, Still};
use super::tables::{self, Row};
use crate::data::Data;
use crate::describe;
use crate::sample::{Sample, Split};

/// Gauges between whose radii the rows by needle lie (mm), with their names.
const NEEDLES: [(&str, f32); 3] = [("41G to 30G", 0.1555), ("30G to 25G", 0.257), ("25G to 23G", 1.0)];
/// Names of the tips.
pub const TIPS: [&str; 3] = ["half balls", "flat tips", "bevels"];
/// Batch of the published evaluation.
pub const PUBLISHED_BATCH: usize = 4;

/// Splits that are reported.
const REPORTED: [Split; 3] = [Split::Test, Split::Hard, Split::Outside];

fn truth(sample: &Sample) -> Field {
    sample.truth.displacement_mm.map(Vector3::from)
}

fn rows(predictors: &mut [Box<dyn Predictor>], samples: &[(&Sample, Input)], mesh: &Mesh) -> Vec<Row> {
    predictors
        .iter_mut()
        .map(|predictor| {
            let (mut errors, mut missing) = (Errors::default(), 0);
            for (sample, input) in samples {
                match predictor.displacement(sample, input) {
                    Some(answer) => errors.add(mesh, &input.rest_mm, &answer, &truth(sample)),
                    None => missing += 1,
                }
            }
            Row { name: predictor.name(), errors, missing }
        })
        .collect()
}

/// The text, given the networks that there are.
pub fn report(data: &Data, networks: Vec<Contact>, paper: Option<Faithful>) -> String {
    let mesh = Mesh::default();
    let train: Vec<&Sample> = data.of(Split::Train).collect();
    let mut predictors: Vec<Box<dyn Predictor>> = vec![Box::new(Still), Box::new(Kelvinlet::new(&train))];
    predictors.extend(paper.map(|paper| Box::new(paper) as Box<dyn Predictor>));
    predictors.extend([Box::new(Linear) as Box<dyn Predictor>, Box::new(Nearest::new(&train))]);
    predictors.extend(Pod::new(&train).map(|pod| Box::new(pod) as Box<dyn Predictor>));
    predictors.push(Box::new(Coarse));
    let mut text = String::new();
    let mut networks = networks;
    let split_samples = |split: Split| -> Vec<(&Sample, Input)> {
        data.of(split).map(|sample| (sample, describe::input(sample))).collect()
    };
    let counts: Vec<String> =
        Split::ALL.iter().map(|&split| format!("{} {}", split.name(), data.of(split).count())).collect();
    let _ = writeln!(text, "Samples: {}. SHA-256 of the shards: `{}`.\n", counts.join(", "), data.sha256);
    let truth_um: Vec<f64> = data.of(Split::Test).map(|sample| 1e3 * f64::from(sample.truth_error_mm)).collect();
    let _ = writeln!(
        text,
        "The truth's own estimated error (worst node against a finer mesh, test split): median {:.2} µm, 95 % {:.2} µm.\n",
        quantile(&truth_um, 0.5),
        quantile(&truth_um, 0.95)
    );
    let coverage = coverage(&mut networks, &REPORTED.map(|split| (split, split_samples(split))));
    let motion = motion(&mut networks, &split_samples(Split::Test));
    predictors.extend(networks.into_iter().map(|network| Box::new(network) as Box<dyn Predictor>));
    for split in REPORTED {
        let samples = split_samples(split);
        if samples.is_empty() {
            continue;
        }
        let rows = rows(&mut predictors, &samples, &mesh);
        let still = &rows[0].errors;
        let _ = writeln!(
            text,
            "## Split `{}`: {} samples, RMS displacement {:.1} µm, largest per sample: median {:.1} µm\n\n{}",
            split.name(),
            still.samples(),
            still.motion_um(),
            quantile(still.worst_um(), 0.5),
            tables::errors(&rows)
        );
        if split == Split::Test {
            let _ = writeln!(
                text,
                "## Test split by scene, tip and needle: MAE / p99 µm / % of RMS displacement\n\n{}",
                groups(&mut predictors, &samples, &mesh)
            );
        }
    }
    let _ = writeln!(text, "## The expected error of the worst node\n\n{coverage}");
    let _ = writeln!(text, "## Travel and reaction, test split\n\n{motion}");
    text.push_str(&published(&mut predictors, &split_samples(Split::Test)));
    text
}

/// Which samples a row of the table counts.
type Wanted = Box<dyn Fn(&Sample) -> bool>;

fn groups(predictors: &mut [Box<dyn Predictor>], samples: &[(&Sample, Input)], mesh: &Mesh) -> String {
    let names: Vec<String> = predictors.iter().map(|p| p.name()).collect();
    let scenes = Scene::built_in_names().iter().enumerate();
    let mut wanted: Vec<(String, Wanted)> = Vec::new();
    for (at, scene) in scenes {
        wanted.push(((*scene).to_owned(), Box::new(move |sample| usize::from(sample.scene) == at)));
    }
    for (at, tip) in TIPS.iter().enumerate() {
        wanted.push(((*tip).to_owned(), Box::new(move |sample| usize::from(sample.tip.kind) == at)));
    }
    let mut thinnest = 0.0;
    for (name, thickest) in NEEDLES {
        let range = thinnest..thickest;
        wanted.push((name.to_owned(), Box::new(move |sample| range.contains(&sample.tip.radius_mm))));
        thinnest = thickest;
    }
    let groups: Vec<(String, usize, f64, Vec<Errors>)> = wanted
        .into_iter()
        .filter_map(|(name, belongs)| {
            let chosen: Vec<(&Sample, Input)> =
                samples.iter().filter(|(sample, _)| belongs(sample)).map(|(s, input)| (*s, input.clone())).collect();
            let rows = rows(predictors, &chosen, mesh);
            let motion_um = rows.first()?.errors.motion_um();
            (!chosen.is_empty())
                .then(|| (name, chosen.len(), motion_um, rows.into_iter().map(|row| row.errors).collect()))
        })
        .collect();
    tables::by_group(&names, &groups)
}

/// Errors of travel and reaction, and the time that a prediction takes.
fn motion(networks: &mut [Contact], samples: &[(&Sample, Input)]) -> String {
    let mut text = String::from(
        "| | travel: MAE / p95 µm | reaction across the force: mean % of the force | one prediction after its start, median ms |\n|---|---|---|---|\n",
    );
    let mut line = |name: &str, answers: Vec<Option<(f32, Vector3<f32>)>>, milliseconds: Option<f64>| {
        let (mut travels, mut reactions) = (Vec::new(), Vec::new());
        for ((sample, input), answer) in samples.iter().zip(answers) {
            let Some((travel_mm, reaction)) = answer else { continue };
            travels.push(f64::from((travel_mm - sample.truth.travel_mm).abs()) * 1e3);
            let off = reaction - Vector3::from(sample.truth.reaction_mn);
            let across = off - input.direction * off.dot(&input.direction);
            reactions.push(100.0 * f64::from(across.norm() / sample.force_mn));
        }
        let time = milliseconds.map_or("–".to_owned(), |ms| format!("{ms:.3}"));
        let (travel, p95) = (mean(&travels), quantile(&travels, 0.95));
        let _ = writeln!(text, "| {name} | {travel:.2} / {p95:.2} | {:.2} | {time} |", mean(&reactions));
    };
    let of = |answer: &retina_core::network::input::Answer| Some((answer.travel_mm, answer.reaction_mn));
    line("`linear`", samples.iter().map(|(_, input)| of(&input.linear)).collect(), None);
    line("`coarse`", samples.iter().map(|(_, input)| input.coarse.as_ref().and_then(of)).collect(), None);
    for network in networks {
        let mut milliseconds = Vec::new();
        let answers = samples
            .iter()
            .map(|(_, input)| {
                let start = Instant::now();
                let answer = network.answer(input);
                milliseconds.push(start.elapsed().as_secs_f64() * 1e3);
                answer.and_then(|corrected| of(&corrected.answer))
            })
            .collect();
        line(&network.name(), answers, Some(quantile(&milliseconds, 0.5)));
    }
    text
}

/// What the published way of averaging would have said.
fn published(predictors: &mut [Box<dyn Predictor>], samples: &[(&Sample, Input)]) -> String {
    let mut text = String::from(
        "## The published mean\n\nThe public evaluation divides the last batch's mean by the number of batches. On the test split it would have said:\n\n| | MAE µm | by the published formula µm |\n|---|---|---|\n",
    );
    for predictor in predictors {
        let mut errors = Vec::new();
        for (sample, input) in samples {
            let Some(answer) = predictor.displacement(sample, input) else { continue };
            let off = answer.iter().zip(truth(sample)).map(|(a, t)| f64::from((a - t).norm()) * 1e3);
            errors.push(off.sum::<f64>() / answer.len() as f64);
        }
        let published = published_mean(&errors, PUBLISHED_BATCH);
        let _ = writeln!(text, "| {} | {:.2} | {published:.4} |", predictor.name(), mean(&errors));
    }
    text
}
