//! What goes into a prediction and what comes out of it. All coordinates are the scene's.

use nalgebra::{Point3, Vector3};
use thiserror::Error;

use super::choice::AUTO_TOLERANCE_UM;
use super::expected_error::ExpectedError;
use crate::equilibrium::error::EquilibriumError;
use crate::mesh::wall::WallError;
use crate::needle::Needle;
use crate::network::weights::WeightsError;
use crate::patch::PatchError;
use crate::range::OutOfRange;

/// How accurate, and at what cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Level {
    /// Layered linear elasticity and an axisymmetric contact law, prepared once per scene: tens of microseconds.
    Linear,
    /// The linear answer with what a network learned that it lacks: a few tenths of a millisecond.
    Network,
    /// Finite elements on a mesh that fits in milliseconds.
    Coarse,
    /// `Coarse` with what a network learned about its error.
    Corrected,
    /// Finite elements on the converged mesh: seconds.
    Reference,
}

impl Level {
    /// Every level, cheapest first.
    pub const ALL: [Level; 5] = [Level::Linear, Level::Network, Level::Coarse, Level::Corrected, Level::Reference];

    /// Whether a network has a part in its answer.
    pub fn is_learned(self) -> bool {
        matches!(self, Level::Network | Level::Corrected)
    }

    /// The level's name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Level::Linear => "linear",
            Level::Network => "network",
            Level::Coarse => "coarse",
            Level::Corrected => "corrected",
            Level::Reference => "reference",
        }
    }
}

/// What is given about the needle's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// The needle advances along this force until the tissue's reaction along it equals the force (mN).
    Force(Vector3<f64>),
    /// The needle stays where it is; the reaction is the answer.
    Pose,
}

/// Which effects to simulate.
#[derive(Clone, Debug, PartialEq, Default)]
pub enum EffectChoice {
    /// Those that the scene calls for: leaving out any other costs no more than [`AUTO_TOLERANCE_UM`].
    #[default]
    Auto,
    /// Those that the scene calls for, with another tolerance.
    AutoWithin {
        /// Error that may be accepted for leaving an effect out (µm).
        tolerance_um: f64,
    },
    /// All that the level knows.
    All,
    /// These, by name.
    Named(Vec<String>),
}

impl EffectChoice {
    /// What the scene calls for where all errors together may be `max_error_um` (µm).
    pub fn auto_for(max_error_um: f64) -> Self {
        EffectChoice::AutoWithin { tolerance_um: max_error_um * EFFECT_SHARE }
    }

    /// Error that may be accepted for leaving an effect out (µm).
    pub fn tolerance_um(&self) -> f64 {
        match self {
            EffectChoice::AutoWithin { tolerance_um } => *tolerance_um,
            EffectChoice::Auto | EffectChoice::All | EffectChoice::Named(_) => AUTO_TOLERANCE_UM,
        }
    }
}

/// Share of a requested error that leaving an effect out may cost; the rest is the level's.
const EFFECT_SHARE: f64 = 0.2;

/// A question to a prepared scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// The needle before it moves.
    pub needle: Needle,
    /// Force or pose control.
    pub control: Control,
    /// Which level answers.
    pub level: Level,
    /// Which effects are simulated.
    pub effects: EffectChoice,
}

/// Whether needle and retina touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactState {
    /// They do not.
    Clear,
    /// They do.
    Touching,
    /// They do, and most of the normal force acts where the tissue slides along the needle; told only where friction is simulated.
    Slipping,
    /// A limit of the tissue is exceeded: what is told is the tissue as if it were still whole.
    Punctured,
}

/// Where the needle ends up and what holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeedleOutcome {
    /// Foremost point, the deflection included (mm).
    pub tip_mm: Point3<f64>,
    /// Advance along the force from where it was given (mm); zero under pose control.
    pub travel_mm: f64,
    /// How far the tip stands aside of a rigid needle's (mm), where the shaft's bending is simulated.
    pub deflection_mm: Option<Vector3<f64>>,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: Vector3<f64>,
}

/// The contact at equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactReport {
    /// Whether there is any.
    pub state: ContactState,
    /// Contact area, measured on the surface at rest (mm²).
    pub area_mm2: f64,
    /// Largest contact pressure (kPa).
    pub max_pressure_kpa: f64,
    /// Deepest penetration of the needle into the tissue that the contact law left (mm).
    pub max_penetration_mm: f64,
    /// Largest principal stretch minus one, in magnitude, anywhere in the tissue (an estimate at level `linear`).
    pub max_strain: f64,
    /// Smallest present volume over that at rest, anywhere in the tissue; `None` at level `linear`, which knows no elements.
    pub least_volume_ratio: Option<f64>,
    /// Share of the normal force that acts where the tissue slides along the needle, 0 to 1; where friction is simulated.
    pub slipping_share: Option<f64>,
    /// Largest share of the strength that the retina's bond has lost anywhere, 0 intact to 1 parted; where adhesion is simulated.
    pub bond_damage: Option<f64>,
    /// Fluid under the retina, where it is simulated.
    pub bleb: Option<BlebReport>,
    /// Force and strain over what the tissue bears, the larger of the two: above 1 it counts as punctured.
    pub puncture_share: f64,
}

/// Fluid under the retina at equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlebReport {
    /// Its pressure above that in the eye (kPa).
    pub pressure_kpa: f64,
    /// Its volume (mm³).
    pub volume_mm3: f64,
}

/// One effect: simulated or not, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectReport {
    /// Name of the effect.
    pub name: &'static str,
    /// Whether it was simulated.
    pub simulated: bool,
    /// Why, in words.
    pub reason: String,
    /// The number decided on, if there was one.
    pub value: Option<f64>,
    /// What it was compared with.
    pub threshold: Option<f64>,
}

/// What the solution cost, in units that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// Newton iterations over all meshes and load steps.
    pub iterations: usize,
    /// Load steps.
    pub load_steps: usize,
    /// Unknowns of the last mesh.
    pub unknowns: usize,
    /// Residual force at the end (mN).
    pub residual_mn: f64,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Deformed nodes (mm).
    pub vertices: Vec<Point3<f64>>,
    /// Unit normals of the deformed surface at the nodes, out of the tissue.
    pub normals: Vec<Vector3<f64>>,
    /// Triangles, counter-clockwise seen from the vitreous.
    pub triangles: Vec<[usize; 3]>,
    /// Length of each node's displacement (µm).
    pub displacement_um: Vec<f64>,
    /// For a patch cut from a mesh: the mesh's index of each node.
    pub source_indices: Option<Vec<usize>>,
    /// The needle.
    pub needle: NeedleOutcome,
    /// The contact.
    pub contact: ContactReport,
    /// Which level answered.
    pub level: Level,
    /// How far the answer is likely to be from the truth.
    pub expected_error: ExpectedError,
    /// Every effect, simulated or not.
    pub effects: Vec<EffectReport>,
    /// What it cost.
    pub solver: SolverReport,
    /// What the caller should know besides.
    pub warnings: Vec<String>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PredictError {
    /// No level keeps a strict budget.
    #[error("the accuracy asked for cannot be kept: {problem}")]
    Budget {
        /// What would be broken, and by how much.
        problem: String,
    },
    /// A number outside its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The needle or the force points out of the tissue, or along its surface.
    #[error(
        "{field} leans {angle_deg:.1} degrees from the inward surface normal; at most {max_deg} degrees are allowed"
    )]
    PointsAway {
        /// `needle.direction` or `force_mn`.
        field: &'static str,
        /// Angle to the inward normal at the contact (degrees).
        angle_deg: f64,
        /// Largest allowed angle (degrees).
        max_deg: f64,
    },
    /// The contact would lie outside of the patch.
    #[error(
        "the needle meets the tissue at ({x_mm:.3}, {y_mm:.3}) mm of the patch frame, outside of the patch (at most {limit_mm} mm from its centre in x and y)"
    )]
    OutsidePatch {
        /// Contact point, patch frame (mm).
        x_mm: f64,
        /// Contact point, patch frame (mm).
        y_mm: f64,
        /// Largest allowed coordinate (mm).
        limit_mm: f64,
    },
    /// The force would press beyond what the tissue model holds for.
    #[error(
        "{force_mn} mN on a needle of {radius_mm} mm radius presses the tissue with {pressure_kpa:.1} kPa, beyond the {limit_kpa:.1} kPa up to which the model of this tissue holds (puncture)"
    )]
    BeyondPuncture {
        /// Force along the surface normal that the force asks for (mN).
        force_mn: f64,
        /// Needle radius (mm).
        radius_mm: f64,
        /// Force over the needle's cross-section (kPa).
        pressure_kpa: f64,
        /// Largest allowed value of it (kPa).
        limit_kpa: f64,
    },
    /// The needle would go deeper into the tissue than the model holds for.
    #[error(
        "the needle would stand {depth_mm:.3} mm deep in the tissue (by linear elasticity), beyond the limit of {limit_mm:.3} mm"
    )]
    TooDeep {
        /// Depth below the rest surface along its normal (mm).
        depth_mm: f64,
        /// Largest allowed depth (mm).
        limit_mm: f64,
    },
    /// An effect that does not exist, or that the level cannot do without.
    #[error("effect `{name}`: {problem}")]
    Effect {
        /// The name asked for.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The patch could not be cut from the scene's mesh.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// The wall could not be meshed.
    #[error(transparent)]
    Mesh(#[from] WallError),
    /// The equilibrium was not found.
    #[error("no equilibrium at level `{level}`: {cause}")]
    Solver {
        /// The level.
        level: &'static str,
        /// The last attempt's failure.
        cause: EquilibriumError,
    },
    /// The detached disc does not lie under the patch.
    #[error(
        "the middle of the bleb lies at ({x_mm:.3}, {y_mm:.3}) mm of the patch frame, outside of the patch (at most {limit_mm} mm from its centre in x and y)"
    )]
    BlebOutsidePatch {
        /// Middle of the bleb, patch frame (mm).
        x_mm: f64,
        /// Middle of the bleb, patch frame (mm).
        y_mm: f64,
        /// Largest allowed coordinate (mm).
        limit_mm: f64,
    },
    /// The contact is not over the fluid: no mesh resolves both it and the edge of the detached disc.
    #[error(
        "`bleb` needs a contact over its fluid: this one, of {core_mm:.3} mm radius in the mesh, lies {away_mm:.3} mm from its middle (both lengths together at most {most_mm:.3} mm); leave it out of `effects` to press beside it"
    )]
    BesideBleb {
        /// Radius of the mesh's core around the contact (mm).
        core_mm: f64,
        /// Distance of the contact's centre from the bleb's (mm).
        away_mm: f64,
        /// Radius of the bleb (mm).
        radius_mm: f64,
        /// Largest sum of the first two (mm).
        most_mm: f64,
    },
    /// A step tells of fluid under the retina of a scene where nothing is detached.
    #[error("a step has fluid under the retina, and the scene has no detached disc for it (`scene.bleb`)")]
    NoBleb,
    /// The equilibrium with fluid under the retina was not found.
    #[error("no equilibrium at level `{level}` with `bleb` ({held}): {cause}")]
    Bleb {
        /// The level.
        level: &'static str,
        /// What was held of the fluid.
        held: String,
        /// The last attempt's failure.
        cause: EquilibriumError,
    },
    /// The level's network cannot be used.
    #[error("level `{level}`: {cause}")]
    Weights {
        /// The level.
        level: &'static str,
        /// What is wrong with its weights.
        cause: WeightsError,
    },
    /// The level's network was not trained for such a request.
    #[error("level `{level}` has no answer here ({field}): {problem}")]
    NotLearned {
        /// The level.
        level: &'static str,
        /// The field of the request.
        field: &'static str,
        /// Why.
        problem: String,
    },
    /// The linear level's preparation or contact law failed.
    #[error("level `linear`: {0}")]
    Linear(String),
}
