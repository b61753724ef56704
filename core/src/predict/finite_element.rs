//! The finite-element levels: where the mesh stands and the solve on it. Not here: how fine the mesh is (`resolution`).

use nalgebra::Vector3;

use super::held::Held;
use super::over_fluid::around_bleb;
pub use super::resolution::{COARSE, REFERENCE, Resolution};
use super::types::{ContactReport, ContactState, PredictError, SolverReport};
use crate::effects::pressure::Pressure;
use crate::equilibrium::bleb::Bleb;
use crate::equilibrium::friction::Rubbing;
use crate::equilibrium::settled::Settled;
use crate::equilibrium::{
    Addition, ContactSettings, ContactSummary, Equilibrium, Load, MeshSize, Motion, Solid, Strains, Tool, Wall,
};
use crate::mesh::disc::DiscGeometry;
use crate::mesh::sample::SurfaceLocator;
use crate::mesh::wall::{Place, WallError, WallTopology};
use crate::patch::Patch;
use crate::progress::Progress;
use crate::solve::newton::Workspace;
use crate::tissue::{LayerKind, RetinalBond, Tissue};

/// What is known of the contact before it is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEstimate {
    /// Patch parameters of its centre at equilibrium.
    pub center: [f64; 2],
    /// Its radius (mm).
    pub radius_mm: f64,
    /// Travel of the needle at first touch (mm).
    pub touch_mm: f64,
    /// Travel of the needle at equilibrium (mm).
    pub travel_mm: f64,
    /// How far the tip then stands aside of a rigid needle's (mm).
    pub deflection: Vector3<f64>,
}

/// Thickness of the innermost element of the retina, in contact radii over the number of elements through it.
const FIRST_ELEMENT_PER_CONTACT: f64 = 2.0;
/// Smallest contact radius that a mesh is made for, in needle radii.
pub(super) const SMALLEST_CONTACT: f64 = 0.05;
/// Depth of the linear answer, in smoothing distances of the contact, below which the needle hardly moves the tissue.
const LIGHT_PER_SMOOTHING: f64 = 0.1;
/// Share of the normal force on slipping tissue above which a contact counts as slipping.
const SLIPPING_FROM: f64 = 0.5;
/// The answer of a finite-element level, patch frame.
pub struct FiniteElementAnswer {
    /// Displacement of each node of the patch (mm).
    pub displacements: Vec<Vector3<f64>>,
    /// Travel of the needle (mm).
    pub travel_mm: f64,
    /// How far the tip stands aside of a rigid needle's (mm), where the shaft bends.
    pub deflection: Option<Vector3<f64>>,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: Vector3<f64>,
    /// The contact.
    pub contact: ContactReport,
    /// What it cost.
    pub solver: SolverReport,
    /// The contact as computed, to aim a finer mesh.
    pub estimate: ContactEstimate,
}

/// A level's mesh and memory for one prediction.
pub struct Bench<'a> {
    /// The level's name, for errors.
    pub level: &'static str,
    /// How finely it computes.
    pub resolution: &'a Resolution,
    /// The mesh's topology, made for `resolution`.
    pub topology: &'a WallTopology,
    /// The solver's memory.
    pub workspace: &'a mut Workspace,
}

/// The problem of one prediction, patch frame.
pub struct Problem<'a> {
    /// The patch.
    pub patch: &'a Patch,
    /// The tissue.
    pub tissue: &'a Tissue,
    /// The needle.
    pub tool: Tool<'a>,
    /// How it is driven.
    pub motion: Motion,
    /// |principal stretch − 1| that the tissue bears.
    pub bears_strain: f64,
    /// Which solid energy.
    pub solid: Solid,
    /// Coulomb's coefficient, where friction is simulated.
    pub friction_coefficient: Option<f64>,
    /// Change of the eye's pressure (kPa), where it is simulated.
    pub pressure_kpa: Option<f64>,
    /// The retina's bond, where it can part.
    pub bond: Option<RetinalBond>,
    /// Fluid under the retina, where it is simulated.
    pub bleb: Option<Bleb>,
}

impl Problem<'_> {
    /// The mesh around the estimated contact.
    pub(crate) fn mesh(&self, resolution: &Resolution, estimate: &ContactEstimate) -> MeshSize {
        let needle_radius = self.tool.body.radius_mm();
        let contact = estimate.radius_mm.max(SMALLEST_CONTACT * needle_radius);
        let core = resolution.core_per_contact * contact;
        let rim = contact + resolution.rim_mm;
        let rings = resolution.rings as f64;
        let ratio = (rim / core).powf(1.0 / rings);
        // Zero without grading, and then without a trace.
        let graded = |share: f64| rings * (share.powf(resolution.ring_grading) - share);
        let radius = |ring: usize| core * ratio.powi(ring as i32) * ratio.powf(graded(ring as f64 / rings));
        let center = estimate.center;
        let disc = match &self.bleb {
            Some(bleb) => around_bleb(bleb, center, core, rim, resolution.rings),
            None => DiscGeometry { center, radii: (0..=resolution.rings).map(radius).collect(), offsets: Vec::new() },
        };
        MeshSize { disc, first_element_mm: FIRST_ELEMENT_PER_CONTACT * contact / resolution.retina_elements as f64 }
    }

    /// Solves on a mesh around the estimated contact, from the displacements `start` (patch parameters and depth in layers in, displacement out).
    ///
    /// # Errors
    /// [`PredictError::Mesh`], [`PredictError::Solver`].
    pub fn solve(
        &self,
        bench: &mut Bench,
        estimate: &ContactEstimate,
        start: &dyn Fn([f64; 2], f64) -> Vector3<f64>,
        progress: &mut dyn Progress,
    ) -> Result<FiniteElementAnswer, PredictError> {
        progress.stage("mesh");
        let Bench { level, resolution, topology, workspace } = bench;
        self.check_on_bleb(resolution, estimate)?;
        let wall = self.wall(topology, resolution, &self.mesh(resolution, estimate))?;
        let (motion, touch_mm) = self.aimed(&wall, resolution, estimate);
        let mut positions = wall.displaced(start);
        wall.place_tip(&mut positions, &(motion.direction.into_inner() * motion.travel_mm + estimate.deflection));
        progress.stage("equilibrium");
        let pressure = self.pressure_kpa.map(|pressure_kpa| Pressure { pressure_kpa });
        let held = Held::new(self, &wall);
        let adhesion = held.as_ref().map(Held::adhesion);
        let fluid = held.as_ref().and_then(|held| held.fluid(self));
        let mut additions: Vec<Addition> =
            pressure.iter().map(|effect| Addition { effect, place: Place::Faces }).collect();
        additions.extend(adhesion.iter().map(|effect| Addition { effect, place: Place::Interface }));
        additions.extend(fluid.iter().map(|effect| Addition { effect, place: Place::Interface }));
        let load = Load { motion: &motion, touch_mm, additions: &additions };
        let failed = |cause| self.failed(level, cause);
        let (equilibrium, rubbing) = match self.friction_coefficient {
            None => (wall.solve(&load, positions, workspace, progress).map_err(failed)?, None),
            Some(coefficient) => {
                let (equilibrium, rubbing) =
                    wall.solve_with_friction(&load, coefficient, positions, workspace, progress).map_err(failed)?;
                (equilibrium, Some(rubbing))
            }
        };
        progress.stage("surface");
        let mut answer = self.answer(&wall, resolution, &equilibrium, touch_mm);
        if let Some(rubbing) = &rubbing {
            answer.contact.rub(rubbing);
        }
        let positions = &equilibrium.positions;
        answer.contact.bond_damage = held.as_ref().zip(self.bond).map(|(held, _)| held.damage(&wall, positions));
        answer.contact.bleb = fluid.map(|fluid| self.told_of(&fluid, &wall, positions));
        Ok(answer)
    }

    /// The contact's parameters: a round tip meets the tissue all at once and needs no softened approach.
    fn contact(&self, resolution: &Resolution) -> ContactSettings {
        match self.tool.body.is_round() {
            true => ContactSettings { softening: 1.0, ..resolution.contact },
            false => resolution.contact,
        }
    }

    /// The meshed wall under the needle.
    ///
    /// # Errors
    /// If the wall cannot be meshed there.
    pub(crate) fn wall<'b>(
        &'b self,
        topology: &'b WallTopology,
        resolution: &Resolution,
        mesh: &MeshSize,
    ) -> Result<Wall<'b>, WallError> {
        let mut wall = Wall::new(
            topology,
            &self.patch.surface,
            self.tissue,
            mesh,
            self.solid,
            self.contact(resolution),
            self.tool,
        )?;
        wall.puncture_at(self.bears_strain);
        if let (Some(settled), Some(pressure_kpa)) = (self.settled(resolution), self.pressure_kpa) {
            wall.settle(&self.patch.surface, &settled, pressure_kpa);
        }
        if let Some(bleb) = &self.bleb {
            wall.raise(bleb, |[x, y]| self.patch.surface.column(x, y).inward.into_inner());
        }
        Ok(wall)
    }

    /// Where the wall stands far from the needle, if the eye's pressure has changed.
    fn settled(&self, resolution: &Resolution) -> Option<Settled> {
        let yields = |kind| kind != LayerKind::Sclera || resolution.sclera_elements > 0;
        self.pressure_kpa.map(|pressure_kpa| Settled::new(self.tissue, pressure_kpa, self.solid, yields))
    }

    /// The motion with a guess of its travel on this wall, and the travel at first touch (mm).
    pub(crate) fn aimed(&self, wall: &Wall, resolution: &Resolution, estimate: &ContactEstimate) -> (Motion, f64) {
        let touch_mm = wall.touch(&self.motion.direction, estimate.touch_mm).unwrap_or(estimate.touch_mm);
        let motion = match self.motion.force_mn {
            Some(force_mn) => {
                let beyond = (estimate.travel_mm - estimate.touch_mm).max(0.0);
                let contact = self.contact(resolution).softened();
                let travel_mm = if beyond < LIGHT_PER_SMOOTHING * contact.smoothing_mm && contact == resolution.contact
                {
                    wall.resting_travel_mm(&wall.start(), &self.motion, touch_mm, force_mn)
                } else {
                    let area = std::f64::consts::PI
                        * estimate.radius_mm.max(SMALLEST_CONTACT * self.tool.body.radius_mm()).powi(2);
                    touch_mm + beyond + force_mn / area / contact.stiffness_kpa_per_mm
                };
                Motion { travel_mm, ..self.motion }
            }
            None => self.motion,
        };
        (motion, touch_mm)
    }

    /// Displacement of a surface point far from the needle (mm).
    fn sunk(&self, settled: &Settled, [x, y]: [f64; 2]) -> Vector3<f64> {
        let column = self.patch.surface.column(x, y);
        column.inward.into_inner() * settled.sink_mm(&column, 0.0)
    }

    /// The equilibrium read off at the patch's nodes.
    pub(crate) fn answer(
        &self,
        wall: &Wall,
        resolution: &Resolution,
        equilibrium: &Equilibrium,
        touch_mm: f64,
    ) -> FiniteElementAnswer {
        let settled = self.settled(resolution);
        let beyond = |parameter| settled.as_ref().map_or_else(Vector3::zeros, |settled| self.sunk(settled, parameter));
        let displacement: Vec<f64> =
            equilibrium.positions.iter().zip(&wall.geometry.rest).map(|(current, rest)| current - rest).collect();
        let surface = SurfaceLocator::new(wall.topology(), &wall.geometry);
        let node = |&parameter: &[f64; 2]| match surface.locate(parameter) {
            Some(sample) => sample.interpolate(&displacement),
            None => beyond(parameter),
        };
        let summary = wall.contact_summary(&equilibrium.positions);
        FiniteElementAnswer {
            displacements: self.patch.parameters.iter().map(node).collect(),
            travel_mm: equilibrium.travel_mm,
            deflection: equilibrium.deflection,
            reaction_mn: equilibrium.reaction_mn,
            contact: report(&summary, &wall.strains(&equilibrium.positions)),
            solver: SolverReport {
                iterations: equilibrium.newton.iterations,
                load_steps: equilibrium.load_steps,
                unknowns: wall.topology().dofs.free,
                residual_mn: equilibrium.newton.residual_mn,
            },
            estimate: ContactEstimate {
                center: summary.center,
                radius_mm: (summary.area_mm2 / std::f64::consts::PI).sqrt(),
                touch_mm,
                travel_mm: equilibrium.travel_mm,
                deflection: equilibrium.deflection.unwrap_or_default(),
            },
        }
    }
}

impl ContactReport {
    /// Says how a contact rubs.
    pub(crate) fn rub(&mut self, rubbing: &Rubbing) {
        if self.state == ContactState::Touching {
            self.slipping_share = Some(rubbing.slipping_share);
            if rubbing.slipping_share > SLIPPING_FROM {
                self.state = ContactState::Slipping;
            }
        }
    }
}

fn report(summary: &ContactSummary, strains: &Strains) -> ContactReport {
    ContactReport {
        state: if summary.area_mm2 > 0.0 { ContactState::Touching } else { ContactState::Clear },
        area_mm2: summary.area_mm2,
        max_pressure_kpa: summary.max_pressure_kpa,
        max_penetration_mm: summary.max_penetration_mm.max(0.0),
        max_strain: strains.max_strain,
        least_volume_ratio: Some(strains.least_volume_ratio),
        slipping_share: None,
        bond_damage: None,
        bleb: None,
        puncture_share: 0.0,
    }
}
