//! The ablation of the paper's network: its variants on the same split, with honest errors and the published mean.

use std::fmt::Write as _;

use nalgebra::Vector3;
use retina_core::network::faithful::UNIT_MM;
use retina_core::network::input::{Field, Input};

use super::errors::{Errors, Mesh, mean, published_mean};
use super::predictors::Predictor;
use super::report::PUBLISHED_BATCH;
use super::tables::{self, Row};
use crate::describe;
use crate::faithful::network::Network;
use crate::faithful::prepared::{Prepared, View};
use crate::faithful::variant::Variant;
use crate::sample::Sample;

/// A trained variant, answering through the trainer's forward pass.
pub struct Trained {
    /// Which.
    pub variant: Variant,
    /// Its parameters.
    pub parameters: Vec<f32>,
    /// Seconds that its training took.
    pub seconds: f64,
    network: Network,
}

impl Trained {
    /// The variant with these parameters.
    pub fn new(variant: Variant, parameters: Vec<f32>, seconds: f64) -> Self {
        Trained { variant, parameters, seconds, network: Network::new(describe::graph(), variant.backbone) }
    }
}

impl Predictor for Trained {
    fn name(&self) -> String {
        format!("{}, {} parameters", self.variant.name(), self.parameters.len())
    }

    fn displacement(&mut self, sample: &Sample, _input: &Input) -> Option<Field> {
        let mut view = View::default();
        Prepared::new(sample).view(0, &mut view);
        self.variant.seen.hide(&mut view);
        let pass = self.network.forward(&self.parameters, &view);
        let rows = pass.rows.last()?.as_chunks::<3>().0;
        Some(std::array::from_fn(|node| Vector3::from(rows[node]) * UNIT_MM))
    }
}

/// The table of all variants on these samples.
pub fn table(variants: &mut [Trained], samples: &[(&Sample, Input)]) -> String {
    let mesh = Mesh::default();
    let mut rows = Vec::new();
    let mut published =
        String::from("| | MAE µm | by the published formula µm | training, minutes |\n|---|---|---|---|\n");
    for variant in variants {
        let (mut errors, mut means) = (Errors::default(), Vec::new());
        for (sample, input) in samples {
            let Some(answer) = variant.displacement(sample, input) else { continue };
            let truth = describe::answer(&sample.truth).displacement_mm;
            let off = answer.iter().zip(&truth).map(|(a, t)| 1e3 * f64::from((a - t).norm()));
            means.push(off.sum::<f64>() / answer.len() as f64);
            errors.add(&mesh, &input.rest_mm, &answer, &truth);
        }
        // A String takes whatever is written.
        let _ = writeln!(
            published,
            "| {} | {:.2} | {:.4} | {:.1} |",
            variant.variant.name(),
            mean(&means),
            published_mean(&means, PUBLISHED_BATCH),
            variant.seconds / 60.0
        );
        rows.push(Row { name: variant.name(), errors, missing: 0 });
    }
    format!("{}\n{published}", tables::errors(&rows))
}
