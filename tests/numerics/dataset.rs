//! Data sets: the same samples whatever the threads and however often a run is killed, whole shards, honest splits, and samples that obey
//! the laws of an equilibrium. On a coarse mesh, because the law is the same on each.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use nalgebra::Point3;
use retina_core::approach::first_touch;
use retina_core::needle::Tip;
use retina_core::predict::finite_element::COARSE;
use retina_core::predict::indentation::{EFFECTS, Indentation, Memory};
use retina_core::predict::{Control, EffectChoice, Level, PreparedScene, Request, Workspace, sampled};
use retina_core::progress::Silent;
use retina_models::dataset::DatasetError;
use retina_models::dataset::deformcontact::{ContactSample, export, import};
use retina_models::dataset::draw::{Depths, LIGHT_SHARE, PathPlan, STEPS, Tips, plan};
use retina_models::dataset::manifest::Manifest;
use retina_models::dataset::part::Part;
use retina_models::dataset::path::before_limit_point;
use retina_models::dataset::run::{BLOCKS, Order, Summary, generate, generate_part};
use retina_models::dataset::truth::TRUTH;
use retina_models::sample::{Sample, Split};
use retina_models::shard::{self, ShardError};
use retina_tests::tolerance::DISCRETISATION;

/// A folder of its own for each test, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("dataset").join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn order(paths: u32, threads: usize) -> Order {
    Order { resolution: COARSE, ..Order::new("all", paths, 5, threads) }
}

fn run(order: &Order, folder: &Path) -> Summary {
    generate(order, folder, &ProgressBar::hidden()).unwrap()
}

fn samples(folder: &Path) -> Vec<Sample> {
    let shards = Manifest::read(folder).unwrap().shards;
    shards.iter().flat_map(|record| shard::read(&folder.join(&record.file)).unwrap()).collect()
}

/// Every file beside the blocks with its bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let files = entries.filter(|entry| entry.file_type().unwrap().is_file());
    files.map(|e| (e.file_name().to_string_lossy().into_owned(), std::fs::read(e.path()).unwrap())).collect()
}

#[test]
fn parts_by_machines_of_a_cluster_give_the_bytes_of_one_run() {
    let (whole, parts) = (folder("whole"), folder("parts"));
    run(&order(20, 2), &whole);
    let computed = std::thread::scope(|scope| {
        let part = |text: &'static str| {
            let parts = &parts;
            let part =
                move || generate_part(&order(20, 1), text.parse().unwrap(), parts, &ProgressBar::hidden()).unwrap();
            scope.spawn(part)
        };
        let both = [part("0/2"), part("1/2")].map(|part| part.join().unwrap().0);
        assert!(both.iter().all(|computed| *computed > 0), "{both:?}");
        both.iter().sum::<u32>()
    });
    assert_eq!(computed, 20);
    let summary = run(&order(20, 1), &parts);
    assert_eq!(summary.computed, 0, "every block was there");
    assert_eq!(files(&parts), files(&whole));
    for wrong in ["2/2", "1", "/", "-1/2", "0/0", "a/b"] {
        assert!(wrong.parse::<Part>().is_err(), "{wrong}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_with_one_thread_and_with_two_and_after_a_kill() {
    let (one, two) = (folder("one"), folder("two"));
    let summary = run(&order(12, 1), &one);
    run(&order(12, 2), &two);
    let whole = files(&one);
    assert!(whole.len() > 2 && summary.counts.all_samples() > 36, "{summary:?}");
    assert_eq!(whole, files(&two));

    // What a kill leaves: the second block never finished, its samples half written, the shards and the manifest of before.
    let blocks = two.join(BLOCKS);
    std::fs::remove_file(blocks.join("block-00001.json")).unwrap();
    std::fs::write(blocks.join("block-00001.safetensors"), b"half").unwrap();
    std::fs::remove_file(two.join("train-000.safetensors")).unwrap();
    let summary = run(&order(12, 2), &two);
    assert_eq!(summary.computed, 4, "only the block that was not finished is computed");
    assert_eq!(whole, files(&two));

    // And nothing is computed when nothing is missing.
    assert_eq!(run(&order(12, 1), &two).computed, 0);
    assert_eq!(whole, files(&two));

    // More paths keep those that are there.
    let more = run(&order(20, 2), &two);
    assert_eq!(more.computed, 12, "the last block had four of its eight paths");
    let (few, many) = (samples(&one), samples(&two));
    assert!(few.iter().all(|sample| many.contains(sample)) && many.len() > few.len());
    let identities: BTreeSet<(u32, u32)> = many.iter().map(|sample| (sample.path, sample.step)).collect();
    assert_eq!(identities.len(), many.len(), "no sample is there twice");
}

#[test]
fn another_seed_is_refused_and_gives_other_data() {
    let place = folder("seeds");
    run(&order(8, 2), &place);
    let other = Order { seed: 6, ..order(8, 2) };
    let error = generate(&other, &place, &ProgressBar::hidden()).unwrap_err();
    assert!(matches!(error, DatasetError::OtherSettings { field: "seed", .. }), "{error}");
    let (light, edged) = (Order { depths: Depths::Light, ..order(8, 2) }, Order { tips: Tips::Edged, ..order(8, 2) });
    for (otherwise, setting) in [(light, "depths"), (edged, "tips")] {
        let error = generate(&otherwise, &place, &ProgressBar::hidden()).unwrap_err();
        assert!(matches!(error, DatasetError::OtherSettings { field, .. } if field == setting), "{error}");
    }
    let another = folder("other-seed");
    run(&other, &another);
    assert_ne!(samples(&place), samples(&another));
}

#[test]
fn what_cannot_be_is_named() {
    let place = folder("refusals");
    for (order, field) in [
        (Order { scene: "cornea".to_owned(), ..order(8, 1) }, "scene"),
        (order(0, 1), "paths"),
        (order(8, 0), "threads"),
    ] {
        let error = generate(&order, &place, &ProgressBar::hidden()).unwrap_err();
        assert!(matches!(error, DatasetError::Value { field: named, .. } if named == field), "{error}");
    }
    assert!(files(&place).is_empty(), "a refused order leaves nothing");
}

#[test]
fn samples_obey_the_laws_of_their_equilibrium() {
    let place = folder("laws");
    let summary = run(&order(16, 2), &place);
    let samples = samples(&place);
    assert!(samples.len() > 48, "{summary:?}");
    let dot = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f32>();
    for sample in &samples {
        assert!(sample.force_mn > 0.0);
        let along = -dot(&sample.truth.reaction_mn, &sample.direction);
        assert!((along - sample.force_mn).abs() <= 1e-6 * sample.force_mn.max(1.0), "{along} {}", sample.force_mn);
        assert!(sample.truth.travel_mm > sample.touch_travel_mm && sample.touch_travel_mm >= -1e-6);
        assert!((dot(&sample.direction, &sample.direction) - 1.0).abs() < 1e-6);
        assert!(dot(&sample.direction, &sample.inward) > 0.25);
        let numbers = sample.truth.displacement_mm.as_flattened();
        assert!(numbers.iter().all(|number| number.is_finite()) && numbers.iter().any(|number| number.abs() > 1e-4));
    }
    for path in samples.chunk_by(|a, b| a.path == b.path) {
        for pair in path.windows(2) {
            assert!(pair[1].step == pair[0].step + 1 && pair[1].truth.travel_mm > pair[0].truth.travel_mm);
            assert!(pair[1].force_mn > pair[0].force_mn, "path {}: deeper takes more force", pair[0].path);
        }
    }
}

#[test]
fn pushed_with_the_force_of_a_step_the_needle_stops_at_its_travel() {
    let plan = (0..).find_map(|path| {
        plan(5, path, &[1], Depths::Deep, Tips::All).filter(|plan| plan.needle.shape.tip == Tip::Hemispherical)
    });
    let plan = plan.unwrap();
    let scene = PreparedScene::new(plan.scene.clone()).unwrap();
    let mut held = Indentation::new(&scene, plan.needle, plan.direction, TRUTH).unwrap();
    let touch_mm = touch_travel_mm(&plan);
    let mut memory = Memory::default();
    let step = held.advance(touch_mm + 0.1, &mut memory, &mut Silent).unwrap().unwrap();
    let force_mn = -step.reaction_mn.dot(&plan.direction);
    let pushed = |share: f64| {
        let request = Request {
            needle: plan.needle,
            control: Control::Force(plan.direction.into_inner() * (share * force_mn)),
            level: Level::Reference,
            effects: EffectChoice::Named(EFFECTS.map(str::to_owned).to_vec()),
        };
        let answer = scene.predict_at(&request, &TRUTH, &mut Workspace::default(), &mut Silent).unwrap();
        (answer.needle.travel_mm - touch_mm) / 0.1 - 1.0
    };
    // The two lay their meshes around contacts that `coarse` finds at its own travel and at its own force.
    let off = pushed(1.0);
    assert!(off.abs() < 0.1 * DISCRETISATION, "{off}");
    assert!(pushed(1.3) > off + DISCRETISATION, "more force goes deeper");
}

fn touch_travel_mm(plan: &PathPlan) -> f64 {
    let patch = plan.scene.patch(&Point3::origin()).unwrap();
    let pose = plan.needle.scene_from_needle();
    first_touch(&patch.surface, &plan.needle.shape.body(), &pose, &plan.direction).unwrap().travel_mm
}

#[test]
fn a_path_ends_where_it_takes_no_more_force() {
    let place = folder("limit-point");
    run(&order(8, 2), &place);
    let mut path: Vec<Sample> = samples(&place).into_iter().filter(|sample| sample.path == 0).collect();
    assert_eq!(before_limit_point(&path), path.len());
    assert!(path.len() > 3);
    path[3].force_mn = path[2].force_mn;
    assert_eq!(before_limit_point(&path), 3);
    assert_eq!(before_limit_point(&[]), 0);
}

#[test]
fn paths_belong_to_one_split_and_splits_to_their_ranges() {
    let mut counts = BTreeMap::new();
    for path in 0..3000 {
        let light = plan(1, path, &[0, 1, 2], Depths::Light, Tips::All).unwrap();
        let edged = plan(1, path, &[0, 1, 2], Depths::Deep, Tips::Edged).unwrap();
        assert!(edged.needle.shape.tip != Tip::Hemispherical);
        let plan = plan(1, path, &[0, 1, 2], Depths::Deep, Tips::All).unwrap();
        *counts.entry(plan.split).or_insert(0) += 1;
        plan.scene.validate().unwrap();
        plan.needle.validate().unwrap();
        let tilt = 180.0 - plan.needle.direction().z.acos().to_degrees();
        assert!(plan.depth_shares.is_sorted() && plan.depth_shares[STEPS - 1] <= 1.0);
        // The same path otherwise.
        assert!(edged.scene == plan.scene && edged.needle.shape.radius_mm == plan.needle.shape.radius_mm);
        assert!(light.needle == plan.needle && light.scene == plan.scene);
        assert!(light.depth_shares.is_sorted() && light.depth_shares[STEPS - 1] < plan.depth_shares[STEPS - 1]);
        assert!(light.depth_shares[0] >= LIGHT_SHARE[0] * (1.0 - 1e-9));
        match plan.split {
            Split::Outside => assert!(sampled::has_scene(&plan.scene)),
            Split::Hard => assert!(!plan.default_tissue && !sampled::has_scene(&plan.scene)),
            _ => {
                assert!(sampled::has_scene(&plan.scene) && sampled::has_needle(&plan.needle.shape));
                assert!((sampled::TILT_DEG[0]..=sampled::TILT_DEG[1] + 1e-9).contains(&tilt), "{tilt}");
            }
        }
    }
    for (split, share) in Split::ALL.iter().zip(retina_models::dataset::draw::SPLIT_SHARES) {
        let found = f64::from(counts[split]) / 3000.0;
        assert!((found - share).abs() < 0.03, "{}: {found}", split.name());
    }
}

#[test]
fn a_shard_comes_back_as_it_was_and_a_corrupt_one_is_an_error() {
    let place = folder("shards");
    run(&order(8, 2), &place);
    let samples = samples(&place);
    let file = place.join("again.safetensors");
    shard::write(&file, &samples).unwrap();
    assert_eq!(shard::read(&file).unwrap(), samples);

    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 7]).unwrap();
    assert!(matches!(shard::read(&file), Err(ShardError::Format { .. })));
    assert!(matches!(shard::read(&place.join("none.safetensors")), Err(ShardError::Io { .. })));

    // One bit of a finished block: found by its hash, named, and not used.
    let block = place.join(BLOCKS).join("block-00000.safetensors");
    let mut bytes = std::fs::read(&block).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(&block, bytes).unwrap();
    let error = generate(&order(8, 2), &place, &ProgressBar::hidden()).unwrap_err();
    assert!(matches!(&error, DatasetError::Malformed { path, .. } if path.contains("block-00000")), "{error}");
}

#[test]
fn the_papers_layout_comes_back_as_it_was() {
    let (place, exported) = (folder("papers"), folder("exported"));
    run(&Order { scene: "macula".to_owned(), ..order(8, 2) }, &place);
    let samples = samples(&place);
    assert_eq!(export(&samples, &exported).unwrap(), samples.len());
    let back = import(&exported.join("macula")).unwrap();
    let mut expected: Vec<ContactSample> = samples.iter().map(ContactSample::of).collect();
    expected.sort_by(|a, b| a.name.cmp(&b.name));
    assert_eq!(back, expected);
    // The tool's cylinder ends at the tip and points where the needle does.
    let first = &back[0];
    let length = (0..3).map(|k| (first.tip_mm[k] - first.shaft_mm[k]).powi(2)).sum::<f32>().sqrt();
    assert!((length - retina_models::dataset::deformcontact::SHAFT_MM).abs() < 1e-4);

    let json = exported.join("macula").join(format!("{}.json", first.name));
    let text = std::fs::read_to_string(&json).unwrap().replace("forceDirectionY", "forceDirectionQ");
    std::fs::write(&json, text).unwrap();
    let error = import(&exported.join("macula")).unwrap_err().to_string();
    assert!(error.contains("forceDirectionY") && error.contains(&first.name), "{error}");
}
