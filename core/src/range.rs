//! The range in which a scene's parameters may lie, and the one check that holds a value against it.
//!
//! Contract: a [`ParameterRange`] is a named constant with its unit, default, bounds and source; [`ParameterRange::check`] accepts
//! exactly the finite values between the bounds, bounds included. The error names the field by its dotted path, so that a
//! caller can point at what to change. Units: those of the parameter, named in `unit`.
//!
//! Not here: the constants themselves (each stands beside the quantity that it bounds) and any clamping; a value outside its range
//! is refused, never moved.

use thiserror::Error;

/// A parameter with its unit, its default and the values allowed for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterRange {
    /// Name of the parameter as people read it.
    pub name: &'static str,
    /// Unit of `default`, `min` and `max`; `1` for a pure number.
    pub unit: &'static str,
    /// The value used where a scene says nothing.
    pub default: f64,
    /// Smallest allowed value, included.
    pub min: f64,
    /// Largest allowed value, included.
    pub max: f64,
    /// Where default and bounds come from; `[unverified]` marks what no source was found for.
    pub source: &'static str,
}

/// A value that is not a finite number inside its range.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{field} = {value} {unit} is outside the allowed range {min} to {max} {unit}")]
pub struct OutOfRange {
    /// Dotted path of the field, for example `tissue.choroid.youngs_modulus_kpa`.
    pub field: String,
    /// The value that was refused (may be NaN or infinite).
    pub value: f64,
    /// Smallest allowed value, included.
    pub min: f64,
    /// Largest allowed value, included.
    pub max: f64,
    /// Unit of `value`, `min` and `max`.
    pub unit: &'static str,
}

impl ParameterRange {
    /// Accepts `value` when it is finite and between the bounds, bounds included.
    ///
    /// `field` is the dotted path that an error carries. Fails with [`OutOfRange`] for NaN, infinities and values outside.
    pub fn check(&self, field: &str, value: f64) -> Result<(), OutOfRange> {
        if (self.min..=self.max).contains(&value) {
            return Ok(());
        }
        Err(OutOfRange { field: field.to_owned(), value, min: self.min, max: self.max, unit: self.unit })
    }
}
