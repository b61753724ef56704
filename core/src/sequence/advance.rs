//! One step of a simulation: where its mesh stands, what it starts from, its equilibrium, and what is remembered of it.
//!
//! The start is the state before, moved by the difference of what linear elasticity expects of the two steps: exact for small steps, as good as
//! a fresh start for large ones. A needle that is held where it was starts from the state before as it is, and tissue that nothing holds down any more from its rest.

use std::sync::Arc;

use nalgebra::Vector3;

use super::fluid::check_filling;
use super::history::History;
use super::plan::{fits, outside, pressed};
use super::{Laid, Settled, Simulation, Step};
use crate::effects::pressure::Pressure;
use crate::equilibrium::friction::Rubbing;
use crate::equilibrium::grip::Grip;
use crate::equilibrium::{Addition, Equilibrium, Load, MeshSize, Motion, Wall};
use crate::mesh::wall::Place;
use crate::predict::expected_error::ExpectedError;
use crate::predict::finite_element::{COARSE, ContactEstimate, Problem};
use crate::predict::held::Held;
use crate::predict::linear::LinearAnswer;
use crate::predict::over_fluid::untouched;
use crate::predict::{ContactState, CutOrGrid, Level, PredictError, Prediction, Question};
use crate::progress::Progress;

/// How far a needle without a force is drawn back along its shaft (mm): nothing of the patch reaches it there.
const WITHDRAWN_MM: f64 = 100.0;

/// The mesh of a step.
struct Aim {
    contact: Option<ContactEstimate>,
    size: MeshSize,
    /// Whether it was laid for this step.
    laid: bool,
    /// What the caller should know of it.
    warnings: Vec<String>,
}

impl Simulation {
    /// The answer to `step`, and whether a mesh was laid for it.
    pub(super) fn advance_at_once(
        &mut self,
        step: &Step,
        progress: &mut dyn Progress,
    ) -> Result<(Prediction, bool), PredictError> {
        progress.stage("linear");
        check_filling(&self.prepared, step.fluid)?;
        let request = self.sequence.request(step, &self.state.needle);
        request.needle.validate()?;
        let filling = step.fluid.or(self.state.filling);
        // Taken out so that the question may borrow them while the rest changes.
        let (prepared, body, patch) = (Arc::clone(&self.prepared), self.body, self.patch.clone());
        let question = Question::new(&prepared, &request, &body, CutOrGrid::Grid(&patch)).filled(filling);
        let sink = question.with_fluid(self.plan.dry.clone());
        let linear = pressed(&question, &sink)?;
        let (met, unforeseen) = self.met(&question, linear.as_ref(), &sink)?;
        let linear = linear.filter(|_| self.decision.contact);
        let moves = linear.is_some() || self.is_strained(&question);
        let (mut prediction, laid) = if moves && (self.decision.contact || self.decision.bleb) {
            let unmoved = filling == self.state.filling && self.unmoved(&question);
            self.solve(&question, linear.as_ref(), unmoved, step.time_s - self.state.time_s, progress)?
        } else {
            self.state.settled = None;
            let why = match (self.decision.contact, question.motion.force_mn) {
                (false, _) => "contact is not simulated",
                (true, Some(0.0)) => "no force is applied",
                (true, _) => "the needle does not reach the surface",
            };
            if let Some(history) = &mut self.state.history {
                history.grip = Grip::default();
            }
            (question.at_rest(self.decision.clone(), self.plan.dry.change_kpa, why), false)
        };
        self.state.met = met;
        prediction.warnings.extend(unforeseen);
        self.remember_puncture(&mut prediction, step.time_s);
        // What is handed on is the guide's place, where a needle without a load would be.
        self.state.needle.tip_mm = prediction.needle.tip_mm - prediction.needle.deflection_mm.unwrap_or_default();
        self.state.needle.orientation = request.needle.orientation;
        self.state.filling = filling;
        Ok((prediction, laid))
    }

    /// Tissue that was punctured stays so: the steps that follow say since when.
    fn remember_puncture(&mut self, prediction: &mut Prediction, time_s: f64) {
        let is_punctured = prediction.contact.state == ContactState::Punctured;
        match self.state.punctured_s {
            Some(since_s) => {
                prediction.contact.state = ContactState::Punctured;
                prediction.warnings.push(format!(
                    "the tissue is punctured since {since_s} s; the surface is that of tissue as if it were still whole"
                ));
            }
            None => self.state.punctured_s = is_punctured.then_some(time_s),
        }
    }

    /// Whether the tissue may be elsewhere than at rest though linear elasticity expects no contact.
    fn is_strained(&self, question: &Question) -> bool {
        let withdrawn = question.motion.force_mn == Some(0.0);
        let kept = |history: &History| history.damage() > Some(0.0) || (history.grip.holds() && !withdrawn);
        self.rates.any() || self.decision.bleb || self.state.history.as_ref().is_some_and(kept)
    }

    /// Whether the needle is held where the step before left it.
    fn unmoved(&self, question: &Question) -> bool {
        let needle = &question.request.needle;
        let stays = (needle.tip_mm, needle.orientation) == (self.state.needle.tip_mm, self.state.needle.orientation);
        stays
            && question.motion.force_mn.is_none()
            && self.state.settled.as_ref().is_some_and(|settled| settled.pressed)
    }

    /// The mesh of a step: that which is laid, or a new one where that does not fit and nothing is remembered.
    fn aim(
        &mut self,
        question: &Question,
        linear: Option<&LinearAnswer>,
        problem: &Problem,
        unmoved: bool,
        progress: &mut dyn Progress,
    ) -> Result<Aim, PredictError> {
        let contact = linear.map(|linear| question.estimate(linear, self.decision.tool_flex));
        if let Some(contact) = &contact {
            problem.check_on_bleb(&self.resolution, contact)?;
        }
        let remembers = self.remembers();
        // Fluid that no needle presses has a mesh of its own, as in a single prediction.
        let own = contact.or(problem.bleb.map(|bleb| untouched(&bleb, 0.0)));
        let fitting = |mesh: &ContactEstimate| own.as_ref().is_none_or(|own| fits(mesh, own));
        let kept = self.state.laid.clone().filter(|laid| remembers || unmoved || fitting(&laid.contact));
        let laid = match &kept {
            Some(laid) => laid.clone(),
            None => {
                let planned = self.plan.around.clone().filter(|_| remembers);
                let (mut around, warning) = planned.or(own.map(|own| (own, None))).unwrap_or((NO_CONTACT, None));
                if let (Level::Reference, Some(linear)) = (question.request.level, linear.filter(|_| !remembers)) {
                    // The finer mesh is made for the contact that `coarse` finds, as in a single prediction.
                    let change_kpa = self.plan.dry.change_kpa;
                    let found = question
                        .coarse(&COARSE, linear, &self.decision, change_kpa, &mut self.coarse, progress)?
                        .estimate;
                    around = ContactEstimate { center: found.center, radius_mm: found.radius_mm, ..around };
                }
                self.state.settled = None;
                Laid { contact: around, size: problem.mesh(&self.resolution, &around), warning }
            }
        };
        self.state.laid = Some(laid.clone());
        let left = contact.as_ref().filter(|_| remembers).and_then(|contact| outside(&laid.contact, contact));
        let warnings = laid.warning.into_iter().chain(left).collect();
        Ok(Aim { contact, size: laid.size, laid: kept.is_none(), warnings })
    }

    fn solve(
        &mut self,
        question: &Question,
        linear: Option<&LinearAnswer>,
        unmoved: bool,
        step_s: f64,
        progress: &mut dyn Progress,
    ) -> Result<(Prediction, bool), PredictError> {
        let change_kpa = self.plan.dry.change_kpa;
        let problem = question.problem(&self.decision, change_kpa);
        let aim = self.aim(question, linear, &problem, unmoved, progress)?;
        progress.stage("mesh");
        let topology = self.topology.clone();
        let wall = problem.wall(&topology, &self.resolution, &aim.size)?;
        let pressure = problem.pressure_kpa.map(|pressure_kpa| Pressure { pressure_kpa });
        let detached = problem.bleb.map_or_else(Vec::new, |bleb| wall.detached(&bleb));
        let mut pressing: Vec<Addition> =
            pressure.iter().map(|effect| Addition { effect, place: Place::Faces }).collect();
        if self.remembers() && self.state.history.is_none() {
            let bleb = self.state.filling.and_then(|filling| question.bleb_with(filling));
            let resting =
                Problem { bleb: bleb.filter(|_| self.decision.bleb), ..question.problem(&self.decision, change_kpa) };
            let rested = resting.wall(&topology, &self.resolution, &aim.size)?;
            self.state.history = Some(self.begin(&resting, &rested, &pressing, &detached, progress)?);
        }
        // Where nothing is remembered, the retina is held as in a single prediction.
        let held = if self.state.history.is_none() { Held::new(&problem, &wall) } else { None };
        let adhesion = held.as_ref().map(Held::adhesion);
        let fluid = problem.fluid(&detached, self.state.fluid_kpa);
        pressing.extend(adhesion.iter().map(|effect| Addition { effect, place: Place::Interface }));
        pressing.extend(fluid.iter().map(|effect| Addition { effect, place: Place::Interface }));
        let withdrawn = question.motion.force_mn == Some(0.0) || !self.decision.contact;
        let (motion, touch_mm) = match &aim.contact {
            Some(contact) => problem.aimed(&wall, &self.resolution, contact),
            None => {
                let travel_mm = if withdrawn { -WITHDRAWN_MM } else { 0.0 };
                let direction = question.tool.patch_from_needle.rotation * -Vector3::z_axis();
                (Motion { direction, force_mn: None, travel_mm }, travel_mm)
            }
        };
        let mut expected = match linear {
            Some(linear) => wall.displaced(&question.start(linear, self.decision.tool_flex)),
            None => wall.start(),
        };
        let deflection = aim.contact.map_or_else(Vector3::zeros, |contact| contact.deflection);
        wall.place_tip(&mut expected, &(motion.direction.into_inner() * motion.travel_mm + deflection));
        // Without mass or fluid, tissue that is let go is back at once but for what its bond and its stresses remember.
        let springs_back = withdrawn && !self.rates.inertia && !self.decision.bleb;
        let start = if springs_back { expected.clone() } else { self.start(&expected, &motion, unmoved) };
        progress.stage("equilibrium");
        let coefficient = problem.friction_coefficient.filter(|_| !withdrawn);
        let load = Load { motion: &motion, touch_mm, additions: &pressing };
        let (equilibrium, rubbing, grip) =
            self.balance(&problem, &wall, &load, coefficient, step_s, start, progress)?;
        if let Some(history) = &mut self.state.history {
            history.commit(&wall, &equilibrium.positions, grip, step_s);
        }
        progress.stage("surface");
        let mut answer = problem.answer(&wall, &self.resolution, &equilibrium, touch_mm);
        if let Some(rubbing) = &rubbing {
            answer.contact.rub(rubbing);
        }
        answer.contact.bond_damage =
            self.state.history.as_ref().filter(|_| self.decision.adhesion).and_then(History::damage);
        answer.contact.bleb = fluid.map(|fluid| problem.told_of(&fluid, &wall, &equilibrium.positions));
        self.state.fluid_kpa = answer.contact.bleb.map(|bleb| bleb.pressure_kpa);
        if withdrawn {
            (answer.travel_mm, answer.deflection) = (0.0, None);
        } else {
            answer = question.with_node_penetration(answer);
        }
        self.state.settled = Some(Settled { positions: equilibrium.positions, expected, pressed: linear.is_some() });
        let mut expected_error = match linear {
            Some(linear) => question.situation_under(linear).expected_error(question.request.level),
            None => ExpectedError::UNKNOWN,
        };
        // Quantiles were measured on single equilibria.
        expected_error.calibrated &= self.state.history.is_none();
        let mut prediction = question.prediction(answer, self.decision.clone(), expected_error);
        prediction.warnings.extend(aim.warnings);
        Ok((prediction, aim.laid))
    }

    /// Tissue that has been at rest for long, on the mesh of `wall`: over fluid, and under the pressure of the eye, if it has changed and anything depends on the rate at which the
    /// tissue leaves it.
    fn begin(
        &mut self,
        problem: &Problem,
        wall: &Wall,
        pressing: &[Addition],
        detached: &[bool],
        progress: &mut dyn Progress,
    ) -> Result<History, PredictError> {
        let tissue = &self.prepared.scene().tissue;
        let rest = &wall.geometry.rest;
        let mut history = History::at_rest(self.rates, &self.decision, tissue, wall.topology(), rest, detached);
        let fluid = problem.fluid(detached, None);
        if fluid.is_some() || (self.rates.any() && !pressing.is_empty()) {
            progress.stage("equilibrium");
            let motion = Motion { direction: Vector3::z_axis(), force_mn: None, travel_mm: WITHDRAWN_MM };
            let mut start = wall.start();
            wall.place_tip(&mut start, &(motion.direction.into_inner() * WITHDRAWN_MM));
            let bond = history.bond(f64::INFINITY);
            let mut additions = pressing.to_vec();
            additions.extend(bond.as_ref().map(|effect| Addition { effect, place: Place::Interface }));
            additions.extend(fluid.iter().map(|effect| Addition { effect, place: Place::Interface }));
            let load = Load { motion: &motion, touch_mm: WITHDRAWN_MM, additions: &additions };
            let settled = wall
                .solve(&load, start, &mut self.solver, progress)
                .map_err(|cause| problem.failed(self.sequence.level.name(), cause))?;
            history.settle(wall, &settled.positions);
        }
        Ok(history)
    }

    /// The equilibrium of a step of `step_s` (s), how it rubs, and the grip that it leaves.
    #[allow(clippy::too_many_arguments)]
    fn balance(
        &mut self,
        problem: &Problem,
        wall: &Wall,
        load: &Load,
        coefficient: Option<f64>,
        step_s: f64,
        start: Vec<f64>,
        progress: &mut dyn Progress,
    ) -> Result<(Equilibrium, Option<Rubbing>, Grip), PredictError> {
        let solver = &mut self.solver;
        let free = Grip::default();
        let grip = self.state.history.as_ref().map_or(&free, |history| &history.grip);
        let rubs = self.decision.friction;
        let solve = |additions: &[Addition]| {
            let load = Load { additions, ..*load };
            match coefficient {
                Some(coefficient) => wall
                    .solve_gripped(&load, coefficient, grip, start, solver, progress)
                    .map(|(equilibrium, rubbing, grip)| (equilibrium, Some(rubbing), grip)),
                None => {
                    let found = wall.solve(&load, start, solver, progress)?;
                    let left = if rubs { Grip::free(found.positions.clone()) } else { Grip::default() };
                    Ok((found, None, left))
                }
            }
        };
        let found = match &self.state.history {
            Some(history) => history.with_additions(wall, step_s, load.additions, solve),
            None => solve(load.additions),
        };
        let level = self.sequence.level.name();
        found.map_err(|cause| problem.failed(level, cause))
    }

    /// Positions to start from.
    fn start(&self, expected: &[f64], motion: &Motion, unmoved: bool) -> Vec<f64> {
        let Some(settled) = &self.state.settled else { return expected.to_vec() };
        if unmoved {
            return settled.positions.clone();
        }
        let mut start: Vec<f64> = settled
            .positions
            .iter()
            .zip(expected.iter().zip(&settled.expected))
            .map(|(settled, (now, before))| settled + (now - before))
            .collect();
        // A needle that is held stands exactly where it is told; one that was elsewhere has nothing to go on from.
        if motion.force_mn.is_none() || !settled.pressed {
            let tip = 3 * self.topology.needle();
            start[tip..].copy_from_slice(&expected[tip..]);
        }
        start
    }
}

/// Stands for a contact where there is none: the mesh is then laid around the patch's centre.
const NO_CONTACT: ContactEstimate = ContactEstimate {
    center: [0.0; 2],
    radius_mm: 0.1,
    touch_mm: 0.0,
    travel_mm: 0.0,
    deflection: Vector3::new(0.0, 0.0, 0.0),
};
