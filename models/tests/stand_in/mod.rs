//! Samples for tests, made in seconds: the core's own levels, with `coarse` in place of the converged truth.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use retina_core::equilibrium::{Motion, Tool};
use retina_core::needle::{Needle, NeedleShape, Tip};
use retina_core::patch::{Patch, vertex_normals};
use retina_core::predict::beds::Beds;
use retina_core::predict::linear::{LinearAnswer, press};
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_models::sample::{Field, LevelAnswer, Sample, Split, TipShape, TissueNumbers};

/// Random samples over the built-in scenes.
pub struct StandIn {
    scenes: Vec<(PreparedScene, Beds, Patch)>,
    random: fastrand::Rng,
    workspace: Workspace,
}

fn three(v: Vector3<f64>) -> [f32; 3] {
    v.cast::<f32>().into()
}

fn field(vectors: impl Iterator<Item = Vector3<f64>>) -> Field {
    let vectors: Vec<[f32; 3]> = vectors.map(three).collect();
    vectors.try_into().unwrap()
}

impl StandIn {
    /// Samples that follow from `seed`.
    pub fn new(seed: u64) -> Self {
        let prepared = |name: &&str| {
            let scene = Scene::built_in(name).unwrap();
            let patch = scene.patch(&Point3::origin()).unwrap();
            let beds = Beds::new(&scene);
            (PreparedScene::new(scene).unwrap(), beds, patch)
        };
        StandIn {
            scenes: Scene::built_in_names().iter().map(prepared).collect(),
            random: fastrand::Rng::with_seed(seed),
            workspace: Workspace::default(),
        }
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.f64()
    }

    /// The next sample, of path `path`.
    pub fn sample(&mut self, path: u32, split: Split) -> Sample {
        loop {
            let scene = self.random.usize(0..self.scenes.len());
            let request = self.request();
            if let Ok(sample) = self.answered(&request, scene, path, split) {
                return sample;
            }
        }
    }

    fn request(&mut self) -> Request {
        let radius_mm = self.between(0.05, 0.32);
        let shape = match self.random.u8(0..4) {
            0 => NeedleShape::flat(radius_mm),
            1 => NeedleShape::bevelled(radius_mm),
            _ => NeedleShape::hemispherical(radius_mm),
        };
        let (tilt, azimuth) = (self.between(0.0, 1.0), self.between(0.0, TAU));
        let points =
            Unit::new_normalize(Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), -tilt.cos()));
        let tip = Point3::new(self.between(-0.8, 0.8), self.between(-0.8, 0.8), 0.1);
        let mut needle = Needle::pointing(shape, tip, &points);
        needle.orientation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.between(0.0, TAU));
        let (lean, side) = (self.between(0.0, 0.25), self.between(0.0, TAU));
        let across = needle.orientation * Vector3::new(side.cos(), side.sin(), 0.0);
        let direction = points.into_inner() * lean.cos() + across * lean.sin();
        let force = self.between(0.03_f64.ln(), 0.7_f64.ln()).exp() * 20.0 * PI * radius_mm * radius_mm;
        Request {
            needle,
            control: Control::Force(direction * force),
            level: Level::Linear,
            effects: EffectChoice::Auto,
        }
    }

    fn answered(&mut self, request: &Request, scene: usize, path: u32, split: Split) -> Result<Sample, PredictError> {
        let StandIn { scenes, workspace, .. } = self;
        let (prepared, beds, patch) = &scenes[scene];
        let Control::Force(force) = request.control else { unreachable!() };
        let at = |level| Request { level, ..request.clone() };
        let linear = prepared.predict(&at(Level::Linear), workspace, &mut Silent)?;
        let coarse = prepared.predict(&at(Level::Coarse), workspace, &mut Silent)?;
        let body = request.needle.shape.body();
        let tool =
            Tool { body: &body, patch_from_needle: request.needle.scene_from_needle(), stiffness_mn_per_mm: None };
        let direction = Unit::new_normalize(force);
        let motion = Motion { direction, force_mn: Some(force.norm()), travel_mm: 0.0 };
        let pressing = press(patch, &tool, &motion)?;
        let bed = LinearAnswer::new(beds, patch, &tool, request.needle.shape.tip, pressing, &direction)?;
        let tissue = &prepared.scene().tissue;
        let layers = [&tissue.retina[0], &tissue.choroid, &tissue.sclera];
        let [x, y] = bed.press.touch.parameter;
        let touched = patch.surface.column(x, y);
        let mut thickness_mm = layers.map(|layer| layer.thickness_mm as f32);
        thickness_mm[0] -= touched.retina_thinning_mm as f32;
        let answer = |prediction: &Prediction| LevelAnswer {
            displacement_mm: field(prediction.vertices.iter().zip(&patch.vertices).map(|(v, rest)| v - rest)),
            travel_mm: prediction.needle.travel_mm as f32,
            reaction_mn: three(prediction.needle.reaction_mn),
        };
        let tip = request.needle.shape.tip;
        Ok(Sample {
            path,
            step: 0,
            split,
            scene: scene as u8,
            rest_mm: field(patch.vertices.iter().map(|vertex| vertex.coords)),
            rest_normal: field(vertex_normals(&patch.vertices, &patch.triangles).into_iter()),
            tip: TipShape {
                kind: tip.kind() as u8,
                radius_mm: request.needle.shape.radius_mm as f32,
                edge_radius_mm: request.needle.shape.edge_radius_mm() as f32,
                bevel_deg: if let Tip::Bevelled { angle_deg, .. } = tip { angle_deg as f32 } else { 90.0 },
            },
            tip_mm: three(request.needle.tip_mm.coords),
            orientation_xyzw: request.needle.orientation.coords.cast::<f32>().into(),
            direction: three(direction.into_inner()),
            force_mn: force.norm() as f32,
            tissue: TissueNumbers {
                thickness_mm,
                youngs_modulus_kpa: layers.map(|layer| layer.youngs_modulus_kpa as f32),
                poisson_ratio: layers.map(|layer| layer.poisson_ratio as f32),
            },
            touch_mm: three(touched.surface.coords),
            inward: three(bed.press.touch.inward.into_inner()),
            touch_travel_mm: bed.press.touch.travel_mm as f32,
            linear_center_mm: three(patch.surface.column(bed.center[0], bed.center[1]).surface.coords),
            linear_depth_mm: bed.depth_mm as f32,
            linear_contact_radius_mm: bed.contact_radius_mm as f32,
            linear_pressure_kpa: bed.max_pressure_kpa as f32,
            linear: answer(&linear),
            coarse: Some(answer(&coarse)),
            truth: answer(&coarse),
            truth_error_mm: 0.0,
        })
    }
}
