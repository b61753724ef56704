//! What a review found, in numbers.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use retina_core::comparison::{ErrorStatistics, quantile};

use super::{Compared, Sample};
use crate::config::ReviewArgs;

/// Counts and statistics over the samples of a review.
#[derive(Clone, Debug)]
pub struct Tally {
    title: String,
    errors_um: Vec<f64>,
    largest_um: Vec<f64>,
    milliseconds: Vec<f64>,
    failures: BTreeMap<String, usize>,
    refused: BTreeMap<&'static str, usize>,
    interrupted: bool,
}

impl Tally {
    /// Nothing is compared yet.
    pub fn new(args: &ReviewArgs) -> Self {
        Self {
            title: format!("{}, seed {}, `{}` beside `reference`", args.scene, args.seed, args.level.name()),
            errors_um: Vec::new(),
            largest_um: Vec::new(),
            milliseconds: Vec::new(),
            failures: BTreeMap::new(),
            refused: BTreeMap::new(),
            interrupted: false,
        }
    }

    /// One sample more.
    pub fn add(&mut self, sample: &Sample) {
        match &sample.outcome {
            Ok(Compared { predicted, truth, errors_um, .. }) => {
                self.errors_um.extend(errors_um);
                self.largest_um.push(truth.prediction.displacement_um.iter().copied().fold(0.0, f64::max));
                self.milliseconds.push(predicted.took.as_secs_f64() * 1e3);
            }
            Err(failure) => {
                let cause = format!("{} at level `{}`", failure.problem.kind.name(), failure.level.name());
                *self.failures.entry(cause).or_default() += 1;
            }
        }
    }

    /// The review was stopped before its end.
    pub fn interrupted(&mut self) {
        self.interrupted = true;
    }

    /// Requests that were drawn again, by the kind of problem.
    pub fn refused(&mut self, refused: BTreeMap<&'static str, usize>) {
        self.refused = refused;
    }

    /// Samples with both answers.
    pub fn compared(&self) -> usize {
        self.largest_um.len()
    }

    /// Samples without, by level and cause.
    pub fn failures(&self) -> &BTreeMap<String, usize> {
        &self.failures
    }

    /// The errors so far in a few words.
    pub fn so_far(&self) -> String {
        let ErrorStatistics { mean_um, max_um, .. } = ErrorStatistics::new(&self.errors_um);
        let failed: usize = self.failures.values().sum();
        format!("error mean {mean_um:.2} µm, worst {max_um:.2} µm, {failed} failed")
    }
}

impl Display for Tally {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let ErrorStatistics { mean_um, p99_um, max_um } = ErrorStatistics::new(&self.errors_um);
        let ended = if self.interrupted { " (interrupted)" } else { "" };
        writeln!(formatter, "{}: {} samples{ended}", self.title, self.compared())?;
        if self.compared() > 0 {
            writeln!(formatter, "node error: mean {mean_um:.2} µm, p99 {p99_um:.2} µm, worst {max_um:.2} µm")?;
            let [median_um, most_um] = [0.5, 1.0].map(|share| quantile(&self.largest_um, share));
            writeln!(formatter, "largest displacement of a sample: median {median_um:.1} µm, at most {most_um:.1} µm")?;
            let [median_ms, most_ms] = [0.5, 1.0].map(|share| quantile(&self.milliseconds, share));
            writeln!(formatter, "time of the level: median {median_ms:.2} ms, at most {most_ms:.2} ms")?;
        }
        for (cause, count) in &self.failures {
            writeln!(formatter, "failed: {count} × {cause}")?;
        }
        let refused: Vec<String> = self.refused.iter().map(|(cause, count)| format!("{count} × {cause}")).collect();
        write!(formatter, "drawn again: {}", if refused.is_empty() { "none".to_owned() } else { refused.join(", ") })
    }
}
