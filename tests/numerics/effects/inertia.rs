//! The rows of `inertia`: of the elements, and of the vitreous that a face drags along.

use retina_core::effects::contact::ContactFaces;
use retina_core::effects::inertia::{Inertia, VitreousDrag};

use super::solids::solids;
use super::{Case, MEMORY_STEPS_S, RADIUS, SIZES, STEP, check_effect, face};
use crate::meshes::noise;

pub fn check() {
    for size in SIZES {
        let solids = solids(size);
        let coasting: Vec<f64> = solids.rest.iter().map(|x| 1.2 * x + 0.01 * size).collect();
        let (stencils, rest) = face(size);
        let faces = ContactFaces::new(&stencils, &rest, 3);
        for step_s in MEMORY_STEPS_S {
            let density_kg_per_mm3 = &[1e-6, 1.2e-6];
            let inertia = Inertia {
                geometry: &solids.geometry,
                stencils: &solids.stencils,
                density_kg_per_mm3,
                coasting: &coasting,
                step_s,
            };
            check_effect("inertia", &inertia, &solids.random_cases());
            let drag =
                VitreousDrag { faces: &faces, stencils: &stencils, start: &rest, drag_kpa_s_per_mm: 2.7e-3, step_s };
            let mut random = noise(9);
            let current = vec![0.0; rest.len()];
            let current: Vec<f64> = current.iter().map(|_| size * RADIUS * random()).collect();
            let case = Case { label: format!("drag, size {size:e}"), group: 0, current, step_mm: STEP * RADIUS * size };
            check_effect("inertia", &drag, &[case]);
        }
    }
}
