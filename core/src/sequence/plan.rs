//! Every step by linear elasticity, before the first is computed: checks, expected contacts, and the mesh for all of them.
//!
//! Checking takes a fraction of a millisecond a step, so a sequence that cannot be is refused before it begins. Where a step leaves its
//! needle's place to the step before, linear elasticity says where that is.

use nalgebra::Vector3;

use super::fluid::{check_filling, fullest};
use super::worst::Worst;
use super::{Sequence, SequenceError, Step, check_time};
use crate::equilibrium::bleb::Bleb;
use crate::needle::{Body, Needle};
use crate::patch::Patch;
use crate::predict::choice::{Decision, Expected};
use crate::predict::finite_element::ContactEstimate;
use crate::predict::linear::LinearAnswer;
use crate::predict::{Control, CutOrGrid, PredictError, PreparedScene, Question, Request, Sink};
use crate::progress::Progress;
use crate::solve::newton::NewtonError;

/// What linear elasticity expects of a sequence.
pub(super) struct Plan {
    /// The contact to lay one mesh around for all steps, and what the caller should know of such a mesh; `None` where the needle presses in no step.
    pub around: Option<(ContactEstimate, Option<String>)>,
    /// Whether that mesh resolves every contact as well as one of its own would.
    pub is_one_contact: bool,
    /// What is expected before anything is pressed.
    pub unpressed: Worst,
    /// What was expected for the decision, the worst of all steps.
    pub expected: Expected,
    /// Whether the needle is held in the tissue in some step: what it presses with is then the tissue's to say.
    pub is_held: bool,
    /// What is decided of every effect but those of rate.
    pub decision: Decision,
    /// What the eye's pressure does by itself.
    pub dry: Sink,
    /// The fluid at its fullest, where it is simulated.
    pub bleb: Option<Bleb>,
    /// The contact of every step that presses, with the step's index.
    pub contacts: Vec<(usize, ContactEstimate)>,
    /// The shortest time in which the load changes between two steps (s); infinite if it never does.
    pub fastest_change_s: f64,
}

/// Largest distance of a contact's centre from the mesh's, and largest difference of their radii, in radii of the contact that the mesh was
/// laid around. On a mesh as coarse as `coarse` a contact that is off by more moves nodes by more than that level's own error (measured).
const LARGEST_MISFIT: f64 = 0.02;
/// How far a contact may reach from the middle of a lasting mesh, in radii of its fine zone.
const LARGEST_REACH: f64 = 1.25;
/// Fine zone of a lasting mesh, in radii of the largest contact, from which on its elements are coarse for every contact.
const WIDEST_ZONE: f64 = 2.0;

/// The contact in the middle of all contacts, as wide as all together, and what the caller should know of a mesh laid around it.
fn middle(contacts: &[(usize, ContactEstimate)]) -> Option<(ContactEstimate, Option<String>)> {
    let contacts = contacts.iter().map(|(_, contact)| contact);
    let largest = contacts.clone().copied().reduce(|a, b| if b.radius_mm > a.radius_mm { b } else { a })?;
    let center = [0, 1].map(|k| {
        let (low, high) = contacts.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), contact| {
            (low.min(contact.center[k]), high.max(contact.center[k]))
        });
        0.5 * (low + high)
    });
    let middle = ContactEstimate { center, ..largest };
    let radius_mm = contacts.map(|contact| reach_mm(&middle, contact)).fold(0.0, f64::max);
    let warning = (radius_mm > WIDEST_ZONE * largest.radius_mm).then(|| {
        format!(
            "the contacts wander over {radius_mm:.3} mm around the middle of the mesh, which is coarse for contacts of {:.3} mm radius",
            largest.radius_mm
        )
    });
    Some((ContactEstimate { radius_mm, ..middle }, warning))
}

fn offset_mm(mesh: &ContactEstimate, contact: &ContactEstimate) -> f64 {
    (contact.center[0] - mesh.center[0]).hypot(contact.center[1] - mesh.center[1])
}

/// How far a contact reaches from the middle of a mesh (mm).
fn reach_mm(mesh: &ContactEstimate, contact: &ContactEstimate) -> f64 {
    offset_mm(mesh, contact) + contact.radius_mm
}

/// Whether a mesh laid around `mesh` resolves `contact` as well as one of its own would.
pub(super) fn fits(mesh: &ContactEstimate, contact: &ContactEstimate) -> bool {
    let allowed_mm = LARGEST_MISFIT * mesh.radius_mm;
    offset_mm(mesh, contact) <= allowed_mm && (contact.radius_mm - mesh.radius_mm).abs() <= allowed_mm
}

/// What the caller should know of `contact` on a lasting mesh laid around `mesh`: that it has left the fine zone.
pub(super) fn outside(mesh: &ContactEstimate, contact: &ContactEstimate) -> Option<String> {
    let (reach_mm, zone_mm) = (reach_mm(mesh, contact), LARGEST_REACH * mesh.radius_mm);
    (reach_mm > zone_mm).then(|| {
        format!("the contact reaches {reach_mm:.3} mm from the middle of the mesh, beyond its fine zone of {zone_mm:.3} mm: the surface is less accurate there")
    })
}

impl Sequence {
    /// The step as a request of its own, with `needle` where the step before left it.
    pub(super) fn request(&self, step: &Step, needle: &Needle) -> Request {
        let needle = Needle {
            tip_mm: step.tip_mm.unwrap_or(needle.tip_mm),
            orientation: step.orientation.unwrap_or(needle.orientation),
            ..*needle
        };
        let control = step.force_mn.map_or(Control::Pose, Control::Force);
        Request { needle, control, level: self.level, effects: self.effects.clone() }
    }

    fn check_times(&self) -> Result<(), SequenceError> {
        let mut before_s = 0.0;
        for (index, step) in self.steps.iter().enumerate() {
            check_time(before_s, step.time_s).map_err(|error| error.of(index, step.time_s))?;
            before_s = step.time_s;
        }
        Ok(())
    }
}

/// The linear answer of a step; `None` where the needle does not press.
pub(super) fn pressed<'b>(question: &'b Question, sink: &Sink) -> Result<Option<LinearAnswer<'b>>, PredictError> {
    if question.motion.force_mn == Some(0.0) {
        return Ok(None);
    }
    question.pressed(&question.raised(sink))
}

/// Checks every step, in the frame of the patch under the first that loads.
///
/// # Errors
/// [`SequenceError`] of the first step that cannot be.
pub(super) fn plan(
    prepared: &PreparedScene,
    sequence: &Sequence,
    body: &Body,
    progress: &mut dyn Progress,
) -> Result<(Patch, Plan), SequenceError> {
    let loads = |step: &&Step| step.force_mn.is_none_or(|force| force != Vector3::zeros());
    let first = sequence.steps.iter().find(loads).or(sequence.steps.first()).ok_or(SequenceError::NoSteps)?;
    sequence.check_times()?;
    let at = |index: usize, cause: PredictError| {
        let time_s = sequence.steps[index].time_s;
        SequenceError::At { step: index, time_s, cause }
    };
    sequence.needle.validate().map_err(|error| at(0, error.into()))?;
    for (index, step) in sequence.steps.iter().enumerate() {
        check_filling(prepared, step.fluid).map_err(|cause| at(index, cause))?;
    }
    let request = sequence.request(first, &sequence.needle);
    let patch = prepared.patch_for(&request, body).map_err(|cause| at(0, cause))?.into_patch();
    let first = Question::new(prepared, &request, body, CutOrGrid::Grid(&patch));
    let first = first.filled(fullest(prepared, &sequence.steps));
    first.check_bleb().map_err(|cause| at(0, cause))?;
    let dry = first.sink_without_fluid();
    let sink = first.with_fluid(dry.clone());
    let unpressed = Worst::unpressed(first.unpressed(&sink));
    let mut worst = unpressed;
    let mut contacts = Vec::new();
    let mut fastest_change_s = f64::INFINITY;
    let mut is_held = false;
    let mut needle = sequence.needle;
    let mut filling = prepared.scene().bleb.map(|fluid| fluid.filling);
    let (mut before_s, mut load_before) = (0.0, (None, filling));
    for (index, step) in sequence.steps.iter().enumerate() {
        if progress.interrupted() {
            let cause = NewtonError::Interrupted { iterations: 0 }.into();
            return Err(at(index, PredictError::Solver { level: sequence.level.name(), cause }));
        }
        let request = sequence.request(step, &needle);
        request.needle.validate().map_err(|error| at(index, error.into()))?;
        filling = step.fluid.or(filling);
        let question = Question::new(prepared, &request, body, CutOrGrid::Grid(&patch)).filled(filling);
        let sink = question.with_fluid(dry.clone());
        let linear = pressed(&question, &sink).map_err(|cause| at(index, cause))?;
        needle = request.needle;
        if let (Some(linear), Some(_)) = (&linear, step.force_mn) {
            let direction = patch.scene_from_patch * question.motion.direction.into_inner();
            needle.tip_mm += direction * linear.travel_mm();
        }
        is_held |= step.force_mn.is_none() && linear.is_some();
        worst.meet(&question, linear.as_ref(), &sink);
        let load = (linear.as_ref().map(|linear| (linear.depth_mm, linear.center)), filling);
        if load != load_before {
            fastest_change_s = fastest_change_s.min(step.time_s - before_s);
        }
        (before_s, load_before) = (step.time_s, load);
        contacts.extend(linear.as_ref().map(|linear| (index, question.estimate(linear, false))));
    }
    let decision = first.decide(worst.expected, &sink).map_err(|cause| at(0, cause))?;
    let around = middle(&contacts);
    let fitted = |contact| around.as_ref().is_some_and(|(mesh, _)| fits(mesh, contact));
    let is_one_contact = contacts.iter().all(|(_, contact)| fitted(contact));
    let expected = worst.expected;
    let bleb = first.bleb().filter(|_| decision.bleb);
    drop(first);
    let plan =
        Plan { around, is_one_contact, unpressed, expected, is_held, decision, dry, bleb, contacts, fastest_change_s };
    Ok((patch, plan))
}
