//! The trainer's layers from a weight file: what the core's inference must answer.

use retina_core::network::contact::Start;
use retina_core::network::faithful::NAME;
use retina_core::network::weights::{Weights, WeightsError};

use crate::contact::network::{Form, Network as Contact, Pass};
use crate::contact::prepared::{Normaliser, Prepared};
use crate::describe;
use crate::faithful::network::Network as Faithful;
use crate::faithful::prepared::{Prepared as Seen, View};
use crate::faithful::variant::Backbone;
use crate::sample::Sample;
use crate::train::layers::Layer;

/// The form of a contact network's weights.
fn form(weights: &Weights, start: Start) -> Result<Form, WeightsError> {
    let count = |part: &str| (0..).take_while(|at| weights.has(&format!("block.{at}.{part}"))).count();
    let length = |name: &str| Ok::<usize, WeightsError>(weights.shape(name)?.iter().product());
    Ok(Form {
        coarse: start == Start::Coarse,
        width: length("input.bias")?,
        blocks: count("weight"),
        messages: count("message"),
        hidden: length("motion.hidden.bias")?,
    })
}

/// What the trainer computes for `sample` with the contact network of this file; nothing where the sample lacks the answer that the network starts from.
///
/// # Errors
/// [`WeightsError`].
pub fn contact(start: Start, file: &[u8], sample: &Sample) -> Result<Vec<Layer>, WeightsError> {
    let weights = Weights::read(start.network(), file)?;
    let form = form(&weights, start)?;
    let network = Contact::new(form, describe::graph());
    let parameters = network.layout.read(&weights)?;
    let Some(mut prepared) = Prepared::new(sample, form.coarse) else { return Ok(Vec::new()) };
    for (part, numbers) in [("local", &mut prepared.local), ("global", &mut prepared.global)] {
        let take = |what: &str| {
            let name = format!("normaliser.{part}.{what}");
            weights.take(&name, weights.shape(&name)?)
        };
        let (mean, scale) = (take("mean")?, take("scale")?);
        Normaliser { mean, scale, low: Vec::new(), high: Vec::new() }.apply(numbers);
    }
    let mut pass = Pass::default();
    network.forward(&parameters, &[&prepared], &mut pass);
    let shift = weights.take("quantile.shift", &[pass.quantile.len()])?;
    pass.quantile.iter_mut().zip(shift).for_each(|(quantile, shift)| *quantile += shift);
    Ok(pass.layers(form))
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
