//! Layers of the wall: Lamé parameters, order, presets, ranges.

use retina_core::tissue::{Layer, LayerKind, RABBIT_SUBLAYER_MODULI_KPA, Tissue};

#[test]
fn lame_parameters_reproduce_youngs_modulus() {
    let layer = Layer { thickness_mm: 0.25, youngs_modulus_kpa: 20.0, poisson_ratio: 0.3 };
    let (mu, lambda) = (layer.shear_modulus_kpa(), layer.first_lame_kpa());
    let youngs = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
    assert!((youngs - 20.0).abs() < 1e-12, "{youngs}");
    assert!((layer.bulk_modulus_kpa() - (lambda + 2.0 / 3.0 * mu)).abs() < 1e-12);
}

#[test]
fn presets_are_allowed_and_ordered_from_the_vitreous_outwards() {
    for tissue in [Tissue::default(), Tissue::with_inner_limiting_membrane(), Tissue::rabbit_sublayers()] {
        tissue.validate().unwrap();
        let kinds: Vec<LayerKind> = tissue.layers().iter().map(|named| named.kind).collect();
        assert!(kinds.is_sorted(), "{kinds:?}");
        assert!((tissue.retina_thickness_mm() - 0.25).abs() < 1e-12);
    }
    assert_eq!(Tissue::default().layers().len(), 3);
    assert_eq!(Tissue::with_inner_limiting_membrane().layers()[0].kind, LayerKind::InnerLimitingMembrane);
    let moduli: Vec<f64> = Tissue::rabbit_sublayers().retina.iter().map(|layer| layer.youngs_modulus_kpa).collect();
    assert_eq!(moduli, RABBIT_SUBLAYER_MODULI_KPA);
}

#[test]
fn a_number_outside_its_range_is_named_by_its_path() {
    let mut tissue = Tissue::default();
    tissue.choroid.youngs_modulus_kpa = 0.5;
    let error = tissue.validate().unwrap_err();
    assert_eq!(error.field, "tissue.choroid.youngs_modulus_kpa");
    assert_eq!((error.value, error.min, error.unit), (0.5, 1.0, "kPa"));

    let mut tissue = Tissue::rabbit_sublayers();
    tissue.retina[2].poisson_ratio = f64::NAN;
    assert_eq!(tissue.validate().unwrap_err().field, "tissue.retina[2].poisson_ratio");

    let mut tissue = Tissue::default();
    tissue.sclera.thickness_mm = f64::INFINITY;
    assert_eq!(tissue.validate().unwrap_err().field, "tissue.sclera.thickness_mm");
}

#[test]
fn the_retina_is_held_to_its_range_as_a_whole() {
    let mut tissue = Tissue::default();
    tissue.retina = vec![tissue.retina[0]; 2];
    let error = tissue.validate().unwrap_err();
    assert_eq!((error.field.as_str(), error.value), ("tissue.retina.thickness_mm", 0.5));
    tissue.retina.clear();
    assert_eq!(tissue.validate().unwrap_err().field, "tissue.retina");
}

#[test]
fn poisson_ratio_ends_below_one_half() {
    let mut tissue = Tissue::default();
    tissue.retina[0].poisson_ratio = 0.4999;
    tissue.validate().unwrap();
    tissue.retina[0].poisson_ratio = 0.49991;
    assert!(tissue.validate().is_err());
}
