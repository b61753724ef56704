//! Where a needle comes to stand that is pushed too lightly to move the tissue by more than the contact's smoothing distance.
//!
//! There the tissue hardly yields and the contact law alone decides: its force grows with the square of the approach d, from nothing at the smoothing
//! distance on. Newton's method from a much larger d only halves it in each step and, once it has lost the last point of the contact, has no stiffness to go by. So the
//! travel is found first, on the tissue as it starts: the force of the contact is a rising function of it.
//! Not here: the equilibrium, which starts from this travel.

use nalgebra::Vector3;

use super::{Motion, Wall};
use crate::effect::Local;

/// Bisections of the travel: from the smoothing distance to a billionth of it.
const BISECTIONS: usize = 40;

impl Wall<'_> {
    /// The travel at which the contact on the tissue at `positions` bears `force_mn`, near first touch at `touch_mm` (mm).
    pub fn resting_travel_mm(&self, positions: &[f64], motion: &Motion, touch_mm: f64, force_mn: f64) -> f64 {
        let reach_mm = self.contact.smoothing_mm;
        let (mut low, mut high) = (touch_mm - 2.0 * reach_mm, touch_mm + reach_mm);
        let mut positions = positions.to_vec();
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            self.place_tip(&mut positions, &(motion.direction.into_inner() * middle));
            if self.contact_force_mn(&positions, &motion.direction) < force_mn {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    /// Force of the contact against the motion along `direction` (mN).
    fn contact_force_mn(&self, positions: &[f64], direction: &Vector3<f64>) -> f64 {
        let contact = self.contact();
        let stencils = &self.topology.faces;
        let mut local = vec![0.0; 3 * stencils.group_size];
        let mut pose = self.tool.patch_from_needle;
        pose.translation.vector = Vector3::from_row_slice(&positions[3 * self.topology.needle()..]);
        let mut force_mn = 0.0;
        for group in 0..stencils.len() {
            stencils.gather(group, positions, &mut local);
            let local = Local { current: &local, group, predicted: &[] };
            for point in contact.contact_points(&local).filter(|point| point.pressure_kpa > 0.0) {
                let (_, gradient) =
                    self.tool.body.distance_and_gradient(&pose.inverse_transform_point(&point.position));
                force_mn += point.pressure_kpa * point.area_mm2 * (pose.rotation * gradient).dot(direction).max(0.0);
            }
        }
        force_mn
    }
}
