//! Recordings written, then read back with rerun's own reader.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};

use clap::Parser as _;
use indicatif::ProgressBar;
use rerun::{ChunkStore, ChunkStoreConfig, EntityPath};
use retina_core::needle::NeedleShape;
use retina_server::config::{Command, CommandLine, ReviewArgs};
use retina_server::recording::needle_mesh::{NeedleMesh, SHAFT_MM};
use retina_server::recording::{self, Destination, RecordingError};
use retina_server::review::{self, ReviewError};

use super::{PATIENCE, ask, questions, service};

/// A file that is deleted when dropped.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("retina-{}-{name}.rrd", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// For each entity of the recording its timelines and how many rows it has; and whether the file brings a blueprint.
struct Contents {
    rows: BTreeMap<String, u64>,
    timelines: BTreeSet<String>,
    has_blueprint: bool,
}

impl Contents {
    fn read(path: &Path) -> Self {
        let mut file = File::open(path).expect("a recording");
        let stores = ChunkStore::from_rrd_reader(&ChunkStoreConfig::default(), &mut file).expect("readable");
        let mut contents = Self { rows: BTreeMap::new(), timelines: BTreeSet::new(), has_blueprint: false };
        for (id, store) in &stores {
            contents.has_blueprint |= id.is_blueprint();
            for chunk in store.iter_physical_chunks().filter(|_| id.is_recording()) {
                *contents.rows.entry(chunk.entity_path().to_string()).or_default() += chunk.num_rows() as u64;
                contents.timelines.extend(chunk.timelines().keys().map(ToString::to_string));
            }
        }
        contents
    }

    fn rows(&self, entity: &str) -> u64 {
        let known = EntityPath::parse_forgiving(entity).to_string();
        *self.rows.get(&known).unwrap_or_else(|| panic!("no {known} among {:?}", self.rows.keys()))
    }
}

fn review_args(path: &Path, more: &[&str]) -> ReviewArgs {
    let words = ["retina-server", "review", "--scene", "flat", "--seed", "3", "--save", path.to_str().expect("UTF-8")];
    match CommandLine::try_parse_from(words.iter().chain(more)).expect("arguments").command {
        Some(Command::Review(args)) => args,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_review_is_read_back_with_every_entity() {
    let file = Scratch::new("review");
    let args = review_args(&file.0, &["--count", "2", "--tip", "hemispherical"]);
    let tally = review::run(&args, &|| false, &ProgressBar::hidden()).expect("a review");
    assert_eq!((tally.compared(), tally.failures().len()), (2, 0), "{tally}");
    let contents = Contents::read(&file.0);
    assert!(contents.has_blueprint);
    assert_eq!(contents.timelines, BTreeSet::from(["sample".to_owned()]));
    for root in ["predicted", "ground_truth"] {
        for part in ["surface", "edges", "rest", "force_1_mm_per_mN", "reaction_1_mm_per_mN", "scale"] {
            assert_eq!(contents.rows(&format!("/{root}/{part}")), 2, "{root}/{part}");
        }
        // A pose for each sample, and the triangles when the needle changes.
        assert!(contents.rows(&format!("/{root}/needle")) >= 3);
    }
    for entity in ["error/surface", "error/edges", "error/arrows_x50", "error/scale", "request"] {
        assert_eq!(contents.rows(&format!("/{entity}")), 2, "{entity}");
    }
    // A series has a row for its looks besides, static, in two parts.
    for entity in ["statistics/mean", "statistics/p99", "statistics/max", "displacement/largest", "time/predicted_ms"] {
        assert!(contents.rows(&format!("/{entity}")) >= 3, "{entity}");
    }
}

#[test]
fn a_review_that_is_stopped_leaves_a_file_that_opens() {
    let file = Scratch::new("stopped");
    let args = review_args(&file.0, &["--count", "9"]);
    let tally = review::run(&args, &|| true, &ProgressBar::hidden()).expect("a review");
    assert_eq!(tally.compared(), 0);
    assert!(tally.to_string().contains("interrupted"), "{tally}");
    assert!(Contents::read(&file.0).has_blueprint);
}

#[test]
fn a_review_says_what_is_wrong_with_its_arguments() {
    let args = review_args(Path::new("/nowhere/at/all.rrd"), &["--count", "1"]);
    let error = review::run(&args, &|| false, &ProgressBar::hidden()).expect_err("no such folder");
    assert!(matches!(error, ReviewError::Recording(RecordingError::Open { .. })), "{error}");
    assert!(error.to_string().contains("/nowhere/at/all.rrd"), "{error}");
    let args = ReviewArgs { scene: "moon".to_owned(), ..args };
    let error = review::run(&args, &|| false, &ProgressBar::hidden()).expect_err("no such scene");
    assert!(error.to_string().contains("macula"), "{error}");
}

#[test]
fn a_service_is_read_back_by_request_and_by_the_clock() {
    let file = Scratch::new("service");
    let recorder = recording::start(&Destination::File(file.0.clone())).expect("a recorder");
    let state = service(Some(recorder.clone()));
    for question in questions() {
        ask(&state, question);
    }
    let totals = recorder.finish(PATIENCE);
    assert_eq!((totals.written, totals.dropped, totals.failed, totals.closed), (4, 0, 0, true));
    // The service still holds its end of the recording; the file must be whole all the same.
    let contents = Contents::read(&file.0);
    drop(state);
    assert!(contents.has_blueprint);
    assert_eq!(contents.timelines, BTreeSet::from(["request".to_owned(), "wall_time".to_owned()]));
    assert_eq!(contents.rows("/request"), 4);
    assert_eq!(contents.rows("/answer/surface"), 2);
    assert_eq!(contents.rows("/failures"), 2);
}

#[test]
fn a_viewer_needs_an_address() {
    let Err(error) = recording::start(&Destination::Viewer("nonsense".to_owned())) else { panic!("no address") };
    assert!(error.to_string().contains("nonsense"), "{error}");
}

#[test]
fn a_drawn_needle_is_the_needle() {
    for shape in [NeedleShape::hemispherical(0.25), NeedleShape::flat(0.25), NeedleShape::bevelled(0.25)] {
        let (mesh, body) = (NeedleMesh::new(&shape), shape.body());
        for (vertex, normal) in mesh.vertices.iter().zip(&mesh.normals) {
            let lid = vertex.z == SHAFT_MM;
            assert!(lid || body.distance(vertex).abs() < 1e-5, "{shape:?}: {vertex} is {}", body.distance(vertex));
            let outwards = body.distance(&(vertex + normal * 1e-3));
            assert!(outwards > 0.0 || lid, "{shape:?}: the normal at {vertex} points inwards");
            assert!((normal.norm() - 1.0).abs() < 1e-9);
        }
        // Outward triangles: the enclosed volume, from the divergence theorem, is positive and near that of the shaft, of which the
        // bevel's cut takes 29 %.
        let corner = |index: u32| mesh.vertices[index as usize].coords;
        let volume: f64 =
            mesh.triangles.iter().map(|t| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2]))) / 6.0).sum();
        let shaft = std::f64::consts::PI * shape.radius_mm * shape.radius_mm * SHAFT_MM;
        assert!(volume > 0.65 * shaft && volume < shaft, "{shape:?}: {volume} of {shaft}");
        let lowest = mesh.vertices.iter().map(|vertex| vertex.z).fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 2e-3, "{shape:?}: the tip is at {lowest}");
    }
}
