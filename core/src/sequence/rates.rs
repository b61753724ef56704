//! Which effects that remember a sequence calls for: the time in which its load changes against the times of the tissue.
//!
//! - `viscoelasticity`: the stress that the networks still bear at the end of the fastest change of the load, over the elastic one:
//!   Σ β A for a linear load over that time ([`Network::borne`]). It tends to 0 for loads slow against every relaxation time.
//! - `inertia`: a linear load over a time T overshoots by at most T₁/(π T) of itself (undamped oscillator under a ramp), T₁ the slowest period. For
//!   T₁ the layers that yield are taken as one quarter wave of shear, T₁ = 4 Σ thickness/√(µ/ρ): nothing else of the wall is slower.

use std::f64::consts::PI;

use super::Sequence;
use super::plan::Plan;
use crate::effects::viscoelasticity::Network;
use crate::effects::{inertia, viscoelasticity};
use crate::predict::choice::Decision;
use crate::predict::choice::adhesion::{Pull, report as report_adhesion};
use crate::predict::{EffectChoice, EffectReport, PreparedScene};
use crate::tissue::{LayerKind, Tissue};

/// Share of the elastic stress or displacement below which `auto` leaves an effect of rate out: the relative error that `reference` itself has.
pub const RATE_TOLERANCE: f64 = 0.01;

/// The effects that remember, those that are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rates {
    pub viscoelasticity: bool,
    pub inertia: bool,
}

impl Rates {
    /// Whether anything is remembered.
    pub fn any(self) -> bool {
        self.viscoelasticity || self.inertia
    }
}

/// The networks of the retina.
pub(super) fn networks(tissue: &Tissue) -> Vec<Network> {
    let lasting = tissue.rate.lasting_share();
    let network = |term: &crate::tissue::rate::PronyTerm| Network {
        relaxation_time_s: term.relaxation_time_s,
        modulus_ratio: term.share / lasting,
    };
    tissue.rate.retina_relaxation.iter().map(network).collect()
}

/// Slowest period of the layers that yield (s).
pub(super) fn slowest_period_s(tissue: &Tissue) -> f64 {
    let density = tissue.rate.density_kg_per_mm3;
    let yielding = tissue.layers().into_iter().filter(|named| named.kind != LayerKind::Sclera);
    let crossing_s: f64 = yielding.map(|n| n.layer.thickness_mm / (n.layer.shear_modulus_kpa() / density).sqrt()).sum();
    4.0 * crossing_s
}

/// Adds to what the plan decided of the whole sequence what depends on its times.
pub(super) fn decide(prepared: &PreparedScene, sequence: &Sequence, plan: &Plan) -> (Decision, Rates) {
    let tissue = &prepared.scene().tissue;
    let mut decision = plan.decision.clone();
    let change_s = plan.fastest_change_s;
    let networks = networks(tissue);
    let borne: f64 = networks.iter().map(|network| network.borne(change_s)).sum();
    let longest_s = networks.iter().fold(0.0, |longest: f64, network| longest.max(network.relaxation_time_s));
    let period_s = slowest_period_s(tissue);
    let overshoot = period_s / (PI * change_s);
    let loads = change_s.is_finite() && (decision.contact || decision.bleb);
    let mut judge = |name: &'static str, value: f64, times: String| {
        let called_for = value > RATE_TOLERANCE;
        let (simulated, why) = match &sequence.effects {
            _ if !loads => (false, "the needle presses in no step".to_owned()),
            EffectChoice::Auto | EffectChoice::AutoWithin { .. } => (called_for, times),
            EffectChoice::All => (true, "asked for with `all`".to_owned()),
            EffectChoice::Named(names) => (names.iter().any(|n| n == name), "as listed in the request".to_owned()),
        };
        let report = EffectReport {
            name,
            simulated,
            reason: why,
            value: loads.then_some(value),
            threshold: loads.then_some(RATE_TOLERANCE),
        };
        decision.tell(report);
        simulated
    };
    let relaxation = format!(
        "the load changes within {change_s:.3e} s, the retina relaxes over up to {longest_s:.3e} s: its networks bear this share of the elastic \
         stress beside it"
    );
    let vibration = format!(
        "the load changes within {change_s:.3e} s, the slowest period is {period_s:.3e} s: the tissue overshoots by up to this share"
    );
    let rates = Rates {
        viscoelasticity: judge(viscoelasticity::NAME, borne, relaxation) && !networks.is_empty(),
        inertia: judge(inertia::NAME, overshoot, vibration),
    };
    if rates.viscoelasticity && plan.is_held {
        // A needle that is moved fast presses the stiffer tissue with more.
        let pull = Pull { normal_force_mn: plan.expected.pull.normal_force_mn * (1.0 + borne), ..plan.expected.pull };
        let report = report_adhesion(&sequence.effects, sequence.level, decision.contact, &pull);
        decision.adhesion = report.simulated;
        decision.tell(report);
    }
    (decision, rates)
}
