//! How fine the truth is, and how far it may be from level `reference`.

use retina_core::equilibrium::ContactSettings;
use retina_core::needle::Tip;
use retina_core::predict::finite_element::{REFERENCE, Resolution};

use crate::sample::Sample;

/// The truth's mesh.
pub const DISC: Resolution = Resolution { retina_elements: 2, sclera_elements: 0, ..REFERENCE };
/// Its name.
pub const NAME: &str = "disc-3-12-2";
/// Where the estimated error comes from.
pub const ERROR_BASIS: &str = "none";

/// The mesh for a tip.
pub fn resolution(tip: &Tip) -> Resolution {
    match tip {
        Tip::Hemispherical => DISC,
        Tip::Flat { .. } | Tip::Bevelled { .. } => {
            Resolution { contact: ContactSettings { softening: 1.0, ..REFERENCE.contact }, ..DISC }
        }
    }
}

/// Estimated error of the truth's worst node (mm).
pub fn error_mm(_sample: &Sample) -> f32 {
    0.0
}
