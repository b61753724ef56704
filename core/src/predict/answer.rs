//! A request answered: by each level, at rest where nothing presses, and back in the scene's coordinates.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::choice::adhesion::Pull;
use super::choice::friction::Sliding;
use super::choice::{self, Decision, Expected};
use super::expected_error::ExpectedError;
use super::finite_element::{Bench, COARSE, ContactEstimate, FiniteElementAnswer, Problem, Resolution};
use super::linear::LinearAnswer;
use super::question::{Begun, Question, Sink};
use super::topologies::shared_topology;
use super::types::{ContactReport, ContactState, Level, NeedleOutcome, PredictError, Prediction, SolverReport};
use super::{PENETRATION_WARNING_MM, RIM_WARNING_MM, Workspace};
use crate::effects::puncture::{Burden, Nearest};
use crate::effects::{adhesion, bleb, contact, friction, puncture, tool_flex};
use crate::equilibrium::settled::Settled;
use crate::equilibrium::{Solid, Tool};
use crate::patch::vertex_normals;
use crate::progress::Progress;
use crate::solve::newton;
use crate::surface::Surface;

impl Question<'_> {
    pub(super) fn answer(
        &self,
        resolution: &Resolution,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        let sink = self.sink();
        let linear = match self.begin(&self.raised(&sink))? {
            Begun::Pressed(linear) => linear,
            Begun::Still(why) => {
                let decision = self.decide(self.unpressed(&sink), &sink)?;
                if decision.bleb {
                    return self.over_fluid(resolution, decision, &sink, why, progress);
                }
                return Ok(self.at_rest(decision, sink.change_kpa, why));
            }
        };
        let strain = linear.depth_mm / self.yielding_mm();
        let expected = self.expected(&linear, &sink);
        let decision = self.decide(expected, &sink)?;
        if !decision.contact && decision.bleb {
            return self.over_fluid(resolution, decision, &sink, "contact is not simulated", progress);
        }
        if !decision.contact {
            return Ok(self.at_rest(decision, sink.change_kpa, "contact is not simulated"));
        }
        let of_level = || self.situation_under(&linear).expected_error(self.request.level);
        let (answer, expected) = match self.request.level {
            Level::Linear => (self.linear(&linear, strain, &sink), of_level()),
            Level::Network => self.by_network(&linear, strain, &decision, &sink, workspace, progress)?,
            Level::Coarse => {
                (self.coarse(resolution, &linear, &decision, sink.change_kpa, workspace, progress)?, of_level())
            }
            Level::Corrected => self.by_correction(&linear, &decision, &sink, workspace, progress)?,
            Level::Reference => {
                (self.fine(resolution, &linear, &decision, sink.change_kpa, workspace, progress)?, of_level())
            }
        };
        Ok(self.prediction(self.with_node_penetration(answer), decision, expected))
    }

    /// What is expected of the effects of a needle that does not press.
    pub(crate) fn unpressed(&self, sink: &Sink) -> Expected {
        let scene = &self.prepared.scene;
        Expected {
            depth_mm: sink.expected_mm,
            strain: sink.expected_mm / self.yielding_mm(),
            sliding: Sliding { coefficient: scene.friction_coefficient, depth_mm: 0.0, tangent: 0.0, along_mm: 0.0 },
            pull: Pull {
                normal_force_mn: 0.0,
                tangential_share: 0.0,
                depth_mm: scene.tissue.retina_thickness_mm(),
                suction_kpa: sink.change_kpa.map_or(0.0, |change_kpa| (-change_kpa).max(0.0)),
                strength_kpa: scene.tissue.bond.strength_kpa,
            },
            bending: self.bending(None),
            limits: self.puncture_limits(),
        }
    }

    /// What the linear answer expects of the effects.
    pub(crate) fn expected(&self, linear: &LinearAnswer, sink: &Sink) -> Expected {
        let still = self.unpressed(sink);
        let moved_mm = linear.depth_mm + sink.expected_mm;
        let [x, y] = linear.press.touch.parameter;
        Expected {
            depth_mm: moved_mm,
            strain: moved_mm / self.yielding_mm(),
            sliding: Sliding { depth_mm: linear.depth_mm, tangent: linear.press.tangent(), ..still.sliding },
            pull: Pull {
                normal_force_mn: linear.normal_force_mn,
                tangential_share: still.sliding.coefficient.min(linear.press.tangent()),
                depth_mm: still.pull.depth_mm - self.patch().surface.column(x, y).retina_thinning_mm,
                ..still.pull
            },
            bending: self.bending(Some(linear)),
            ..still
        }
    }

    /// Adds to the reported penetration that of the patch's own nodes: a coarse face may cut a sharp edge between its quadrature points.
    pub(crate) fn with_node_penetration(&self, mut answer: FiniteElementAnswer) -> FiniteElementAnswer {
        let mut pose = self.tool.patch_from_needle;
        pose.translation.vector += self.motion.direction.into_inner() * answer.travel_mm;
        pose.translation.vector += answer.deflection.unwrap_or_default();
        let penetration = |(vertex, moved): (&Point3<f64>, &Vector3<f64>)| {
            -self.tool.body.distance(&pose.inverse_transform_point(&(vertex + moved)))
        };
        let nodes = self.patch().vertices.iter().zip(&answer.displacements).map(penetration);
        answer.contact.max_penetration_mm = nodes.fold(answer.contact.max_penetration_mm, f64::max);
        answer
    }

    pub(super) fn linear(&self, linear: &LinearAnswer, strain: f64, sink: &Sink) -> FiniteElementAnswer {
        let settled = self.settled(sink.change_kpa, Solid::Elasticity);
        let radius_mm = linear.contact_radius_mm;
        let travel_mm = if self.motion.force_mn.is_some() { linear.travel_mm() } else { 0.0 };
        let moved = |&parameter: &[f64; 2]| linear.displacement(parameter) + self.sunk(settled.as_ref(), parameter);
        let displacements: Vec<Vector3<f64>> = self.patch().parameters.iter().map(moved).collect();
        FiniteElementAnswer {
            displacements,
            travel_mm,
            deflection: None,
            reaction_mn: linear.press.touch.inward.into_inner() * -linear.normal_force_mn,
            contact: ContactReport {
                state: ContactState::Touching,
                area_mm2: std::f64::consts::PI * radius_mm * radius_mm,
                max_pressure_kpa: linear.max_pressure_kpa,
                max_penetration_mm: 0.0,
                max_strain: strain,
                least_volume_ratio: None,
                slipping_share: None,
                bond_damage: None,
                bleb: None,
                puncture_share: 0.0,
            },
            solver: SolverReport::default(),
            estimate: self.estimate(linear, false),
        }
    }

    /// Linear surface displacement, fading with depth as the layers share a uniform pressure.
    pub(crate) fn start<'b>(
        &self,
        linear: &'b LinearAnswer,
        bends: bool,
    ) -> impl Fn([f64; 2], f64) -> Vector3<f64> + 'b {
        let shift = self.bent(linear, bends).shift;
        let layers = self.prepared.scene.tissue.layers();
        let compliance: Vec<f64> =
            layers.iter().map(|named| named.layer.thickness_mm / named.layer.youngs_modulus_kpa).collect();
        let total: f64 = compliance.iter().sum();
        move |[x, y], depth_in_layers| {
            let above: f64 = compliance
                .iter()
                .enumerate()
                .map(|(layer, c)| c * (depth_in_layers - layer as f64).clamp(0.0, 1.0))
                .sum();
            linear.displacement([x - shift.x, y - shift.y]) * (1.0 - above / total)
        }
    }

    pub(crate) fn problem(&self, decision: &Decision, pressure_kpa: Option<f64>) -> Problem<'_> {
        Problem {
            patch: self.patch(),
            tissue: &self.prepared.scene.tissue,
            tool: Tool {
                stiffness_mn_per_mm: self.request.needle.stiffness_mn_per_mm.filter(|_| decision.tool_flex),
                ..self.tool
            },
            motion: self.motion,
            bears_strain: self.puncture_limits().strain,
            solid: decision.solid,
            friction_coefficient: decision.friction.then_some(self.prepared.scene.friction_coefficient),
            pressure_kpa,
            bond: decision.adhesion.then_some(self.prepared.scene.tissue.bond),
            bleb: self.bleb().filter(|_| decision.bleb),
        }
    }

    pub(crate) fn coarse(
        &self,
        resolution: &Resolution,
        linear: &LinearAnswer,
        decision: &Decision,
        change_kpa: Option<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<FiniteElementAnswer, PredictError> {
        let resolution = &resolved(resolution, decision);
        let topology = shared_topology(resolution.division(&self.prepared.scene.tissue, decision.parts()))?;
        let (_, solver) = match &mut workspace.coarse {
            Some(kept) if Arc::ptr_eq(&kept.0, &topology) => kept,
            slot => {
                let memory = newton::Workspace::new(&topology.pattern, &topology.symbolic);
                slot.insert((topology.clone(), memory))
            }
        };
        let mut bench = Bench { level: Level::Coarse.name(), resolution, topology: &topology, workspace: solver };
        let start = self.start(linear, decision.tool_flex);
        let estimate = self.estimate(linear, decision.tool_flex);
        self.problem(decision, change_kpa).solve(&mut bench, &estimate, &start, progress)
    }

    /// A finer answer than `coarse`, on a mesh made for the contact that `coarse` finds.
    pub(super) fn fine(
        &self,
        resolution: &Resolution,
        linear: &LinearAnswer,
        decision: &Decision,
        change_kpa: Option<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<FiniteElementAnswer, PredictError> {
        let resolution = &resolved(resolution, decision);
        let coarse = self.coarse(&COARSE, linear, decision, change_kpa, workspace, progress)?;
        let topology = shared_topology(resolution.division(&self.prepared.scene.tissue, decision.parts()))?;
        let mut solver = newton::Workspace::new(&topology.pattern, &topology.symbolic);
        let mut bench =
            Bench { level: Level::Reference.name(), resolution, topology: &topology, workspace: &mut solver };
        // Travel and start belong together: a needle off by a micrometre opens the contact or closes it with a thousand kPa.
        let aim = ContactEstimate {
            center: coarse.estimate.center,
            radius_mm: coarse.estimate.radius_mm,
            ..self.estimate(linear, decision.tool_flex)
        };
        let start = self.start(linear, decision.tool_flex);
        let mut answer = self.problem(decision, change_kpa).solve(&mut bench, &aim, &start, progress)?;
        answer.solver.iterations += coarse.solver.iterations;
        Ok(answer)
    }

    /// The answer without contact: the surface at rest, or where the pressure moves it.
    pub(crate) fn at_rest(&self, mut decision: Decision, change_kpa: Option<f64>, reason: &str) -> Prediction {
        decision.without(&[contact::NAME, friction::NAME, adhesion::NAME, tool_flex::NAME], reason);
        let lifted = decision.reports.iter().any(|report| report.name == bleb::NAME && report.value > report.threshold);
        let settled = self.settled(change_kpa, decision.solid);
        let moved = |&parameter: &[f64; 2]| self.sunk(settled.as_ref(), parameter);
        let answer = FiniteElementAnswer {
            displacements: self.patch().parameters.iter().map(moved).collect(),
            travel_mm: 0.0,
            deflection: None,
            reaction_mn: Vector3::zeros(),
            contact: ContactReport {
                state: ContactState::Clear,
                area_mm2: 0.0,
                max_pressure_kpa: 0.0,
                max_penetration_mm: 0.0,
                max_strain: settled.as_ref().map_or(0.0, Settled::max_strain),
                least_volume_ratio: None,
                slipping_share: None,
                bond_damage: None,
                bleb: None,
                puncture_share: 0.0,
            },
            solver: SolverReport::default(),
            estimate: ContactEstimate {
                center: [0.0; 2],
                radius_mm: 0.0,
                touch_mm: 0.0,
                travel_mm: 0.0,
                deflection: Vector3::zeros(),
            },
        };
        let expected = match settled {
            Some(_) => ExpectedError::UNKNOWN,
            None if lifted => ExpectedError::UNKNOWN,
            // Nothing moves, exactly.
            None => ExpectedError { median_um: 0.0, p95_um: 0.0, calibrated: true },
        };
        self.prediction(answer, decision, expected)
    }

    /// Holds the answer against what the tissue bears; what to say if it is more.
    fn judge(&self, answer: &mut FiniteElementAnswer, decision: &mut Decision) -> Option<String> {
        let limits = self.puncture_limits();
        let burden = match answer.contact.state {
            ContactState::Clear if answer.contact.bleb.is_none() => Burden::default(),
            _ => Burden { force_mn: answer.reaction_mn.norm(), strain: answer.contact.max_strain },
        };
        for report in decision.reports.iter_mut().filter(|report| report.name == puncture::NAME) {
            *report = choice::puncture::report(&limits, &burden);
        }
        let nearest = limits.nearest(&burden);
        answer.contact.puncture_share = nearest.share();
        nearest.is_beyond().then(|| {
            answer.contact.state = ContactState::Punctured;
            let Nearest { measure, value, limit, .. } = nearest;
            format!("the tissue is punctured: the {measure} is {value:.4}, beyond {limit:.4}; the surface is that of tissue as if it were still whole")
        })
    }

    /// The answer in scene coordinates.
    pub(crate) fn prediction(
        &self,
        mut answer: FiniteElementAnswer,
        mut decision: Decision,
        expected: ExpectedError,
    ) -> Prediction {
        let patch = self.patch();
        let deformed: Vec<Point3<f64>> =
            patch.vertices.iter().zip(&answer.displacements).map(|(vertex, moved)| vertex + moved).collect();
        let normals = vertex_normals(&deformed, &patch.triangles);
        let frame = &patch.scene_from_patch;
        let direction = frame * self.motion.direction.into_inner();
        let mut warnings = Vec::new();
        warnings.extend(self.judge(&mut answer, &mut decision));
        warnings.extend(answer.contact.bleb.and_then(|bleb| self.peeling(bleb.pressure_kpa, bleb.volume_mm3)));
        let unused = decision.reports.iter().filter(|r| !r.simulated && r.value > r.threshold && r.value.is_some());
        warnings.extend(unused.map(|r| format!("`{}` is not simulated though the scene calls for it", r.name)));
        let penetration_mm = answer.contact.max_penetration_mm;
        if penetration_mm > PENETRATION_WARNING_MM {
            warnings.push(format!(
                "the needle stands {:.1} µm inside the predicted surface: its edge is sharper than this level resolves",
                penetration_mm * 1e3
            ));
        }
        let [x, y] = answer.estimate.center;
        if let Surface::Mesh(field) = &patch.surface
            && answer.contact.state != ContactState::Clear
            && field.rim_distance_mm(x, y) < RIM_WARNING_MM
        {
            warnings.push(format!(
                "the mesh ends, or has a hole, {:.2} mm from the contact: the surface is taken to go on level there",
                field.rim_distance_mm(x, y)
            ));
        }
        if answer.contact.least_volume_ratio.is_some_and(|ratio| ratio <= 0.0) {
            warnings.push(
                "small-strain elasticity turns the tissue under the needle inside out: simulate `finite_strain`"
                    .to_owned(),
            );
        }
        let deflection_mm = answer.deflection.map(|deflection| frame * deflection);
        let rigid_tip = self.request.needle.tip_mm + direction * answer.travel_mm;
        Prediction {
            vertices: deformed.iter().map(|vertex| frame * vertex).collect(),
            normals: normals.iter().map(|normal| frame * normal).collect(),
            triangles: patch.triangles.clone(),
            displacement_um: answer.displacements.iter().map(|moved| moved.norm() * 1e3).collect(),
            source_indices: patch.source_indices.clone(),
            needle: NeedleOutcome {
                tip_mm: deflection_mm.map_or(rigid_tip, |deflection| rigid_tip + deflection),
                travel_mm: answer.travel_mm,
                deflection_mm,
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

/// How finely what is decided is computed by a level that computes as finely as `resolution`.
pub(crate) fn resolved(resolution: &Resolution, decision: &Decision) -> Resolution {
    if decision.bleb { resolution.over_fluid() } else { *resolution }
}
