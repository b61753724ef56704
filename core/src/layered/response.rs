//! The surface around a pressed tool: the tables of its loads added up once, then read at any radius.
//!
//! Between the samples the tables are interpolated by cubics; the edge parts of punches between the prepared radii (the rim of a
//! blunt tip, the present contact edge) are added in closed form, as their square root is not smooth there. Beyond the grid
//! (4 mm) the displacement is continued as 1/r: exact for a bed much thicker than that (Boussinesq), and an upper bound for the thin
//! beds of the eye, which move there by less than 0.1 µm per mN. Units: mm, mN.

use super::indentation::Indentation;
use super::prepared::{LinearBed, PunchBlend};
use super::tables::{edge_shape_normal, edge_shape_radial};

/// The displaced surface of a bed under one indentation.
#[derive(Debug, Clone)]
pub struct SurfaceResponse<'a> {
    nodes: &'a [f64],
    bed: &'a LinearBed,
    normal: Vec<f64>,
    radial: Vec<f64>,
    edges: Vec<(PunchBlend, f64)>,
}

impl LinearBed {
    /// Adds up the loads of `indentation`.
    pub fn surface_response(&self, indentation: &Indentation) -> SurfaceResponse<'_> {
        let nodes = &self.grid.samples_mm;
        let mut normal = vec![0.0; nodes.len()];
        let mut radial = vec![0.0; nodes.len()];
        for (table, &force) in self.stretches.iter().zip(&indentation.stretch_forces_mn) {
            if force != 0.0 {
                add(&mut normal, force, &table.normal);
                add(&mut radial, force, &table.radial);
            }
        }
        let edges: Vec<(PunchBlend, f64)> =
            indentation.partial_punches.iter().map(|p| (self.blend(p.radius_mm), p.force_mn)).collect();
        for (blend, force) in &edges {
            // Flat under the punch, whatever the blend of its neighbours says.
            let within = nodes.partition_point(|&r| r <= blend.radius);
            normal[..within].iter_mut().for_each(|u| *u -= force * (blend.depth - blend.edge_normal));
            for (index, weight) in blend.weights() {
                if weight > 0.0 {
                    add(&mut normal[within..], force * weight, &self.punches[index].smooth_normal[within..]);
                    add(&mut radial, force * weight, &self.punches[index].smooth_radial);
                }
            }
        }
        SurfaceResponse { nodes, bed: self, normal, radial, edges }
    }
}

impl SurfaceResponse<'_> {
    /// Displacement (u_r, u_z), mm, of the surface point that rests at distance `r_mm` ≥ 0 from the axis.
    pub fn displacement(&self, r_mm: f64) -> (f64, f64) {
        let end = self.nodes[self.nodes.len() - 1];
        if r_mm > end {
            let (radial, normal) = self.displacement(end);
            return (radial * end / r_mm, normal * end / r_mm);
        }
        let at = self.bed.grid.sample_interval(r_mm);
        let mut normal = self.cubic(&self.normal, at, r_mm);
        let mut radial = self.cubic(&self.radial, at, r_mm);
        for (blend, force) in &self.edges {
            normal -= force * blend.edge_normal * edge_shape_normal(blend.radius, r_mm);
            radial += force * blend.edge_radial * edge_shape_radial(blend.radius, r_mm);
        }
        (radial, normal)
    }

    /// Cubic through values and three-point slopes at both ends of interval `at`.
    fn cubic(&self, values: &[f64], at: usize, r: f64) -> f64 {
        let step = self.nodes[at + 1] - self.nodes[at];
        let (x, y) = ((r - self.nodes[at]) / step, (self.nodes[at + 1] - r) / step);
        let (slope0, slope1) = (self.slope(values, at) * step, self.slope(values, at + 1) * step);
        y * y * ((1.0 + 2.0 * x) * values[at] + x * slope0) + x * x * ((1.0 + 2.0 * y) * values[at + 1] - y * slope1)
    }

    /// Slope of the parabola through a node and its neighbours; at the outer end, of the parabola through the last three; on the axis, of
    /// the chord.
    fn slope(&self, values: &[f64], node: usize) -> f64 {
        let chord = |i: usize| (values[i + 1] - values[i]) / (self.nodes[i + 1] - self.nodes[i]);
        if node == 0 {
            return chord(0);
        }
        if node + 1 == values.len() {
            return 2.0 * chord(node - 1) - self.slope(values, node - 1);
        }
        let (before, after) = (self.nodes[node] - self.nodes[node - 1], self.nodes[node + 1] - self.nodes[node]);
        (after * chord(node - 1) + before * chord(node)) / (before + after)
    }
}

/// `sum` += `factor` · `term`.
fn add(sum: &mut [f64], factor: f64, term: &[f64]) {
    sum.iter_mut().zip(term).for_each(|(s, t)| *s += factor * t);
}
