//! The trained networks that ship with the program, read and checked once.
//!
//! Weights that cannot be used are kept as the error that they are: only the level that needs them has no answer then.

use std::sync::{Arc, OnceLock};

use super::types::{Level, PredictError};
use crate::network::contact::{ContactNetwork, Start};
use crate::network::weights::{WeightsError, hash};

const CONTACT: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../models/weights/contact.safetensors"));
const CORRECTED: &[u8] =
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../models/weights/corrected.safetensors"));

/// Both networks, or why there is none.
pub struct Networks {
    contact: Result<ContactNetwork, WeightsError>,
    corrected: Result<ContactNetwork, WeightsError>,
}

impl Networks {
    /// From the bytes of two weight files.
    pub fn read(contact: &[u8], corrected: &[u8]) -> Self {
        Networks {
            contact: ContactNetwork::new(Start::Linear, contact),
            corrected: ContactNetwork::new(Start::Coarse, corrected),
        }
    }

    /// Those that ship.
    pub fn shipped() -> Arc<Self> {
        static SHIPPED: OnceLock<Arc<Networks>> = OnceLock::new();
        SHIPPED.get_or_init(|| Arc::new(Self::read(CONTACT, CORRECTED))).clone()
    }

    /// The SHA-256 of the weights of each learned level that ship, in hexadecimal digits.
    pub fn shipped_hashes() -> [(Level, String); 2] {
        [(Level::Network, hash(CONTACT)), (Level::Corrected, hash(CORRECTED))]
    }

    /// The network of `level`.
    ///
    /// # Errors
    /// [`PredictError::Weights`]; [`PredictError::NotLearned`] for a level that has no network.
    pub fn of(&self, level: Level) -> Result<&ContactNetwork, PredictError> {
        let network = match level {
            Level::Network => &self.contact,
            Level::Corrected => &self.corrected,
            Level::Linear | Level::Coarse | Level::Reference => {
                let problem = "it has no network".to_owned();
                return Err(PredictError::NotLearned { level: level.name(), field: "accuracy.level", problem });
            }
        };
        network.as_ref().map_err(|cause| PredictError::Weights { level: level.name(), cause: cause.clone() })
    }
}
