//! A path computed: each step's truth under displacement control, and what `linear` and `coarse` answer to its force.
//!
//! The truth of a step is the equilibrium with the needle held at the step's travel; its force is the tissue's resistance along the direction.
//! The other levels are asked the equivalent question: the needle at the path's start, pushed along the direction with that force. A step
//! that prediction would refuse for that force (too deep, beyond puncture) or that finds no equilibrium ends the path; it is counted by its cause.

use std::f64::consts::PI;

use nalgebra::Vector3;
use retina_core::needle::Tip;
use retina_core::patch::vertex_normals;
use retina_core::predict::finite_element::Resolution;
use retina_core::predict::indentation::{EFFECTS, Expectation, Indentation, IndentationStep, Memory};
use retina_core::predict::{
    Control, EffectChoice, Level, MAX_DEPTH_SHARE, PUNCTURE_PRESSURE_PER_MODULUS, PredictError, Prediction,
    PreparedScene, Request, Workspace,
};
use retina_core::progress::{Progress, Silent};

use super::draw::{PathPlan, STEPS};
use crate::sample::{Field, LevelAnswer, NODES, Sample, TipShape, TissueNumbers};

/// Newton iterations of one step after which it counts as not converged: what takes more is mostly an edge that cuts its way in.
pub const MOST_ITERATIONS: usize = 50;

/// Share of the puncture limit that a path's expected force keeps.
const BELOW_PUNCTURE: f64 = 0.98;

/// Why a path ended before its last step; the words under which the manifest counts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// No pose was found, or linear elasticity has no answer there.
    NoStart,
    /// The step's force lies beyond the puncture limit.
    BeyondPuncture,
    /// Its expected depth lies beyond the depth limit.
    TooDeep,
    /// No equilibrium within the iterations allowed.
    NotConverged,
    /// The mesh could not be laid.
    Mesh,
    /// The needle does not press, or the tissue pulls: no such sample can be asked for.
    NoForce,
    /// It takes no more force than the step before: past a limit point, where a pushed needle would not stop at this travel.
    LimitPoint,
    /// Any other refusal of a level.
    Refused,
}

impl Cause {
    /// Every cause.
    pub const ALL: [Self; 8] = [
        Self::NoStart,
        Self::BeyondPuncture,
        Self::TooDeep,
        Self::NotConverged,
        Self::Mesh,
        Self::NoForce,
        Self::LimitPoint,
        Self::Refused,
    ];

    /// Its name in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoStart => "no_start",
            Self::BeyondPuncture => "beyond_puncture",
            Self::TooDeep => "too_deep",
            Self::NotConverged => "not_converged",
            Self::Mesh => "mesh",
            Self::NoForce => "no_force",
            Self::LimitPoint => "limit_point",
            Self::Refused => "refused",
        }
    }

    fn of(error: &PredictError) -> Self {
        match error {
            PredictError::BeyondPuncture { .. } => Self::BeyondPuncture,
            PredictError::TooDeep { .. } => Self::TooDeep,
            PredictError::Solver { .. } => Self::NotConverged,
            PredictError::Mesh(_) => Self::Mesh,
            _ => Self::Refused,
        }
    }
}

/// What a path gave.
pub struct PathOutcome {
    /// Its samples, in the order of their steps.
    pub samples: Vec<Sample>,
    /// Why it has fewer than all steps.
    pub ended_by: Option<Cause>,
    /// Newton iterations on the fine mesh, all steps together.
    pub iterations: usize,
}

/// How many of a path's first samples take ever more force. What comes after is an equilibrium of the needle held there, and none of the needle
/// pushed with that force.
pub fn before_limit_point(samples: &[Sample]) -> usize {
    let falls = samples.windows(2).position(|pair| pair[1].force_mn <= pair[0].force_mn);
    falls.map_or(samples.len(), |at| at + 1)
}

/// A thread's memory.
#[derive(Default)]
pub struct PathMemory {
    truth: Memory,
    levels: Workspace,
}

/// Stops a solve that takes too long.
struct Patience {
    asked: usize,
}

impl Progress for Patience {
    fn stage(&mut self, _name: &'static str) {
        self.asked = 0;
    }

    fn interrupted(&mut self) -> bool {
        self.asked += 1;
        self.asked > MOST_ITERATIONS
    }
}

/// A path at work.
pub struct Path<'a> {
    plan: &'a PathPlan,
    prepared: &'a PreparedScene,
    truth: Indentation<'a>,
    travels_mm: Vec<f64>,
}

impl<'a> Path<'a> {
    /// The path of `plan` on its scene, prepared, with the truth as fine as `resolution`.
    ///
    /// # Errors
    /// The cause for which it has no step at all.
    pub fn new(plan: &'a PathPlan, prepared: &'a PreparedScene, resolution: Resolution) -> Result<Self, Cause> {
        let truth = Indentation::new(prepared, plan.needle, plan.direction, resolution).map_err(|e| Cause::of(&e))?;
        let mut path = Path { plan, prepared, truth, travels_mm: Vec::new() };
        path.travels_mm = path.travels().ok_or(Cause::NoStart)?;
        Ok(path)
    }

    /// Travel of each step (mm): its share of the depth that both limits allow, by linear elasticity.
    fn travels(&self) -> Option<Vec<f64>> {
        let patch = self.truth.patch();
        let tool = self.plan.needle;
        let touch = retina_core::approach::first_touch(
            &patch.surface,
            &tool.shape.body(),
            &tool.scene_from_needle(),
            &self.plan.direction,
        )?;
        let cosine = self.plan.direction.dot(&touch.inward);
        let tissue = &self.prepared.scene().tissue;
        let thinning_mm = patch.surface.column(touch.parameter[0], touch.parameter[1]).retina_thinning_mm;
        let yielding_mm = tissue.retina_thickness_mm() + tissue.choroid.thickness_mm - thinning_mm;
        let mut deepest_mm = MAX_DEPTH_SHARE * yielding_mm;
        let puncture_mn = PUNCTURE_PRESSURE_PER_MODULUS
            * tissue.retina[0].youngs_modulus_kpa
            * PI
            * tool.shape.radius_mm.powi(2)
            * BELOW_PUNCTURE;
        let request = request(self.plan, puncture_mn * cosine, Level::Linear);
        match self.prepared.expect(&request) {
            Ok(expected) => deepest_mm = deepest_mm.min(expected?.depth_mm),
            Err(PredictError::TooDeep { .. }) => {}
            Err(_) => return None,
        }
        Some(self.plan.depth_shares.iter().map(|share| touch.travel_mm + share * deepest_mm / cosine).collect())
    }

    /// The truth of step `step` alone.
    ///
    /// # Errors
    /// The cause for which there is none.
    pub fn truth(&mut self, step: usize, memory: &mut PathMemory) -> Result<IndentationStep, Cause> {
        let mut patience = Patience { asked: 0 };
        let solved = self.truth.advance(self.travels_mm[step], &mut memory.truth, &mut patience);
        solved.map_err(|error| Cause::of(&error))?.ok_or(Cause::NoForce)
    }

    /// All steps, until one fails.
    pub fn run(mut self, memory: &mut PathMemory) -> PathOutcome {
        let mut outcome = PathOutcome { samples: Vec::new(), ended_by: None, iterations: 0 };
        for step in 0..STEPS {
            let sample = self.truth(step, memory).and_then(|truth| {
                outcome.iterations += truth.iterations;
                self.sample(step, &truth, memory)
            });
            match sample {
                Ok(sample) => outcome.samples.push(sample),
                Err(cause) => {
                    outcome.ended_by = Some(cause);
                    break;
                }
            }
        }
        outcome
    }

    fn sample(&self, step: usize, truth: &IndentationStep, memory: &mut PathMemory) -> Result<Sample, Cause> {
        let plan = self.plan;
        let direction = plan.direction.into_inner();
        let force_mn = -truth.reaction_mn.dot(&direction);
        if force_mn <= 0.0 {
            return Err(Cause::NoForce);
        }
        let refused = |error: PredictError| Cause::of(&error);
        let expected = self.prepared.expect(&request(plan, force_mn, Level::Linear)).map_err(refused)?;
        let expected = expected.ok_or(Cause::NoForce)?;
        let mut answer =
            |level| self.prepared.predict(&request(plan, force_mn, level), &mut memory.levels, &mut Silent);
        let linear = answer(Level::Linear).map_err(refused)?;
        let coarse = answer(Level::Coarse).ok();
        let patch = self.truth.patch();
        let moved = |prediction: &Prediction| -> Field {
            field(prediction.vertices.iter().zip(&patch.vertices).map(|(now, rest)| now - rest))
        };
        let level = |prediction: &Prediction| LevelAnswer {
            displacement_mm: moved(prediction),
            travel_mm: prediction.needle.travel_mm as f32,
            reaction_mn: single(&prediction.needle.reaction_mn),
        };
        let Expectation { touch, center, .. } = expected;
        let column = patch.surface.column(touch.parameter[0], touch.parameter[1]);
        let displacement_mm = field(truth.displacements.iter().copied());
        let coordinates = plan.needle.orientation.coords;
        Ok(Sample {
            path: plan.path,
            step: step as u32,
            split: plan.split,
            scene: plan.scene_index,
            rest_mm: field(patch.vertices.iter().map(|vertex| vertex.coords)),
            rest_normal: field(vertex_normals(&patch.vertices, &patch.triangles).into_iter()),
            tip: tip_shape(plan),
            tip_mm: single(&plan.needle.tip_mm.coords),
            orientation_xyzw: [coordinates.x, coordinates.y, coordinates.z, coordinates.w].map(|c| c as f32),
            direction: single(&direction),
            force_mn: force_mn as f32,
            tissue: tissue_numbers(plan, column.retina_thinning_mm),
            touch_mm: single(&column.surface.coords),
            inward: single(&touch.inward),
            touch_travel_mm: touch.travel_mm as f32,
            linear_center_mm: single(&patch.surface.column(center[0], center[1]).surface.coords),
            linear_depth_mm: expected.depth_mm as f32,
            linear_contact_radius_mm: expected.contact_radius_mm as f32,
            linear_pressure_kpa: expected.max_pressure_kpa as f32,
            linear: level(&linear),
            coarse: coarse.as_ref().map(level),
            truth: LevelAnswer {
                displacement_mm,
                travel_mm: truth.travel_mm as f32,
                reaction_mn: single(&truth.reaction_mn),
            },
            truth_error_mm: 0.0,
        })
    }
}

/// The question that a step with this force answers.
fn request(plan: &PathPlan, force_mn: f64, level: Level) -> Request {
    Request {
        needle: plan.needle,
        control: Control::Force(plan.direction.into_inner() * force_mn),
        level,
        effects: EffectChoice::Named(EFFECTS.map(str::to_owned).to_vec()),
    }
}

fn tip_shape(plan: &PathPlan) -> TipShape {
    let shape = &plan.needle.shape;
    let bevel_deg = if let Tip::Bevelled { angle_deg, .. } = shape.tip { angle_deg as f32 } else { 90.0 };
    TipShape {
        kind: shape.tip.kind() as u8,
        radius_mm: shape.radius_mm as f32,
        edge_radius_mm: shape.edge_radius_mm() as f32,
        bevel_deg,
    }
}

fn tissue_numbers(plan: &PathPlan, thinning_mm: f64) -> TissueNumbers {
    let tissue = &plan.scene.tissue;
    let layers = [&tissue.retina[0], &tissue.choroid, &tissue.sclera];
    let mut thickness_mm = layers.map(|layer| layer.thickness_mm as f32);
    thickness_mm[0] = (tissue.retina[0].thickness_mm - thinning_mm) as f32;
    TissueNumbers {
        thickness_mm,
        youngs_modulus_kpa: layers.map(|layer| layer.youngs_modulus_kpa as f32),
        poisson_ratio: layers.map(|layer| layer.poisson_ratio as f32),
    }
}

fn single(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

fn field(vectors: impl Iterator<Item = Vector3<f64>>) -> Field {
    let mut field = [[0.0; 3]; NODES];
    for (node, vector) in field.iter_mut().zip(vectors) {
        *node = single(&vector);
    }
    field
}
