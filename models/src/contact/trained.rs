//! A trained contact network as its weight file has it: to compute its layers as the trainer does, and to set its bounds right anew.

use retina_core::network::contact::Start;
use retina_core::network::weights::{HASH, NETWORK, Weights, WeightsError};
use safetensors::{SafeTensorError, SafeTensors};

use super::bounds;
use super::network::{Form, Network};
use super::prepared::{Normaliser, Prepared};
use crate::describe;
use crate::sample::Sample;
use crate::train::export::{self, Named};

/// A network with its parameters and what its inputs are standardised by.
pub struct Trained {
    /// The network.
    pub network: Network,
    /// Its parameters.
    pub parameters: Vec<f32>,
    local: Normaliser,
    global: Normaliser,
}

impl Trained {
    /// From weights.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn read(start: Start, weights: &Weights) -> Result<Self, WeightsError> {
        let network = Network::new(form(weights, start)?, describe::graph());
        let normaliser = |part: &str| {
            let take = |what: &str| {
                let name = format!("normaliser.{part}.{what}");
                weights.take(&name, weights.shape(&name)?)
            };
            Ok(Normaliser { mean: take("mean")?, scale: take("scale")?, low: Vec::new(), high: Vec::new() })
        };
        Ok(Trained {
            parameters: network.layout.read(weights)?,
            network,
            local: normaliser("local")?,
            global: normaliser("global")?,
        })
    }

    /// A sample as the network takes it; `None` where it lacks the answer that the network starts from.
    pub fn prepare(&self, sample: &Sample) -> Option<Prepared> {
        let mut prepared = Prepared::new(sample, self.network.form.coarse)?;
        self.local.apply(&mut prepared.local);
        self.global.apply(&mut prepared.global);
        Some(prepared)
    }

    /// The weight file `file` of this network with bounds that hold on `samples`, of data with the SHA-256 `data`.
    ///
    /// # Errors
    /// If the file is none of tensors.
    pub fn with_bounds(
        &self,
        start: Start,
        file: &[u8],
        samples: &[Prepared],
        data: &str,
    ) -> Result<Vec<u8>, SafeTensorError> {
        let judged = bounds::judge(&self.network, &self.parameters, samples);
        let anew = bounds::tensors(&judged);
        let kept = SafeTensors::deserialize(file)?;
        let mut tensors: Vec<Named> = kept
            .tensors()
            .into_iter()
            .filter(|(name, _)| anew.iter().all(|(written, ..)| written != name))
            .map(|(name, tensor)| (name, tensor.shape().to_vec(), numbers(tensor.data())))
            .collect();
        tensors.extend(anew);
        let (_, header) = SafeTensors::read_metadata(file)?;
        let told = header.metadata().clone().unwrap_or_default();
        let mut about: Vec<(&str, String)> = told.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
        about.retain(|(key, _)| ![HASH, NETWORK, BOUNDS].contains(key));
        about.push((BOUNDS, data.to_owned()));
        export::weights(start.network(), &tensors, &about)
    }
}

/// Under this name a weight file tells which data its bounds hold on, where they were set right after the training.
const BOUNDS: &str = "bounds_data_sha256";

fn numbers(bytes: &[u8]) -> Vec<f32> {
    let (numbers, _) = bytes.as_chunks();
    numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

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
