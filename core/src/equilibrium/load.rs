//! What an equilibrium is asked for and what it comes to: numerical parameters, tool, motion and load in; positions, reaction and contact out.

use nalgebra::{Isometry3, Unit, Vector3};

use crate::effect::{Effect, Multiplier};
use crate::mesh::disc::DiscGeometry;
use crate::mesh::wall::Place;
use crate::needle::Body;
use crate::solve::newton::NewtonReport;

/// Which solid energy is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solid {
    /// Small strain.
    Elasticity,
    /// Neo-Hookean.
    FiniteStrain,
}

/// Numerical parameters of the contact and of its solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Penalty stiffness (kPa/mm).
    pub stiffness_kpa_per_mm: f64,
    /// Smoothing distance (mm).
    pub smoothing_mm: f64,
    /// Gauss points along each edge of a face.
    pub points_per_edge: usize,
    /// A first solve with this many times less stiffness and more smoothing leads to the contact proper; 1: none is needed. A stiff contact
    /// on a fine mesh finds its points one by one, a soft one all at once.
    pub softening: f64,
    /// Residual relative to the force scale at which Newton stops.
    pub tolerance: f64,
}

impl ContactSettings {
    /// The contact of the first solve.
    pub fn softened(&self) -> Self {
        ContactSettings {
            stiffness_kpa_per_mm: self.stiffness_kpa_per_mm / self.softening,
            smoothing_mm: self.smoothing_mm * self.softening,
            softening: 1.0,
            ..*self
        }
    }
}

/// Where a mesh stands and how it is graded.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSize {
    /// The disc around the contact.
    pub disc: DiscGeometry,
    /// Thickness of the innermost element of the retina (mm), unless equal elements are thinner.
    pub first_element_mm: f64,
}

/// The needle as the wall sees it.
#[derive(Clone, Copy, Debug)]
pub struct Tool<'a> {
    /// Its solid.
    pub body: &'a Body,
    /// Its pose before it moves.
    pub patch_from_needle: Isometry3<f64>,
    /// Force for a deflection of its tip across the shaft (mN/mm); `None`: the shaft does not bend.
    pub stiffness_mn_per_mm: Option<f64>,
}

/// How the needle is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Direction of advance.
    pub direction: Unit<Vector3<f64>>,
    /// Force along it (mN); `None`: the needle is advanced by `travel_mm` and held.
    pub force_mn: Option<f64>,
    /// Travel from the given pose: the target under pose control, a guess under force control (mm).
    pub travel_mm: f64,
}

/// An effect besides the solid and the contact, and where it acts.
#[derive(Clone, Copy)]
pub struct Addition<'a> {
    /// The energy.
    pub effect: &'a dyn Effect,
    /// Where it acts.
    pub place: Place,
}

/// What is done to a wall.
#[derive(Clone, Copy)]
pub struct Load<'a> {
    /// How the needle is driven.
    pub motion: &'a Motion,
    /// Travel of the needle at first touch of the tissue at rest (mm): where load steps begin, if they are needed.
    pub touch_mm: f64,
    /// What acts besides the needle's contact.
    pub additions: &'a [Addition<'a>],
}

impl Load<'_> {
    /// What acts besides, and `effect` on the faces.
    pub(super) fn with_faces<'b>(&'b self, effect: &'b dyn Effect) -> Vec<Addition<'b>> {
        let joined = Addition { effect, place: Place::Faces };
        self.additions.iter().copied().chain([joined]).collect()
    }

    /// The multipliers of what acts.
    pub(super) fn multipliers(&self) -> impl Iterator<Item = &Multiplier> {
        self.additions.iter().filter_map(|addition| addition.effect.multiplier())
    }
}

/// An equilibrium.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    /// Current positions of all vertices, the needle's tip last (mm).
    pub positions: Vec<f64>,
    /// Travel of the needle from its given pose (mm).
    pub travel_mm: f64,
    /// How far the tip stands aside of a rigid needle's (mm), where the shaft bends.
    pub deflection: Option<Vector3<f64>>,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: Vector3<f64>,
    /// Cost of all load steps together.
    pub newton: NewtonReport,
    /// Load steps.
    pub load_steps: usize,
}

/// How far the tissue of an equilibrium is from its rest state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strains {
    /// Largest |principal stretch − 1|.
    pub max_strain: f64,
    /// Smallest present volume over that at rest; zero or less where the tissue is turned inside out.
    pub least_volume_ratio: f64,
}

/// The contact of an equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSummary {
    /// Rest area under pressure (mm²).
    pub area_mm2: f64,
    /// Largest pressure (kPa).
    pub max_pressure_kpa: f64,
    /// Deepest penetration (mm).
    pub max_penetration_mm: f64,
    /// Centre of pressure in patch parameters.
    pub center: [f64; 2],
}
