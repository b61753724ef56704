//! One effect's question: does leaving it out cost more than may be neglected?

use super::super::types::{EffectChoice, EffectReport};

/// A number, what it may be, and what to say.
pub(super) struct Criterion<'a> {
    /// Name of the effect.
    pub name: &'static str,
    /// The number decided on.
    pub value: f64,
    /// From above this value on the effect is called for.
    pub threshold: f64,
    /// What the number is, with its unit in brackets at the end of the sentence.
    pub quantity: &'a str,
    /// Why the effect cannot be simulated here, or would change nothing, if that is so.
    pub ruled_out: Option<&'a str>,
}

impl Criterion<'_> {
    /// The decision for `choice`, with its reason.
    pub fn settle(self, choice: &EffectChoice) -> EffectReport {
        let called_for = self.value > self.threshold;
        let wanted = match choice {
            EffectChoice::Auto | EffectChoice::AutoWithin { .. } => called_for,
            EffectChoice::All => true,
            EffectChoice::Named(names) => names.iter().any(|name| name == self.name),
        };
        let reason = match (self.ruled_out, choice) {
            (Some(reason), _) => reason.to_owned(),
            (None, EffectChoice::All) => "asked for with `all`".to_owned(),
            (None, EffectChoice::Named(_)) => "as listed in the request".to_owned(),
            (None, _) if called_for => format!("{} exceeds what may be neglected", self.quantity),
            (None, _) => format!("{} may be neglected", self.quantity),
        };
        EffectReport {
            name: self.name,
            simulated: wanted && self.ruled_out.is_none(),
            reason,
            value: Some(self.value),
            threshold: Some(self.threshold),
        }
    }
}
