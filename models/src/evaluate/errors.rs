//! Errors of displacements: over all nodes of all samples, in micrometres, with the motion beside them.
//!
//! A mean is over every node of every sample. (The published evaluation divides the last batch's mean by the number of batches: [`published_mean`]
//! shows what that gives.)

use nalgebra::{Point3, Vector3};
use retina_core::network::input::Field;
use retina_core::patch::{Patch, vertex_normals};
use retina_core::surface::Surface;

/// Micrometres in a millimetre.
const UM: f64 = 1e3;

/// Errors of a set of samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// Distance of each node to the truth (µm).
    nodes_um: Vec<f64>,
    /// The largest of each sample (µm).
    worst_um: Vec<f64>,
    /// Angles between normals (degrees).
    normals_deg: Vec<f64>,
    /// Sum of the squared true displacements (µm²).
    motion_um2: f64,
    /// Mean error of each edge vector (µm), by sample.
    edges_um: Vec<f64>,
}

/// The number below which `share` of `numbers` lie.
pub fn quantile(numbers: &[f64], share: f64) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = (share * (sorted.len() as f64 - 1.0)).round();
    sorted.get(at as usize).copied().unwrap_or(f64::NAN)
}

/// The mean of some numbers.
pub fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

/// The mesh of a patch, for normals and edges.
pub struct Mesh {
    triangles: Vec<[usize; 3]>,
    edges: Vec<(usize, usize)>,
}

impl Default for Mesh {
    fn default() -> Self {
        let triangles = Patch::grid(Surface::Flat, nalgebra::Isometry3::identity()).triangles;
        let edges = crate::describe::graph().edges().filter(|(a, b)| a < b).collect();
        Mesh { triangles, edges }
    }
}

impl Mesh {
    fn normals(&self, rest: &Field, moved: &Field) -> Vec<Vector3<f64>> {
        let vertices: Vec<Point3<f64>> =
            rest.iter().zip(moved).map(|(rest, moved)| Point3::from((rest + moved).cast::<f64>())).collect();
        vertex_normals(&vertices, &self.triangles)
    }
}

impl Errors {
    /// Adds a sample: nodes at rest, what was answered, what is true (mm).
    pub fn add(&mut self, mesh: &Mesh, rest: &Field, answer: &Field, truth: &Field) {
        let off: Vec<Vector3<f64>> = answer.iter().zip(truth).map(|(a, t)| (a - t).cast::<f64>() * UM).collect();
        self.worst_um.push(off.iter().map(|e| e.norm()).fold(0.0, f64::max));
        self.nodes_um.extend(off.iter().map(|e| e.norm()));
        self.motion_um2 += truth.iter().map(|t| t.cast::<f64>().norm_squared() * UM * UM).sum::<f64>();
        let edges: Vec<f64> = mesh.edges.iter().map(|&(a, b)| (off[a] - off[b]).norm()).collect();
        self.edges_um.push(mean(&edges));
        let normals = mesh.normals(rest, answer).into_iter().zip(mesh.normals(rest, truth));
        // The angle from the chord: a cosine near one has lost its digits.
        self.normals_deg
            .extend(normals.map(|(a, t)| (2.0 * (0.5 * (a - t).norm()).clamp(0.0, 1.0).asin()).to_degrees()));
    }

    /// Samples.
    pub fn samples(&self) -> usize {
        self.worst_um.len()
    }

    /// Mean distance (µm).
    pub fn mae_um(&self) -> f64 {
        mean(&self.nodes_um)
    }

    /// Root of the mean square (µm).
    pub fn rmse_um(&self) -> f64 {
        mean(&self.nodes_um.iter().map(|e| e * e).collect::<Vec<_>>()).sqrt()
    }

    /// Variance of the nodes' distances (µm²).
    pub fn variance_um2(&self) -> f64 {
        let mean_um = self.mae_um();
        mean(&self.nodes_um.iter().map(|e| (e - mean_um).powi(2)).collect::<Vec<_>>())
    }

    /// Distance below which this share of the nodes lie (µm).
    pub fn node_quantile_um(&self, share: f64) -> f64 {
        quantile(&self.nodes_um, share)
    }

    /// The worst nodes of the samples (µm).
    pub fn worst_um(&self) -> &[f64] {
        &self.worst_um
    }

    /// Mean angle between normals (degrees).
    pub fn normals_deg(&self) -> f64 {
        mean(&self.normals_deg)
    }

    /// Mean error of an edge (µm): graph consistency.
    pub fn edges_um(&self) -> f64 {
        mean(&self.edges_um)
    }

    /// Root mean square error in percent of that of the motion: 100 where nothing moves.
    pub fn percent(&self) -> f64 {
        100.0 * (self.nodes_um.iter().map(|e| e * e).sum::<f64>() / self.motion_um2).sqrt()
    }

    /// Root mean square of the true displacements (µm).
    pub fn motion_um(&self) -> f64 {
        (self.motion_um2 / self.nodes_um.len() as f64).sqrt()
    }
}

/// The mean as the published evaluation takes it: that of the last batch, divided by the number of batches.
pub fn published_mean(errors: &[f64], batch: usize) -> f64 {
    let batches: Vec<&[f64]> = errors.chunks(batch).collect();
    batches.last().map_or(f64::NAN, |last| mean(last) / batches.len() as f64)
}
