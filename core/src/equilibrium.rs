//! The equilibrium of one contact on one mesh: needle, wall and force in; positions, travel and reaction out.
//!
//! Patch frame throughout. [`Wall`] is the meshed problem; [`Wall::solve`] finds its equilibrium from a start, directly if it can, by load
//! steps if it must. Not here: how fine a mesh a level uses, where the mesh is centred.

pub mod friction;
mod light;
pub mod settled;

use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};

use crate::effect::{Effect, Local};
use crate::effects::contact::{Contact, ContactFaces};
use crate::effects::elasticity::Elasticity;
use crate::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use crate::mesh::disc::DiscGeometry;
use crate::mesh::element::{NODES, POINTS};
use crate::mesh::wall::{LayerThickness, Place, WallError, WallGeometry, WallTopology};
use crate::needle::Body;
use crate::progress::Progress;
use crate::solve::newton::{
    Drive, Globalization, NewtonError, NewtonReport, NewtonSettings, System, Workspace, holding_force,
};
use crate::surface::Surface;
use crate::tissue::{LayerKind, Tissue};
use settled::Settled;

/// Which solid energy is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solid {
    /// Small strain.
    Elasticity,
    /// Neo-Hookean.
    FiniteStrain,
}

/// Numerical parameters of the contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Penalty stiffness (kPa/mm).
    pub stiffness_kpa_per_mm: f64,
    /// Smoothing distance (mm).
    pub smoothing_mm: f64,
    /// Gauss points along each edge of a face.
    pub points_per_edge: usize,
    /// A first solve with this many times less stiffness and more smoothing leads to the contact proper; 1: none is needed. A stiff contact
    /// on a fine mesh finds its points one by one, a soft one all at once.
    pub softening: f64,
}

impl ContactSettings {
    /// The contact of the first solve.
    pub fn softened(&self) -> Self {
        ContactSettings {
            stiffness_kpa_per_mm: self.stiffness_kpa_per_mm / self.softening,
            smoothing_mm: self.smoothing_mm * self.softening,
            softening: 1.0,
            ..*self
        }
    }
}

/// Where a mesh stands and how it is graded.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSize {
    /// The disc around the contact.
    pub disc: DiscGeometry,
    /// Thickness of the innermost element of the retina (mm), unless equal elements are thinner.
    pub first_element_mm: f64,
}

/// The needle as the wall sees it.
#[derive(Clone, Copy, Debug)]
pub struct Tool<'a> {
    /// Its solid.
    pub body: &'a Body,
    /// Its pose before it moves.
    pub patch_from_needle: Isometry3<f64>,
}

/// How the needle is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Direction of advance.
    pub direction: Unit<Vector3<f64>>,
    /// Force along it (mN); `None`: the needle is advanced by `travel_mm` and held.
    pub force_mn: Option<f64>,
    /// Travel from the given pose: the target under pose control, a guess under force control (mm).
    pub travel_mm: f64,
}

/// An effect besides the solid and the contact, and where it acts.
#[derive(Clone, Copy)]
pub struct Addition<'a> {
    /// The energy.
    pub effect: &'a dyn Effect,
    /// Where it acts.
    pub place: Place,
}

/// What is done to a wall.
#[derive(Clone, Copy)]
pub struct Load<'a> {
    /// How the needle is driven.
    pub motion: &'a Motion,
    /// Travel of the needle at first touch of the tissue at rest (mm): where load steps begin, if they are needed.
    pub touch_mm: f64,
    /// What acts besides the needle's contact.
    pub additions: &'a [Addition<'a>],
}

/// A meshed wall under a needle.
pub struct Wall<'a> {
    topology: &'a WallTopology,
    /// Rest geometry.
    pub geometry: WallGeometry,
    materials: Vec<Lame>,
    faces: ContactFaces,
    solid: Solid,
    contact: ContactSettings,
    tool: Tool<'a>,
    /// Radius of the rim (mm).
    rim_mm: f64,
    /// Positions without the needle's contact, where they are not those at rest.
    settled: Option<Vec<f64>>,
    /// Force of the pressure on the whole surface (mN).
    pressure_force_mn: f64,
}

/// One way to reach an equilibrium.
struct Attempt {
    load_steps: usize,
    globalization: Globalization,
    /// Newton iterations for each load step.
    max_iterations: usize,
}

/// An equilibrium.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    /// Current positions of all vertices, the needle's tip last (mm).
    pub positions: Vec<f64>,
    /// Travel of the needle from its given pose (mm).
    pub travel_mm: f64,
    /// Force of the tissue on the needle (mN).
    pub reaction_mn: Vector3<f64>,
    /// Cost of all load steps together.
    pub newton: NewtonReport,
    /// Load steps.
    pub load_steps: usize,
}

/// The contact of an equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSummary {
    /// Rest area under pressure (mm²).
    pub area_mm2: f64,
    /// Largest pressure (kPa).
    pub max_pressure_kpa: f64,
    /// Deepest penetration (mm).
    pub max_penetration_mm: f64,
    /// Centre of pressure in patch parameters.
    pub center: [f64; 2],
}

/// How far the tissue of an equilibrium is from its rest state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strains {
    /// Largest |principal stretch − 1|.
    pub max_strain: f64,
    /// Smallest present volume over that at rest; zero or less where the tissue is turned inside out.
    pub least_volume_ratio: f64,
}

/// Residual relative to the force scale at which Newton stops.
const RELATIVE_TOLERANCE: f64 = 1e-7;
/// The same in the first solve of a softened contact.
const SOFTENED_TOLERANCE: f64 = 1e-3;
/// Force scale under pose control (mN): that of a light touch.
const POSE_FORCE_SCALE_MN: f64 = 0.01;
/// Rounding of the tissue's forces over stiffness (λ + 2µ) times squared width of the mesh: stretches are known to a few times 1e-16, and a stress
/// acts on a piece of the mesh. No residual is asked to be smaller.
const ROUNDING: f64 = 1e-15;
/// The same in a wall under pressure, over the force of the pressure on the whole surface.
const SMALLEST_FORCE_SHARE: f64 = 1e-5;
/// What is tried, in this order: directly from the given start, then from first touch in load steps.
const ATTEMPTS: [Attempt; 4] = [
    Attempt { load_steps: 1, globalization: Globalization::PredictedStress, max_iterations: 45 },
    Attempt { load_steps: 4, globalization: Globalization::PredictedStress, max_iterations: 30 },
    Attempt { load_steps: 8, globalization: Globalization::PredictedStress, max_iterations: 30 },
    Attempt { load_steps: 12, globalization: Globalization::LineSearch, max_iterations: 100 },
];
/// Iterations of all attempts together: what takes more is a sharp edge that cuts its way in, where no load path of this model ends.
const MOST_ITERATIONS: usize = 120;
/// Iterations in which the needle waits for the tissue.
const HELD_ITERATIONS: usize = 1;
/// Share of the remaining way by which the needle overlaps the tissue at the start of load steps.
const FIRST_OVERLAP: f64 = 0.05;
/// Largest travel in one Newton iteration, in needle radii.
const MAX_TRAVEL_PER_RADIUS: f64 = 0.25;
/// Iterations that bring the needle to first contact.
const TOUCH_ITERATIONS: usize = 20;

impl<'a> Wall<'a> {
    /// Meshes the wall under `surface`.
    ///
    /// # Errors
    /// If the wall cannot be meshed there.
    pub fn new(
        topology: &'a WallTopology,
        surface: &Surface,
        tissue: &Tissue,
        mesh: &MeshSize,
        solid: Solid,
        contact: ContactSettings,
        tool: Tool<'a>,
    ) -> Result<Self, WallError> {
        let layers = tissue.layers();
        let thicknesses: Vec<LayerThickness> = layers
            .iter()
            .map(|named| LayerThickness {
                thickness_mm: named.layer.thickness_mm,
                thins: matches!(named.kind, LayerKind::Retina(_)),
                first_element_mm: match named.kind {
                    LayerKind::Retina(0) => mesh.first_element_mm,
                    _ => f64::INFINITY,
                },
            })
            .collect();
        let geometry = WallGeometry::new(topology, &mesh.disc, &thicknesses, |x, y| surface.column(x, y))?;
        let lame = |layer: usize| Lame {
            mu: layers[layer].layer.shear_modulus_kpa(),
            lambda: layers[layer].layer.first_lame_kpa(),
        };
        let materials = topology.element_layer.iter().map(|&layer| lame(layer)).collect();
        let faces = ContactFaces::new(&topology.faces, &geometry.rest, contact.points_per_edge);
        let rim_mm = mesh.disc.radii.last().copied().unwrap_or_default();
        Ok(Wall {
            topology,
            geometry,
            materials,
            faces,
            solid,
            contact,
            tool,
            rim_mm,
            settled: None,
            pressure_force_mn: 0.0,
        })
    }

    /// The mesh's topology.
    pub fn topology(&self) -> &WallTopology {
        self.topology
    }

    /// The inner surface's faces at rest.
    pub fn faces(&self) -> &ContactFaces {
        &self.faces
    }

    /// Lets the wall begin, and its rim stand, where every point has sunk along its column under `pressure_kpa`.
    pub fn settle(&mut self, surface: &Surface, settled: &Settled, pressure_kpa: f64) {
        let area: f64 = (0..self.topology.faces.len()).flat_map(|face| self.faces.areas(face)).sum();
        self.pressure_force_mn = pressure_kpa.abs() * area;
        let mut positions = self.geometry.rest.clone();
        for (vertex, &(point, _)) in self.topology.vertices.iter().enumerate() {
            let [x, y] = self.geometry.parameters[point];
            let column = surface.column(x, y);
            let sink = column.inward.into_inner() * settled.sink_mm(&column, self.geometry.layer_coordinates[vertex]);
            for k in 0..3 {
                positions[3 * vertex + k] += sink[k];
            }
        }
        self.settled = Some(positions);
    }

    /// Positions without contact, with the needle's tip at its given pose.
    pub fn start(&self) -> Vec<f64> {
        let mut positions = self.settled.as_ref().unwrap_or(&self.geometry.rest).clone();
        self.place_tip(&mut positions, &Vector3::zeros());
        positions
    }

    /// Positions without contact displaced by `field` (patch parameters and depth in layers in, displacement out), the needle's tip at its given
    /// pose. Fixed vertices stay.
    pub fn displaced(&self, field: &dyn Fn([f64; 2], f64) -> Vector3<f64>) -> Vec<f64> {
        let mut positions = self.start();
        for (vertex, &(point, _)) in self.topology.vertices.iter().enumerate() {
            if self.topology.dofs.index(vertex, 0).is_none() {
                continue;
            }
            let moved = field(self.geometry.parameters[point], self.geometry.layer_coordinates[vertex]);
            for k in 0..3 {
                positions[3 * vertex + k] += moved[k];
            }
        }
        positions
    }

    /// Puts the needle's tip at `offset` from its given pose.
    pub fn place_tip(&self, positions: &mut [f64], offset: &Vector3<f64>) {
        let tip = self.tool.patch_from_needle.translation.vector + offset;
        positions[3 * self.topology.needle()..].copy_from_slice(tip.as_slice());
    }

    /// What rounding leaves of the balance of forces (mN).
    fn rounding_mn(&self) -> f64 {
        let stiffest_kpa = self.materials.iter().map(|lame| lame.lambda + 2.0 * lame.mu).fold(0.0, f64::max);
        ROUNDING * stiffest_kpa * self.rim_mm * self.rim_mm
    }

    fn contact(&self) -> Contact<'_> {
        self.contact_with(&self.contact)
    }

    fn contact_with(&self, settings: &ContactSettings) -> Contact<'_> {
        Contact {
            faces: &self.faces,
            shape: self.tool.body,
            frame_from_needle: self.tool.patch_from_needle.rotation.to_rotation_matrix(),
            stiffness_kpa_per_mm: settings.stiffness_kpa_per_mm,
            smoothing_mm: settings.smoothing_mm,
        }
    }

    fn solid(&self) -> Box<dyn Effect + '_> {
        let (geometry, materials) = (&self.geometry.solid, &self.materials[..]);
        match self.solid {
            Solid::Elasticity => Box::new(Elasticity { geometry, materials }),
            Solid::FiniteStrain => Box::new(FiniteStrain { geometry, materials, law: NeoHookean::Logarithmic }),
        }
    }

    /// The travel along `direction` at which the needle first touches the rest surface, from the guess `travel_mm`; `None` if
    /// the line misses the mesh.
    pub fn touch(&self, direction: &Unit<Vector3<f64>>, mut travel_mm: f64) -> Option<f64> {
        let contact = self.contact();
        let mut positions = self.start();
        let stencils = &self.topology.faces;
        let mut local = vec![0.0; 3 * stencils.group_size];
        for _ in 0..TOUCH_ITERATIONS {
            self.place_tip(&mut positions, &(direction.into_inner() * travel_mm));
            let mut nearest = (f64::INFINITY, Point3::origin());
            for group in 0..stencils.len() {
                stencils.gather(group, &positions, &mut local);
                let local = Local { current: &local, group, predicted: &[] };
                for point in contact.contact_points(&local) {
                    if point.gap_mm < nearest.0 {
                        nearest = (point.gap_mm, point.position);
                    }
                }
            }
            let mut pose = self.tool.patch_from_needle;
            pose.translation.vector += direction.into_inner() * travel_mm;
            let gradient = self.tool.body.signed_distance(&pose.inverse_transform_point(&nearest.1)).gradient;
            let closing = (pose.rotation * gradient).dot(direction);
            if closing < 1e-3 {
                return None;
            }
            let step = nearest.0 / closing;
            travel_mm += step;
            if step.abs() < 0.1 * self.contact.smoothing_mm {
                return Some(travel_mm);
            }
        }
        None
    }

    /// Finds the equilibrium under `load` from the start `positions` (tissue and tip).
    ///
    /// # Errors
    /// The failure of the last attempt.
    pub fn solve(
        &self,
        load: &Load,
        positions: Vec<f64>,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, NewtonError> {
        let mut start = Some(positions);
        let mut spent = 0;
        let mut failure = NewtonError::Interrupted { iterations: 0 };
        for attempt in &ATTEMPTS {
            if spent >= MOST_ITERATIONS {
                break;
            }
            let positions = start.take().unwrap_or_else(|| self.touching(load));
            match self.follow(load, attempt, positions, &mut spent, workspace, progress) {
                Ok(mut equilibrium) => {
                    equilibrium.newton.iterations = spent;
                    return Ok(equilibrium);
                }
                Err(stop @ NewtonError::Interrupted { .. }) => return Err(stop),
                Err(error) => failure = error,
            }
        }
        if let NewtonError::NotConverged { iterations, .. } = &mut failure {
            *iterations = spent;
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

    /// Follows equal load steps to the whole motion, with a softened contact if there is one, and ends with the contact proper.
    fn follow(
        &self,
        load: &Load,
        attempt: &Attempt,
        mut positions: Vec<f64>,
        spent: &mut usize,
        workspace: &mut Workspace,
        progress: &mut dyn Progress,
    ) -> Result<Equilibrium, NewtonError> {
        let Load { motion, touch_mm, .. } = *load;
        let direction = motion.direction.into_inner();
        let softened = self.contact.softened();
        let mut total = NewtonReport::default();
        for step in 1..=attempt.load_steps {
            let share = step as f64 / attempt.load_steps as f64;
            let drive = match motion.force_mn {
                Some(force_mn) => Drive::Force { direction, force_mn: share * force_mn },
                None => {
                    let travel_mm = touch_mm + share * (motion.travel_mm - touch_mm);
                    self.place_tip(&mut positions, &(direction * travel_mm));
                    Drive::Held
                }
            };
            if self.contact.softening > 1.0 {
                let drive = (drive, SOFTENED_TOLERANCE);
                total += self.newton(&softened, drive, load, attempt, &mut positions, spent, workspace, progress)?;
            }
            if self.contact.softening <= 1.0 || step == attempt.load_steps {
                let drive = (drive, RELATIVE_TOLERANCE);
                total +=
                    self.newton(&self.contact, drive, load, attempt, &mut positions, spent, workspace, progress)?;
            }
        }
        Ok(self.equilibrium(motion, positions, total, attempt.load_steps, workspace))
    }

    /// One Newton solve with this contact, to the given tolerance relative to the force scale.
    #[allow(clippy::too_many_arguments)]
    fn newton(
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
        let mut terms =
            vec![self.topology.term(Place::Elements, solid.as_ref()), self.topology.term(Place::Faces, &contact)];
        terms.extend(load.additions.iter().map(|addition| self.topology.term(addition.place, addition.effect)));
        let system = System {
            terms: &terms,
            dofs: &self.topology.dofs,
            pattern: &self.topology.pattern,
            symbolic: &self.topology.symbolic,
            driven: Some(self.topology.needle()),
            dead_load: &[],
        };
        let smallest = (self.rounding_mn() / RELATIVE_TOLERANCE).max(SMALLEST_FORCE_SHARE * self.pressure_force_mn);
        let force_mn = load.motion.force_mn.unwrap_or(POSE_FORCE_SCALE_MN);
        let scale = force_mn.max(smallest);
        let light_mn = self.light_residual_mn(&terms[0], force_mn);
        let settings = NewtonSettings {
            globalization: attempt.globalization,
            force_scale_mn: scale,
            tolerance_mn: (tolerance * scale).max(light_mn),
            max_iterations: attempt.max_iterations.min(MOST_ITERATIONS.saturating_sub(*spent)),
            held_iterations: HELD_ITERATIONS,
            max_travel_mm: MAX_TRAVEL_PER_RADIUS * self.tool.body.radius_mm(),
        };
        let solved = system.solve(positions, drive, &settings, workspace, progress);
        *spent += solved.as_ref().map_or_else(NewtonError::iterations, |report| report.iterations);
        solved
    }

    fn equilibrium(
        &self,
        motion: &Motion,
        positions: Vec<f64>,
        newton: NewtonReport,
        load_steps: usize,
        workspace: &Workspace,
    ) -> Equilibrium {
        let tip = Vector3::from_row_slice(&positions[3 * self.topology.needle()..]);
        let travel_mm = (tip - self.tool.patch_from_needle.translation.vector).dot(&motion.direction);
        Equilibrium { positions, travel_mm, reaction_mn: -holding_force(workspace), newton, load_steps }
    }

    /// Area, pressure and penetration of the contact.
    pub fn contact_summary(&self, positions: &[f64]) -> ContactSummary {
        let contact = self.contact();
        let stencils = &self.topology.faces;
        let mut local = vec![0.0; 3 * stencils.group_size];
        let mut summary = ContactSummary::default();
        let (mut force, mut moment) = (0.0, [0.0; 2]);
        for (group, face) in self.topology.face_points.iter().enumerate() {
            stencils.gather(group, positions, &mut local);
            let local = Local { current: &local, group, predicted: &[] };
            if !contact.is_active(&local) {
                continue;
            }
            for (index, point) in contact.contact_points(&local).enumerate() {
                summary.max_penetration_mm = summary.max_penetration_mm.max(-point.gap_mm);
                if point.pressure_kpa <= 0.0 {
                    continue;
                }
                summary.area_mm2 += point.area_mm2;
                summary.max_pressure_kpa = summary.max_pressure_kpa.max(point.pressure_kpa);
                let share = point.pressure_kpa * point.area_mm2;
                force += share;
                for (&vertex, value) in face.iter().zip(self.faces.values(index)) {
                    let parameter = self.geometry.parameters[self.topology.vertices[vertex].0];
                    moment = [0, 1].map(|k| moment[k] + share * value * parameter[k]);
                }
            }
        }
        if force > 0.0 {
            summary.center = moment.map(|m| m / force);
        }
        summary
    }

    /// Stretch and volume at the quadrature points.
    pub fn strains(&self, positions: &[f64]) -> Strains {
        let stencils = &self.topology.elements;
        let mut local = [0.0; 3 * NODES];
        let mut found = Strains { max_strain: 0.0, least_volume_ratio: f64::INFINITY };
        for element in 0..stencils.len() {
            stencils.gather(element, positions, &mut local);
            for point in 0..POINTS {
                let f = self.geometry.solid.deformation_gradient(element, point, &local);
                found.least_volume_ratio = found.least_volume_ratio.min(f.determinant());
                // |σ − 1| ≤ ‖F − 1‖ for every principal stretch σ: only candidates are worth an eigenvalue problem.
                if (f - Matrix3::identity()).norm() > found.max_strain {
                    let stretches =
                        (f.transpose() * f).symmetric_eigenvalues().map(|l| (l.max(0.0).sqrt() - 1.0).abs());
                    found.max_strain = found.max_strain.max(stretches.max());
                }
            }
        }
        found
    }
}
