//! What every answer must obey, whatever was asked, and the one word that stands for the cause of every refusal.
//!
//! Contract: [`broken`] lists the laws that an answer breaks, in words with numbers; none for a sound one. The hard cases, the random search and
//! the audit of effects hold every answer against it. Units: mm, mN.
//!
//! Not here: whether an answer is accurate (the `accuracy` tier).

use nalgebra::Point3;
use retina_core::equilibrium::bleb::VOLUME_TOLERANCE;
use retina_core::equilibrium::error::EquilibriumError;
use retina_core::needle::Needle;
use retina_core::predict::{ContactState, Control, Level, PENETRATION_WARNING_MM, PredictError, Prediction, Request};
use retina_core::scene::Scene;
use retina_core::scene::bleb::Filling;
use retina_core::solve::newton::NewtonError;
use retina_core::tissue::Layer;

/// Deepest that a node may stand inside of the needle in an answer that does not say so (mm): half of the best published tool-to-layer error.
pub const PENETRATION_MM: f64 = PENETRATION_WARNING_MM;
/// Residual of an equilibrium over its force scale: that at which the solver stops.
const RESIDUAL: f64 = 1e-7;
/// Smallest force scale over the stiffness λ + 2µ of the tissue's stiffest layer (mN/kPa): the rounding of stretches (1e-15) acting on a mesh of at most 3 mm radius, over [`RESIDUAL`].
const SCALE_PER_STIFFNESS: f64 = 1e-15 * 9.0 / RESIDUAL;
/// Residual that the rounding of coordinates leaves over the shear modulus over thickness of a layer (mN mm/kPa): 1e-15 of a coordinate of 2 mm, over
/// 2 mm² of the layer.
const RESIDUAL_PER_SHEAR: f64 = 1e-15 * 4.0;
/// The same over Lamé's first modulus over thickness: layers are nearly level, so that coordinates along them change a volume by little.
const RESIDUAL_PER_VOLUME: f64 = 1e-15;
/// No more of a force may be lost in that.
const LOST_SHARE: f64 = 1e-3;
/// Force scale under pose control (mN): that of a light touch.
const POSE_SCALE_MN: f64 = 0.01;
/// Force scale in a wall under pressure over the pressure (mN/kPa): 1e-5 of the mesh's area, at most that of a disc of 3 mm radius.
const SCALE_PER_PRESSURE: f64 = 3e-4;
/// Lengths of normals are off by rounding alone.
const NORMAL_LENGTH: f64 = 1e-12;
/// The reaction along the force against the force, both over the force scale: ten times the residual.
const BALANCE: f64 = 1e-6;

/// Laws that `answer` to `request` on `scene` breaks.
pub fn broken(scene: &Scene, request: &Request, answer: &Prediction) -> Vec<String> {
    let mut broken = Vec::new();
    if !is_finite(answer) {
        // Nothing else can be said of it.
        return vec!["not finite".to_owned()];
    }
    let pressure_on = is_simulated(answer, "pressure");
    if let Some(normal) = answer.normals.iter().find(|normal| (normal.norm() - 1.0).abs() > NORMAL_LENGTH) {
        broken.push(format!("a normal has length {}", normal.norm()));
    }
    let says = |word: &str| answer.warnings.iter().any(|warning| warning.contains(word));
    if let Some(ratio) = answer.contact.least_volume_ratio.filter(|&ratio| ratio <= 0.0)
        && (is_simulated(answer, "finite_strain") || !says("inside out"))
    {
        broken.push(format!("an element is inverted (volume {ratio:.3} of that at rest)"));
    }
    let deepest_mm = deepest_mm(request, answer);
    if deepest_mm > PENETRATION_MM && answer.contact.state != ContactState::Clear && !says("inside the predicted") {
        broken.push(format!("a node stands {:.2} µm inside the needle", deepest_mm * 1e3));
    }
    if answer.contact.state == ContactState::Clear && !pressure_on && answer.solver.iterations == 0 {
        let moved = answer.displacement_um.iter().copied().fold(0.0, f64::max);
        if moved != 0.0 || answer.needle.reaction_mn.norm() != 0.0 {
            broken.push(format!("nothing touches, but a node moves by {moved:e} µm"));
        }
    }
    let pressure_scale = if pressure_on { SCALE_PER_PRESSURE * scene.pressure_change_kpa().abs() } else { 0.0 };
    let stiffness = |layer: &Layer| layer.first_lame_kpa() + 2.0 * layer.shear_modulus_kpa();
    let stiffest_kpa = scene.tissue.layers().iter().map(|named| stiffness(&named.layer)).fold(0.0, f64::max);
    let smallest = (SCALE_PER_STIFFNESS * stiffest_kpa).max(pressure_scale);
    let lifted_alone = answer.contact.bleb.is_some() && answer.contact.state == ContactState::Clear;
    let scale_mn = match request.control {
        Control::Force(force) if !lifted_alone => force.norm().max(smallest),
        _ => POSE_SCALE_MN.max(smallest),
    };
    if let (Some(found), Some(fluid)) = (answer.contact.bleb, scene.bleb) {
        let missing = match fluid.filling {
            Filling::Volume(volume_mm3) => found.volume_mm3 / volume_mm3 - 1.0,
            Filling::Pressure(pressure_kpa) => (found.pressure_kpa - pressure_kpa) / pressure_kpa,
        };
        if missing.is_nan() || missing.abs() > VOLUME_TOLERANCE {
            broken.push(format!("fluid of {:?} came to {found:?}", fluid.filling));
        }
    }
    let rounding = |layer: &Layer| {
        (RESIDUAL_PER_SHEAR * layer.shear_modulus_kpa() + RESIDUAL_PER_VOLUME * layer.first_lame_kpa())
            / layer.thickness_mm
    };
    let largest_mn = scene.tissue.layers().iter().map(|named| rounding(&named.layer)).fold(0.0, f64::max);
    let rounded_mn = largest_mn.min(LOST_SHARE * scale_mn);
    if answer.solver.residual_mn > (RESIDUAL * scale_mn).max(rounded_mn) {
        broken.push(format!("a residual of {:e} mN is left", answer.solver.residual_mn));
    }
    if let Control::Force(force) = request.control
        && answer.contact.state != ContactState::Clear
    {
        let missing = (answer.needle.reaction_mn.dot(&force.normalize()) + force.norm()).abs();
        let allowed = match request.level {
            Level::Linear => BALANCE * force.norm(),
            _ => BALANCE / RESIDUAL * (RESIDUAL * scale_mn).max(rounded_mn),
        };
        if missing > allowed {
            broken.push(format!("the reaction misses {missing:e} mN of the force of {:e} mN", force.norm()));
        }
    }
    broken
}

/// Whether the answer says that the effect was simulated.
pub fn is_simulated(answer: &Prediction, name: &str) -> bool {
    answer.effects.iter().any(|effect| effect.name == name && effect.simulated)
}

/// Whether every number of the answer is finite.
fn is_finite(answer: &Prediction) -> bool {
    let points = answer.vertices.iter().map(|vertex| &vertex.coords).chain(&answer.normals);
    let numbers = points.flat_map(|vector| vector.iter()).chain(&answer.displacement_um);
    let contact = &answer.contact;
    let scalars = [
        answer.needle.travel_mm,
        contact.area_mm2,
        contact.max_pressure_kpa,
        contact.max_penetration_mm,
        contact.max_strain,
        contact.least_volume_ratio.unwrap_or(1.0),
        contact.slipping_share.unwrap_or(0.0),
        contact.bond_damage.unwrap_or(0.0),
        answer.solver.residual_mn,
    ];
    let needle = answer.needle.tip_mm.coords.iter().chain(answer.needle.reaction_mn.iter());
    numbers.chain(needle).chain(&scalars).all(|number| number.is_finite())
}

/// How deep the deepest node stands inside the needle where it ends up (mm); negative outside.
fn deepest_mm(request: &Request, answer: &Prediction) -> f64 {
    let needle = Needle { tip_mm: answer.needle.tip_mm, ..request.needle };
    let body = needle.shape.body();
    let needle_from_scene = needle.scene_from_needle().inverse();
    let depth = |vertex: &Point3<f64>| -body.distance(&needle_from_scene.transform_point(vertex));
    answer.vertices.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)
}

/// What kind of end a request came to without an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// It asks for what has no answer in this model, and is told so before anything is computed.
    Refused,
    /// It should have had an answer, and is told that none was found.
    Failed,
}

/// The kind of an error and the cause that it names, in a few words.
pub fn cause(error: &PredictError) -> (Kind, &'static str) {
    use Kind::{Failed, Refused};
    let solver = |cause: &EquilibriumError| match cause {
        EquilibriumError::Newton(NewtonError::NotConverged { .. }) => "no equilibrium: iterations used up",
        EquilibriumError::Newton(NewtonError::NoStep { .. }) => "no equilibrium: no acceptable step",
        EquilibriumError::Newton(NewtonError::BadStart { .. }) => "the start is not admissible",
        EquilibriumError::Newton(NewtonError::Linear(_)) => "no equilibrium: linear system",
        EquilibriumError::Newton(NewtonError::Interrupted { .. }) => "interrupted",
        EquilibriumError::NotSettled { .. } => "friction does not settle",
        EquilibriumError::Torn { .. } => "no equilibrium: the tissue punctures",
    };
    match error {
        PredictError::Budget { .. } => (Refused, "budget"),
        PredictError::OutOfRange(_) => (Refused, "out of range"),
        PredictError::PointsAway { .. } => (Refused, "points away"),
        PredictError::OutsidePatch { .. } => (Refused, "outside the patch"),
        PredictError::BeyondPuncture { .. } => (Refused, "beyond puncture"),
        PredictError::TooDeep { .. } => (Refused, "too deep"),
        PredictError::Effect { .. } => (Refused, "effect"),
        PredictError::NotLearned { .. } => (Refused, "not learned"),
        PredictError::Weights { .. } => (Failed, "weights"),
        PredictError::Patch(_) => (Refused, "patch of the mesh"),
        PredictError::Mesh(_) => (Refused, "tissue cannot be meshed"),
        PredictError::Linear(problem) if problem.contains("grows past") => (Refused, "contact too wide"),
        PredictError::Linear(problem) if problem.contains("shaft") => (Refused, "shaft first"),
        PredictError::Linear(_) => (Failed, "level linear"),
        PredictError::BlebOutsidePatch { .. } => (Refused, "bleb outside the patch"),
        PredictError::BesideBleb { .. } => (Refused, "beside the bleb"),
        PredictError::NoBleb => (Refused, "no bleb to fill"),
        PredictError::Solver { cause, .. } | PredictError::Bleb { cause, .. } => (Failed, solver(cause)),
    }
}
