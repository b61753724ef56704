//! One call from a question to an answer: scene, needle, force and level in; surface, normals and report out.
//!
//! [`PreparedScene`] holds what depends on the scene alone; [`Workspace`] is a thread's memory. Read on in `types` (what goes in and comes
//! out), `linear` (the layered answer, start of all others), `finite_element` (the levels on meshes), `choice` (effects). Not here: HTTP, clocks,
//! threads.

pub mod beds;
pub mod budget;
pub mod calibration;
pub mod choice;
pub mod expected_error;
pub mod finite_element;
pub mod linear;
pub(crate) mod topologies;
pub mod types;

pub use types::*;

use std::sync::Arc;

use nalgebra::{Point3, Unit, Vector3};

use crate::effects::{adhesion, contact, finite_strain, friction};
use crate::equilibrium::Solid;
use crate::equilibrium::settled::Settled;
use crate::equilibrium::{Motion, Tool};
use crate::mesh::wall::WallTopology;
use crate::needle::Body;
use crate::patch::{Patch, vertex_normals};
use crate::progress::Progress;
use crate::scene::{Scene, SceneSurface};
use crate::solve::newton;
use beds::Beds;
use budget::{Budget, Choice, LevelTimes};
use choice::adhesion::Pull;
use choice::friction::Sliding;
use choice::{Decision, Expected, decide, pressure};
use expected_error::{ExpectedError, Situation};
use finite_element::{Bench, COARSE, ContactEstimate, FiniteElementAnswer, Problem, REFERENCE, Resolution};
use linear::{LinearAnswer, Load, Press, press};
use topologies::shared_topology;

/// Normal force over the needle's cross-section, in Young's moduli of the innermost retina, beyond which tissue models of this kind do not
/// hold: the needle punctures. Chosen where the finite-element levels still converge throughout; no puncture force of the retina is
/// published.
pub const PUNCTURE_PRESSURE_PER_MODULUS: f64 = 0.75;

/// Depth beyond which no answer is given, as a share of retina and choroid under the contact.
pub const MAX_DEPTH_SHARE: f64 = 0.7;

/// Penetration of the needle into the predicted surface from which on an answer warns of it (mm).
pub const PENETRATION_WARNING_MM: f64 = 5e-3;

/// A scene with everything that depends on it alone. Shared between threads.
pub struct PreparedScene {
    scene: Scene,
    beds: Beds,
    /// The patch, where it does not depend on the contact.
    patch: Option<Patch>,
}

/// A thread's memory, reused between predictions.
#[derive(Default)]
pub struct Workspace {
    coarse: Option<(Arc<WallTopology>, newton::Workspace)>,
}

impl PreparedScene {
    /// Validates and prepares `scene`.
    ///
    /// # Errors
    /// [`PredictError::OutOfRange`] naming the field.
    pub fn new(scene: Scene) -> Result<Self, PredictError> {
        scene.validate()?;
        let patch = match scene.surface {
            SceneSurface::Mesh(_) => None,
            _ => Some(scene.patch(&Point3::origin())?),
        };
        Ok(PreparedScene { beds: Beds::new(&scene), scene, patch })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Memory that the preparation holds (bytes).
    pub fn memory_bytes(&self) -> usize {
        let mesh = match &self.scene.surface {
            SceneSurface::Mesh(mesh) => size_of_val(mesh.vertices()) + size_of_val(mesh.triangles()),
            _ => 0,
        };
        size_of::<Self>() + self.beds.memory_bytes() + mesh
    }

    /// Answers `request`.
    ///
    /// # Errors
    /// [`PredictError`].
    pub fn predict(
        &self,
        request: &Request,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        self.predict_at(request, &REFERENCE, workspace, progress)
    }

    /// As [`PreparedScene::predict`], with `resolution` in place of that of level `reference`: for measuring what refinement changes.
    ///
    /// # Errors
    /// [`PredictError`].
    pub fn predict_at(
        &self,
        request: &Request,
        resolution: &Resolution,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        progress.stage("linear");
        let body = request.needle.shape.body();
        self.aimed(request, &body)?.answer(resolution, workspace, progress)
    }

    /// The level that answers `request` (whose own level does not matter) within `budget`, where the levels take `times_ms`.
    ///
    /// # Errors
    /// [`PredictError::Budget`] for a strict budget that no level keeps; what [`PreparedScene::predict`] would refuse.
    pub fn choose(&self, request: &Request, budget: &Budget, times_ms: &LevelTimes) -> Result<Choice, PredictError> {
        budget.choose(&self.situation(request)?, times_ms)
    }

    /// What is known of `request` before a level computes it.
    ///
    /// # Errors
    /// What [`PreparedScene::predict`] would refuse.
    pub fn situation(&self, request: &Request) -> Result<Situation, PredictError> {
        let body = request.needle.shape.body();
        let question = self.aimed(request, &body)?;
        Ok(match question.begin(&question.raised(&question.sink()))? {
            Begun::Still(_) => question.situation(0.0, 0.0, None),
            Begun::Pressed(linear) => question.situation_under(&linear),
        })
    }

    /// The request in the frame of the patch where the needle touches.
    fn aimed<'a>(&'a self, request: &'a Request, body: &'a Body) -> Result<Question<'a>, PredictError> {
        request.needle.validate()?;
        Ok(Question::new(self, request, body, self.patch_for(request, body)?))
    }

    /// The patch of a request: the scene's own, or the nodes of its mesh nearest to where the needle touches.
    pub(crate) fn patch_for(&self, request: &Request, body: &Body) -> Result<CutOrGrid<'_>, PredictError> {
        if let Some(patch) = &self.patch {
            return Ok(CutOrGrid::Grid(patch));
        }
        let tip = request.needle.tip_mm;
        let first = Question::new(self, request, body, self.patch_around(&tip)?);
        let around = press(first.patch(), &first.tool, &first.motion).map(|press| {
            let [x, y] = press.touch.parameter;
            first.patch().scene_from_patch * first.patch().surface.column(x, y).surface
        });
        self.patch_around(&around.unwrap_or(tip))
    }

    /// The patch of a contact (scene coordinates).
    fn patch_around(&self, contact: &Point3<f64>) -> Result<CutOrGrid<'_>, PredictError> {
        Ok(match &self.patch {
            Some(patch) => CutOrGrid::Grid(patch),
            None => CutOrGrid::Cut(Box::new(self.scene.patch(contact)?)),
        })
    }
}

/// A grid's patch is the scene's, a cut one the request's own.
pub(crate) enum CutOrGrid<'a> {
    Grid(&'a Patch),
    Cut(Box<Patch>),
}

impl CutOrGrid<'_> {
    pub(crate) fn patch(&self) -> &Patch {
        match self {
            CutOrGrid::Grid(patch) => patch,
            CutOrGrid::Cut(patch) => patch,
        }
    }
}

/// A request in the patch frame.
pub(crate) struct Question<'a> {
    pub(crate) prepared: &'a PreparedScene,
    pub(crate) request: &'a Request,
    patch: CutOrGrid<'a>,
    pub(crate) tool: Tool<'a>,
    pub(crate) motion: Motion,
}

impl<'a> Question<'a> {
    /// The request in the frame of `patch`.
    pub(crate) fn new(prepared: &'a PreparedScene, request: &'a Request, body: &'a Body, patch: CutOrGrid<'a>) -> Self {
        let frame = patch.patch().scene_from_patch;
        let patch_from_needle = frame.inverse() * request.needle.scene_from_needle();
        let motion = match request.control {
            Control::Force(force) => Motion {
                direction: Unit::try_new(frame.inverse() * force, 0.0).unwrap_or(-Vector3::z_axis()),
                force_mn: Some(force.norm()),
                travel_mm: 0.0,
            },
            Control::Pose => {
                Motion { direction: patch_from_needle.rotation * -Vector3::z_axis(), force_mn: None, travel_mm: 0.0 }
            }
        };
        Question { prepared, request, patch, tool: Tool { body, patch_from_needle }, motion }
    }
}

/// What a request comes to before any level computes it.
enum Begun<'a> {
    /// Nothing moves, for this reason.
    Still(&'static str),
    /// The needle presses.
    Pressed(LinearAnswer<'a>),
}

/// What the eye's pressure does by itself.
pub(crate) struct Sink {
    /// The decision about the effect.
    pub(crate) report: EffectReport,
    /// Change of the pressure (kPa), where it is simulated.
    change_kpa: Option<f64>,
    /// Sinking that linear elasticity expects of it at the patch's centre, in magnitude (mm); 0 where it is not simulated.
    expected_mm: f64,
}

impl Question<'_> {
    pub(crate) fn patch(&self) -> &Patch {
        self.patch.patch()
    }

    /// The linear answer inside the limits of the tissue model; `None` where the needle does not reach the surface.
    pub(crate) fn pressed(&self, tool: &Tool) -> Result<Option<LinearAnswer<'_>>, PredictError> {
        let press = press(self.patch(), tool, &self.motion)?;
        self.check_pressure(&press)?;
        if matches!(press.load, Load::Depth(depth) if depth <= 0.0) {
            return Ok(None);
        }
        let tip = self.request.needle.shape.tip;
        let linear = LinearAnswer::new(&self.prepared.beds, self.patch(), tool, tip, press, &self.motion.direction)?;
        self.check_depth(&linear)?;
        Ok(Some(linear))
    }

    fn answer(
        &self,
        resolution: &Resolution,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        let sink = self.sink();
        let sliding = Sliding { coefficient: self.prepared.scene.friction_coefficient, depth_mm: 0.0, tangent: 0.0 };
        let pull = Pull {
            normal_force_mn: 0.0,
            depth_mm: self.prepared.scene.tissue.retina_thickness_mm(),
            strength_kpa: self.prepared.scene.tissue.bond.strength_kpa,
        };
        let linear = match self.begin(&self.raised(&sink))? {
            Begun::Pressed(linear) => linear,
            Begun::Still(why) => {
                let strain = sink.expected_mm / self.yielding_mm();
                let decision = self.decide(Expected { depth_mm: sink.expected_mm, strain, sliding, pull }, &sink)?;
                return Ok(self.at_rest(decision, sink.change_kpa, why));
            }
        };
        let strain = linear.depth_mm / self.yielding_mm();
        let moved_mm = linear.depth_mm + sink.expected_mm;
        let sliding = Sliding { depth_mm: linear.depth_mm, tangent: linear.press.tangent(), ..sliding };
        let [x, y] = linear.press.touch.parameter;
        let pull = Pull {
            normal_force_mn: linear.normal_force_mn,
            depth_mm: pull.depth_mm - self.patch().surface.column(x, y).retina_thinning_mm,
            ..pull
        };
        let expected = Expected { depth_mm: moved_mm, strain: moved_mm / self.yielding_mm(), sliding, pull };
        let decision = self.decide(expected, &sink)?;
        if !decision.contact {
            return Ok(self.at_rest(decision, sink.change_kpa, "contact is not simulated"));
        }
        let answer = match self.request.level {
            Level::Linear => self.linear(&linear, strain, &sink),
            Level::Coarse => self.coarse(&linear, &decision, sink.change_kpa, workspace, progress)?,
            Level::Reference => self.fine(resolution, &linear, &decision, sink.change_kpa, workspace, progress)?,
        };
        let expected = self.situation_under(&linear).expected_error(self.request.level);
        Ok(self.prediction(self.with_node_penetration(answer), decision, expected))
    }

    /// The linear answer, or why nothing moves.
    fn begin(&self, tool: &Tool) -> Result<Begun<'_>, PredictError> {
        if self.motion.force_mn == Some(0.0) {
            return Ok(Begun::Still("no force is applied"));
        }
        Ok(match self.pressed(tool)? {
            Some(linear) => Begun::Pressed(linear),
            None => Begun::Still("the needle does not reach the surface"),
        })
    }

    pub(crate) fn situation_under(&self, linear: &LinearAnswer) -> Situation {
        self.situation(linear.depth_mm, linear.depth_mm / self.yielding_mm(), Some(&linear.press))
    }

    fn situation(&self, depth_mm: f64, strain: f64, press: Option<&Press>) -> Situation {
        let points = self.tool.patch_from_needle.rotation * -Vector3::z_axis();
        let angle_deg = press.map_or(0.0, |press| points.dot(&press.touch.inward).clamp(-1.0, 1.0).acos().to_degrees());
        Situation::new(&self.prepared.scene, &self.request.needle.shape, angle_deg, depth_mm, strain)
    }

    /// What the eye's pressure does by itself.
    pub(crate) fn sink(&self) -> Sink {
        let Scene { tissue, .. } = &self.prepared.scene;
        let change_kpa = self.prepared.scene.pressure_change_kpa();
        let linear = Settled::new(tissue, change_kpa, Solid::Elasticity, |_| true);
        let centre = self.patch().surface.column(0.0, 0.0);
        let report = pressure::report(&self.request.effects, change_kpa, linear.sink_mm(&centre, 0.0) * 1e3);
        let simulated = report.simulated;
        let expected_mm = if simulated { linear.sink_mm(&centre, 0.0).abs() } else { 0.0 };
        Sink { report, change_kpa: simulated.then_some(change_kpa), expected_mm }
    }

    fn decide(&self, expected: Expected, sink: &Sink) -> Result<Decision, PredictError> {
        decide(&self.request.effects, self.request.level, expected, &sink.report)
    }

    /// The surface far from the needle under the pressure, by the law of `solid`.
    fn settled(&self, change_kpa: Option<f64>, solid: Solid) -> Option<Settled> {
        change_kpa.map(|change_kpa| Settled::new(&self.prepared.scene.tissue, change_kpa, solid, |_| true))
    }

    /// How far the surface at `parameter` sinks under the pressure (mm).
    fn sunk(&self, settled: Option<&Settled>, [x, y]: [f64; 2]) -> Vector3<f64> {
        settled.map_or_else(Vector3::zeros, |settled| {
            let column = self.patch().surface.column(x, y);
            column.inward.into_inner() * settled.sink_mm(&column, 0.0)
        })
    }

    /// The tool as it stands to the surface at rest: raised by what the surface under it has sunk.
    fn raised(&self, sink: &Sink) -> Tool<'_> {
        let mut tool = self.tool;
        if sink.change_kpa.is_some() {
            // What `decide` will find unless the sinking itself is small.
            let finite = match &self.request.effects {
                EffectChoice::Named(names) => names.iter().any(|name| name == finite_strain::NAME),
                EffectChoice::Auto | EffectChoice::All => true,
            };
            let finite = finite && self.request.level != Level::Linear;
            let solid = if finite { Solid::FiniteStrain } else { Solid::Elasticity };
            let at = tool.patch_from_needle.translation.vector;
            tool.patch_from_needle.translation.vector -=
                self.sunk(self.settled(sink.change_kpa, solid).as_ref(), [at.x, at.y]);
        }
        tool
    }

    /// Adds to the reported penetration that of the patch's own nodes: a coarse face may cut a sharp edge between its quadrature points.
    pub(crate) fn with_node_penetration(&self, mut answer: FiniteElementAnswer) -> FiniteElementAnswer {
        let mut pose = self.tool.patch_from_needle;
        pose.translation.vector += self.motion.direction.into_inner() * answer.travel_mm;
        let penetration = |(vertex, moved): (&Point3<f64>, &Vector3<f64>)| {
            -self.tool.body.distance(&pose.inverse_transform_point(&(vertex + moved)))
        };
        let nodes = self.patch().vertices.iter().zip(&answer.displacements).map(penetration);
        answer.contact.max_penetration_mm = nodes.fold(answer.contact.max_penetration_mm, f64::max);
        answer
    }

    /// Thickness of retina and choroid (mm).
    pub(crate) fn yielding_mm(&self) -> f64 {
        let tissue = &self.prepared.scene.tissue;
        tissue.retina_thickness_mm() + tissue.choroid.thickness_mm
    }

    fn check_pressure(&self, press: &Press) -> Result<(), PredictError> {
        if let Load::Force(force_mn) = press.load {
            let radius_mm = self.tool.body.radius_mm();
            let pressure_kpa = force_mn / (std::f64::consts::PI * radius_mm * radius_mm);
            let softest = |low: f64, layer: &crate::tissue::Layer| low.min(layer.youngs_modulus_kpa);
            let modulus = self.prepared.scene.tissue.retina.iter().fold(f64::INFINITY, softest);
            let limit_kpa = PUNCTURE_PRESSURE_PER_MODULUS * modulus;
            if pressure_kpa > limit_kpa {
                return Err(PredictError::BeyondPuncture { force_mn, radius_mm, pressure_kpa, limit_kpa });
            }
        }
        Ok(())
    }

    fn check_depth(&self, linear: &LinearAnswer) -> Result<(), PredictError> {
        let [x, y] = linear.press.touch.parameter;
        let thinning_mm = self.patch().surface.column(x, y).retina_thinning_mm;
        let limit_mm = MAX_DEPTH_SHARE * (self.yielding_mm() - thinning_mm);
        let depth_mm = linear.depth_mm;
        if depth_mm > limit_mm { Err(PredictError::TooDeep { depth_mm, limit_mm }) } else { Ok(()) }
    }

    fn linear(&self, linear: &LinearAnswer, strain: f64, sink: &Sink) -> FiniteElementAnswer {
        let settled = self.settled(sink.change_kpa, Solid::Elasticity);
        let radius_mm = linear.contact_radius_mm;
        let travel_mm = if self.motion.force_mn.is_some() { linear.travel_mm() } else { 0.0 };
        let moved = |&parameter: &[f64; 2]| linear.displacement(parameter) + self.sunk(settled.as_ref(), parameter);
        let displacements: Vec<Vector3<f64>> = self.patch().parameters.iter().map(moved).collect();
        FiniteElementAnswer {
            displacements,
            travel_mm,
            reaction_mn: linear.press.touch.inward.into_inner() * -linear.normal_force_mn,
            contact: ContactReport {
                state: ContactState::Touching,
                area_mm2: std::f64::consts::PI * radius_mm * radius_mm,
                max_pressure_kpa: linear.max_pressure_kpa,
                max_penetration_mm: 0.0,
                max_strain: strain,
                slipping_share: None,
                bond_damage: None,
            },
            solver: SolverReport::default(),
            estimate: self.estimate(linear),
        }
    }

    pub(crate) fn estimate(&self, linear: &LinearAnswer) -> ContactEstimate {
        ContactEstimate {
            center: linear.center,
            radius_mm: linear.contact_radius_mm,
            touch_mm: linear.press.touch.travel_mm,
            travel_mm: linear.travel_mm(),
        }
    }

    /// Linear surface displacement, fading with depth as the layers share a uniform pressure.
    pub(crate) fn start<'b>(&self, linear: &'b LinearAnswer) -> impl Fn([f64; 2], f64) -> Vector3<f64> + 'b {
        let layers = self.prepared.scene.tissue.layers();
        let compliance: Vec<f64> =
            layers.iter().map(|named| named.layer.thickness_mm / named.layer.youngs_modulus_kpa).collect();
        let total: f64 = compliance.iter().sum();
        move |parameter, depth_in_layers| {
            let above: f64 = compliance
                .iter()
                .enumerate()
                .map(|(layer, c)| c * (depth_in_layers - layer as f64).clamp(0.0, 1.0))
                .sum();
            linear.displacement(parameter) * (1.0 - above / total)
        }
    }

    pub(crate) fn problem(&self, decision: &Decision, pressure_kpa: Option<f64>) -> Problem<'_> {
        Problem {
            patch: self.patch(),
            tissue: &self.prepared.scene.tissue,
            tool: self.tool,
            motion: self.motion,
            solid: decision.solid,
            friction_coefficient: decision.friction.then_some(self.prepared.scene.friction_coefficient),
            pressure_kpa,
            bond: decision.adhesion.then_some(self.prepared.scene.tissue.bond),
        }
    }

    pub(crate) fn coarse(
        &self,
        linear: &LinearAnswer,
        decision: &Decision,
        change_kpa: Option<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<FiniteElementAnswer, PredictError> {
        let topology = shared_topology(COARSE.division(&self.prepared.scene.tissue, decision.adhesion))?;
        let (_, solver) = match &mut workspace.coarse {
            Some(kept) if Arc::ptr_eq(&kept.0, &topology) => kept,
            slot => {
                let memory = newton::Workspace::new(&topology.pattern, &topology.symbolic);
                slot.insert((topology.clone(), memory))
            }
        };
        let mut bench =
            Bench { level: Level::Coarse.name(), resolution: &COARSE, topology: &topology, workspace: solver };
        let start = self.start(linear);
        self.problem(decision, change_kpa).solve(&mut bench, &self.estimate(linear), &start, progress)
    }

    /// A finer answer than `coarse`, on a mesh made for the contact that `coarse` finds.
    fn fine(
        &self,
        resolution: &Resolution,
        linear: &LinearAnswer,
        decision: &Decision,
        change_kpa: Option<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<FiniteElementAnswer, PredictError> {
        let coarse = self.coarse(linear, decision, change_kpa, workspace, progress)?;
        let topology = shared_topology(resolution.division(&self.prepared.scene.tissue, decision.adhesion))?;
        let mut solver = newton::Workspace::new(&topology.pattern, &topology.symbolic);
        let mut bench =
            Bench { level: Level::Reference.name(), resolution, topology: &topology, workspace: &mut solver };
        // Travel and start belong together: a needle off by a micrometre opens the contact or closes it with a thousand kPa.
        let aim = ContactEstimate {
            center: coarse.estimate.center,
            radius_mm: coarse.estimate.radius_mm,
            ..self.estimate(linear)
        };
        let start = self.start(linear);
        let mut answer = self.problem(decision, change_kpa).solve(&mut bench, &aim, &start, progress)?;
        answer.solver.iterations += coarse.solver.iterations;
        Ok(answer)
    }

    /// The answer without contact: the surface at rest, or where the pressure moves it.
    pub(crate) fn at_rest(&self, mut decision: Decision, change_kpa: Option<f64>, reason: &str) -> Prediction {
        for report in &mut decision.reports {
            if [contact::NAME, friction::NAME, adhesion::NAME].contains(&report.name) {
                report.simulated = false;
                report.reason = reason.to_owned();
            }
        }
        let settled = self.settled(change_kpa, decision.solid);
        let moved = |&parameter: &[f64; 2]| self.sunk(settled.as_ref(), parameter);
        let answer = FiniteElementAnswer {
            displacements: self.patch().parameters.iter().map(moved).collect(),
            travel_mm: 0.0,
            reaction_mn: Vector3::zeros(),
            contact: ContactReport {
                state: ContactState::Clear,
                area_mm2: 0.0,
                max_pressure_kpa: 0.0,
                max_penetration_mm: 0.0,
                max_strain: settled.as_ref().map_or(0.0, Settled::max_strain),
                slipping_share: None,
                bond_damage: None,
            },
            solver: SolverReport::default(),
            estimate: ContactEstimate { center: [0.0; 2], radius_mm: 0.0, touch_mm: 0.0, travel_mm: 0.0 },
        };
        // Nothing moves, exactly.
        let expected = ExpectedError { median_um: 0.0, p95_um: 0.0, calibrated: true };
        self.prediction(answer, decision, expected)
    }

    /// The answer in scene coordinates.
    pub(crate) fn prediction(
        &self,
        answer: FiniteElementAnswer,
        decision: Decision,
        expected: ExpectedError,
    ) -> Prediction {
        let patch = self.patch();
        let deformed: Vec<Point3<f64>> =
            patch.vertices.iter().zip(&answer.displacements).map(|(vertex, moved)| vertex + moved).collect();
        let normals = vertex_normals(&deformed, &patch.triangles);
        let frame = &patch.scene_from_patch;
        let direction = frame * self.motion.direction.into_inner();
        let mut warnings = Vec::new();
        let unused = decision.reports.iter().find(|r| !r.simulated && r.value > r.threshold && r.value.is_some());
        if let Some(effect) = unused {
            warnings.push(format!("`{}` is not simulated though the scene calls for it", effect.name));
        }
        let penetration_mm = answer.contact.max_penetration_mm;
        if penetration_mm > PENETRATION_WARNING_MM {
            warnings.push(format!(
                "the needle stands {:.1} µm inside the predicted surface: its edge is sharper than this level resolves",
                penetration_mm * 1e3
            ));
        }
        Prediction {
            vertices: deformed.iter().map(|vertex| frame * vertex).collect(),
            normals: normals.iter().map(|normal| frame * normal).collect(),
            triangles: patch.triangles.clone(),
            displacement_um: answer.displacements.iter().map(|moved| moved.norm() * 1e3).collect(),
            source_indices: patch.source_indices.clone(),
            needle: NeedleOutcome {
                tip_mm: self.request.needle.tip_mm + direction * answer.travel_mm,
                travel_mm: answer.travel_mm,
                reaction_mn: frame * answer.reaction_mn,
            },
            contact: answer.contact,
            level: self.request.level,
            expected_error: expected,
            effects: decision.reports,
            solver: answer.solver,
            warnings,
        }
    }
}
