//! Triangles of a needle, to be looked at.
//!
//! Contract: every vertex lies on the needle's real surface, at its true radius and with the true shape of its tip; the mesh is closed
//! where the shaft is cut off. Coordinates are the needle's own: the tip at the origin, the shaft towards +z. Units: mm.

use std::f64::consts::TAU;

use nalgebra::{Point3, Unit, Vector3};
use retina_core::needle::NeedleShape;

/// Length of the shaft that is drawn, from the tip (mm).
pub const SHAFT_MM: f64 = 1.5;

/// Vertices around the shaft.
const AROUND: usize = 32;

/// Rings over the rounded edge, from the end plane to the shaft.
const RINGS: usize = 8;

/// How far the first and the last ring keep from the directions of the end plane and of the shaft, where no single point is
/// foremost.
const MARGIN: f64 = 1e-5;

/// A closed mesh of a needle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NeedleMesh {
    /// Needle-local (mm).
    pub vertices: Vec<Point3<f64>>,
    /// Unit, outwards.
    pub normals: Vec<Vector3<f64>>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl NeedleMesh {
    /// A needle of that shape.
    pub fn new(shape: &NeedleShape) -> Self {
        let body = shape.body();
        let mut mesh = Self::default();
        let face = body.face_normal();
        let centre = mesh.add(body.foremost_along(&face), face);
        let mut inner: Option<Vec<u32>> = None;
        for ring in 0..=RINGS {
            let share = (ring as f64 / RINGS as f64).clamp(MARGIN, 1.0 - MARGIN);
            let (towards_face, outwards) = (f64::cos(share * TAU / 4.0), f64::sin(share * TAU / 4.0));
            let outer = mesh.ring(|aside| {
                let direction = Unit::new_normalize(face.into_inner() * towards_face + aside * outwards);
                (body.foremost_along(&direction), direction)
            });
            match &inner {
                None => mesh.fan(centre, &outer),
                Some(inner) => mesh.band(inner, &outer),
            }
            inner = Some(outer);
        }
        let end = |aside: Vector3<f64>| {
            let foot = Point3::new(body.axis_x_mm(), 0.0, SHAFT_MM) + aside * body.radius_mm();
            (Some(foot), Unit::new_unchecked(aside))
        };
        let cut = mesh.ring(end);
        if let Some(inner) = inner {
            mesh.band(&inner, &cut);
        }
        // Twice, because the shaft's edge has two normals.
        let lid: Vec<u32> = mesh.ring(|aside| (end(aside).0, Vector3::z_axis())).into_iter().rev().collect();
        let middle = mesh.add(Some(Point3::new(body.axis_x_mm(), 0.0, SHAFT_MM)), Vector3::z_axis());
        mesh.fan(middle, &lid);
        mesh
    }

    /// A missing point, which only a direction along the shaft would have, becomes the tip.
    fn add(&mut self, point: Option<Point3<f64>>, normal: Unit<Vector3<f64>>) -> u32 {
        self.vertices.push(point.unwrap_or_else(Point3::origin));
        self.normals.push(normal.into_inner());
        self.vertices.len() as u32 - 1
    }

    fn ring(&mut self, mut at: impl FnMut(Vector3<f64>) -> (Option<Point3<f64>>, Unit<Vector3<f64>>)) -> Vec<u32> {
        (0..AROUND)
            .map(|step| {
                let (sin, cos) = (step as f64 * TAU / AROUND as f64).sin_cos();
                let (point, normal) = at(Vector3::new(cos, sin, 0.0));
                self.add(point, normal)
            })
            .collect()
    }

    fn fan(&mut self, centre: u32, ring: &[u32]) {
        let next = |step: usize| ring[(step + 1) % ring.len()];
        self.triangles.extend(ring.iter().enumerate().map(|(step, &corner)| [centre, next(step), corner]));
    }

    fn band(&mut self, lower: &[u32], upper: &[u32]) {
        for step in 0..AROUND {
            let next = (step + 1) % AROUND;
            self.triangles.push([lower[step], lower[next], upper[next]]);
            self.triangles.push([lower[step], upper[next], upper[step]]);
        }
    }
}
