//! Trained weights, read from the bytes of a safetensors file and checked before anything uses them.
//!
//! The file's metadata holds the SHA-256 of all tensors' bytes (`sha256`) and what the network is (`network`, `commit`, `data`, …). A wrong hash, a
//! tensor that is missing, has another shape or is not finite is an error that says so; the other levels work without the file.

use std::collections::BTreeMap;

use sha2::{Digest as _, Sha256};
use thiserror::Error;

use super::header::{self, Header};

/// Why weights cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WeightsError {
    /// Not a safetensors file.
    #[error("the weights are not a safetensors file")]
    Format,
    /// The bytes are not those that were written.
    #[error("the weights are damaged: their SHA-256 is {found}, not {expected}")]
    Hash {
        /// What the file says.
        expected: String,
        /// What its bytes come to.
        found: String,
    },
    /// Weights of something else.
    #[error("these are weights of network `{found}`, not of `{expected}`")]
    Network {
        /// Which were asked for.
        expected: String,
        /// Which they are.
        found: String,
    },
    /// A tensor that the network needs is not there.
    #[error("the weights have no tensor `{name}`")]
    Missing {
        /// Its name.
        name: String,
    },
    /// A tensor of another shape or type.
    #[error("tensor `{name}` of the weights is {found}, not {expected}")]
    Shape {
        /// Its name.
        name: String,
        /// What the network needs.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A number that is none.
    #[error("tensor `{name}` of the weights holds a number that is not finite at index {index}")]
    NotFinite {
        /// Its name.
        name: String,
        /// The first such number.
        index: usize,
    },
}

/// Name of the metadata's entry for the hash of the tensors' bytes.
pub const HASH: &str = "sha256";
/// Name of the metadata's entry for what the network is.
pub const NETWORK: &str = "network";

/// Checked weights by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
    metadata: BTreeMap<String, String>,
}

/// The SHA-256 of `bytes` in hexadecimal digits.
pub fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Weights {
    /// Reads and checks the weights of `network`.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn read(network: &str, file: &[u8]) -> Result<Self, WeightsError> {
        let (Header { tensors: entries, metadata }, data) = header::split(file).ok_or(WeightsError::Format)?;
        let said = |key: &str| metadata.get(key).cloned().unwrap_or_default();
        let found = hash(data);
        if said(HASH) != found {
            return Err(WeightsError::Hash { expected: said(HASH), found });
        }
        if said(NETWORK) != network {
            return Err(WeightsError::Network { expected: network.to_owned(), found: said(NETWORK) });
        }
        let mut tensors = BTreeMap::new();
        for (name, entry) in entries {
            let wrong = |expected: String| WeightsError::Shape {
                name: name.clone(),
                expected,
                found: format!("{} {:?} at bytes {:?}", entry.dtype, entry.shape, entry.offsets),
            };
            let count = entry.shape.iter().try_fold(1usize, |count, length| count.checked_mul(*length));
            let length = count.and_then(|count| count.checked_mul(size_of::<f32>()));
            let bytes = match (entry.dtype.as_str(), entry.offsets.as_slice()) {
                ("F32", &[start, end]) if length.is_some() && end.checked_sub(start) == length => data.get(start..end),
                _ => None,
            };
            let bytes = bytes
                .ok_or_else(|| wrong("F32 with as many numbers as the shape says, inside of the file".to_owned()))?;
            let numbers: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
            if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(WeightsError::NotFinite { name, index });
            }
            tensors.insert(name, (entry.shape, numbers));
        }
        Ok(Weights { tensors, metadata })
    }

    /// What the file says about itself.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// Whether there is a tensor of that name.
    pub fn has(&self, name: &str) -> bool {
        self.tensors.contains_key(name)
    }

    /// The shape of a tensor.
    ///
    /// # Errors
    /// [`WeightsError::Missing`].
    pub fn shape(&self, name: &str) -> Result<&[usize], WeightsError> {
        let missing = || WeightsError::Missing { name: name.to_owned() };
        self.tensors.get(name).map(|(shape, _)| shape.as_slice()).ok_or_else(missing)
    }

    /// The numbers of a tensor of that shape, row by row.
    ///
    /// # Errors
    /// [`WeightsError::Missing`], [`WeightsError::Shape`].
    pub fn take(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, WeightsError> {
        let found = self.shape(name)?;
        if found != shape {
            return Err(WeightsError::Shape {
                name: name.to_owned(),
                expected: format!("{shape:?}"),
                found: format!("{found:?}"),
            });
        }
        Ok(self.tensors[name].1.clone())
    }
}
