//! The reference hexahedron: twenty nodes, fourteen quadrature points, four pressure modes.
//!
//! Displacements are quadratic serendipity functions on the cube [−1, 1]³ (Zienkiewicz & Taylor, *The Finite Element Method*, vol. 1,
//! section 8.6). The volume change that the volumetric energy sees is J projected on the discontinuous linear functions 1, ξ, η, ζ, which
//! removes volumetric locking (Simo, Taylor & Pister 1985; the projection is the static elimination of a discontinuous pressure).
//! Integrals use Irons' fourteen-point rule (Irons 1971), exact for polynomials of degree five.
//! Not here: geometry of any particular mesh, materials.

use std::sync::LazyLock;

/// Nodes of an element.
pub const NODES: usize = 20;
/// Nodes of one of its faces.
pub const FACE_NODES: usize = 8;
/// Quadrature points of an element.
pub const POINTS: usize = 14;
/// Pressure modes of an element.
pub const MODES: usize = 4;
/// Lattice steps along an element's edge.
pub const ORDER: usize = 2;

/// Whether an element has a node at this offset of its 3 × 3 × 3 lattice: corners and mid-edges only.
pub fn has_node(offset: [usize; 3]) -> bool {
    offset.iter().filter(|&&o| o == 1).count() <= 1
}

/// Lattice offsets of the nodes in local order, first coordinate fastest.
pub static NODE_OFFSETS: LazyLock<[[usize; 3]; NODES]> = LazyLock::new(|| {
    let mut offsets = [[0; 3]; NODES];
    for (offset, node) in offsets.iter_mut().zip(lattice_nodes()) {
        *offset = node;
    }
    offsets
});

/// Local indices of the nodes of the face ζ = 1, in local order.
pub static TOP_NODES: LazyLock<[usize; FACE_NODES]> = LazyLock::new(|| {
    let mut top = [0; FACE_NODES];
    let on_top = (0..NODES).filter(|&a| NODE_OFFSETS[a][2] == ORDER);
    for (slot, node) in top.iter_mut().zip(on_top) {
        *slot = node;
    }
    top
});

fn lattice_nodes() -> Vec<[usize; 3]> {
    let all = (0..=ORDER).flat_map(|k| (0..=ORDER).flat_map(move |j| (0..=ORDER).map(move |i| [i, j, k])));
    all.filter(|&offset| has_node(offset)).collect()
}

/// Value and gradient of one shape function at a point of the reference cube.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shape {
    /// The shape function N.
    pub value: f64,
    /// ∂N/∂ξ, ∂N/∂η, ∂N/∂ζ.
    pub gradient: [f64; 3],
}

/// A quadrature point with every shape function evaluated there.
#[derive(Clone, Debug)]
pub struct QuadraturePoint {
    /// Weight on the reference cube (the weights sum to its volume, 8).
    pub weight: f64,
    /// One entry per node.
    pub shapes: [Shape; NODES],
    /// Pressure modes 1, ξ, η, ζ.
    pub modes: [f64; MODES],
}

/// Irons' fourteen-point rule with the shape functions at its points.
pub static QUADRATURE: LazyLock<Vec<QuadraturePoint>> = LazyLock::new(quadrature);

fn quadrature() -> Vec<QuadraturePoint> {
    let face = (19.0_f64 / 30.0).sqrt();
    let corner = (19.0_f64 / 33.0).sqrt();
    let mut rule = Vec::with_capacity(POINTS);
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut at = [0.0; 3];
            at[axis] = sign * face;
            rule.push((at, 320.0 / 361.0));
        }
    }
    for octant in 0..8 {
        let at = [0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { -corner } else { corner });
        rule.push((at, 121.0 / 361.0));
    }
    let point = |(at, weight): ([f64; 3], f64)| QuadraturePoint {
        weight,
        shapes: shapes(at),
        modes: [1.0, at[0], at[1], at[2]],
    };
    rule.into_iter().map(point).collect()
}

/// Every shape function at the point `at` of the reference cube, in local node order.
pub fn shapes(at: [f64; 3]) -> [Shape; NODES] {
    let mut out = [Shape::default(); NODES];
    for (shape, offset) in out.iter_mut().zip(NODE_OFFSETS.iter()) {
        *shape = serendipity(at, offset.map(|o| o as f64 - 1.0));
    }
    out
}

/// Value and gradient of one shape function at a point of the face ζ = 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaceShape {
    /// The shape function N.
    pub value: f64,
    /// ∂N/∂ξ, ∂N/∂η.
    pub gradient: [f64; 2],
}

/// Where the nodes of the face ζ = 1 lie, in the order of [`TOP_NODES`].
const FACE_NODES_AT: [[f64; 2]; FACE_NODES] =
    [[-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.0, 1.0], [1.0, 1.0]];

/// The shape functions of the nodes of the face ζ = 1 at its point `at`, in the order of [`TOP_NODES`]: [`shapes`] there, in two dimensions.
pub fn face_shapes([xi, eta]: [f64; 2]) -> [FaceShape; FACE_NODES] {
    FACE_NODES_AT.map(|[a, b]| {
        let (p, q) = (1.0 + a * xi, 1.0 + b * eta);
        if a == 0.0 {
            let bubble = 0.5 * (1.0 - xi * xi);
            FaceShape { value: bubble * q, gradient: [-xi * q, bubble * b] }
        } else if b == 0.0 {
            let bubble = 0.5 * (1.0 - eta * eta);
            FaceShape { value: bubble * p, gradient: [bubble * a, -eta * p] }
        } else {
            let s = p + q - 3.0;
            FaceShape { value: 0.25 * p * q * s, gradient: [0.25 * a * q * (s + p), 0.25 * b * p * (s + q)] }
        }
    })
}

fn serendipity(at: [f64; 3], node: [f64; 3]) -> Shape {
    if let Some(mid) = (0..3).find(|&k| node[k] == 0.0) {
        // Mid-edge node: a bubble along its edge, linear across.
        let along = |k: usize| {
            if k == mid { (1.0 - at[k] * at[k], -2.0 * at[k]) } else { (1.0 + node[k] * at[k], node[k]) }
        };
        let [(a, da), (b, db), (c, dc)] = [along(0), along(1), along(2)];
        return Shape { value: 0.25 * a * b * c, gradient: [0.25 * da * b * c, 0.25 * a * db * c, 0.25 * a * b * dc] };
    }
    let [a, b, c] = [0, 1, 2].map(|k| 1.0 + node[k] * at[k]);
    let s = a + b + c - 5.0;
    Shape {
        value: 0.125 * a * b * c * s,
        gradient: [
            0.125 * node[0] * b * c * (s + a),
            0.125 * node[1] * a * c * (s + b),
            0.125 * node[2] * a * b * (s + c),
        ],
    }
}

/// Points of the longest rule that [`gauss_rule`] knows.
pub const MOST_GAUSS_POINTS: usize = 5;

/// Gauss–Legendre points and weights on [−1, 1] (Abramowitz & Stegun, table 25.4).
///
/// # Panics
/// For other than 2 to [`MOST_GAUSS_POINTS`] points: callers name constants.
pub fn gauss_rule(points: usize) -> Vec<(f64, f64)> {
    match points {
        2 => {
            let x = (1.0_f64 / 3.0).sqrt();
            vec![(-x, 1.0), (x, 1.0)]
        }
        3 => {
            let x = (3.0_f64 / 5.0).sqrt();
            vec![(-x, 5.0 / 9.0), (0.0, 8.0 / 9.0), (x, 5.0 / 9.0)]
        }
        4 => {
            let root = 2.0 / 7.0 * (6.0_f64 / 5.0).sqrt();
            let (inner, outer) = ((3.0 / 7.0 - root).sqrt(), (3.0 / 7.0 + root).sqrt());
            let (w_inner, w_outer) = ((18.0 + 30.0_f64.sqrt()) / 36.0, (18.0 - 30.0_f64.sqrt()) / 36.0);
            vec![(-outer, w_outer), (-inner, w_inner), (inner, w_inner), (outer, w_outer)]
        }
        5 => {
            let root = 2.0 * (10.0_f64 / 7.0).sqrt();
            let (inner, outer) = ((5.0 - root).sqrt() / 3.0, (5.0 + root).sqrt() / 3.0);
            let spread = 13.0 * 70.0_f64.sqrt();
            let (w_inner, w_outer) = ((322.0 + spread) / 900.0, (322.0 - spread) / 900.0);
            vec![(-outer, w_outer), (-inner, w_inner), (0.0, 128.0 / 225.0), (inner, w_inner), (outer, w_outer)]
        }
        other => panic!("no Gauss rule with {other} points is tabulated"),
    }
}
