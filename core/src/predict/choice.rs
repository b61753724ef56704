//! Which effects a request calls for, and why. Solid and contact here, every other effect's criterion in a file of its own.

pub mod adhesion;
pub mod bleb;
mod criterion;
pub mod friction;
pub mod pressure;
pub mod puncture;
pub mod tool_flex;

use super::types::{EffectChoice, EffectReport, Level, PredictError};
use crate::effects::puncture::{Burden, Limits};
use crate::effects::{self, EFFECT_NAMES, contact, elasticity, finite_strain, inertia, viscoelasticity};
use crate::equilibrium::Solid;
use adhesion::Pull;
use friction::Sliding;
use tool_flex::Bending;

/// Error that `auto` accepts for leaving an effect out where nothing else is asked for (µm): a tenth of the best published tool-to-layer error (9 µm).
pub const AUTO_TOLERANCE_UM: f64 = 1.0;

/// Why one prediction leaves out what depends on rate: its load lasts.
const STATIC: &str = "static scene: not called for";

/// The decision.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Which solid energy.
    pub solid: Solid,
    /// Whether the needle is seen at all.
    pub contact: bool,
    /// Whether needle and tissue rub.
    pub friction: bool,
    /// Whether the retina can come off.
    pub adhesion: bool,
    /// Whether there is fluid under the retina.
    pub bleb: bool,
    /// Whether the needle's shaft bends.
    pub tool_flex: bool,
    /// The report, in the order of [`EFFECT_NAMES`].
    pub reports: Vec<EffectReport>,
}

impl Decision {
    /// Whether retina and choroid may come apart.
    pub fn parts(&self) -> bool {
        self.adhesion || self.bleb
    }

    /// Tells of these effects that they are not simulated, for this reason.
    pub fn without(&mut self, names: &[&str], reason: &str) {
        for report in self.reports.iter_mut().filter(|report| names.contains(&report.name)) {
            report.simulated = false;
            report.reason = reason.to_owned();
        }
    }

    /// Takes in what is decided of the scene's fluid, which acts before anything is pressed.
    pub fn with_bleb(mut self, bleb: EffectReport) -> Self {
        self.bleb = bleb.simulated;
        self.tell(bleb);
        self
    }

    /// Puts `report` in the place of what was told of its effect.
    pub fn tell(&mut self, report: EffectReport) {
        if let Some(place) = self.reports.iter_mut().find(|place| place.name == report.name) {
            *place = report;
        }
    }

    /// Whether where the tissue ends up depends on the way there, however slowly it is gone.
    pub fn is_path_dependent(&self) -> bool {
        self.friction || self.adhesion
    }
}

/// What the linear answer predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Depth of the needle (mm).
    pub depth_mm: f64,
    /// That depth over the thickness of what yields (retina and choroid): a mean strain.
    pub strain: f64,
    /// How the needle slides.
    pub sliding: Sliding,
    /// How it pulls at the retina's bond.
    pub pull: Pull,
    /// What bends the needle's shaft.
    pub bending: Bending,
    /// What the tissue bears before it punctures.
    pub limits: Limits,
}

/// Decides for `choice` at `level`; `pressure` is what was decided about it before anything was pressed. Of a scene without fluid: see [`Decision::with_bleb`].
///
/// # Errors
/// [`PredictError::Effect`] for a name that does not exist or a list without a solid.
pub fn decide(
    choice: &EffectChoice,
    level: Level,
    expected: Expected,
    pressure: &EffectReport,
) -> Result<Decision, PredictError> {
    // A strain ε changes the answer by the order of ε times itself.
    let linearisation_error_um = expected.strain * expected.depth_mm * 1e3;
    let called_for = linearisation_error_um > choice.tolerance_um();
    let (wanted, contact, why) = match choice {
        EffectChoice::Auto | EffectChoice::AutoWithin { .. } => (called_for, true, None),
        EffectChoice::All => (true, true, Some("asked for with `all`")),
        EffectChoice::Named(names) => {
            let has = |name: &str| names.iter().any(|n| n == name);
            if let Some(name) = names.iter().find(|n| !EFFECT_NAMES.contains(&n.as_str())) {
                let problem = format!("does not exist; known: {}", EFFECT_NAMES.join(", "));
                return Err(PredictError::Effect { name: name.clone(), problem });
            }
            if !has(elasticity::NAME) && !has(finite_strain::NAME) {
                let problem = "is left out, and so is `finite_strain`; tissue needs one of them".to_owned();
                return Err(PredictError::Effect { name: elasticity::NAME.to_owned(), problem });
            }
            (has(finite_strain::NAME), has(contact::NAME), Some("as listed in the request"))
        }
    };
    let possible = level != Level::Linear;
    if level.is_learned() && contact && !wanted && why.is_some() {
        let problem = format!("is part of what level `{}` learned and cannot be left out", level.name());
        return Err(PredictError::Effect { name: finite_strain::NAME.to_owned(), problem });
    }
    let finite = (wanted || level.is_learned()) && possible;
    let reason = match (why, possible) {
        (_, false) => "level `linear` is small-strain by construction".to_owned(),
        (Some(why), _) => why.to_owned(),
        (None, _) if level.is_learned() && !called_for => format!("part of what level `{}` learned", level.name()),
        (None, _) if called_for => {
            "the linear answer's strain times its depth exceeds what may be neglected [µm]".to_owned()
        }
        (None, _) => "the linear answer's strain times its depth may be neglected [µm]".to_owned(),
    };
    let plain = |name, simulated, reason: &str| EffectReport {
        name,
        simulated,
        reason: reason.to_owned(),
        value: None,
        threshold: None,
    };
    let elastic = if finite { "contained in `finite_strain`" } else { "always" };
    let reports = vec![
        plain(elasticity::NAME, true, elastic),
        EffectReport {
            name: finite_strain::NAME,
            simulated: finite,
            reason,
            value: Some(linearisation_error_um),
            threshold: Some(choice.tolerance_um()),
        },
        plain(
            contact::NAME,
            contact,
            if contact { "the needle reaches the surface" } else { "as listed in the request" },
        ),
        friction::report(choice, level, contact, &expected.sliding),
        pressure.clone(),
        adhesion::report(choice, level, contact, &expected.pull),
        bleb::report(choice, level, None),
        plain(viscoelasticity::NAME, false, STATIC),
        plain(inertia::NAME, false, STATIC),
        tool_flex::report(choice, level, contact, &expected.bending),
        puncture::report(
            &expected.limits,
            &Burden { force_mn: expected.pull.normal_force_mn, strain: expected.strain },
        ),
    ];
    let solid = if finite { Solid::FiniteStrain } else { Solid::Elasticity };
    let is_on = |name: &str| reports.iter().any(|report| report.name == name && report.simulated);
    if is_on(effects::adhesion::NAME) && expected.pull.tears_all_off() {
        let Pull { suction_kpa, strength_kpa, .. } = expected.pull;
        let problem = format!(
            "a fall of the eye's pressure by {suction_kpa} kPa pulls at all of the retina with more than the bond's strength of {strength_kpa} kPa: it comes off everywhere, \
             which has no equilibrium"
        );
        return Err(PredictError::Effect { name: effects::adhesion::NAME.to_owned(), problem });
    }
    Ok(Decision {
        solid,
        contact,
        friction: is_on(effects::friction::NAME),
        adhesion: is_on(effects::adhesion::NAME),
        bleb: false,
        tool_flex: is_on(effects::tool_flex::NAME),
        reports,
    })
}
