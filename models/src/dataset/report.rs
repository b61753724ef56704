//! What a data set is worth: how far the surface moves, and how far off the cheap answers are.

use retina_core::comparison::quantile;

use crate::sample::{Field, NODES, Sample, Split};

/// Length of the longest vector of a field (µm).
pub fn largest_um(field: &Field) -> f64 {
    field.iter().map(length_um).fold(0.0, f64::max)
}

fn length_um(vector: &[f32; 3]) -> f64 {
    1e3 * vector.iter().map(|&c| f64::from(c).powi(2)).sum::<f64>().sqrt()
}

/// Largest distance of a node between two fields (µm).
pub fn distance_um(a: &Field, b: &Field) -> f64 {
    a.iter().zip(b).map(|(a, b)| length_um(&std::array::from_fn(|k| a[k] - b[k]))).fold(0.0, f64::max)
}

/// Node distances of `answer` to the truth of many samples.
#[derive(Default)]
struct Errors {
    nodes_um: Vec<f64>,
    worst_um: Vec<f64>,
}

impl Errors {
    fn add(&mut self, truth: &Field, answer: &Field) {
        let mut worst = 0.0_f64;
        for node in 0..NODES {
            let error = length_um(&std::array::from_fn(|k| truth[node][k] - answer[node][k]));
            worst = worst.max(error);
            self.nodes_um.push(error);
        }
        self.worst_um.push(worst);
    }

    fn rms_um(&self) -> f64 {
        (self.nodes_um.iter().map(|e| e * e).sum::<f64>() / self.nodes_um.len() as f64).sqrt()
    }
}

/// The report on `samples`, as Markdown.
pub fn report(samples: &[Sample]) -> String {
    let mut text = String::from(
        "| split | samples | paths | largest displacement µm: 5 % | 25 % | median | 75 % | 95 % | max | force mN: median | max |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for split in Split::ALL.map(Some).into_iter().chain([None]) {
        let of: Vec<&Sample> =
            samples.iter().filter(|sample| split.is_none_or(|split| sample.split == split)).collect();
        if of.is_empty() {
            continue;
        }
        let moved: Vec<f64> = of.iter().map(|sample| largest_um(&sample.truth.displacement_mm)).collect();
        let forces: Vec<f64> = of.iter().map(|sample| f64::from(sample.force_mn)).collect();
        let paths = of.chunk_by(|a, b| a.path == b.path).count();
        let at = [0.05, 0.25, 0.5, 0.75, 0.95, 1.0].map(|share| format!("{:.1}", quantile(&moved, share))).join(" | ");
        let (name, count) = (split.map_or("all", Split::name), of.len());
        text += &format!(
            "| {name} | {count} | {paths} | {at} | {:.3} | {:.3} |\n",
            quantile(&forces, 0.5),
            quantile(&forces, 1.0)
        );
    }
    text += "\n| answer | tip | samples | MAE µm | RMS µm | p99 node µm | worst node µm: median | 95 % | % of RMS displacement |\n|---|---|---|---|---|---|---|---|---|\n";
    let still = [[0.0; 3]; NODES];
    for (tip, kinds) in [("all", 0..=2), ("half ball", 0..=0), ("flat", 1..=1), ("bevelled", 2..=2)] {
        let of = || samples.iter().filter(|sample| kinds.contains(&sample.tip.kind));
        let mut nothing = Errors::default();
        of().for_each(|sample| nothing.add(&sample.truth.displacement_mm, &still));
        let mut linear = Errors::default();
        of().for_each(|sample| linear.add(&sample.truth.displacement_mm, &sample.linear.displacement_mm));
        let mut coarse = Errors::default();
        for (truth, answer) in of().filter_map(|sample| sample.coarse.map(|coarse| (sample.truth, coarse))) {
            coarse.add(&truth.displacement_mm, &answer.displacement_mm);
        }
        for (name, errors) in [("nothing moves", &nothing), ("`linear`", &linear), ("`coarse`", &coarse)] {
            text += &format!(
                "| {name} | {tip} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} |\n",
                errors.worst_um.len(),
                errors.nodes_um.iter().sum::<f64>() / errors.nodes_um.len() as f64,
                errors.rms_um(),
                quantile(&errors.nodes_um, 0.99),
                quantile(&errors.worst_um, 0.5),
                quantile(&errors.worst_um, 0.95),
                100.0 * errors.rms_um() / nothing.rms_um()
            );
        }
    }
    text
}
