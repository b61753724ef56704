//! Predictions over a bleb: the fluid in the patch's frame, meshes around contact and bleb, and the surface that no needle presses.

use nalgebra::Vector3;

use super::PreparedScene;
use super::choice::{self, Decision};
use super::expected_error::ExpectedError;
use super::finite_element::{Bench, ContactEstimate, Problem, Resolution, SMALLEST_CONTACT};
use super::question::{Question, Sink};
use super::topologies::shared_topology;
use super::types::{EffectChoice, EffectReport, Level, PredictError, Prediction};
use crate::effects::{contact, friction, tool_flex};
use crate::equilibrium::Motion;
use crate::equilibrium::bleb::{Bleb, compliance, middle_mm};
use crate::equilibrium::error::EquilibriumError;
use crate::mesh::disc::DiscGeometry;
use crate::needle::Body;
use crate::progress::Progress;
use crate::scene::bleb::{Filling, SubretinalFluid};
use crate::solve::newton::Workspace;

/// Least distance of a bleb from the rim, in its radii.
const BLEB_TO_RIM: f64 = 0.6;
/// How much of a bleb's radius the core of the mesh and its distance from the bleb's centre may take.
const CORE_IN_BLEB: f64 = 0.8;
/// Radius of the mesh's core in that of a bleb that no needle presses.
const CORE_PER_BLEB: f64 = 0.4;
/// How far a needle that does not press is drawn back along its shaft (mm): nothing of the patch reaches it there.
const WITHDRAWN_MM: f64 = 100.0;

impl PreparedScene {
    /// Volume (mm³) and pressure above that in the eye (kPa) of the scene's fluid: that which is given, and what a flat bleb has of the other.
    fn volume_and_pressure(&self, fluid: &SubretinalFluid) -> (f64, f64) {
        let compliance = compliance(&self.scene().tissue, fluid.radius_mm);
        match fluid.filling {
            Filling::Volume(volume_mm3) => (volume_mm3, volume_mm3 / compliance),
            Filling::Pressure(pressure_kpa) => (pressure_kpa * compliance, pressure_kpa),
        }
    }

    /// Volume of what fills the scene's detached disc, that expected of a flat bleb where the pressure is given (mm³); 0 where there is no disc.
    pub(crate) fn volume_mm3(&self, filling: Filling) -> f64 {
        self.scene().bleb.map_or(0.0, |fluid| self.volume_and_pressure(&SubretinalFluid { filling, ..fluid }).0)
    }

    /// What is decided of this fluid.
    fn lifting(&self, fluid: Option<&SubretinalFluid>, choice: &EffectChoice, level: Level) -> EffectReport {
        let fluid = fluid.filter(|fluid| !fluid.is_empty());
        let rise_um = |fluid: &SubretinalFluid| middle_mm(self.volume_and_pressure(fluid).0, fluid.radius_mm) * 1e3;
        choice::bleb::report(choice, level, fluid.map(rise_um))
    }
}

impl Question<'_> {
    /// What is decided of the fluid at `level`.
    pub(super) fn lifting(&self, level: Level) -> EffectReport {
        self.prepared.lifting(self.fluid.as_ref(), &self.request.effects, level)
    }

    /// The fluid, in patch parameters.
    pub(crate) fn bleb(&self) -> Option<Bleb> {
        self.bleb_with(self.fluid?.filling)
    }

    /// The fluid that would be there with this filling, in patch parameters.
    pub(crate) fn bleb_with(&self, filling: Filling) -> Option<Bleb> {
        let frame = self.patch().scene_from_patch;
        self.fluid.map(|fluid| SubretinalFluid { filling, ..fluid }).map(|fluid| {
            let center = frame.inverse_transform_point(&fluid.center_mm);
            let (volume_mm3, pressure_kpa) = self.prepared.volume_and_pressure(&fluid);
            Bleb {
                center: [center.x, center.y],
                radius_mm: fluid.radius_mm,
                volume_mm3,
                pressure_kpa,
                keeps_volume: matches!(fluid.filling, Filling::Volume(_)),
            }
        })
    }

    /// Refuses a bleb that is called for and whose centre is not under the patch.
    pub(crate) fn check_bleb(&self) -> Result<(), PredictError> {
        let lifted = self.lifting(Level::Coarse).simulated;
        let Some(Bleb { center: [x_mm, y_mm], .. }) = self.bleb().filter(|_| lifted) else { return Ok(()) };
        let limit_mm = self.patch().parameters.iter().flatten().fold(0.0_f64, |limit, c| limit.max(c.abs()));
        if x_mm.abs().max(y_mm.abs()) > limit_mm {
            return Err(PredictError::BlebOutsidePatch { x_mm, y_mm, limit_mm });
        }
        Ok(())
    }

    /// The answer where fluid lifts the retina and no needle presses it.
    pub(super) fn over_fluid(
        &self,
        resolution: &Resolution,
        mut decision: Decision,
        sink: &Sink,
        reason: &str,
        progress: &mut dyn Progress,
    ) -> Result<Prediction, PredictError> {
        decision.without(&[contact::NAME, friction::NAME, tool_flex::NAME], reason);
        let level = self.request.level;
        self.check_learned(level, &decision, sink)?;
        let problem = self.problem(&decision, sink.change_kpa);
        let Some(bleb) = problem.bleb else { return Ok(self.at_rest(decision, sink.change_kpa, reason)) };
        let resolution = resolution.over_fluid();
        let topology = shared_topology(resolution.division(&self.prepared.scene().tissue, decision.parts()))?;
        let mut solver = Workspace::new(&topology.pattern, &topology.symbolic);
        let mut bench =
            Bench { level: level.name(), resolution: &resolution, topology: &topology, workspace: &mut solver };
        let direction = problem.tool.patch_from_needle.rotation * -Vector3::z_axis();
        let away = untouched(&bleb, -WITHDRAWN_MM);
        let motion = Motion { direction, force_mn: None, travel_mm: -WITHDRAWN_MM };
        let problem = Problem { motion, friction_coefficient: None, ..problem };
        let mut answer = problem.solve(&mut bench, &away, &|_, _| Vector3::zeros(), progress)?;
        (answer.travel_mm, answer.deflection, answer.reaction_mn) = (0.0, None, Vector3::zeros());
        Ok(self.prediction(answer, decision, ExpectedError::UNKNOWN))
    }

    /// What to say of a bond that the fluid would open further.
    pub(super) fn peeling(&self, pressure_kpa: f64, volume_mm3: f64) -> Option<String> {
        let released = self.bleb()?.released_mn_per_mm(pressure_kpa, volume_mm3);
        let borne = self.prepared.scene().tissue.bond.fracture_energy_mn_per_mm;
        (released > borne).then(|| {
            format!(
                "the fluid would peel the retina further: at the edge of the bleb it offers {released:.3} mN/mm, the bond takes {borne:.3} mN/mm; the disc is held as it was given"
            )
        })
    }
}

impl Problem<'_> {
    /// The error of a solve without an equilibrium.
    pub(crate) fn failed(&self, level: &'static str, cause: EquilibriumError) -> PredictError {
        match &self.bleb {
            Some(bleb) if !cause.is_interrupted() => PredictError::Bleb { level, held: bleb.held(), cause },
            _ => PredictError::Solver { level, cause },
        }
    }

    /// Refuses a contact that is not over the fluid ([`check_over`]).
    pub(crate) fn check_on_bleb(
        &self,
        resolution: &Resolution,
        estimate: &ContactEstimate,
    ) -> Result<(), PredictError> {
        self.bleb.as_ref().map_or(Ok(()), |bleb| check_over(bleb, self.tool.body, resolution, estimate))
    }
}

/// Refuses a contact of `body` that is not over the fluid: a mesh around it would not resolve the edge of the bleb.
pub(crate) fn check_over(
    bleb: &Bleb,
    body: &Body,
    resolution: &Resolution,
    estimate: &ContactEstimate,
) -> Result<(), PredictError> {
    let contact = estimate.radius_mm.max(SMALLEST_CONTACT * body.radius_mm());
    let core_mm = resolution.core_per_contact * contact;
    let away_mm = (estimate.center[0] - bleb.center[0]).hypot(estimate.center[1] - bleb.center[1]);
    let most_mm = CORE_IN_BLEB * bleb.radius_mm;
    if away_mm + core_mm <= most_mm {
        return Ok(());
    }
    Err(PredictError::BesideBleb { core_mm, away_mm, radius_mm: bleb.radius_mm, most_mm })
}

/// Stands for the contact of a needle that does not press, `travel_mm` along its way: the mesh is then laid around the middle of the bleb.
pub(crate) fn untouched(bleb: &Bleb, travel_mm: f64) -> ContactEstimate {
    ContactEstimate {
        center: bleb.center,
        radius_mm: CORE_PER_BLEB * bleb.radius_mm,
        touch_mm: travel_mm,
        travel_mm,
        deflection: Vector3::zeros(),
    }
}

/// `count` + 1 radii from `inner` to `outer` in equal ratios (mm).
fn graded(inner: f64, outer: f64, count: usize) -> impl Iterator<Item = f64> {
    let ratio = (outer / inner).powf(1.0 / count as f64);
    (0..=count).map(move |ring| inner * ratio.powi(ring as i32))
}

/// A disc with its core around the contact and one of its circles, half of the rings in, on the edge of the bleb; from there on all are around the bleb, whose circle
/// they grow from.
pub(super) fn around_bleb(bleb: &Bleb, center: [f64; 2], core: f64, rim: f64, rings: usize) -> DiscGeometry {
    let within = rings / 2;
    let rim = rim.max((1.0 + BLEB_TO_RIM) * bleb.radius_mm);
    let radii: Vec<f64> =
        graded(core, bleb.radius_mm, within).chain(graded(bleb.radius_mm, rim, rings - within).skip(1)).collect();
    // In proportion to the radius, so that no two circles cross.
    let offset = |radius: &f64| {
        let share = ((radius - core) / (bleb.radius_mm - core)).min(1.0);
        [0, 1].map(|k| share * (bleb.center[k] - center[k]))
    };
    let offsets = radii[1..].iter().map(offset).collect();
    DiscGeometry { center, radii, offsets }
}
