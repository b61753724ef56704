//! `contact`: derivatives under every tip and at every gap, and what is out of reach.

use nalgebra::{Point3, Rotation3, Vector3};
use retina_core::effect::{Effect, Local, Stencils};
use retina_core::effects::contact::{Contact, ContactFaces};
use retina_core::mesh::element::FACE_NODES;
use retina_core::needle::{Body, NeedleShape};
use retina_tests::tolerance::EXACT;

use super::{Case, RADIUS, REPEATS, SIZES, STEP, check_effect, check_prediction, face};
use crate::meshes::noise;

/// How the needle stands to a face: label, smoothing distance and least gap, in radii.
const CONTACTS: [(&str, f64, f64); 3] = [("touching", 0.02, 0.01), ("smoothing zone", 0.3, -0.1), ("deep", 1e-3, -0.3)];

pub fn shapes(size: f64) -> [NeedleShape; 3] {
    let radius = RADIUS * size;
    [NeedleShape::hemispherical(radius), NeedleShape::flat(radius), NeedleShape::bevelled(radius)]
}

/// A random turn that leaves the needle within 40° of pointing down.
fn turned(seed: u64) -> Rotation3<f64> {
    let mut random = noise(seed);
    Rotation3::from_euler_angles(0.5 * random(), 0.5 * random(), 0.0)
        * Rotation3::from_axis_angle(&Vector3::z_axis(), 3.0 * random())
}

/// The face as it lies, the needle where its least gap is `gap`.
fn pressed(contact: &Contact, stencils: &Stencils, rest: &[f64], gap: f64, size: f64, seed: u64) -> Vec<f64> {
    let n = FACE_NODES + 1;
    let mut random = noise(1000 + seed);
    let mut current = vec![0.0; 3 * n];
    stencils.gather(0, rest, &mut current);
    for value in &mut current {
        *value += 0.01 * size * RADIUS * random();
    }
    // The shaft's axis over the face: a bevel pushed in at its sharp point would leave the face beside it.
    let axis = contact.frame_from_needle * Vector3::x() * contact.shape.axis_x_mm();
    current[n - 1] = 0.1 * size * RADIUS * random() - axis.x;
    current[2 * n - 1] = 0.1 * size * RADIUS * random() - axis.y;
    for _ in 0..200 {
        let local = Local { current: &current, group: 0, predicted: &[] };
        let least = contact.contact_points(&local).fold(f64::INFINITY, |least, point| least.min(point.gap_mm));
        let advance = contact.frame_from_needle * -Vector3::z() * (0.7 * (least - gap));
        for k in 0..3 {
            current[(k + 1) * n - 1] += advance[k];
        }
    }
    current
}

/// Whether no quadrature point is so near to a jump of the second derivative that differences over `h` would cross it.
fn smooth(contact: &Contact, body: &Body, current: &[f64], h: f64) -> bool {
    let n = FACE_NODES + 1;
    let tip = Vector3::new(current[n - 1], current[2 * n - 1], current[3 * n - 1]);
    let local = Local { current, group: 0, predicted: &[] };
    contact.contact_points(&local).all(|point| {
        if point.gap_mm > contact.smoothing_mm + 2.0 * h {
            return true;
        }
        let s = contact.smoothing_mm;
        let at = Point3::from(contact.frame_from_needle.inverse_transform_vector(&(point.position.coords - tip)));
        let here = body.signed_distance(&at).hessian;
        let corners = (0..8).map(|c| Vector3::from_fn(|k, _| if c >> k & 1 == 0 { -2.0 * h } else { 2.0 * h }));
        (point.gap_mm - s).abs() > 2.0 * h
            && (point.gap_mm + s).abs() > 2.0 * h
            && corners
                .map(|c| body.signed_distance(&(at + c)).hessian)
                .all(|hessian| (hessian - here).amax() <= 1e-3 * here.amax().max(1.0 / body.radius_mm()))
    })
}

/// Calls `visit(contact, case)` for every shape, kind of contact and random pose at `size`.
pub fn for_each_contact(size: f64, mut visit: impl FnMut(&Contact, Case)) {
    let (stencils, rest) = face(size);
    let faces = ContactFaces::new(&stencils, &rest, 3);
    for shape in shapes(size) {
        let body = shape.body();
        for (label, smoothing, gap) in CONTACTS {
            let mut found = 0;
            for seed in 0..60 {
                let contact = Contact {
                    faces: &faces,
                    shape: &body,
                    frame_from_needle: turned(seed),
                    stiffness_kpa_per_mm: 5e4 / size,
                    smoothing_mm: smoothing * RADIUS * size,
                };
                let step_mm = STEP * RADIUS * size;
                let current = pressed(&contact, &stencils, &rest, gap * RADIUS * size, size, seed);
                if found == REPEATS || !smooth(&contact, &body, &current, step_mm) {
                    continue;
                }
                found += 1;
                let label = format!("{:?}, {label}, seed {seed}, size {size:e}", shape.tip);
                visit(&contact, Case { label, group: 0, current, step_mm });
            }
            assert_eq!(found, REPEATS, "too few smooth poses: {:?}, {label}", shape.tip);
        }
    }
}

pub fn check() {
    for size in SIZES {
        let mut seen = 0;
        for_each_contact(size, |contact, case| {
            seen += usize::from(check_prediction(contact, &case));
            check_effect("contact", contact, &[case]);
        });
        assert!(seen >= 3 * REPEATS, "the Hessian sees the stresses in {seen} cases");
    }
}

/// A contact of the retina's scale under a needle turned at random.
fn stiff_contact<'a>(faces: &'a ContactFaces, shape: &'a Body, seed: u64) -> Contact<'a> {
    Contact { faces, shape, frame_from_needle: turned(seed), stiffness_kpa_per_mm: 5e4, smoothing_mm: 5e-4 }
}

/// A bent face near the needle, at random.
#[test]
fn a_face_is_passed_over_only_where_no_point_of_it_acts() {
    let (stencils, rest) = face(1.0);
    let faces = ContactFaces::new(&stencils, &rest, 5);
    for shape in shapes(1.0) {
        let body = shape.body();
        let (mut acting, mut passed) = (0, 0);
        for seed in 0..400 {
            let contact = stiff_contact(&faces, &body, seed);
            let mut random = fastrand::Rng::with_seed(seed);
            let mut current = vec![0.0; 3 * stencils.group_size];
            stencils.gather(0, &rest, &mut current);
            let size = current.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
            for (at, x) in current.iter_mut().enumerate() {
                let is_needle = (at + 1) % stencils.group_size == 0;
                *x += (2.0 * random.f64() - 1.0) * size * if is_needle { 2.0 } else { 0.3 };
            }
            let local = Local { current: &current, group: 0, predicted: &[] };
            let acts = contact.energy(&local) > 0.0;
            assert!(!acts || contact.is_active(&local), "{:?}, seed {seed}", shape.tip);
            acting += usize::from(acts);
            passed += usize::from(!contact.is_active(&local));
        }
        assert!(acting > 20 && passed > 20, "{:?}: {acting} act, {passed} are passed over", shape.tip);
    }
}

#[test]
fn a_contact_out_of_reach_is_inactive_and_exactly_zero() {
    let (stencils, rest) = face(1.0);
    let faces = ContactFaces::new(&stencils, &rest, 3);
    for shape in shapes(1.0) {
        let body = shape.body();
        for seed in 0..20 {
            let contact = stiff_contact(&faces, &body, seed);
            for gap in [5.0001e-4, 0.1, 2.0, 10.0] {
                let current = pressed(&contact, &stencils, &rest, gap, 1.0, seed);
                let local = Local { current: &current, group: 0, predicted: &[] };
                assert!((contact.energy(&local) - EXACT).abs() <= EXACT, "{:?} {gap}", shape.tip);
                let n = current.len();
                let mut out = vec![7.0; n * n];
                contact.add_gradient(&local, &mut out[..n]);
                contact.add_hessian(&local, &mut out);
                assert!(out.iter().all(|&entry| entry == 7.0), "{:?} {gap}", shape.tip);
                assert!(gap < 2.0 || !contact.is_active(&local), "{:?} {gap}", shape.tip);
            }
            // The other way round: what acts is never called inactive.
            for gap in [4e-4, -1e-3, -0.1] {
                let current = pressed(&contact, &stencils, &rest, gap, 1.0, seed);
                let local = Local { current: &current, group: 0, predicted: &[] };
                assert!(contact.energy(&local) > 0.0 && contact.is_active(&local), "{:?} {gap}", shape.tip);
            }
        }
    }
}
