//! What a baseline without invariances is told of a request: the request's own numbers and where it happens, standardised.

use retina_core::network::features::Features;

use crate::contact::prepared::Normaliser;
use crate::describe;
use crate::sample::Sample;

/// Numbers of a sample: those of the contact networks, then where it touches, which way the needle points and is driven, and where the contact ends.
pub fn of(sample: &Sample) -> Vec<f32> {
    let mut features = Features::default();
    let input = describe::input(sample);
    features.describe(&input, None);
    let points = (input.patch_from_needle.rotation * -nalgebra::Vector3::z()).cast::<f32>();
    let side = (input.patch_from_needle.rotation * nalgebra::Vector3::x()).cast::<f32>();
    let mut numbers = features.global;
    for vector in [input.touch_mm, points, side, input.direction, input.center_mm] {
        numbers.extend(vector.iter());
    }
    numbers.extend([input.depth_mm, input.contact_radius_mm, input.force_mn]);
    numbers
}

/// Standardised numbers of samples, with what standardises others.
pub fn standardised(samples: &[&Sample]) -> (Vec<Vec<f32>>, Normaliser) {
    let mut rows: Vec<Vec<f32>> = samples.iter().map(|sample| of(sample)).collect();
    let width = rows.first().map_or(0, Vec::len);
    let normaliser = Normaliser::new(rows.iter().map(Vec::as_slice), width);
    rows.iter_mut().for_each(|row| normaliser.apply(row));
    (rows, normaliser)
}
