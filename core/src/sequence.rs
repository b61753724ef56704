//! A sequence: a timed list of needle poses and forces in, one surface after another out.
//!
//! Time runs from 0, when the tissue is at rest under the pressure of its eye; the load of a step is reached at the step's time, linearly from the step before. Without
//! memory every step is an equilibrium of its own, and the step before is only its start. Memory is of two kinds, and [`Simulation`] carries both from
//! step to step: of time (`viscoelasticity`, `inertia`), and of the way, however slowly it is gone (`friction`: where the needle holds the tissue; `adhesion`:
//! how far the bond was torn).
//!
//! Where the mesh stands: a mesh as coarse as `coarse` answers well only for the contact that it was made for (a contact of half the radius is off by a
//! third of its motion). So without memory a step keeps the mesh, and starts from the step before, while its expected contact stays within
//! two hundredths of a radius of the one that the mesh was laid around, as in a stream at haptic rate; else it gets a mesh of its own and a fresh linear
//! start, and says so. Tissue once punctured stays so in every step that follows, which say since when. What tissue remembers lives in its elements and faces: with memory one mesh lasts from first to last. It is laid around
//! all expected contacts, level `coarse` divides it more finely ([`LASTING`]) unless all of them are one and nothing depends on time, and a step whose contact leaves its fine zone carries a
//! warning that says by how much.
//!
//! Read on in `plan` (every step checked before the first is computed), `rates` (which effects of time are called for), `history` and `bond` (what is
//! remembered), `advance` (one step), `cut` (a step in parts). Not here: clocks, threads, the wire.

mod advance;
mod bond;
mod cut;
mod history;
mod plan;
mod rates;

use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::equilibrium::MeshSize;
use crate::mesh::wall::WallTopology;
use crate::needle::{Body, Needle};
use crate::predict::choice::Decision;
use crate::predict::finite_element::{COARSE, ContactEstimate, REFERENCE, Resolution};
use crate::predict::topologies::shared_topology;
use crate::predict::{self, CutOrGrid, EffectChoice, EffectReport, Level, PredictError, Prediction, PreparedScene};
use crate::progress::Progress;
use crate::range::ParameterRange;
use crate::solve::newton;
use history::History;
use plan::Plan;
use rates::Rates;

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
    /// A step has no answer.
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

/// The answer of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOutcome {
    /// Index of the step.
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

/// A sequence under way: what is kept between its steps.
pub struct Simulation<'a> {
    prepared: &'a PreparedScene,
    sequence: &'a Sequence,
    body: Body,
    patch: CutOrGrid<'a>,
    plan: Plan,
    decision: Decision,
    rates: Rates,
    resolution: &'a Resolution,
    topology: Arc<WallTopology>,
    solver: newton::Workspace,
    coarse: predict::Workspace,
    next: usize,
    time_s: f64,
    needle: Needle,
    /// Force of the tissue on it at the end of the last part of a step, scene coordinates (mN).
    reaction_mn: Vector3<f64>,
    laid: Option<Laid>,
    settled: Option<Settled>,
    history: Option<History>,
    /// The first step whose tissue was punctured, and its time (s).
    punctured: Option<(usize, f64)>,
}

impl<'a> Simulation<'a> {
    /// Checks every step by linear elasticity and decides which effects the sequence calls for. Nothing is simulated yet.
    ///
    /// # Errors
    /// [`SequenceError`], naming the step at fault.
    pub fn new(
        prepared: &'a PreparedScene,
        sequence: &'a Sequence,
        progress: &mut dyn Progress,
    ) -> Result<Self, SequenceError> {
        Self::at(prepared, sequence, None, progress)
    }

    /// As [`Simulation::new`], with `resolution` in place of the level's: for measuring what refinement changes.
    ///
    /// # Errors
    /// [`SequenceError`], naming the step at fault.
    pub fn at(
        prepared: &'a PreparedScene,
        sequence: &'a Sequence,
        resolution: Option<&'a Resolution>,
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
        let resolution = resolution.unwrap_or(match sequence.level {
            Level::Reference => &REFERENCE,
            _ if rates.any() || (decision.is_path_dependent() && !plan.is_one_contact()) => &LASTING,
            _ => &COARSE,
        });
        let topology = shared_topology(resolution.division(&prepared.scene().tissue, decision.adhesion))
            .map_err(|error| first(PredictError::Mesh(error)))?;
        let solver = newton::Workspace::new(&topology.pattern, &topology.symbolic);
        Ok(Simulation {
            prepared,
            sequence,
            body,
            patch,
            plan,
            decision,
            rates,
            resolution,
            topology,
            solver,
            coarse: predict::Workspace::default(),
            next: 0,
            time_s: 0.0,
            needle: sequence.needle,
            reaction_mn: Vector3::zeros(),
            laid: None,
            settled: None,
            history: None,
            punctured: None,
        })
    }

    /// Every effect, simulated or not, and why; the same for all steps.
    pub fn effects(&self) -> &[EffectReport] {
        &self.decision.reports
    }

    /// Whether a step depends on those before it: its mesh then lasts.
    fn remembers(&self) -> bool {
        self.rates.any() || self.decision.is_path_dependent()
    }

    /// Triangles between the nodes of every step's surface, counter-clockwise seen from the vitreous.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.patch.patch().triangles
    }

    /// Computes the next step; `None` after the last. After an error the steps that follow have nothing to start from.
    ///
    /// # Errors
    /// [`SequenceError::At`].
    pub fn step(&mut self, progress: &mut dyn Progress) -> Result<Option<StepOutcome>, SequenceError> {
        let Some(step) = self.sequence.steps.get(self.next) else { return Ok(None) };
        let (index, time_s) = (self.next, step.time_s);
        let outcome = self.advance(step, progress);
        let (prediction, mesh_laid) = outcome.map_err(|cause| SequenceError::At { step: index, time_s, cause })?;
        self.next += 1;
        Ok(Some(StepOutcome { step: index, time_s, mesh_laid, prediction }))
    }
}
