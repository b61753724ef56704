//! The rigid tool's underside as the contact law sees it: heights at the sample radii and, where it has one, its edge.
//!
//! Heights count up from the foremost point; only differences matter, so a profile may start anywhere. Where the underside
//! turns up (a shaft, the rim of a blunt tip), the heights beyond are +∞ and the edge says where exactly, for a punch's stiffness
//! is proportional to that radius. Units: mm.

use super::error::LayeredError;
use super::prepared::LinearBed;

/// The rim of a tool: contact cannot grow beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileEdge {
    /// Radius of the rim, mm; at least the first sample radius off the axis, at most the last.
    pub radius_mm: f64,
    /// Height of the underside at the rim (its limit from inside), mm.
    pub height_mm: f64,
}

/// An axisymmetric rigid underside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidProfile<'a> {
    /// Height at each of [`LinearBed::sample_radii_mm`], mm; +∞ where there is no underside. Samples at or beyond the edge are not used.
    pub heights_mm: &'a [f64],
    /// The rim; without one, contact may grow up to the last finite sample.
    pub edge: Option<ProfileEdge>,
}

/// A profile as stops that the growing contact passes: radii and heights above the lowest, the last being the rim if there is one.
pub(super) struct Stops {
    /// Radius of each stop, mm.
    pub radii: Vec<f64>,
    /// Height above the foremost stop, mm.
    pub heights: Vec<f64>,
    /// Whether the last stop is a rim.
    pub ends_at_edge: bool,
    /// The outermost of the foremost stops.
    pub first: usize,
}

impl RigidProfile<'_> {
    /// Checks the profile against the bed's sample radii and lists its stops.
    pub(super) fn stops(&self, bed: &LinearBed) -> Result<Stops, LayeredError> {
        let samples = bed.sample_radii_mm();
        if self.heights_mm.len() != samples.len() {
            return Err(LayeredError::ProfileLength { given: self.heights_mm.len(), expected: samples.len() });
        }
        let refuse = |field, radius_mm, value| Err(LayeredError::InvalidProfile { field, radius_mm, value });
        for (&radius, &height) in samples.iter().zip(self.heights_mm) {
            if height.is_nan() || height == f64::NEG_INFINITY {
                return refuse("height_mm", radius, height);
            }
        }
        let edge = match self.edge {
            Some(edge) => Some(edge),
            None => self.implied_edge(samples),
        };
        let mut radii = samples.to_vec();
        let mut heights = self.heights_mm.to_vec();
        if let Some(edge) = edge {
            let within = edge.radius_mm >= samples[1] && edge.radius_mm <= samples[samples.len() - 1];
            if !within {
                return refuse("edge radius_mm", edge.radius_mm, edge.radius_mm);
            }
            if !edge.height_mm.is_finite() {
                return refuse("edge height_mm", edge.radius_mm, edge.height_mm);
            }
            let kept = samples.partition_point(|&t| t < edge.radius_mm);
            radii.truncate(kept);
            heights.truncate(kept);
            radii.push(edge.radius_mm);
            heights.push(edge.height_mm);
        }
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        if lowest == f64::INFINITY {
            return refuse("every height_mm", 0.0, lowest);
        }
        heights.iter_mut().for_each(|height| *height -= lowest);
        let first = heights.iter().rposition(|&height| height <= 0.0).unwrap_or(0);
        Ok(Stops { radii, heights, ends_at_edge: edge.is_some(), first })
    }

    /// A rim half-way to the first of the trailing infinite samples, at the last finite height.
    fn implied_edge(&self, samples: &[f64]) -> Option<ProfileEdge> {
        let last = self.heights_mm.iter().rposition(|height| height.is_finite())?;
        let next = samples.get(last + 1)?;
        let radius_mm = (0.5 * (samples[last] + next)).max(samples[1]);
        Some(ProfileEdge { radius_mm, height_mm: self.heights_mm[last] })
    }
}
