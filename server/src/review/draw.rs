//! Random requests that the scene takes.

use std::collections::BTreeMap;

use retina_core::needle::NeedleShape;
use retina_core::predict::{Level, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::tissue::Tissue;
use retina_core::working_range::WorkingRange;

use super::ReviewError;
use crate::config::TipChoice;
use crate::problem::from_predict;

/// Requests that may be refused one after the other: a scene that takes fewer is not worth a review.
const PATIENCE: usize = 1000;

/// Draws requests and counts those that are refused.
pub struct Draws {
    range: WorkingRange,
    tip: TipChoice,
    refused: BTreeMap<&'static str, usize>,
}

impl Draws {
    /// Requests on `tissue` with needles of that tip, from `seed`.
    pub fn new(tissue: &Tissue, seed: u64, tip: TipChoice) -> Self {
        Self { range: WorkingRange::new(tissue, seed), tip, refused: BTreeMap::new() }
    }

    /// The next request at `level` that the scene takes. What is too deep, too strong or off the patch is refused at every level
    /// alike, so the cheapest one tells.
    ///
    /// # Errors
    /// [`ReviewError::NothingFits`].
    pub fn next(
        &mut self,
        scene: &PreparedScene,
        level: Level,
        workspace: &mut Workspace,
    ) -> Result<Request, ReviewError> {
        for _ in 0..PATIENCE {
            let request = self.draw();
            match scene.predict(&request, workspace, &mut Silent) {
                Ok(_) => return Ok(Request { level, ..request }),
                Err(refusal) => *self.refused.entry(from_predict(refusal).kind.name()).or_default() += 1,
            }
        }
        Err(ReviewError::NothingFits(PATIENCE))
    }

    /// How many were refused, by the kind of problem.
    pub fn refused(self) -> BTreeMap<&'static str, usize> {
        self.refused
    }

    fn draw(&mut self) -> Request {
        let shape = match self.tip {
            TipChoice::Any => return self.range.request(Level::Linear),
            TipChoice::Hemispherical => NeedleShape::hemispherical,
            TipChoice::Flat => NeedleShape::flat,
            TipChoice::Bevelled => NeedleShape::bevelled,
        };
        let radius_mm = self.range.radius_mm();
        self.range.request_with(shape(radius_mm), Level::Linear)
    }
}
