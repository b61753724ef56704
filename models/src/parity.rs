//! The trainer's layers from a weight file: what the core's inference must answer.

use retina_core::network::contact::{QUANTILES, STRAIN_BINS, Start, strain_bin};
use retina_core::network::faithful::NAME;
use retina_core::network::weights::{Weights, WeightsError};

use crate::contact::network::Pass;
use crate::contact::trained::Trained;
use crate::describe;
use crate::faithful::network::Network as Faithful;
use crate::faithful::prepared::{Prepared as Seen, View};
use crate::faithful::variant::Backbone;
use crate::sample::Sample;
use crate::train::layers::Layer;

/// What the trainer computes for `sample` with the contact network of this file; nothing where the sample lacks the answer that the network starts from.
///
/// # Errors
/// [`WeightsError`].
pub fn contact(start: Start, file: &[u8], sample: &Sample) -> Result<Vec<Layer>, WeightsError> {
    let weights = Weights::read(start.network(), file)?;
    let trained = Trained::read(start, &weights)?;
    let Some(prepared) = trained.prepare(sample) else { return Ok(Vec::new()) };
    let mut pass = Pass::default();
    trained.network.forward(&trained.parameters, &[&prepared], &mut pass);
    let shifts = weights.take("quantile.shift", &[STRAIN_BINS, QUANTILES])?;
    let shift = &shifts[strain_bin(prepared.strain) * QUANTILES..];
    pass.quantile.iter_mut().zip(shift).for_each(|(quantile, shift)| *quantile += shift);
    Ok(pass.layers(trained.network.form))
}

/// What the trainer computes for `sample` with the paper's network of this file.
///
/// # Errors
/// [`WeightsError`].
pub fn faithful(file: &[u8], sample: &Sample) -> Result<Vec<Layer>, WeightsError> {
    let network = Faithful::new(describe::graph(), Backbone::Tag);
    let parameters = network.layout.read(&Weights::read(NAME, file)?)?;
    let mut view = View::default();
    Seen::new(sample).view(0, &mut view);
    Ok(network.forward(&parameters, &view).layers())
}
