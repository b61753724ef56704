//! Where the wall stands under a change of pressure alone, far from any needle.
//!
//! A wide wall on a sclera that does not yield cannot spread sideways, so each layer is squeezed along its column (confined compression): a layer of stretch λ
//! carries the stress P(λ) = −p. Small strain: P = M (λ − 1), M = E (1 − ν) / ((1 + ν)(1 − 2 ν)) the oedometric modulus. Neo-Hookean: P = µ (λ − 1/λ) + Λ ln λ / λ, Λ the
//! first Lamé parameter, which is [`crate::effects::finite_strain`] with F = diag(1, 1, λ). The pressure per present area is that per rest area, for
//! the area does not change. Exact on a plane; on the eye's ball it leaves out terms of the order of thickness over radius (0.04).
//!
//! The wall's rim and the nodes of a patch beyond it stand there, and every solve begins there.
//! Not here: the sinking of the whole eye's coat, which the patch frame follows.

use super::Solid;
use crate::surface::Column;
use crate::tissue::{Layer, LayerKind, Tissue};

/// Bisections for a stretch: to the last bit.
const BISECTIONS: usize = 64;
/// Stretches between which a layer is sought; beyond e the neo-Hookean law of an incompressible layer has no more strength.
const STRETCHES: (f64, f64) = (1e-3, std::f64::consts::E);

/// How far the layers under a pressure are squeezed.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// For each layer from the vitreous outwards: by how much it is thinner than at rest, as a share; its thickness (mm); whether it belongs to the retina.
    squeezed: Vec<(f64, f64, bool)>,
    retina_mm: f64,
}

impl Settled {
    /// The layers of `tissue` under `pressure_kpa`; those for which `yields` is false are rigid.
    pub fn new(tissue: &Tissue, pressure_kpa: f64, solid: Solid, yields: impl Fn(LayerKind) -> bool) -> Self {
        let squeeze = |layer: &Layer| 1.0 - stretch(layer, pressure_kpa, solid);
        let layers = tissue.layers();
        let squeezed = layers.iter().map(|named| {
            let share = if yields(named.kind) { squeeze(&named.layer) } else { 0.0 };
            (share, named.layer.thickness_mm, matches!(named.kind, LayerKind::Retina(_)))
        });
        Settled { squeezed: squeezed.collect(), retina_mm: tissue.retina_thickness_mm() }
    }

    /// Largest |stretch − 1| of a layer.
    pub fn max_strain(&self) -> f64 {
        self.squeezed.iter().map(|layer| layer.0.abs()).fold(0.0, f64::max)
    }

    /// How far a point sinks along its column (mm); `depth_in_layers` is 0 at the surface, 1.5 in the middle of the second layer.
    pub fn sink_mm(&self, column: &Column, depth_in_layers: f64) -> f64 {
        let thinned = 1.0 - column.retina_thinning_mm / self.retina_mm;
        let below = |(index, &(share, thickness_mm, thins)): (usize, &(f64, f64, bool))| {
            let above = (depth_in_layers - index as f64).clamp(0.0, 1.0);
            share * thickness_mm * if thins { thinned } else { 1.0 } * (1.0 - above)
        };
        self.squeezed.iter().enumerate().map(below).sum()
    }
}

/// The stretch of a layer across under `pressure_kpa`.
pub fn stretch(layer: &Layer, pressure_kpa: f64, solid: Solid) -> f64 {
    let (mu, lambda) = (layer.shear_modulus_kpa(), layer.first_lame_kpa());
    if solid == Solid::Elasticity {
        return 1.0 - pressure_kpa / (lambda + 2.0 * mu);
    }
    let (mut low, mut high) = STRETCHES;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let stress = mu * (middle - 1.0 / middle) + lambda * middle.ln() / middle;
        if stress < -pressure_kpa {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
