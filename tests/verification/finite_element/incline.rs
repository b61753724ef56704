//! Friction on an incline: a stiff block pressed against the end of a wide flat needle by a force that leans, held by friction alone.
//!
//! Closed form: it sticks as long as the tangent of the lean is below µ, and its slip y then solves f₁(y) = tan θ / µ, whatever the distribution of the
//! pressure: y = ε (1 − √(1 − tan θ / µ)). Above, nothing holds it. IPC's scene of the same (tan θ = 0.5: µ = 0.49 slides, 0.50 sticks) is the threshold here.

use nalgebra::{Rotation3, Vector3};
use retina_core::assemble::{Dofs, Pattern};
use retina_core::effect::{Effect, Local, Stencils, Term};
use retina_core::effects::contact::{Contact, ContactFaces};
use retina_core::effects::elasticity::Elasticity;
use retina_core::effects::friction::{Friction, RubbingPoint};
use retina_core::effects::solid::SolidGeometry;
use retina_core::mesh::element::TOP_NODES;
use retina_core::needle::NeedleShape;
use retina_core::progress::Silent;
use retina_core::solve::newton::{Drive, Globalization, NewtonError, NewtonSettings, System, Workspace};
use retina_core::solve::sparse::{Precision, SymbolicFactor};

use super::block::{Mesh, block, lame};

/// Force along the needle's axis (mN).
const NORMAL_MN: f64 = 1.0;
const TANGENT: f64 = 0.5;
/// ε (mm).
const FULL_SLIP_MM: f64 = 1e-3;
/// Edges of the block (mm): flat, so that it does not tip over.
const EDGE_MM: f64 = 0.4;
const HEIGHT_MM: f64 = 0.04;
const STIFFNESS_KPA_PER_MM: f64 = 1e4;

/// Mean slip of the block's top and the friction force on the needle, or why the block does not stand.
fn lean(coefficient: f64, tangent: f64) -> Result<(Vector3<f64>, Vector3<f64>), NewtonError> {
    let mesh =
        Mesh::glued(&block([2, 2, 1], |[s, t, w]| [EDGE_MM * (s - 0.5), EDGE_MM * (t - 0.5), HEIGHT_MM * (w - 1.0)]));
    let needle = mesh.vertices();
    let mut rest = mesh.rest.clone();
    rest.extend([0.0; 3]);
    let mut faces = Stencils { group_size: TOP_NODES.len() + 1, vertices: Vec::new() };
    for element in 0..mesh.elements.len() {
        faces.vertices.extend(TOP_NODES.iter().map(|&a| mesh.elements.group(element)[a]));
        faces.vertices.push(needle as u32);
    }
    let body = NeedleShape::flat(2.0).body();
    let contact_faces = ContactFaces::new(&faces, &rest, 4);
    let contact = Contact {
        faces: &contact_faces,
        shape: &body,
        frame_from_needle: Rotation3::identity(),
        stiffness_kpa_per_mm: STIFFNESS_KPA_PER_MM,
        smoothing_mm: 1e-5,
    };
    let geometry = SolidGeometry::new(&mesh.elements, &mesh.rest).expect("a block");
    let materials = vec![lame(1e6, 0.3); mesh.elements.len()];
    let solid = Elasticity { geometry: &geometry, materials: &materials };
    let dofs = Dofs::new(needle + 1, 0..needle, |_, _| false, Some(needle));
    let pattern = Pattern::new(&dofs, &[&mesh.elements, &faces]);
    let symbolic = SymbolicFactor::new(&pattern).expect("analysed");
    let volume = EDGE_MM * EDGE_MM * HEIGHT_MM;
    let nodal = mesh.body_load(|_| Vector3::new(tangent, 0.0, 1.0) * (NORMAL_MN / volume));
    let mut load = vec![0.0; dofs.free];
    for (at, force) in nodal.iter().enumerate() {
        load[dofs.index(at / 3, at % 3).expect("free")] = *force;
    }
    // Pressed in by what the penalty yields, so that the first pressures are those of the load.
    let area = EDGE_MM * EDGE_MM;
    let sunk = NORMAL_MN / area / STIFFNESS_KPA_PER_MM;
    let mut positions = rest.clone();
    (0..needle).for_each(|v| positions[3 * v + 2] += sunk);
    let (mut slip, mut force) = (Vector3::zeros(), Vector3::zeros());
    for _round in 0..20 {
        let mut current = vec![0.0; 3 * faces.group_size];
        let points: Vec<Vec<RubbingPoint>> = (0..faces.len())
            .map(|group| {
                faces.gather(group, &positions, &mut current);
                let local = Local { current: &current, group, predicted: &[] };
                let rubbing = |(point, state): (usize, retina_core::effects::contact::ContactPoint)| {
                    let node = |&v: &u32| Vector3::from_row_slice(&rest[3 * v as usize..][..3]);
                    let values = contact_faces.values(point).iter();
                    let anchor: Vector3<f64> = values.zip(faces.group(group)).map(|(n, v)| node(v) * *n).sum();
                    let limit_mn = coefficient * state.pressure_kpa * state.area_mm2;
                    RubbingPoint { point, limit_mn, normal: -Vector3::z(), anchor }
                };
                contact.contact_points(&local).enumerate().map(rubbing).collect()
            })
            .collect();
        let friction = Friction { faces: &contact_faces, points, full_slip_mm: FULL_SLIP_MM };
        let terms = [
            Term { effect: &solid, stencils: &mesh.elements, set: 0 },
            Term { effect: &contact, stencils: &faces, set: 1 },
            Term { effect: &friction, stencils: &faces, set: 1 },
        ];
        let (dofs, pattern, symbolic) = (&dofs, &pattern, &symbolic);
        let system = System { terms: &terms, dofs, pattern, symbolic, driven: Some(needle), dead_load: &load };
        let settings = NewtonSettings {
            precision: Precision::Single,
            globalization: Globalization::LineSearch,
            force_scale_mn: NORMAL_MN,
            tolerance_mn: 1e-7 * NORMAL_MN,
            max_iterations: 60,
            max_weakened: 60,
            max_travel_mm: 1.0,
        };
        let mut workspace = Workspace::new(pattern, symbolic);
        let report = system.solve(&mut positions, Drive::Held, &settings, &mut workspace, &mut Silent)?;
        let top: Vec<usize> = (0..needle).filter(|&v| rest[3 * v + 2] == 0.0).collect();
        let moved = |&v: &usize| Vector3::from_fn(|k, _| positions[3 * v + k] - rest[3 * v + k]);
        slip = top.iter().map(moved).sum::<Vector3<f64>>() / top.len() as f64;
        force = (0..faces.len())
            .map(|group| {
                faces.gather(group, &positions, &mut current);
                let mut out = vec![0.0; current.len()];
                friction.add_gradient(&Local { current: &current, group, predicted: &[] }, &mut out);
                Vector3::from_fn(|k, _| out[(k + 1) * faces.group_size - 1])
            })
            .sum();
        if report.iterations == 0 {
            break;
        }
    }
    Ok((slip, force))
}

#[test]
fn a_block_sticks_below_the_angle_of_friction_and_slides_above() {
    for (coefficient, tangent) in [(0.51, TANGENT), (0.8, TANGENT), (2.0, TANGENT), (0.015, 0.01)] {
        let (slip, force) = lean(coefficient, tangent).unwrap_or_else(|e| panic!("µ {coefficient}: {e}"));
        let exact = FULL_SLIP_MM * (1.0 - (1.0 - tangent / coefficient).sqrt());
        println!("µ {coefficient}, tan θ {tangent}: slip {:.4} µm, exact {:.4} µm", slip.x * 1e3, exact * 1e3);
        assert!((slip.x / exact - 1.0).abs() < 2e-3, "µ {coefficient}: {} for {exact}", slip.x);
        assert!((force.x + tangent * NORMAL_MN).abs() < 1e-5 && force.z.abs() < 1e-12, "{force}");
    }
    for (coefficient, tangent) in [(0.49, TANGENT), (0.1, TANGENT), (0.015, 0.02)] {
        let stands = lean(coefficient, tangent);
        assert!(stands.is_err(), "µ {coefficient} does not hold tan θ {tangent}, yet it stands: {stands:?}");
    }
}
