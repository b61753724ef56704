//! A needle driven along a line step by step: displacement control, one equilibrium after another, each with the force that it takes.
//!
//! Every step has a mesh of its own, laid around the contact that `coarse` finds at that travel, as in a single prediction. It starts from the
//! step before: meshes of one topology stand to their contacts alike, so each vertex takes along its displacement, moved by the difference of what linear
//! elasticity expects of it at the two steps. Simulated are finite strain and frictionless contact with a rigid needle ([`EFFECTS`]).
//!
//! Also here: what linear elasticity expects of a request, in numbers ([`PreparedScene::expect`]). Not here: which travels are worth a step.
//! Patch frame for what is expected, scene coordinates for what is answered; the built-in scenes' are the same.

use std::sync::Arc;

use nalgebra::{Unit, Vector3};

use super::choice::adhesion::Pull;
use super::choice::friction::Sliding;
use super::choice::{Decision, Expected};
use super::finite_element::{COARSE, ContactEstimate, FiniteElementAnswer, Resolution};
use super::linear::LinearAnswer;
use super::question::{CutOrGrid, Question};
use super::topologies::shared_topology;
use super::types::{Control, EffectChoice, Level, PredictError, Request};
use super::{PreparedScene, Workspace};
use crate::approach::Touch;
use crate::effects::{contact, finite_strain};
use crate::equilibrium::{Load, Motion};
use crate::mesh::wall::WallTopology;
use crate::needle::{Body, Needle};
use crate::patch::Patch;
use crate::progress::Progress;
use crate::solve::newton;

/// What is simulated, for requests that are to be compared with a step.
pub const EFFECTS: [&str; 2] = [finite_strain::NAME, contact::NAME];

/// Coordinates of the needle's tip, the last of all vertices.
const TIP: usize = 3;

/// What linear elasticity expects of a request, patch frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation {
    /// First touch of needle and surface at rest.
    pub touch: Touch,
    /// Depth along the inward normal (mm).
    pub depth_mm: f64,
    /// Force along it (mN).
    pub normal_force_mn: f64,
    /// Contact radius (mm).
    pub contact_radius_mm: f64,
    /// Largest mean pressure of a ring of the contact (kPa).
    pub max_pressure_kpa: f64,
    /// Centre of the contact, patch parameters (mm).
    pub center: [f64; 2],
    /// Travel of the needle (mm).
    pub travel_mm: f64,
}

impl Expectation {
    fn of(linear: &LinearAnswer) -> Self {
        Expectation {
            touch: linear.press.touch,
            depth_mm: linear.depth_mm,
            normal_force_mn: linear.normal_force_mn,
            contact_radius_mm: linear.contact_radius_mm,
            max_pressure_kpa: linear.max_pressure_kpa,
            center: linear.center,
            travel_mm: linear.travel_mm(),
        }
    }
}

impl PreparedScene {
    /// What linear elasticity expects of `request`; `None` where the needle does not press.
    ///
    /// # Errors
    /// What [`PreparedScene::predict`] would refuse.
    pub fn expect(&self, request: &Request) -> Result<Option<Expectation>, PredictError> {
        request.needle.validate()?;
        let body = request.needle.shape.body();
        let question = Question::new(self, request, &body, self.patch_for(request, &body)?);
        if question.motion.force_mn == Some(0.0) {
            return Ok(None);
        }
        Ok(question.pressed(&question.tool)?.as_ref().map(Expectation::of))
    }
}

/// A thread's memory, reused between indentations.
#[derive(Default)]
pub struct Memory {
    coarse: Workspace,
    fine: Option<(Arc<WallTopology>, newton::Workspace)>,
}

/// An equilibrium on the needle's way.
pub struct IndentationStep {
    /// Displacement of each node of the patch, patch frame (mm).
    pub displacements: Vec<Vector3<f64>>,
    /// Travel of the needle (mm).
    pub travel_mm: f64,
    /// Force of the tissue on the needle, patch frame (mN).
    pub reaction_mn: Vector3<f64>,
    /// Newton iterations on the fine mesh.
    pub iterations: usize,
    /// Largest principal stretch minus one, in magnitude, anywhere in the tissue.
    pub max_strain: f64,
}

/// The state that the next step starts from: positions of all vertices, the needle's tip last.
struct Before {
    positions: Vec<f64>,
    /// What linear elasticity expected of them.
    expected: Vec<f64>,
}

/// A needle on its way.
pub struct Indentation<'a> {
    prepared: &'a PreparedScene,
    body: Body,
    patch: Patch,
    request: Request,
    direction: Unit<Vector3<f64>>,
    resolution: Resolution,
    topology: Arc<WallTopology>,
    before: Option<Before>,
}

impl<'a> Indentation<'a> {
    /// `needle` before it moves, to be driven along `direction` (scene coordinates) into the tissue meshed as finely as `resolution` says.
    ///
    /// # Errors
    /// [`PredictError`] for a needle out of its ranges or a mesh that cannot be.
    pub fn new(
        prepared: &'a PreparedScene,
        needle: Needle,
        direction: Unit<Vector3<f64>>,
        resolution: Resolution,
    ) -> Result<Self, PredictError> {
        needle.validate()?;
        let request = Request {
            needle,
            control: Control::Force(direction.into_inner()),
            level: Level::Reference,
            effects: EffectChoice::Named(EFFECTS.map(str::to_owned).to_vec()),
        };
        let body = needle.shape.body();
        let patch = prepared.patch_for(&request, &body)?.patch().clone();
        let direction = patch.scene_from_patch.inverse() * direction;
        let topology = shared_topology(resolution.division(&prepared.scene().tissue, false))?;
        Ok(Indentation { prepared, body, patch, request, direction, resolution, topology, before: None })
    }

    /// The patch that the needle is driven into.
    pub fn patch(&self) -> &Patch {
        &self.patch
    }

    fn question(&self, travel_mm: f64) -> Question<'_> {
        let mut question = Question::new(self.prepared, &self.request, &self.body, CutOrGrid::Grid(&self.patch));
        question.motion = Motion { direction: self.direction, force_mn: None, travel_mm };
        question
    }

    /// What linear elasticity expects of the needle driven by `travel_mm` from its given pose; `None` where it does not press.
    ///
    /// # Errors
    /// [`PredictError`] for a motion that leads out of the tissue, beside the patch or beyond the depth for which tissue models hold.
    pub fn expect(&self, travel_mm: f64) -> Result<Option<Expectation>, PredictError> {
        let question = self.question(travel_mm);
        Ok(question.pressed(&question.tool)?.as_ref().map(Expectation::of))
    }

    /// The equilibrium with the needle driven by `travel_mm` from its given pose; `None` where it does not press. A step that fails leaves nothing
    /// to start from.
    ///
    /// # Errors
    /// [`PredictError`].
    pub fn advance(
        &mut self,
        travel_mm: f64,
        memory: &mut Memory,
        progress: &mut dyn Progress,
    ) -> Result<Option<IndentationStep>, PredictError> {
        let before = self.before.take();
        progress.stage("linear");
        let question = self.question(travel_mm);
        let Some(linear) = question.pressed(&question.tool)? else { return Ok(None) };
        let (answer, now) = self.solve(&question, &linear, before, memory, progress)?;
        self.before = Some(now);
        Ok(Some(IndentationStep {
            displacements: answer.displacements,
            travel_mm: answer.travel_mm,
            reaction_mn: answer.reaction_mn,
            iterations: answer.solver.iterations,
            max_strain: answer.contact.max_strain,
        }))
    }

    fn solve(
        &self,
        question: &Question,
        linear: &LinearAnswer,
        before: Option<Before>,
        memory: &mut Memory,
        progress: &mut dyn Progress,
    ) -> Result<(FiniteElementAnswer, Before), PredictError> {
        let decision = decided(question, linear)?;
        let found = question.coarse(&COARSE, linear, &decision, None, &mut memory.coarse, progress)?.estimate;
        let aim =
            ContactEstimate { center: found.center, radius_mm: found.radius_mm, ..question.estimate(linear, false) };
        progress.stage("mesh");
        let problem = question.problem(&decision, None);
        let wall = problem.wall(&self.topology, &self.resolution, &problem.mesh(&self.resolution, &aim))?;
        let (motion, touch_mm) = problem.aimed(&wall, &self.resolution, &aim);
        let mut expected = wall.displaced(&question.start(linear, false));
        wall.place_tip(&mut expected, &(motion.direction.into_inner() * motion.travel_mm));
        let start = carried(before.as_ref(), &expected);
        progress.stage("equilibrium");
        let solver = match &mut memory.fine {
            Some((topology, solver)) if Arc::ptr_eq(topology, &self.topology) => solver,
            slot => {
                let solver = newton::Workspace::new(&self.topology.pattern, &self.topology.symbolic);
                &mut slot.insert((self.topology.clone(), solver)).1
            }
        };
        let level = Level::Reference.name();
        let equilibrium = wall
            .solve(&Load { motion: &motion, touch_mm, additions: &[] }, start, solver, progress)
            .map_err(|cause| PredictError::Solver { level, cause })?;
        progress.stage("surface");
        let answer = problem.answer(&wall, &self.resolution, &equilibrium, touch_mm);
        Ok((answer, Before { positions: equilibrium.positions, expected }))
    }
}

/// The decision for [`EFFECTS`].
fn decided(question: &Question, linear: &LinearAnswer) -> Result<Decision, PredictError> {
    let tissue = &question.prepared.scene().tissue;
    let expected = Expected {
        depth_mm: linear.depth_mm,
        strain: linear.depth_mm / question.yielding_mm(),
        sliding: Sliding {
            coefficient: question.prepared.scene().friction_coefficient,
            depth_mm: linear.depth_mm,
            tangent: linear.press.tangent(),
            along_mm: 0.0,
        },
        pull: Pull {
            normal_force_mn: linear.normal_force_mn,
            tangential_share: 0.0,
            suction_kpa: 0.0,
            depth_mm: tissue.retina_thickness_mm(),
            strength_kpa: tissue.bond.strength_kpa,
        },
        bending: question.bending(Some(linear)),
        limits: question.puncture_limits(),
    };
    question.decide(expected, &question.sink())
}

/// Where the vertices start: as `expected`, and off it by what the step before was off its own expectation. The needle's tip stands where it is told.
fn carried(before: Option<&Before>, expected: &[f64]) -> Vec<f64> {
    let mut start = expected.to_vec();
    if let Some(Before { positions, expected }) = before {
        let tissue = start.len() - TIP;
        for (start, (settled, expected)) in start[..tissue].iter_mut().zip(positions.iter().zip(expected)) {
            *start += settled - expected;
        }
    }
    start
}
