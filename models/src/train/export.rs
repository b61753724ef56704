//! Trained weights as a safetensors file that tells what it is, and carries the hash of its own numbers.

use std::collections::HashMap;

use retina_core::network::weights::{HASH, NETWORK, hash};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError};

/// A tensor to be written: name, shape, numbers.
pub type Named = (String, Vec<usize>, Vec<f32>);

/// Bytes of the header's length.
const LENGTH_BYTES: usize = 8;

/// The file of `network` with `tensors`, and `about` in its metadata.
///
/// # Errors
/// A shape that does not fit its numbers.
pub fn weights(network: &str, tensors: &[Named], about: &[(&str, String)]) -> Result<Vec<u8>, SafeTensorError> {
    let bytes: Vec<Vec<u8>> =
        tensors.iter().map(|(_, _, numbers)| numbers.iter().flat_map(|n| n.to_le_bytes()).collect()).collect();
    let views = || -> Result<Vec<(&str, TensorView)>, SafeTensorError> {
        let pairs = tensors.iter().zip(&bytes);
        pairs
            .map(|((name, shape, _), bytes)| Ok((name.as_str(), TensorView::new(Dtype::F32, shape.clone(), bytes)?)))
            .collect()
    };
    // The format orders the tensors' bytes by itself: they are hashed as it lays them out.
    let bare = safetensors::serialize(views()?, None)?;
    let header = bare.first_chunk::<LENGTH_BYTES>().map_or(0, |length| u64::from_le_bytes(*length) as usize);
    let digest = hash(&bare[LENGTH_BYTES + header..]);
    let mut metadata = HashMap::from([(HASH.to_owned(), digest), (NETWORK.to_owned(), network.to_owned())]);
    metadata.extend(about.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
    safetensors::serialize(views()?, Some(metadata))
}
