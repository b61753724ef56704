//! The layered beds of a scene: one where the retina is equally thick everywhere, several thicknesses where it has a pit.

use std::sync::OnceLock;

use super::types::PredictError;
use crate::layered::{BedBase, BedLayer, LayeredBed, LinearBed};
use crate::scene::{Scene, SceneSurface};
use crate::tissue::{LayerKind, Tissue};

/// Thicknesses prepared for a surface with a pit.
const PIT_BEDS: usize = 5;
/// Memory of one prepared bed (bytes): its tables, measured.
const BED_BYTES: usize = 1 << 20;

/// A bed with a given thinning of the retina.
pub struct Bed {
    thinning_mm: f64,
    /// The prepared bed.
    pub linear: LinearBed,
}

/// Beds by ascending thinning, each prepared when first needed.
pub struct Beds {
    tissue: Tissue,
    thinnings_mm: Vec<f64>,
    beds: Vec<OnceLock<Result<Bed, PredictError>>>,
}

impl Beds {
    /// The beds that `scene` needs.
    pub fn new(scene: &Scene) -> Self {
        let thinnings_mm = match scene.surface {
            SceneSurface::FovealPit { depth_mm, .. } => {
                (0..PIT_BEDS).map(|i| depth_mm * i as f64 / (PIT_BEDS - 1) as f64).collect()
            }
            _ => vec![0.0],
        };
        let beds = thinnings_mm.iter().map(|_| OnceLock::new()).collect();
        Beds { tissue: scene.tissue.clone(), thinnings_mm, beds }
    }

    /// Memory held when all are prepared (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.beds.len() * BED_BYTES
    }

    /// The two neighbours of a thinning with their interpolation weights; one where it is exact.
    ///
    /// # Errors
    /// [`PredictError::Linear`] if a bed cannot be prepared.
    pub fn around(&self, thinning_mm: f64) -> Result<Vec<(&Bed, f64)>, PredictError> {
        let above = self.thinnings_mm.partition_point(|&t| t < thinning_mm).min(self.beds.len() - 1);
        if above == 0 || self.thinnings_mm[above] == thinning_mm {
            return Ok(vec![(self.bed(above)?, 1.0)]);
        }
        let (low, high) = (self.bed(above - 1)?, self.bed(above)?);
        let weight = ((thinning_mm - low.thinning_mm) / (high.thinning_mm - low.thinning_mm)).clamp(0.0, 1.0);
        Ok(vec![(low, 1.0 - weight), (high, weight)])
    }

    fn bed(&self, index: usize) -> Result<&Bed, PredictError> {
        self.beds[index].get_or_init(|| self.prepare(self.thinnings_mm[index])).as_ref().map_err(Clone::clone)
    }

    fn prepare(&self, thinning_mm: f64) -> Result<Bed, PredictError> {
        let retina = self.tissue.retina_thickness_mm();
        let layers = self
            .tissue
            .layers()
            .iter()
            .map(|named| BedLayer {
                thickness_mm: match named.kind {
                    LayerKind::Retina(_) => named.layer.thickness_mm * (retina - thinning_mm) / retina,
                    _ => named.layer.thickness_mm,
                },
                youngs_modulus_kpa: named.layer.youngs_modulus_kpa,
                poisson_ratio: named.layer.poisson_ratio,
            })
            .collect();
        let linear = LinearBed::prepare(&LayeredBed { layers, base: BedBase::Bonded })
            .map_err(|error| PredictError::Linear(error.to_string()))?;
        Ok(Bed { thinning_mm, linear })
    }
}
