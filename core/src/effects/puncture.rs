//! `puncture`: the limits up to which the tissue stays whole, a force under the needle and a strain anywhere; beyond one the answer says so.
//!
//! It has no energy and moves nothing: tissue models of this kind describe tissue that is whole. What is measured at the equilibrium, the length of the
//! tissue's reaction F and the largest |principal stretch − 1| ε, is held against a limit each; the larger of F/F_max and ε/ε_max is the share that is used, and above
//! one the tissue counts as punctured. A puncture is seen as a sharp drop of the force (PMC4288008), which comes after this; no force or strain at which a
//! retina punctures is published, so both limits are the scene's (`scene::puncture`).
//!
//! Law: the share grows with each of the two, is one exactly at a limit, and does not depend on the unit of length: F_max of a limit of pressure
//! grows with the needle's cross-section.
//! Not here: what pierced tissue does, the memory of a sequence (`sequence`).

/// Name of the effect.
pub const NAME: &str = "puncture";

/// What the tissue bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Force between needle and tissue (mN).
    pub force_mn: f64,
    /// |principal stretch − 1|.
    pub strain: f64,
}

/// What the tissue is asked to bear.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Burden {
    /// Force between needle and tissue (mN).
    pub force_mn: f64,
    /// Largest |principal stretch − 1|.
    pub strain: f64,
}

/// The measure that is nearest to its limit, or farthest beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// `force` or `strain`.
    pub measure: &'static str,
    /// Its unit; `1` for a pure number.
    pub unit: &'static str,
    /// What it is.
    pub value: f64,
    /// What it may be.
    pub limit: f64,
}

impl Limits {
    /// The measure of `burden` that is nearest to its limit.
    pub fn nearest(&self, burden: &Burden) -> Nearest {
        let force = Nearest { measure: "force", unit: "mN", value: burden.force_mn, limit: self.force_mn };
        let strain = Nearest { measure: "strain", unit: "1", value: burden.strain, limit: self.strain };
        if strain.share() > force.share() { strain } else { force }
    }
}

impl Nearest {
    /// The share of the limit that is used.
    pub fn share(&self) -> f64 {
        self.value / self.limit
    }

    /// Whether the limit is exceeded.
    pub fn is_beyond(&self) -> bool {
        self.value > self.limit
    }
}
