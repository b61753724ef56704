//! How often what is promised about errors holds.

use std::fmt::Write as _;

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
        "| network | split | below the median, % | below the 95 % bound, % | median bound µm | known to the network, % |\n|---|---|---|---|---|---|\n",
    );
    for level in [Level::Linear, Level::Coarse] {
        for (split, samples) in splits {
            text.push_str(&measured(level, *split, samples));
        }
    }
    for network in networks {
        for (split, samples) in splits {
            let (mut below, mut bounds, mut known, mut count) = ([0.0; 2], Vec::new(), 0.0, 0.0);
            for (sample, input) in samples {
                let Some(answer) = network.answer(input) else { continue };
                let truth = describe::answer(&sample.truth).displacement_mm;
                let off = answer.answer.displacement_mm.iter().zip(&truth).map(|(a, t)| (a - t).norm());
                let worst = off.fold(0.0, f32::max);
                for (below, bound) in below.iter_mut().zip(answer.error_mm) {
                    *below += f64::from(u8::from(worst <= bound));
                }
                bounds.push(f64::from(answer.error_mm[1]) * 1e3);
                known += f64::from(u8::from(answer.known));
                count += 1.0;
            }
            if count > 0.0 {
                let [half, most] = below.map(|below| 100.0 * below / count);
                let (name, bound, known) = (network.name(), quantile(&bounds, 0.5), 100.0 * known / count);
                let _ =
                    writeln!(text, "| {name} | {} | {half:.1} | {most:.1} | {bound:.2} | {known:.1} |", split.name());
            }
        }
    }
    text
}

/// How often the measured quantiles of a level hold on other samples.
fn measured(level: Level, split: Split, samples: &[(&Sample, Input)]) -> String {
    let (mut below, mut bounds, mut count) = ([0.0; 2], Vec::new(), 0.0);
    for (sample, _) in samples {
        let quantiles = expected_error::quantiles(level, usize::from(sample.tip.kind), strain(sample));
        let (Some(quantiles), Some(worst_um)) = (quantiles, worst_um(sample, level)) else { continue };
        let ratio = worst_um / (f64::from(sample.linear_depth_mm) * 1e3);
        below[0] += f64::from(u8::from(ratio <= quantiles.median));
        below[1] += f64::from(u8::from(ratio <= quantiles.p95));
        bounds.push(quantiles.p95 * f64::from(sample.linear_depth_mm) * 1e3);
        count += 1.0;
    }
    if count == 0.0 {
        return String::new();
    }
    let [half, most] = below.map(|below| 100.0 * below / count);
    format!("| `{}` | {} | {half:.1} | {most:.1} | {:.2} | – |\n", level.name(), split.name(), quantile(&bounds, 0.5))
}
