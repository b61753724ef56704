//! What `auto` leaves out costs no more than it may, however much that is.

use nalgebra::{Point3, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::choice::AUTO_TOLERANCE_UM;
use retina_core::predict::{Control, EffectChoice, Level, Prediction, PreparedScene, Request};
use retina_core::scene::Scene;

use crate::support::ask;

#[test]
fn auto_leaves_out_what_the_tolerance_allows() {
    let worst_um = |a: &Prediction, b: &Prediction| {
        a.vertices.iter().zip(&b.vertices).map(|(a, b)| (a - b).norm() * 1e3).fold(0.0, f64::max)
    };
    let (mut fewest, mut most) = (usize::MAX, 0);
    for (coefficient, force_mn, angle_deg) in [(0.3, 0.05, 20.0), (0.02, 0.4, 30.0), (0.1, 0.8, 10.0)] {
        let mut scene = Scene::built_in("macula").unwrap();
        scene.friction_coefficient = coefficient;
        let scene = PreparedScene::new(scene).unwrap();
        let (sin, cos) = f64::to_radians(angle_deg).sin_cos();
        let shape = NeedleShape::hemispherical(0.257);
        let request = Request {
            needle: Needle::pointing(shape, Point3::origin(), &-Vector3::z_axis()),
            control: Control::Force(Vector3::new(sin, 0.0, -cos) * force_mn),
            level: Level::Coarse,
            effects: EffectChoice::Auto,
        };
        let all = ask(&scene, &Request { effects: EffectChoice::All, ..request.clone() }).unwrap();
        let mut before = usize::MAX;
        for tolerance_um in [0.05, 0.5, 5.0, 50.0] {
            let effects = EffectChoice::AutoWithin { tolerance_um };
            let answer = ask(&scene, &Request { effects, ..request.clone() }).unwrap();
            let taken = answer.effects.iter().filter(|effect| effect.simulated && effect.threshold.is_some()).count();
            let off_um = worst_um(&answer, &all);
            println!(
                "µ {coefficient}, {force_mn} mN at {angle_deg}°: within {tolerance_um} µm {taken} effects, off by {off_um:.3} µm"
            );
            assert!(taken <= before, "a wider tolerance takes more");
            assert!(off_um <= tolerance_um, "off by {off_um} µm, allowed {tolerance_um}");
            (before, fewest, most) = (taken, fewest.min(taken), most.max(taken));
        }
    }
    assert!(fewest < most, "the tolerance changes nothing");
    let shared = EffectChoice::auto_for(5.0 * AUTO_TOLERANCE_UM);
    assert_eq!(shared.tolerance_um(), EffectChoice::Auto.tolerance_um());
}
