//! Panels: kinds of requests that a chart shows apart from each other.

use retina_core::needle::NeedleShape;
use retina_core::predict::{Level, PredictError, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::tissue::Tissue;
use retina_core::tissue::ranges;
use retina_core::working_range::WorkingRange;

/// A kind of requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Panel {
    /// Round tips on the built-in scenes, the whole range of forces and tilts.
    Default,
    /// Flat and bevelled tips on the built-in scenes.
    Hard,
    /// Round tips on tissue drawn from the whole range of its parameters: outside of what the expected errors were measured on.
    Outside,
}

/// Share of a parameter's range, on a logarithmic scale and centred on its default, from which tissue is drawn.
const TISSUE_SHARE: f64 = 0.5;
/// Least motion of a request (µm): an error is read against it.
const LEAST_MOTION_UM: f64 = 5.0;

/// A request and the scene that it is asked of.
pub struct Question {
    /// The scene, prepared.
    pub scene: PreparedScene,
    /// The request; its level is the contestant's business.
    pub request: Request,
}

impl Panel {
    /// Every panel.
    pub const ALL: [Self; 3] = [Self::Default, Self::Hard, Self::Outside];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Hard => "hard",
            Self::Outside => "outside",
        }
    }

    /// What it holds, for a reader.
    pub fn caption(self) -> &'static str {
        match self {
            Self::Default => "round tips, built-in scenes",
            Self::Hard => "flat and bevelled tips, built-in scenes",
            Self::Outside => "round tips, tissue from the whole range",
        }
    }

    /// The first `count` requests of this panel that `linear` answers and that move the surface; everything follows from `seed`.
    ///
    /// # Errors
    /// If a scene cannot be prepared.
    pub fn questions(self, count: usize, seed: u64) -> Result<Vec<Question>, PredictError> {
        let names = Scene::built_in_names();
        let mut random = fastrand::Rng::with_seed(seed ^ (self as u64) << 32);
        let mut workspace = Workspace::default();
        let mut questions = Vec::with_capacity(count);
        while questions.len() < count {
            let name = names[questions.len() % names.len()];
            let Some(mut scene) = Scene::built_in(name) else { continue };
            if self == Self::Outside {
                scene.tissue = tissue(&scene.tissue, &mut random);
            }
            let mut range = WorkingRange::new(&scene.tissue, random.u64(..));
            let scene = PreparedScene::new(scene)?;
            let request = loop {
                let radius_mm = range.radius_mm();
                let shape = match self {
                    Self::Default | Self::Outside => NeedleShape::hemispherical(radius_mm),
                    Self::Hard if random.bool() => NeedleShape::flat(radius_mm),
                    Self::Hard => NeedleShape::bevelled(radius_mm),
                };
                let request = range.request_with(shape, Level::Linear);
                let answer = scene.predict(&request, &mut workspace, &mut Silent);
                let moves = |um: &[f64]| um.iter().any(|&um| um > LEAST_MOTION_UM);
                if answer.is_ok_and(|answer| moves(&answer.displacement_um)) {
                    break request;
                }
            };
            questions.push(Question { scene, request });
        }
        Ok(questions)
    }
}

/// `around` with thicknesses and moduli drawn from the middle of their ranges.
fn tissue(around: &Tissue, random: &mut fastrand::Rng) -> Tissue {
    let mut tissue = around.clone();
    let mut draw = |default: f64, range: &retina_core::range::ParameterRange| {
        let low = default * (range.min / default).powf(TISSUE_SHARE);
        let high = default * (range.max / default).powf(TISSUE_SHARE);
        low * (high / low).powf(random.f64())
    };
    for layer in &mut tissue.retina {
        layer.youngs_modulus_kpa = draw(layer.youngs_modulus_kpa, &ranges::RETINA.youngs_modulus);
    }
    tissue.choroid.youngs_modulus_kpa = draw(tissue.choroid.youngs_modulus_kpa, &ranges::CHOROID.youngs_modulus);
    tissue.choroid.thickness_mm = draw(tissue.choroid.thickness_mm, &ranges::CHOROID.thickness);
    tissue
}
