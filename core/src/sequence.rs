//! A sequence: a timed list of needle poses and forces in, one surface after another out.
//!
//! A [`Simulation`] is planned from a sequence. Either it computes the sequence's own steps ([`Simulation::step`]), or it takes the sequence for a rehearsal and its steps come
//! one by one, the next unknown ([`Simulation::advance_to`]); both are the same steps to the same bits, and one that fails leaves everything as the last good one left it.
//!
//! Time runs from 0, when the tissue is at rest under the pressure of its eye; the load of a step is reached at the step's time, linearly from the step before. Without
//! memory every step is an equilibrium of its own, and the step before is only its start. Memory is of two kinds, and [`Simulation`] carries both from
//! step to step: of time (`viscoelasticity`, `inertia`), and of the way, however slowly it is gone (`friction`: where the needle holds the tissue; `adhesion`:
//! how far the bond was torn). Fluid under the retina is a load like the needle: a step says how much there is of it at its time, and before the first the tissue has been at rest over what the
//! scene has of it.
//!
//! Where the mesh stands: a mesh as coarse as `coarse` answers well only for the contact that it was made for (a contact of half the radius is off by a
//! third of its motion). So without memory a step keeps the mesh, and starts from the step before, while its expected contact stays within
//! two hundredths of a radius of the one that the mesh was laid around, as in a stream at haptic rate; else it gets a mesh of its own and a fresh linear
//! start, and says so. Tissue once punctured stays so in every step that follows, which say since when. What tissue remembers lives in its elements and faces: with memory one mesh lasts from first to last. It is laid around
//! all expected contacts, level `coarse` divides it more finely ([`LASTING`]) unless all of them are one and nothing depends on time, and a step whose contact leaves its fine zone carries a
//! warning that says by how much.
//!
//! Read on in `plan` (every step checked before the first is computed), `rates` (which effects of time are called for), `history` and `bond` (what is
//! remembered), `advance` (one step), `worst` (what a step calls for), `cut` (a step in parts), `fluid` (what is under the retina). Not here: clocks, threads, the wire.

mod advance;
mod bond;
mod cut;
mod fluid;
mod history;
mod plan;
mod rates;
mod worst;

use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::equilibrium::MeshSize;
use crate::mesh::wall::WallTopology;
use crate::needle::{Body, Needle};
use crate::patch::Patch;
use crate::predict::answer::resolved;
use crate::predict::choice::Decision;
use crate::predict::finite_element::{COARSE, ContactEstimate, REFERENCE, Resolution};
use crate::predict::topologies::shared_topology;
use crate::predict::{self, EffectChoice, EffectReport, Level, PredictError, Prediction, PreparedScene};
use crate::progress::Progress;
use crate::range::ParameterRange;
use crate::scene::bleb::Filling;
use crate::solve::newton;
use history::History;
use plan::Plan;
use rates::Rates;
use worst::Worst;

/// Time between two steps.
pub const TIME_STEP: ParameterRange = ParameterRange {
    name: "time between steps",
    unit: "s",
    default: 0.1,
    min: 1e-6,
    max: 1e3,
    source: "bound of this program: a thousandth of the tissue's slowest period to ten times its longest relaxation time",
};

/// Level `coarse` on a mesh that lasts: over contacts of a third to the whole of the radius that it was laid around it is nearer to `reference` than
/// `coarse` is on a mesh made for each (measured), at two to three times the cost.
pub const LASTING: Resolution = Resolution { core_cells: 2, core_per_contact: 1.0, ..COARSE };

/// One step. What is left out stays as the step before left it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// When the step's load is reached (s); the tissue is at rest at 0.
    pub time_s: f64,
    /// Foremost point of the needle (scene coordinates) (mm).
    pub tip_mm: Option<Point3<f64>>,
    /// Rotation from needle-local to scene coordinates.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// The needle advances along this force (mN) until the tissue's reaction along it equals the force; zero withdraws it. `None`: it
    /// stays where it is, and the reaction is the answer.
    pub force_mn: Option<Vector3<f64>>,
    /// What there is of the fluid under the retina at the step's time, on the scene's detached disc: before the first step the scene's own. The disc stays as wide as it is.
    pub fluid: Option<Filling>,
}

/// A timed list of needle poses and forces.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequence {
    /// The needle before the first step.
    pub needle: Needle,
    /// The steps, in order of time.
    pub steps: Vec<Step>,
    /// Which level answers; `linear` has no sequence.
    pub level: Level,
    /// Which effects are simulated.
    pub effects: EffectChoice,
}

/// Why a sequence cannot begin or go on.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SequenceError {
    /// There is no step.
    #[error("steps: there must be at least one")]
    NoSteps,
    /// Two steps lie too close together, too far apart or in the wrong order.
    #[error("steps[{step}].time_s is {step_s} s after what comes before; {min_s} to {max_s} s are allowed")]
    Time {
        /// Index of the step.
        step: usize,
        /// Time since the step before, or since 0 (s).
        step_s: f64,
        /// Least allowed (s).
        min_s: f64,
        /// Most allowed (s).
        max_s: f64,
    },
    /// The level has no sequence.
    #[error("level `{level}` answers one load at a time; a sequence needs `coarse` or `reference`")]
    Level {
        /// The level asked for.
        level: &'static str,
    },
    /// A step cannot be, or has no answer.
    #[error("steps[{step}] at {time_s} s: {cause}")]
    At {
        /// Index of the step.
        step: usize,
        /// Its time (s).
        time_s: f64,
        /// Why.
        cause: PredictError,
    },
}

/// Why a step has no answer. Nothing has changed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StepError {
    /// It lies too close to the step before, too far from it or before it.
    #[error("time_s is {step_s} s after what comes before; {min_s} to {max_s} s are allowed")]
    Time {
        /// Time since the step before, or since 0 (s).
        step_s: f64,
        /// Least allowed (s).
        min_s: f64,
        /// Most allowed (s).
        max_s: f64,
    },
    /// It cannot be, or no equilibrium was found.
    #[error(transparent)]
    Predict(#[from] PredictError),
}

impl StepError {
    /// The error of the step at `time_s`, the sequence's `step`-th.
    fn of(self, step: usize, time_s: f64) -> SequenceError {
        match self {
            StepError::Time { step_s, min_s, max_s } => SequenceError::Time { step, step_s, min_s, max_s },
            StepError::Predict(cause) => SequenceError::At { step, time_s, cause },
        }
    }
}

/// The answer of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOutcome {
    /// Number of the step among those answered, from 0.
    pub step: usize,
    /// Its time (s).
    pub time_s: f64,
    /// Whether a mesh was laid for this step: it did not start from the step before.
    pub mesh_laid: bool,
    /// Surface, needle, contact and cost.
    pub prediction: Prediction,
}

/// The mesh and the contact that it was laid around.
#[derive(Clone, Debug)]
struct Laid {
    contact: ContactEstimate,
    size: MeshSize,
    /// What every step's caller should know of it.
    warning: Option<String>,
}

/// Where a step ended, on the mesh that is laid.
#[derive(Clone, Debug)]
struct Settled {
    /// Positions of every vertex (mm).
    positions: Vec<f64>,
    /// Where linear elasticity had expected them (mm).
    expected: Vec<f64>,
    /// Whether the needle was pressed in.
    pressed: bool,
}

/// What is kept from step to step.
#[derive(Clone, Debug)]
struct State {
    time_s: f64,
    needle: Needle,
    /// Force of the tissue on it at the end of the last part of a step, scene coordinates (mN).
    reaction_mn: Vector3<f64>,
    laid: Option<Laid>,
    settled: Option<Settled>,
    history: Option<History>,
    /// The time of the first step whose tissue was punctured (s).
    punctured_s: Option<f64>,
    /// What decides about the effects, of the steps so far.
    met: Worst,
    /// What there is of the fluid, where the scene has a detached disc.
    filling: Option<Filling>,
    /// Pressure of the fluid above that in the eye (kPa), where one was found.
    fluid_kpa: Option<f64>,
}

/// A needle's motion under way, planned from a sequence.
pub struct Simulation {
    prepared: Arc<PreparedScene>,
    sequence: Sequence,
    body: Body,
    patch: Patch,
    plan: Plan,
    decision: Decision,
    rates: Rates,
    resolution: Resolution,
    topology: Arc<WallTopology>,
    solver: newton::Workspace,
    coarse: predict::Workspace,
    /// Steps answered.
    answered: usize,
    state: State,
}

impl Simulation {
    /// Checks every step by linear elasticity and decides which effects the sequence calls for. Nothing is simulated yet.
    ///
    /// # Errors
    /// [`SequenceError`], naming the step at fault.
    pub fn new(
        prepared: &Arc<PreparedScene>,
        sequence: &Sequence,
        progress: &mut dyn Progress,
    ) -> Result<Self, SequenceError> {
        Self::at(prepared, sequence, None, progress)
    }

    /// As [`Simulation::new`], with `resolution` in place of the level's: for measuring what refinement changes.
    ///
    /// # Errors
    /// [`SequenceError`], naming the step at fault.
    pub fn at(
        prepared: &Arc<PreparedScene>,
        sequence: &Sequence,
        resolution: Option<&Resolution>,
        progress: &mut dyn Progress,
    ) -> Result<Self, SequenceError> {
        if sequence.level == Level::Linear || sequence.level.is_learned() {
            return Err(SequenceError::Level { level: sequence.level.name() });
        }
        progress.stage("plan");
        let body = sequence.needle.shape.body();
        let (patch, plan) = plan::plan(prepared, sequence, &body, progress)?;
        let first = |cause| SequenceError::At { step: 0, time_s: sequence.steps[0].time_s, cause };
        let (decision, rates) = rates::decide(prepared, sequence, &plan);
        let lasts = rates.any() || decision.is_path_dependent();
        let resolution = *resolution.unwrap_or(match sequence.level {
            Level::Reference => &REFERENCE,
            _ if rates.any() || (decision.is_path_dependent() && !plan.is_one_contact) => &LASTING,
            _ => &COARSE,
        });
        let resolution = resolved(&resolution, &decision);
        plan.check_over_fluid(&body, &resolution, lasts).map_err(|(step, cause)| SequenceError::At {
            step,
            time_s: sequence.steps[step].time_s,
            cause,
        })?;
        let topology = shared_topology(resolution.division(&prepared.scene().tissue, decision.parts()))
            .map_err(|error| first(PredictError::Mesh(error)))?;
        Ok(Simulation {
            prepared: Arc::clone(prepared),
            sequence: sequence.clone(),
            body,
            patch,
            decision,
            rates,
            resolution,
            solver: newton::Workspace::new(&topology.pattern, &topology.symbolic),
            topology,
            coarse: predict::Workspace::default(),
            answered: 0,
            state: State {
                time_s: 0.0,
                needle: sequence.needle,
                reaction_mn: Vector3::zeros(),
                laid: None,
                settled: None,
                history: None,
                punctured_s: None,
                met: plan.unpressed,
                filling: prepared.scene().bleb.map(|fluid| fluid.filling),
                fluid_kpa: None,
            },
            plan,
        })
    }

    /// Every effect, simulated or not, and why; the same for all steps.
    pub fn effects(&self) -> &[EffectReport] {
        &self.decision.reports
    }

    /// Whether some step of the plan loads the tissue: the needle presses it, or fluid lifts it. Where none does, nothing is known of what a load would call for.
    pub fn loads(&self) -> bool {
        self.plan.around.is_some() || self.plan.bleb.is_some()
    }

    /// Whether a step depends on those before it: its mesh then lasts.
    fn remembers(&self) -> bool {
        self.rates.any() || self.decision.is_path_dependent()
    }

    /// Triangles between the nodes of every step's surface, counter-clockwise seen from the vitreous.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.patch.triangles
    }

    /// The time of the last step answered; 0 before the first (s).
    pub fn time_s(&self) -> f64 {
        self.state.time_s
    }

    /// Computes the next of the sequence's own steps; `None` after the last.
    ///
    /// # Errors
    /// [`SequenceError`] of that step, which is the next again.
    pub fn step(&mut self, progress: &mut dyn Progress) -> Result<Option<StepOutcome>, SequenceError> {
        let Some(&step) = self.sequence.steps.get(self.answered) else { return Ok(None) };
        self.advance_to(&step, progress).map(Some).map_err(|error| error.of(self.answered, step.time_s))
    }

    /// Computes `step`, whatever the sequence says. It goes on from the last that was answered, and what it leaves out stays as that left it.
    ///
    /// # Errors
    /// [`StepError`]; nothing has changed then, so another step may take its place.
    pub fn advance_to(&mut self, step: &Step, progress: &mut dyn Progress) -> Result<StepOutcome, StepError> {
        check_time(self.state.time_s, step.time_s)?;
        let before = self.state.clone();
        match self.advance(step, progress) {
            Ok((prediction, mesh_laid)) => {
                self.answered += 1;
                Ok(StepOutcome { step: self.answered - 1, time_s: step.time_s, mesh_laid, prediction })
            }
            Err(cause) => {
                self.state = before;
                Err(cause.into())
            }
        }
    }
}

/// Whether a step at `time_s` may follow what was at `before_s` (s).
fn check_time(before_s: f64, time_s: f64) -> Result<(), StepError> {
    let step_s = time_s - before_s;
    // Times a bound apart differ by a little less or more once they are written with a finite number of digits.
    let rounding_s = f64::EPSILON * time_s.abs();
    let widened = ParameterRange { min: TIME_STEP.min - rounding_s, max: TIME_STEP.max + rounding_s, ..TIME_STEP };
    widened.check("", step_s).map_err(|_| StepError::Time { step_s, min_s: TIME_STEP.min, max_s: TIME_STEP.max })
}
