//! A request in the frame of the patch: what it comes to before any level computes it, and the limits that it must keep.

use nalgebra::{Unit, Vector3};

use super::choice::{Decision, Expected, decide, pressure, tool_flex};
use super::expected_error::Situation;
use super::linear::{LinearAnswer, Load, Press, press};
use super::sampled;
use super::types::{Control, EffectChoice, EffectReport, Level, PredictError, Request};
use super::{MAX_DEPTH_SHARE, MAX_SETTLED_STRAIN, PUNCTURE_PRESSURE_PER_MODULUS, PreparedScene};
use crate::effects::finite_strain;
use crate::effects::puncture::Limits;
use crate::equilibrium::bleb::Bleb;
use crate::equilibrium::settled::Settled;
use crate::equilibrium::{Motion, Solid, Tool};
use crate::needle::Body;
use crate::patch::Patch;
use crate::scene::Scene;
use crate::scene::bleb::{Filling, SubretinalFluid};

/// A grid's patch is the scene's, a cut one the request's own.
pub(crate) enum CutOrGrid<'a> {
    Grid(&'a Patch),
    Cut(Box<Patch>),
}

impl CutOrGrid<'_> {
    pub(crate) fn patch(&self) -> &Patch {
        match self {
            CutOrGrid::Grid(patch) => patch,
            CutOrGrid::Cut(patch) => patch,
        }
    }

    /// The patch for one who keeps it.
    pub(crate) fn into_patch(self) -> Patch {
        match self {
            CutOrGrid::Grid(patch) => patch.clone(),
            CutOrGrid::Cut(patch) => *patch,
        }
    }
}

/// A request in the patch frame.
pub(crate) struct Question<'a> {
    pub(crate) prepared: &'a PreparedScene,
    pub(crate) request: &'a Request,
    patch: CutOrGrid<'a>,
    pub(crate) tool: Tool<'a>,
    pub(crate) motion: Motion,
    /// Fluid under the retina: the scene's, unless a sequence has changed how much there is of it.
    pub(super) fluid: Option<SubretinalFluid>,
}

impl<'a> Question<'a> {
    /// The request in the frame of `patch`.
    pub(crate) fn new(prepared: &'a PreparedScene, request: &'a Request, body: &'a Body, patch: CutOrGrid<'a>) -> Self {
        let frame = patch.patch().scene_from_patch;
        let patch_from_needle = frame.inverse() * request.needle.scene_from_needle();
        let motion = match request.control {
            Control::Force(force) => Motion {
                direction: Unit::try_new(frame.inverse() * force, 0.0).unwrap_or(-Vector3::z_axis()),
                force_mn: Some(force.norm()),
                travel_mm: 0.0,
            },
            Control::Pose => {
                Motion { direction: patch_from_needle.rotation * -Vector3::z_axis(), force_mn: None, travel_mm: 0.0 }
            }
        };
        let tool = Tool { body, patch_from_needle, stiffness_mn_per_mm: None };
        Question { prepared, request, patch, tool, motion, fluid: prepared.scene().bleb }
    }

    /// The same with so much fluid on the scene's detached disc, where that is not the scene's own amount.
    pub(crate) fn filled(mut self, filling: Option<Filling>) -> Self {
        if let (Some(fluid), Some(filling)) = (&mut self.fluid, filling) {
            fluid.filling = filling;
        }
        self
    }
}

/// What a request comes to before any level computes it.
pub(super) enum Begun<'a> {
    /// Nothing moves, for this reason.
    Still(&'static str),
    /// The needle presses.
    Pressed(LinearAnswer<'a>),
}

/// What the eye's pressure and fluid under the retina do by themselves.
#[derive(Clone)]
pub(crate) struct Sink {
    /// The decision about the effect.
    pub(crate) report: EffectReport,
    /// Change of the pressure (kPa), where it is simulated.
    pub(crate) change_kpa: Option<f64>,
    /// Fluid under the retina, where it is simulated.
    pub(super) bleb: Option<Bleb>,
    /// Largest sinking and rising of a node that is expected of them, in magnitude (mm); 0 where they are not simulated.
    pub(super) expected_mm: f64,
}

impl Question<'_> {
    pub(crate) fn patch(&self) -> &Patch {
        self.patch.patch()
    }

    /// The linear answer inside the limits of the tissue model; `None` where the needle does not reach the surface.
    pub(crate) fn pressed(&self, tool: &Tool) -> Result<Option<LinearAnswer<'_>>, PredictError> {
        let press = press(self.patch(), tool, &self.motion)?;
        self.check_pressure(&press)?;
        if matches!(press.load, Load::Depth(depth) if depth <= 0.0) {
            return Ok(None);
        }
        let tip = self.request.needle.shape.tip;
        let linear = LinearAnswer::new(&self.prepared.beds, self.patch(), tool, tip, press, &self.motion.direction)?;
        self.check_depth(&linear)?;
        Ok(Some(linear))
    }

    /// The linear answer, or why nothing moves.
    pub(super) fn begin(&self, tool: &Tool) -> Result<Begun<'_>, PredictError> {
        self.check_bleb()?;
        if self.motion.force_mn == Some(0.0) {
            return Ok(Begun::Still("no force is applied"));
        }
        Ok(match self.pressed(tool)? {
            Some(linear) => Begun::Pressed(linear),
            None => Begun::Still("the needle does not reach the surface"),
        })
    }

    pub(crate) fn situation_under(&self, linear: &LinearAnswer) -> Situation {
        let mut situation =
            self.situation(linear.depth_mm, linear.depth_mm / self.yielding_under(&linear.press), Some(&linear.press));
        // Needles were sampled with rigid shafts.
        let bending = self.bending(Some(linear));
        if tool_flex::report(&self.request.effects, Level::Coarse, true, &bending).simulated {
            situation.sampled = false;
            situation.deflection_um = bending.deflection_um();
        }
        // No error was measured over fluid.
        situation.lifted = self.lifting(Level::Coarse).simulated;
        situation
    }

    pub(super) fn situation(&self, depth_mm: f64, strain: f64, press: Option<&Press>) -> Situation {
        let points = self.tool.patch_from_needle.rotation * -Vector3::z_axis();
        let angle_deg = press.map_or(0.0, |press| points.dot(&press.touch.inward).clamp(-1.0, 1.0).acos().to_degrees());
        let mut situation =
            Situation::new(&self.prepared.scene, &self.request.needle.shape, angle_deg, depth_mm, strain);
        situation.sampled &= sampled::has_drive(&points, &self.motion.direction);
        situation
    }

    /// What the eye's pressure and fluid under the retina do by themselves.
    pub(super) fn sink(&self) -> Sink {
        self.with_fluid(self.sink_without_fluid())
    }

    /// `dry` with what the fluid does besides.
    pub(crate) fn with_fluid(&self, dry: Sink) -> Sink {
        let bleb = self.bleb().filter(|_| self.lifting(self.request.level).simulated);
        let rise_mm = bleb.map_or(0.0, |bleb| bleb.expected_rise_mm(bleb.center));
        Sink { bleb, expected_mm: dry.expected_mm + rise_mm, ..dry }
    }

    /// What the eye's pressure does by itself.
    pub(crate) fn sink_without_fluid(&self) -> Sink {
        let change_kpa = self.prepared.scene.pressure_change_kpa();
        let sink_mm = if change_kpa == 0.0 { 0.0 } else { self.deepest_sink_mm(change_kpa) };
        let report = pressure::report(&self.request.effects, change_kpa, sink_mm * 1e3);
        let simulated = report.simulated;
        let expected_mm = if simulated { sink_mm.abs() } else { 0.0 };
        Sink { report, change_kpa: simulated.then_some(change_kpa), bleb: None, expected_mm }
    }

    /// How far that node of the patch sinks under a change of pressure that sinks most, by linear or by neo-Hookean elasticity, whichever is more (mm).
    fn deepest_sink_mm(&self, change_kpa: f64) -> f64 {
        let tissue = &self.prepared.scene.tissue;
        let laws =
            [Solid::Elasticity, Solid::FiniteStrain].map(|solid| Settled::new(tissue, change_kpa, solid, |_| true));
        let surface = &self.patch().surface;
        // The floor of a pit sinks less than what is around it, and soft tissue that is pulled yields more than linearly.
        let deepest = |settled: &Settled| {
            let sinks = self.patch().parameters.iter().map(|&[x, y]| settled.sink_mm(&surface.column(x, y), 0.0));
            sinks.fold(0.0, |deepest: f64, sink| if sink.abs() > deepest.abs() { sink } else { deepest })
        };
        let [linear, finite] = laws.each_ref().map(deepest);
        if finite.abs() > linear.abs() { finite } else { linear }
    }

    pub(crate) fn decide(&self, expected: Expected, sink: &Sink) -> Result<Decision, PredictError> {
        if let (Some(change_kpa), Some(settled)) = (sink.change_kpa, self.settled(sink.change_kpa, Solid::FiniteStrain))
            && settled.max_strain() > MAX_SETTLED_STRAIN
        {
            let problem = format!(
                "a change by {change_kpa} kPa alone strains a layer of this tissue by {:.2}, beyond the limit of {MAX_SETTLED_STRAIN}",
                settled.max_strain()
            );
            return Err(PredictError::Effect { name: crate::effects::pressure::NAME.to_owned(), problem });
        }
        let decision = decide(&self.request.effects, self.request.level, expected, &sink.report)?;
        Ok(decision.with_bleb(self.lifting(self.request.level)))
    }

    /// The surface far from the needle under the pressure, by the law of `solid`.
    pub(super) fn settled(&self, change_kpa: Option<f64>, solid: Solid) -> Option<Settled> {
        change_kpa.map(|change_kpa| Settled::new(&self.prepared.scene.tissue, change_kpa, solid, |_| true))
    }

    /// How far the surface at `parameter` sinks under the pressure (mm).
    pub(super) fn sunk(&self, settled: Option<&Settled>, [x, y]: [f64; 2]) -> Vector3<f64> {
        settled.map_or_else(Vector3::zeros, |settled| {
            let column = self.patch().surface.column(x, y);
            column.inward.into_inner() * settled.sink_mm(&column, 0.0)
        })
    }

    /// The tool as it stands to the surface at rest: raised by what the surface under it has sunk, lowered by what fluid has raised it.
    pub(crate) fn raised(&self, sink: &Sink) -> Tool<'_> {
        let mut tool = self.tool;
        if let Some(bleb) = &sink.bleb {
            let at = tool.patch_from_needle.translation.vector;
            let inward = self.patch().surface.column(at.x, at.y).inward.into_inner();
            tool.patch_from_needle.translation.vector += inward * bleb.expected_rise_mm([at.x, at.y]);
        }
        if sink.change_kpa.is_some() {
            // What `decide` will find unless the sinking itself is small.
            let finite = match &self.request.effects {
                EffectChoice::Named(names) => names.iter().any(|name| name == finite_strain::NAME),
                EffectChoice::Auto | EffectChoice::AutoWithin { .. } | EffectChoice::All => true,
            };
            let finite = finite && self.request.level != Level::Linear;
            let solid = if finite { Solid::FiniteStrain } else { Solid::Elasticity };
            let at = tool.patch_from_needle.translation.vector;
            tool.patch_from_needle.translation.vector -=
                self.sunk(self.settled(sink.change_kpa, solid).as_ref(), [at.x, at.y]);
        }
        tool
    }

    /// Thickness of retina and choroid (mm).
    pub(crate) fn yielding_mm(&self) -> f64 {
        let tissue = &self.prepared.scene.tissue;
        tissue.retina_thickness_mm() + tissue.choroid.thickness_mm
    }

    /// The same where the needle touches: a pit thins the retina (mm).
    fn yielding_under(&self, press: &Press) -> f64 {
        let [x, y] = press.touch.parameter;
        self.yielding_mm() - self.patch().surface.column(x, y).retina_thinning_mm
    }

    pub(super) fn check_pressure(&self, press: &Press) -> Result<(), PredictError> {
        if let Load::Force(force_mn) = press.load {
            let radius_mm = self.tool.body.radius_mm();
            let pressure_kpa = force_mn / (std::f64::consts::PI * radius_mm * radius_mm);
            let limit_kpa = PUNCTURE_PRESSURE_PER_MODULUS * self.prepared.scene.tissue.softest_retina_kpa();
            if pressure_kpa > limit_kpa {
                return Err(PredictError::BeyondPuncture { force_mn, radius_mm, pressure_kpa, limit_kpa });
            }
        }
        Ok(())
    }

    /// What the tissue bears under this needle.
    pub(crate) fn puncture_limits(&self) -> Limits {
        let Scene { tissue, puncture, .. } = &self.prepared.scene;
        Limits {
            force_mn: puncture.force_mn(self.tool.body.radius_mm(), tissue.softest_retina_kpa()),
            strain: puncture.max_strain,
        }
    }

    pub(super) fn check_depth(&self, linear: &LinearAnswer) -> Result<(), PredictError> {
        let limit_mm = MAX_DEPTH_SHARE * self.yielding_under(&linear.press);
        let depth_mm = linear.depth_mm;
        if depth_mm > limit_mm { Err(PredictError::TooDeep { depth_mm, limit_mm }) } else { Ok(()) }
    }
}
