//! The next stretch of a growing contact: which stop closes first, and under what force. Units: mm, mN.

use super::error::LayeredError;
use super::grid::stretch_punches;
use super::prepared::LinearBed;
use super::profile::Stops;

/// One stretch of growth: from the front to the stop that closes next.
pub(super) struct Stretch {
    /// Contact radii at its start and end, mm.
    pub radii: [f64; 2],
    /// Depth per force of the whole stretch, mm/mN.
    pub depth: f64,
    /// Force of the whole stretch, mN; infinite at a rim.
    pub force: f64,
    /// The stop reached.
    pub next: usize,
}

impl LinearBed {
    /// Closing at the rim per unit force of each stretch; empty without a rim.
    pub(super) fn rim_closing(&self, stops: &Stops) -> Vec<f64> {
        if !stops.ends_at_edge {
            return Vec::new();
        }
        let radius = stops.radii[stops.radii.len() - 1];
        let at = self.grid.node_interval(radius);
        let nodes = &self.grid.nodes_mm;
        let fraction = (radius - nodes[at]) / (nodes[at + 1] - nodes[at]);
        let inner = self.stretches.iter().take(stops.radii.len() - 1);
        inner.map(|table| (1.0 - fraction) * table.closing_nodes[at] + fraction * table.closing_nodes[at + 1]).collect()
    }

    /// The stretch that starts at `front` with the present gaps.
    pub(super) fn stretch(
        &self,
        stops: &Stops,
        rim: &[f64],
        gaps: &[f64],
        front: usize,
        force: f64,
    ) -> Result<Stretch, LayeredError> {
        let last = gaps.len() - 1;
        if front == last {
            if !stops.ends_at_edge {
                return Err(LayeredError::ContactTooWide { radius_mm: stops.radii[last], force_mn: force });
            }
            let rim = stops.radii[last];
            let depth = self.blend(rim).depth;
            return Ok(Stretch { radii: [rim, rim], depth, force: f64::INFINITY, next: last });
        }
        let radii = [stops.radii[front], stops.radii[front + 1]];
        if stops.ends_at_edge && front + 1 == last {
            let punches = stretch_punches(radii[0], radii[1]).map(|(radius, part)| (self.blend(radius), part));
            let closing: f64 = punches.iter().map(|(punch, part)| part * self.closing_at(punch, radii[1])).sum();
            let depth = punches.iter().map(|(punch, part)| part * punch.depth).sum();
            return Ok(Stretch { radii, depth, force: gaps[last].max(0.0) / closing, next: last });
        }
        let table = &self.stretches[front];
        let samples = if stops.ends_at_edge { last } else { last + 1 };
        let (mut force, mut next) = (f64::INFINITY, front + 1);
        let inner = gaps[..samples].iter().zip(&table.closing[..samples]).enumerate().skip(front + 1);
        for (stop, (&gap, &closing)) in inner.chain(rim.get(front).map(|closing| (last, (&gaps[last], closing)))) {
            if gap < force * closing {
                (force, next) = (gap.max(0.0) / closing, stop);
            }
        }
        Ok(Stretch { radii, depth: table.depth, force, next })
    }
}
