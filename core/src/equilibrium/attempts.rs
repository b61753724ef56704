//! How an equilibrium is reached: directly from a good start if it can be, by load steps if it must.
//!
//! Not here: the repetition that friction needs (`friction`), Newton's method itself (`solve`).

use nalgebra::Vector3;

use super::error::EquilibriumError;
use super::{ContactSettings, Equilibrium, Load, Motion, Wall};
use crate::effect::Multiplier;
use crate::mesh::wall::Place;
use crate::progress::Progress;
use crate::solve::newton::{
    Drive, Globalization, NewtonError, NewtonReport, NewtonSettings, System, Workspace, holding_force,
};
use crate::solve::sparse::Precision;

/// One way to reach an equilibrium.
pub(super) struct Attempt {
    load_steps: usize,
    globalization: Globalization,
    /// In which precision matrices are factorised first.
    precision: Precision,
    /// Newton iterations for each load step.
    max_iterations: usize,
    /// How many of them may find the tissue about to buckle.
    max_weakened: usize,
    /// Whether it goes on from the equilibrium of a load that is nearly this one, the factor at hand.
    resumes: bool,
    /// Largest travel in one Newton iteration, in that of a direct attempt.
    travel_share: f64,
}

/// Residual relative to the force scale at which the first solve of a softened contact stops.
const SOFTENED_TOLERANCE: f64 = 1e-3;
/// Force scale under pose control (mN): that of a light touch.
const POSE_FORCE_SCALE_MN: f64 = 0.01;
/// Smallest force scale in a wall under pressure, over the force of the pressure on the whole surface.
const SMALLEST_FORCE_SHARE: f64 = 1e-5;
/// Iterations of a direct attempt that may find the tissue about to buckle: those that came to rest took ten at most.
const DIRECT_WEAKENED: usize = 15;
/// How many of them go directly from the start.
const DIRECT: usize = 2;
/// What is tried, in this order: directly from the given start, then from first touch in load steps. Far from linear, rounding decides where an iteration ends: what single
/// precision does not find, double may.
const ATTEMPTS: [Attempt; 5] = [
    Attempt {
        load_steps: 1,
        globalization: Globalization::PredictedStress,
        precision: Precision::Single,
        max_iterations: 45,
        max_weakened: DIRECT_WEAKENED,
        resumes: false,
        travel_share: 1.0,
    },
    Attempt {
        load_steps: 1,
        globalization: Globalization::PredictedStress,
        precision: Precision::Double,
        max_iterations: 45,
        max_weakened: DIRECT_WEAKENED,
        resumes: false,
        travel_share: 1.0,
    },
    Attempt {
        load_steps: 4,
        globalization: Globalization::PredictedStress,
        precision: Precision::Double,
        max_iterations: 30,
        max_weakened: 30,
        resumes: false,
        travel_share: 1.0,
    },
    Attempt {
        load_steps: 8,
        globalization: Globalization::PredictedStress,
        precision: Precision::Double,
        max_iterations: 30,
        max_weakened: 30,
        resumes: false,
        travel_share: 1.0,
    },
    Attempt {
        load_steps: 12,
        globalization: Globalization::LineSearch,
        precision: Precision::Double,
        max_iterations: 100,
        max_weakened: 100,
        resumes: false,
        travel_share: 1.0,
    },
];
/// Longest travels of a step between rounds, in that of a direct attempt, in the order in which they are tried. Under high friction there are several balances for the same pressures: whole steps find
/// one soonest, short ones do not leap from one to another where whole ones go to and fro.
pub(super) const ROUND_TRAVELS: [f64; 2] = [1.0, 0.12];

/// What is tried from an equilibrium nearby: with full steps from where it was left, and where they fail with a line search.
pub(super) const fn repetitions(travel_share: f64) -> [Attempt; 2] {
    [
        Attempt {
            load_steps: 1,
            globalization: Globalization::PredictedStress,
            precision: Precision::Double,
            max_iterations: 45,
            max_weakened: 45,
            resumes: true,
            travel_share,
        },
        Attempt {
            load_steps: 1,
            globalization: Globalization::LineSearch,
            precision: Precision::Double,
            max_iterations: 100,
            max_weakened: 100,
            resumes: false,
            travel_share,
        },
    ]
}

/// Friction coupled to the pressures, from a state nearby.
pub(super) const COUPLED: Attempt = Attempt {
    load_steps: 1,
    globalization: Globalization::PredictedStress,
    precision: Precision::Single,
    max_iterations: 7,
    max_weakened: 3,
    resumes: false,
    travel_share: 1.0,
};
/// Iterations of all attempts together: what takes more is a sharp edge that cuts its way in, where no load path of this model ends.
const MOST_ITERATIONS: usize = 120;
/// Share of the remaining way by which the needle overlaps the tissue at the start of load steps.
const FIRST_OVERLAP: f64 = 0.05;
/// Largest travel in one Newton iteration, in needle radii.
const MAX_TRAVEL_PER_RADIUS: f64 = 0.25;

impl Wall<'_> {
    /// Finds the equilibrium under `load` from the start `positions` (tissue and tip).
    ///
    /// # Errors
    /// The failure of the last attempt; [`EquilibriumError::Torn`] where the tissue is strained beyond what it bears by then.
    pub fn solve(
        &self,
        load: &Load,
        positions: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, EquilibriumError> {
        self.solve_to(self.contact.tolerance, load, positions, workspace, progress)
    }

    /// As [`Wall::solve`], to the residual `tolerance` relative to the force scale.
    ///
    /// # Errors
    /// [`EquilibriumError`].
    pub(super) fn solve_to(
        &self,
        tolerance: f64,
        load: &Load,
        positions: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, EquilibriumError> {
        self.solve_by(&ATTEMPTS, tolerance, load, positions, workspace, progress)
    }

    /// As [`Wall::solve`], without load steps where the start is no good one.
    ///
    /// # Errors
    /// [`EquilibriumError`].
    pub(super) fn solve_directly(
        &self,
        load: &Load,
        positions: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, EquilibriumError> {
        self.solve_by(&ATTEMPTS[..DIRECT], self.contact.tolerance, load, positions, workspace, progress)
    }

    /// The first of `attempts` that succeeds.
    fn solve_by(
        &self,
        attempts: &[Attempt],
        tolerance: f64,
        load: &Load,
        start: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, EquilibriumError> {
        let (mut spent, mut spent_in_single) = (0, 0);
        let mut failure = EquilibriumError::Newton(NewtonError::Interrupted { iterations: 0 });
        for attempt in attempts {
            if spent >= MOST_ITERATIONS {
                break;
            }
            let positions = if attempt.load_steps == 1 { start.clone() } else { self.touching(load) };
            match self.follow(load, (attempt, tolerance), positions, &mut spent, workspace, progress) {
                Ok(mut equilibrium) => {
                    equilibrium.newton.iterations = spent_in_single + spent;
                    return Ok(equilibrium);
                }
                Err(stop) if stop.is_interrupted() => return Err(stop),
                Err(error) if attempt.precision == Precision::Single => {
                    spent_in_single += std::mem::take(&mut spent);
                    failure = error;
                }
                // Load steps may find a rest there, but one of tissue folded as no whole tissue would be.
                Err(stop @ EquilibriumError::Torn { .. }) => return Err(stop),
                Err(error) => failure = error,
            }
        }
        if let EquilibriumError::Newton(NewtonError::NotConverged { iterations, .. }) = &mut failure {
            *iterations = spent_in_single + spent;
        }
        Err(failure)
    }

    /// The tissue at rest and the needle just overlapping it.
    fn touching(&self, load: &Load) -> Vec<f64> {
        let Load { motion, touch_mm, .. } = *load;
        let mut positions = self.start();
        let overlap = FIRST_OVERLAP * (motion.travel_mm - touch_mm).max(0.0) + 2.0 * self.contact.smoothing_mm;
        self.place_tip(&mut positions, &(motion.direction.into_inner() * (touch_mm + overlap)));
        positions
    }

    /// Follows equal load steps to the whole motion, with a softened contact if there is one, and ends with the contact proper, to a residual `tolerance` relative to the
    /// force scale.
    fn follow(
        &self,
        load: &Load,
        (attempt, tolerance): (&Attempt, f64),
        mut positions: Vec<f64>,
        spent: &mut usize,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, EquilibriumError> {
        let Load { motion, touch_mm, .. } = *load;
        let softened = self.contact.softened();
        load.multipliers().for_each(Multiplier::reset);
        let mut total = NewtonReport::default();
        for step in 1..=attempt.load_steps {
            let share = step as f64 / attempt.load_steps as f64;
            if motion.force_mn.is_none() {
                self.hold_at(&mut positions, motion, touch_mm + share * (motion.travel_mm - touch_mm));
            }
            let drive = self.drive(motion, share);
            let softly = (&softened, SOFTENED_TOLERANCE);
            let proper = (&self.contact, tolerance);
            let softly = (self.contact.softening > 1.0).then_some(softly);
            let proper = (softly.is_none() || step == attempt.load_steps).then_some(proper);
            for (contact, tolerance) in softly.into_iter().chain(proper) {
                let drive = (drive, tolerance);
                total += self
                    .newton(contact, drive, load, attempt, &mut positions, spent, workspace, progress)
                    .map_err(|cause| self.judged(cause, &positions, *spent))?;
            }
        }
        Ok(self.equilibrium(motion, positions, total, attempt.load_steps, workspace))
    }

    /// How far the tissue is strained, if that is beyond what it bears.
    fn overstrain(&self, positions: &[f64]) -> Option<f64> {
        let bounded = self.bears_strain.is_finite();
        let strain = bounded.then(|| self.strains(positions).max_strain);
        strain.filter(|strain| *strain > self.bears_strain)
    }

    /// What it means that a solve failed with `cause` at `positions`: tissue that is strained beyond what it bears punctures.
    fn judged(&self, cause: NewtonError, positions: &[f64], iterations: usize) -> EquilibriumError {
        match (cause, self.overstrain(positions)) {
            (NewtonError::NotConverged { .. } | NewtonError::NoStep { .. } | NewtonError::Linear(_), Some(strain)) => {
                EquilibriumError::Torn { iterations, strain, limit: self.bears_strain }
            }
            (cause, _) => cause.into(),
        }
    }

    /// One Newton solve with this contact, to the given tolerance relative to the force scale.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn newton(
        &self,
        contact: &ContactSettings,
        (drive, tolerance): (Drive, f64),
        load: &Load,
        attempt: &Attempt,
        positions: &mut [f64],
        spent: &mut usize,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<NewtonReport, NewtonError> {
        let solid = self.solid();
        let contact = self.contact_with(contact);
        let flex = self.flex(load.motion);
        let mut terms =
            vec![self.topology.term(Place::Elements, solid.as_ref()), self.topology.term(Place::Faces, &contact)];
        terms.extend(flex.iter().map(|flex| self.topology.term(Place::Tip, flex)));
        terms.extend(load.additions.iter().map(|addition| self.topology.term(addition.place, addition.effect)));
        let system = System {
            terms: &terms,
            dofs: &self.topology.dofs,
            pattern: &self.topology.pattern,
            symbolic: &self.topology.symbolic,
            driven: Some(self.topology.needle()),
            dead_load: &[],
        };
        let smallest = (self.rounding_mn() / self.contact.tolerance).max(SMALLEST_FORCE_SHARE * self.pressure_force_mn);
        let force_mn = load.motion.force_mn.unwrap_or(POSE_FORCE_SCALE_MN);
        let scale = force_mn.max(smallest);
        let wanted_mn = tolerance * scale;
        let lost_at_most_mn = self.lost_at_most_mn(force_mn);
        let mut settings = NewtonSettings {
            globalization: attempt.globalization,
            precision: attempt.precision,
            force_scale_mn: scale,
            tolerance_mn: wanted_mn.max(lost_at_most_mn),
            max_iterations: attempt.max_iterations.min(MOST_ITERATIONS.saturating_sub(*spent)),
            max_weakened: attempt.max_weakened,
            max_travel_mm: attempt.travel_share * MAX_TRAVEL_PER_RADIUS * self.tool.body.radius_mm(),
        };
        let mut counted = |solved: Result<NewtonReport, NewtonError>| {
            *spent += solved.as_ref().map_or_else(NewtonError::iterations, |report| report.iterations);
            solved
        };
        let mut report = counted(match attempt.resumes {
            true => system.resume(positions, drive, &settings, workspace, progress),
            false => system.solve(positions, drive, &settings, workspace, progress),
        })?;
        if lost_at_most_mn > wanted_mn && report.residual_mn > wanted_mn {
            settings.tolerance_mn = wanted_mn.max(self.lost_mn(&terms, positions).min(lost_at_most_mn));
            settings.max_iterations = settings.max_iterations.saturating_sub(report.iterations);
            report += counted(match report.iterations {
                0 => system.solve(positions, drive, &settings, workspace, progress),
                _ => system.resume(positions, drive, &settings, workspace, progress),
            })?;
        }
        Ok(report)
    }

    pub(super) fn equilibrium(
        &self,
        motion: &Motion,
        positions: Vec<f64>,
        newton: NewtonReport,
        load_steps: usize,
        workspace: &Workspace,
    ) -> Equilibrium {
        let (travel_mm, deflection) = self.ended(&positions, motion);
        let tip = Vector3::from_row_slice(&positions[3 * self.topology.needle()..]);
        // What holds the tip is the guide and, where it bends, the shaft.
        let shaft = self.flex(motion).map_or_else(Vector3::zeros, |flex| flex.force_on_guide(&tip));
        let reaction_mn = shaft - holding_force(workspace);
        Equilibrium { positions, travel_mm, deflection, reaction_mn, newton, load_steps }
    }
}
