//! How often what is promised about errors holds.

use retina_core::network::input::Input;
use retina_core::predict::{Level, expected_error};

use super::errors::quantile;
use super::predictors::{Contact, Predictor};
use crate::calibrate::{strain, worst_um};
use crate::describe;
use crate::sample::{Sample, Split};

/// How often the promised bounds hold, and whether the network knows that it does not know.
pub fn coverage(networks: &mut [Contact], splits: &[(Split, Vec<(&Sample, Input)>)]) -> String {
    let mut text = String::from(
        "| level | split | below the median, % | below the 95 % bound, % | median bound µm | called calibrated, % | of these below the bound, % |\n|---|---|---|---|---|---|---|\n",
    );
    for level in [Level::Linear, Level::Coarse] {
        for (split, samples) in splits {
            let mut tally = Tally::default();
            for (sample, _) in samples {
                let quantiles = expected_error::quantiles(level, usize::from(sample.tip.kind), strain(sample));
                let (Some(quantiles), Some(worst_um)) = (quantiles, worst_um(sample, level)) else { continue };
                let depth_um = f64::from(sample.linear_depth_mm) * 1e3;
                let bounds_um = [quantiles.median, quantiles.p95].map(|ratio| ratio * depth_um);
                tally.add(worst_um, bounds_um, sampled(*split));
            }
            text.push_str(&tally.row(&format!("`{}`", level.name()), *split));
        }
    }
    for network in networks {
        for (split, samples) in splits {
            let mut tally = Tally::default();
            for (sample, input) in samples {
                let Some(answer) = network.answer(input) else { continue };
                let truth = describe::answer(&sample.truth).displacement_mm;
                let off = answer.answer.displacement_mm.iter().zip(&truth).map(|(a, t)| (a - t).norm());
                let um = |mm: f32| f64::from(mm) * 1e3;
                tally.add(um(off.fold(0.0, f32::max)), answer.error_mm.map(um), answer.known && sampled(*split));
            }
            text.push_str(&tally.row(&network.name(), *split));
        }
    }
    text
}

/// Whether `retina_core::predict::sampled` has the requests of a split: it does not have the outer fifths of `hard`, nor the needles and angles of `outside`.
fn sampled(split: Split) -> bool {
    !matches!(split, Split::Hard | Split::Outside)
}

/// How many errors stay below their median and their 95 % bound.
#[derive(Default)]
struct Tally {
    below: [f64; 2],
    bounds_um: Vec<f64>,
    /// Of those called calibrated: all, and below the 95 % bound.
    calibrated: [f64; 2],
}

impl Tally {
    /// Adds the error of a worst node with its median and bound (µm), and whether the answer calls itself calibrated.
    fn add(&mut self, worst_um: f64, bounds_um: [f64; 2], calibrated: bool) {
        let counts = |is: bool| f64::from(u8::from(is));
        for (below, bound_um) in self.below.iter_mut().zip(bounds_um) {
            *below += counts(worst_um <= bound_um);
        }
        self.calibrated[0] += counts(calibrated);
        self.calibrated[1] += counts(calibrated && worst_um <= bounds_um[1]);
        self.bounds_um.push(bounds_um[1]);
    }

    /// The row of a table; nothing where nothing was added.
    fn row(&self, name: &str, split: Split) -> String {
        if self.bounds_um.is_empty() {
            return String::new();
        }
        let percent = |number: f64, of: f64| format!("{:.1}", 100.0 * number / of);
        let all = self.bounds_um.len() as f64;
        let [half, most] = self.below.map(|below| percent(below, all));
        let [calibrated, held] = self.calibrated;
        let held = if calibrated > 0.0 { percent(held, calibrated) } else { "–".to_owned() };
        format!(
            "| {name} | {} | {half} | {most} | {:.2} | {} | {held} |\n",
            split.name(),
            quantile(&self.bounds_um, 0.5),
            percent(calibrated, all)
        )
    }
}
