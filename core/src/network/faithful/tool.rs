//! The tool's mesh: a cylinder of 102 nodes around the needle's axis, its forward end following the tip.
//!
//! Ten rings of ten nodes and one node in the middle of each end; the cylinder is ten radii long, as in the paper's retina experiment.

use nalgebra::Point3;

use crate::needle::Body;

/// Nodes of a ring.
const AROUND: usize = 10;
/// Rings.
const RINGS: usize = 10;
/// Nodes in all.
pub const TOOL_NODES: usize = AROUND * RINGS + 2;
/// Length of the cylinder in radii.
const LENGTH: f64 = 10.0;
/// Where the first ring stands, in radii from the axis: just inside, so that the tip is below it.
const INSIDE: f64 = 0.98;
/// Halvings of the way to the needle's surface.
const HALVINGS: usize = 40;

/// The nodes in needle coordinates (mm).
pub fn nodes(body: &Body) -> [Point3<f64>; TOOL_NODES] {
    let radius = body.radius_mm();
    let length = LENGTH * radius;
    let spacing = length / (RINGS - 1) as f64;
    std::array::from_fn(|node| {
        let (share, angle, ring) = match node {
            0 => (0.0, 0.0, 0),
            node if node == TOOL_NODES - 1 => (0.0, 0.0, RINGS - 1),
            node => {
                let (ring, at) = ((node - 1) / AROUND, (node - 1) % AROUND);
                (INSIDE, std::f64::consts::TAU * at as f64 / AROUND as f64, ring)
            }
        };
        let (sin, cos) = libm::sincos(angle);
        let (x, y) = (body.axis_x_mm() + share * radius * cos, share * radius * sin);
        // A steep bevel reaches far back: what lies before its face is brought onto it.
        let z = (ring as f64 * spacing).max(underside(body, x, y, length));
        Point3::new(x, y, z)
    })
}

/// Height at which a line along the axis enters the needle (mm).
fn underside(body: &Body, x: f64, y: f64, length: f64) -> f64 {
    let (mut outside, mut inside) = (-length, length);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (outside + inside);
        if body.distance(&Point3::new(x, y, middle)) > 0.0 {
            outside = middle;
        } else {
            inside = middle;
        }
    }
    inside
}

/// Both directions of every edge: along the rings, along the shaft, across each face, and from the ends' middles.
pub fn edges() -> Vec<(usize, usize)> {
    let node = |ring: usize, at: usize| 1 + ring * AROUND + at % AROUND;
    let mut edges = Vec::new();
    for at in 0..AROUND {
        edges.extend([(0, node(0, at)), (TOOL_NODES - 1, node(RINGS - 1, at))]);
        for ring in 0..RINGS {
            edges.push((node(ring, at), node(ring, at + 1)));
            if ring + 1 < RINGS {
                edges.extend([(node(ring, at), node(ring + 1, at)), (node(ring, at), node(ring + 1, at + 1))]);
            }
        }
    }
    let back: Vec<(usize, usize)> = edges.iter().map(|&(a, b)| (b, a)).collect();
    edges.extend(back);
    edges
}
