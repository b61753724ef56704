//! What is read off an equilibrium: the contact's area, pressure and penetration, and the tissue's largest strain.

use nalgebra::Matrix3;

use super::{ContactSummary, Strains, Wall};
use crate::effect::{Effect, Local};
use crate::mesh::element::{NODES, POINTS};

impl Wall<'_> {
    /// Area, pressure and penetration of the contact.
    pub fn contact_summary(&self, positions: &[f64]) -> ContactSummary {
        let contact = self.contact();
        let stencils = &self.topology.faces;
        let mut local = vec![0.0; 3 * stencils.group_size];
        let mut summary = ContactSummary::default();
        let (mut force, mut moment) = (0.0, [0.0; 2]);
        for (group, face) in self.topology.face_points.iter().enumerate() {
            stencils.gather(group, positions, &mut local);
            let local = Local { current: &local, group, predicted: &[] };
            if !contact.is_active(&local) {
                continue;
            }
            for (index, point) in contact.contact_points(&local).enumerate() {
                summary.max_penetration_mm = summary.max_penetration_mm.max(-point.gap_mm);
                if point.pressure_kpa <= 0.0 {
                    continue;
                }
                summary.area_mm2 += point.area_mm2;
                summary.max_pressure_kpa = summary.max_pressure_kpa.max(point.pressure_kpa);
                let share = point.pressure_kpa * point.area_mm2;
                force += share;
                for (&vertex, value) in face.iter().zip(self.faces.values(index)) {
                    let parameter = self.geometry.parameters[self.topology.vertices[vertex].0];
                    moment = [0, 1].map(|k| moment[k] + share * value * parameter[k]);
                }
            }
        }
        if force > 0.0 {
            summary.center = moment.map(|m| m / force);
        }
        summary
    }

    /// Stretch and volume at the quadrature points.
    pub fn strains(&self, positions: &[f64]) -> Strains {
        let stencils = &self.topology.elements;
        let mut local = [0.0; 3 * NODES];
        let mut found = Strains { max_strain: 0.0, least_volume_ratio: f64::INFINITY };
        let mut candidates = Vec::with_capacity(stencils.len());
        for element in 0..stencils.len() {
            stencils.gather(element, positions, &mut local);
            let distortion = self.geometry.solid.distortion(element, &local);
            found.least_volume_ratio = found.least_volume_ratio.min(distortion.least_volume_ratio);
            candidates.push((distortion.most_strain, element));
        }
        // Few are worth eigenvalue problems, if those that may be strained most come first.
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (bound, element) in candidates {
            if bound <= found.max_strain {
                break;
            }
            stencils.gather(element, positions, &mut local);
            for point in 0..POINTS {
                let f = self.geometry.solid.deformation_gradient(element, point, &local);
                if (f - Matrix3::identity()).norm() > found.max_strain {
                    let stretches =
                        (f.transpose() * f).symmetric_eigenvalues().map(|l| (l.max(0.0).sqrt() - 1.0).abs());
                    found.max_strain = found.max_strain.max(stretches.max());
                }
            }
        }
        found
    }
}
