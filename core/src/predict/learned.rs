//! The learned levels: the linear answer, or that of `coarse`, with what a network adds to it.
//!
//! A network answers for what it was trained on: one layer of retina on choroid and sclera, a rigid needle without friction, the pressure of rest, an intact
//! bond without fluid under it, a shaft that does not bend, finite strain. Anything else is refused by name, and a budget does not choose the level there.
//!
//! `network` was trained under a given force. For a needle that is held where it is, the force is sought whose travel is the needle's own.

use nalgebra::Vector3;

use super::Workspace;
use super::choice::{Decision, Expected, decide};
use super::expected_error::ExpectedError;
use super::finite_element::{COARSE, ContactEstimate, FiniteElementAnswer};
use super::linear::{LinearAnswer, Load, Press};
use super::question::{Question, Sink};
use super::types::{ContactReport, ContactState, Level, PredictError, SolverReport};
use crate::effects::{adhesion, bleb, friction, pressure};
use crate::network::contact::{Corrected, Memory};
use crate::network::graph::Graph;
use crate::network::input::{Answer, Field, Input, Relief, TissueNumbers};
use crate::patch::{NODE_COUNT, Patch, vertex_normals};
use crate::progress::Progress;

/// What a network needs of a patch at rest, made once where the patch is the scene's.
#[derive(Clone, Debug)]
pub(crate) struct RestPatch {
    positions: Field,
    normals: Field,
    /// How much thinner the retina is under each node than the tissue says (mm).
    thinning_mm: [f32; NODE_COUNT],
    graph: Graph,
}

impl RestPatch {
    pub(crate) fn new(patch: &Patch) -> Self {
        let normals = vertex_normals(&patch.vertices, &patch.triangles);
        RestPatch {
            positions: std::array::from_fn(|node| patch.vertices[node].coords.cast()),
            normals: std::array::from_fn(|node| normals[node].cast()),
            thinning_mm: std::array::from_fn(|node| patch.surface.thinning(&patch.vertices[node]).mm as f32),
            graph: Graph::new(&patch.triangles),
        }
    }
}

/// Travel that a held needle may be missed by (mm): 0.01 µm.
const HELD_MM: f32 = 1e-5;
/// Forces tried at most for a held needle.
const MOST_FORCES: usize = 12;
/// A step of the search changes the force by at most this factor.
const LARGEST_FACTOR: f64 = 2.0;

fn answer_of(answer: &FiniteElementAnswer) -> Answer {
    Answer {
        displacement_mm: std::array::from_fn(|node| answer.displacements[node].cast()),
        travel_mm: answer.travel_mm as f32,
        reaction_mn: answer.reaction_mn.cast(),
    }
}

impl Question<'_> {
    /// Why `level` has no answer for this request under `decision`, if it has none.
    pub(super) fn check_learned(&self, level: Level, decision: &Decision, sink: &Sink) -> Result<(), PredictError> {
        if !level.is_learned() {
            return Ok(());
        }
        self.prepared.networks.of(level)?;
        let simulated = [
            (decision.friction, friction::NAME),
            (decision.adhesion, adhesion::NAME),
            (self.lifting(level).simulated, bleb::NAME),
            (sink.change_kpa.is_some(), pressure::NAME),
        ];
        if let Some((_, name)) = simulated.into_iter().find(|(on, _)| *on) {
            let problem = format!("is not in the training of level `{}`", level.name());
            return Err(PredictError::Effect { name: name.to_owned(), problem });
        }
        let not_learned =
            |field, problem: &str| PredictError::NotLearned { level: level.name(), field, problem: problem.to_owned() };
        let tissue = &self.prepared.scene.tissue;
        if tissue.retina.len() > 1 {
            return Err(not_learned("scene.tissue.retina", "it learned a retina of one layer"));
        }
        if tissue.inner_limiting_membrane.is_some() {
            return Err(not_learned("scene.tissue.inner_limiting_membrane", "it learned a retina without one"));
        }
        if level == Level::Corrected && self.motion.force_mn.is_none() {
            return Err(not_learned("control", "it learned what `coarse` answers to a force, not to a held needle"));
        }
        Ok(())
    }

    /// What is expected of a learned level's error, `None` where it has no answer.
    pub(super) fn learned_error(
        &self,
        level: Level,
        linear: &LinearAnswer,
        expected: Expected,
        sink: &Sink,
    ) -> Option<ExpectedError> {
        let decision = decide(&self.request.effects, level, expected, &sink.report).ok()?;
        self.check_learned(level, &decision, sink).ok()?;
        let network = self.prepared.networks.of(level).ok()?;
        let situation = self.situation_under(linear);
        Some(match level {
            // Its own heads say.
            Level::Network => {
                let (corrected, _) = self.network(linear, &mut Memory::default()).ok()?;
                self.expected_of(&corrected, linear)
            }
            // The heads need the coarse answer; what they came to in the validation, by bins, does not.
            _ => {
                let known = network.knows_depth(situation.strain as f32);
                let ratios = network.prior(situation.tip != 0, situation.strain as f32);
                let [median_mm, p95_mm] = ratios.map(|ratio| f64::from(ratio) * linear.depth_mm);
                situation.with_rigid_needle(
                    median_mm * 1e3,
                    p95_mm * 1e3,
                    known && situation.sampled && self.patch().source_indices.is_none(),
                )
            }
        })
    }

    fn expected_of(&self, corrected: &Corrected, linear: &LinearAnswer) -> ExpectedError {
        let [median_mm, p95_mm] = corrected.error_mm.map(f64::from);
        let situation = self.situation_under(linear);
        // The extremes of what a network saw are met one number at a time: a tissue of the outer fifths can lie between them, where the bounds were seen to hold less often.
        let calibrated = corrected.known && situation.sampled && self.patch().source_indices.is_none();
        situation.with_rigid_needle(median_mm * 1e3, p95_mm * 1e3, calibrated)
    }

    /// The request as a network sees it.
    fn input(&self, rest: &RestPatch, linear: &LinearAnswer, coarse: Option<Answer>) -> Input {
        let surface = &self.patch().surface;
        let [x, y] = linear.press.touch.parameter;
        let touched = surface.column(x, y);
        let tissue = &self.prepared.scene.tissue;
        let layers = [&tissue.retina[0], &tissue.choroid, &tissue.sclera];
        let mut thickness_mm = layers.map(|layer| layer.thickness_mm as f32);
        thickness_mm[0] = (layers[0].thickness_mm - touched.retina_thinning_mm) as f32;
        let inward = linear.press.touch.inward.into_inner();
        let parameters = &self.patch().parameters;
        let center = surface.column(linear.center[0], linear.center[1]).surface;
        let thinning = surface.thinning(&center);
        let thinnings_mm = [touched.retina_thinning_mm, thinning.mm];
        Input {
            rest_mm: rest.positions,
            rest_normal: rest.normals,
            shape: self.request.needle.shape,
            body: *self.tool.body,
            patch_from_needle: self.tool.patch_from_needle,
            direction: self.motion.direction.into_inner().cast(),
            force_mn: (linear.normal_force_mn * linear.press.cosine) as f32,
            tissue: TissueNumbers {
                thickness_mm,
                youngs_modulus_kpa: layers.map(|layer| layer.youngs_modulus_kpa as f32),
                poisson_ratio: layers.map(|layer| layer.poisson_ratio as f32),
            },
            relief: Relief::new(&rest.thinning_mm, thinnings_mm, &thinning.slope, &thinning.bend),
            touch_mm: touched.surface.coords.cast(),
            inward: inward.cast(),
            center_mm: center.coords.cast(),
            depth_mm: linear.depth_mm as f32,
            contact_radius_mm: linear.contact_radius_mm as f32,
            pressure_kpa: linear.max_pressure_kpa as f32,
            linear: Answer {
                displacement_mm: std::array::from_fn(|node| linear.displacement(parameters[node]).cast()),
                travel_mm: linear.travel_mm() as f32,
                reaction_mn: (inward * -linear.normal_force_mn).cast(),
            },
            coarse,
        }
    }

    /// The contact network's answer, and the travel that a force answers (mm, beyond the pose of the request).
    fn network(&self, linear: &LinearAnswer, memory: &mut Memory) -> Result<(Corrected, f64), PredictError> {
        let network = self.prepared.networks.of(Level::Network)?;
        let own;
        let rest = match &self.prepared.rest {
            Some(rest) => rest,
            None => {
                own = RestPatch::new(self.patch());
                &own
            }
        };
        let mut ask = |linear: &LinearAnswer| {
            network.predict(&self.input(rest, linear, None), &rest.graph, memory).ok_or_else(|| self.missing())
        };
        let mut found = ask(linear)?;
        if self.motion.force_mn.is_some() {
            return Ok((found, linear.normal_force_mn * linear.press.cosine));
        }
        let tip = self.request.needle.shape.tip;
        let pressed = |normal_force_mn: f64| {
            let press = Press { load: Load::Force(normal_force_mn), ..linear.press };
            LinearAnswer::new(&self.prepared.beds, self.patch(), &self.tool, tip, press, &self.motion.direction)
        };
        // Secant on the travel, which a held needle does not have; the first step takes the tissue for linear.
        let mut force = linear.normal_force_mn;
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..MOST_FORCES {
            let travel = f64::from(found.answer.travel_mm) - self.motion.travel_mm;
            if travel.abs() < f64::from(HELD_MM) {
                return Ok((found, force * linear.press.cosine));
            }
            let slope = match before {
                Some((old_force, old_travel)) if old_force != force => (travel - old_travel) / (force - old_force),
                _ => linear.depth_mm / (linear.press.cosine * force),
            };
            before = Some((force, travel));
            force = (force - travel / slope).clamp(force / LARGEST_FACTOR, force * LARGEST_FACTOR);
            found = ask(&pressed(force)?)?;
        }
        Err(PredictError::NotLearned {
            level: Level::Network.name(),
            field: "control",
            problem: "no force was found that takes the needle to where it is held".to_owned(),
        })
    }

    fn missing(&self) -> PredictError {
        let problem = "the answer that it corrects is not there".to_owned();
        PredictError::NotLearned { level: self.request.level.name(), field: "accuracy.level", problem }
    }

    /// Level `network`.
    pub(super) fn by_network(
        &self,
        linear: &LinearAnswer,
        strain: f64,
        decision: &Decision,
        sink: &Sink,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(FiniteElementAnswer, ExpectedError), PredictError> {
        self.check_learned(Level::Network, decision, sink)?;
        progress.stage("network");
        let (corrected, force_mn) = self.network(linear, &mut workspace.network)?;
        let expected = self.expected_of(&corrected, linear);
        let radius_mm = linear.contact_radius_mm;
        let contact = ContactReport {
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
        };
        let answer = self.learned(&corrected, contact, SolverReport::default(), self.estimate(linear, false), force_mn);
        Ok((answer, expected))
    }

    /// Level `corrected`.
    pub(super) fn by_correction(
        &self,
        linear: &LinearAnswer,
        decision: &Decision,
        sink: &Sink,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<(FiniteElementAnswer, ExpectedError), PredictError> {
        self.check_learned(Level::Corrected, decision, sink)?;
        let coarse = self.coarse(&COARSE, linear, decision, None, workspace, progress)?;
        progress.stage("network");
        let network = self.prepared.networks.of(Level::Corrected)?;
        let own;
        let rest = match &self.prepared.rest {
            Some(rest) => rest,
            None => {
                own = RestPatch::new(self.patch());
                &own
            }
        };
        let input = self.input(rest, linear, Some(answer_of(&coarse)));
        let corrected = network.predict(&input, &rest.graph, &mut workspace.network).ok_or_else(|| self.missing())?;
        let expected = self.expected_of(&corrected, linear);
        let force_mn = linear.normal_force_mn * linear.press.cosine;
        Ok((self.learned(&corrected, coarse.contact, coarse.solver, coarse.estimate, force_mn), expected))
    }

    /// A network's answer in double precision; the reaction along the direction is the force itself.
    fn learned(
        &self,
        corrected: &Corrected,
        mut contact: ContactReport,
        solver: SolverReport,
        estimate: ContactEstimate,
        force_mn: f64,
    ) -> FiniteElementAnswer {
        let direction = self.motion.direction.into_inner();
        let reaction: Vector3<f64> = corrected.answer.reaction_mn.cast();
        let reaction_mn = reaction - direction * (reaction.dot(&direction) + force_mn);
        // Travel of a held needle is what the search left of it.
        let travel_mm =
            if self.motion.force_mn.is_some() { f64::from(corrected.answer.travel_mm) } else { self.motion.travel_mm };
        // No node stands inside the needle: what the mesh of `coarse` left there is no longer so.
        contact.max_penetration_mm = 0.0;
        FiniteElementAnswer {
            displacements: corrected.answer.displacement_mm.iter().map(|moved| moved.cast()).collect(),
            travel_mm,
            deflection: None,
            reaction_mn,
            contact,
            solver,
            estimate,
        }
    }
}
