//! No force, no contact: nothing moves, exactly.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use retina_core::predict::{
    ContactState, Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request,
};
use retina_core::scene::Scene;

use crate::support::{ask, at, built_in, cap, largest_um, mesh_scene, straight};

fn scenes() -> Vec<Arc<PreparedScene>> {
    let (vertices, triangles) = cap();
    let mut scenes: Vec<Arc<PreparedScene>> = Scene::built_in_names().iter().map(|name| built_in(name)).collect();
    scenes.push(Arc::new(mesh_scene(vertices, triangles)));
    scenes
}

fn assert_rest(scene: &PreparedScene, answer: &Prediction) {
    assert_eq!(answer.contact.state, ContactState::Clear);
    assert!(answer.displacement_um.iter().all(|&moved| moved.to_bits() == 0));
    assert_eq!(answer.needle.reaction_mn, Vector3::zeros());
    assert_eq!((answer.needle.travel_mm, answer.contact.max_pressure_kpa, answer.contact.area_mm2), (0.0, 0.0, 0.0));
    assert_eq!(answer.solver.iterations, 0);
    if answer.source_indices.is_none() {
        let patch = scene.scene().patch(&Point3::origin()).unwrap();
        assert_eq!(answer.vertices, patch.vertices, "the rest vertices, to the last bit");
    }
    let contact = answer.effects.iter().find(|effect| effect.name == "contact").unwrap();
    assert!(!contact.simulated && !contact.reason.is_empty());
}

#[test]
fn no_force_moves_nothing() {
    for scene in scenes() {
        for level in Level::ALL {
            assert_rest(&scene, &ask(&scene, &straight(level, 0.0)).unwrap());
            // Below the surface too: a needle that does not push is not there.
            let mut inside = straight(level, 0.0);
            inside.needle.tip_mm.z = -0.05;
            assert_rest(&scene, &ask(&scene, &inside).unwrap());
        }
    }
}

#[test]
fn a_held_needle_above_the_surface_moves_nothing_and_one_below_does() {
    for scene in scenes() {
        for level in Level::ALL {
            let mut held = Request { control: Control::Pose, ..straight(level, 1.0) };
            for height in [0.1, 0.01] {
                held.needle.tip_mm.z = height;
                assert_rest(&scene, &ask(&scene, &held).unwrap());
            }
            if level == Level::Reference {
                continue;
            }
            held.needle.tip_mm.z = -0.02;
            if level == Level::Corrected {
                let refusal = ask(&scene, &held);
                assert!(matches!(refusal, Err(PredictError::NotLearned { field: "control", .. })), "{refusal:?}");
                continue;
            }
            let answer = ask(&scene, &held).unwrap();
            assert_eq!(answer.contact.state, ContactState::Touching);
            assert!(largest_um(&answer) > 0.5 && answer.needle.reaction_mn.z > 1e-3);
        }
    }
}

#[test]
fn without_contact_in_the_effects_nothing_moves() {
    let scene = built_in("macula");
    for level in Level::ALL {
        let mut request = straight(level, 1.0);
        request.effects = EffectChoice::Named(vec!["elasticity".to_owned()]);
        assert_rest(&scene, &ask(&scene, &request).unwrap());
    }
}

#[test]
fn an_effect_that_is_not_called_for_leaves_no_trace() {
    let scene = built_in("flat");
    // So light a touch that `auto` stays with small strain.
    let auto = straight(Level::Coarse, 2e-3);
    let named = ["elasticity", "contact"].map(str::to_owned).to_vec();
    let named = Request { effects: EffectChoice::Named(named), ..auto.clone() };
    let (auto, named) = (ask(&scene, &auto).unwrap(), ask(&scene, &named).unwrap());
    assert!(!auto.effects.iter().any(|effect| effect.name == "finite_strain" && effect.simulated));
    assert_eq!(auto.vertices, named.vertices);
    let all = Request { effects: EffectChoice::All, ..at(&straight(Level::Coarse, 2e-3), Level::Coarse) };
    assert_ne!(ask(&scene, &all).unwrap().vertices, auto.vertices);
}
