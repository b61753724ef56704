//! What can go wrong when a layered bed is prepared or pressed. Units: mm, mN, kPa.

use thiserror::Error;

/// Why a layered bed or a contact on it was refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LayeredError {
    /// The bed has no layer.
    #[error("the bed has no layer")]
    NoLayers,
    /// A layer has a value outside its range, or one that is not finite.
    #[error("layer {index}: {field} = {value} is not allowed ({allowed})")]
    InvalidLayer {
        /// Index of the layer, 0 is the inner (loaded) one.
        index: usize,
        /// Name of the field.
        field: &'static str,
        /// The value given.
        value: f64,
        /// The range allowed.
        allowed: &'static str,
    },
    /// The base has a value outside its range, or one that is not finite.
    #[error("base: {field} = {value} is not allowed ({allowed})")]
    InvalidBase {
        /// Name of the field.
        field: &'static str,
        /// The value given.
        value: f64,
        /// The range allowed.
        allowed: &'static str,
    },
    /// The profile does not have one height for each sample radius.
    #[error("the profile has {given} heights, the bed samples it at {expected} radii")]
    ProfileLength {
        /// Number of heights given.
        given: usize,
        /// Number of sample radii.
        expected: usize,
    },
    /// A profile height or edge value is not a number, or the whole profile is infinite.
    #[error("profile: {field} at radius {radius_mm} mm = {value} is not allowed")]
    InvalidProfile {
        /// What the value is.
        field: &'static str,
        /// Radius of the sample, mm.
        radius_mm: f64,
        /// The value given.
        value: f64,
    },
    /// A force or depth is negative or not finite.
    #[error("{field} = {value} is not allowed (finite, not negative)")]
    InvalidLoad {
        /// Name of the field.
        field: &'static str,
        /// The value given.
        value: f64,
    },
    /// The contact grows past the largest prepared radius.
    #[error("the contact grows past the largest prepared radius, {radius_mm} mm, at a force of {force_mn} mN")]
    ContactTooWide {
        /// The largest prepared contact radius, mm.
        radius_mm: f64,
        /// Force at which it was reached, mN.
        force_mn: f64,
    },
    /// The discrete punch equation was not positive definite: the bed's numbers are beyond double precision.
    #[error(
        "the punch of radius {radius_mm} mm has no positive definite stiffness; the layers' contrast is too extreme"
    )]
    NotPositiveDefinite {
        /// Radius of the punch, mm.
        radius_mm: f64,
    },
}
