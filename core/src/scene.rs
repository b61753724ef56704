//! A scene: a surface with the tissue under it, placed in the scene frame.
//!
//! Contract: a scene does not change during a prediction. The built-in ones stand at the origin, so their patch frame is the scene
//! frame. Units: mm, kPa.
//!
//! Not here: the needle and its force (they come with each request), effects, the ranges of pressure and friction (`conditions`), where the tissue
//! punctures (`puncture`), the numbers of the fluid (`bleb`).

pub mod bleb;
pub mod conditions;
pub mod puncture;

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};

use crate::needle::{ORIENTATION_NORM, TIP_COORDINATE};
use crate::patch::{Patch, PatchError};
use crate::range::{OutOfRange, ParameterRange};
use crate::surface::{EYE_RADIUS, PIT_DEPTH, PIT_SIGMA, Surface, TriangleMesh};
use crate::tissue::Tissue;
use bleb::SubretinalFluid;
use conditions::{EYE_PRESSURE, FRICTION_COEFFICIENT};
use puncture::Puncture;

/// Thickness of the retina around the built-in fovea, mm: its thickest by the source of [`PIT_DEPTH`], so the floor is 0.10 mm.
pub const FOVEA_RETINA_MM: f64 = 0.23;

/// The retina that a pit must leave, mm; (unverified) bound of this program, half of the foveola's 0.10 mm.
pub const LEAST_PIT_FLOOR_MM: f64 = 0.05;

const BUILT_IN: [&str; 3] = ["flat", "macula", "fovea"];

/// The inner surface of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum SceneSurface {
    /// A plane.
    Flat,
    /// A ball seen from inside.
    Sphere {
        /// Radius at the inner surface, mm.
        radius_mm: f64,
    },
    /// A ball seen from inside with a foveal pit.
    FovealPit {
        /// Radius at the inner surface without the pit, mm.
        radius_mm: f64,
        /// Depth of the pit, mm.
        depth_mm: f64,
        /// Standard deviation of the pit's bell, mm.
        sigma_mm: f64,
    },
    /// A mesh in scene coordinates; the patch is cut where the needle meets it.
    Mesh(Arc<TriangleMesh>),
}

/// What a needle can be pushed into.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name by which people call it.
    pub name: String,
    /// The inner surface of the retina at rest.
    pub surface: SceneSurface,
    /// The layers under it.
    pub tissue: Tissue,
    /// Where the patch of an analytic surface stands: takes patch to scene coordinates, mm. A mesh places its own patch.
    pub scene_from_patch: Isometry3<f64>,
    /// Coulomb's coefficient between needle and retina, a pure number.
    pub friction_coefficient: f64,
    /// Pressure in the eye, kPa.
    pub pressure_kpa: f64,
    /// Pressure in the eye when the surface was measured, kPa.
    pub rest_pressure_kpa: f64,
    /// Where the tissue punctures.
    pub puncture: Puncture,
    /// Fluid under the retina.
    pub bleb: Option<SubretinalFluid>,
}

impl Scene {
    /// The scene of that name, `None` for a name that is not one of [`built_in_names`](Self::built_in_names).
    pub fn built_in(name: &str) -> Option<Self> {
        let mut tissue = Tissue::default();
        let radius_mm = EYE_RADIUS.default;
        let surface = match name {
            "flat" => SceneSurface::Flat,
            "macula" => SceneSurface::Sphere { radius_mm },
            "fovea" => {
                tissue.retina[0].thickness_mm = FOVEA_RETINA_MM;
                SceneSurface::FovealPit { radius_mm, depth_mm: PIT_DEPTH.default, sigma_mm: PIT_SIGMA.default }
            }
            _ => return None,
        };
        Some(Self {
            name: name.to_owned(),
            surface,
            tissue,
            scene_from_patch: Isometry3::identity(),
            friction_coefficient: FRICTION_COEFFICIENT.default,
            pressure_kpa: EYE_PRESSURE.default,
            rest_pressure_kpa: EYE_PRESSURE.default,
            puncture: Puncture::default(),
            bleb: None,
        })
    }

    /// Names of the built-in scenes: a plane, the macula as a part of the eye's ball, and the foveal pit.
    pub fn built_in_names() -> &'static [&'static str] {
        &BUILT_IN
    }

    /// Holds surface, tissue and placement against their ranges; fails with the first that is outside.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        self.tissue.validate()?;
        FRICTION_COEFFICIENT.check("friction_coefficient", self.friction_coefficient)?;
        EYE_PRESSURE.check("pressure_kpa", self.pressure_kpa)?;
        EYE_PRESSURE.check("rest_pressure_kpa", self.rest_pressure_kpa)?;
        self.puncture.validate()?;
        self.bleb.iter().try_for_each(SubretinalFluid::validate)?;
        match self.surface {
            SceneSurface::Flat | SceneSurface::Mesh(_) => {}
            SceneSurface::Sphere { radius_mm } => EYE_RADIUS.check("surface.radius_mm", radius_mm)?,
            SceneSurface::FovealPit { radius_mm, depth_mm, sigma_mm } => {
                EYE_RADIUS.check("surface.radius_mm", radius_mm)?;
                let deepest = PIT_DEPTH.max.min(self.tissue.retina_thickness_mm() - LEAST_PIT_FLOOR_MM);
                ParameterRange { max: deepest, ..PIT_DEPTH }.check("surface.depth_mm", depth_mm)?;
                PIT_SIGMA.check("surface.sigma_mm", sigma_mm)?;
            }
        }
        for (index, &coordinate) in self.scene_from_patch.translation.vector.iter().enumerate() {
            TIP_COORDINATE.check(&format!("scene_from_patch.translation_mm[{index}]"), coordinate)?;
        }
        let norm = self.scene_from_patch.rotation.quaternion().norm();
        ORIENTATION_NORM.check("scene_from_patch.rotation_xyzw", norm)
    }

    /// Change of the pressure since the surface was measured, kPa.
    pub fn pressure_change_kpa(&self) -> f64 {
        self.pressure_kpa - self.rest_pressure_kpa
    }

    /// The patch that a needle meets at a contact in scene coordinates, mm.
    ///
    /// An analytic surface has one patch wherever the contact is. A mesh is cut around it, which fails as [`Patch::cut`] says.
    pub fn patch(&self, contact_in_scene: &Point3<f64>) -> Result<Patch, PatchError> {
        let surface = match &self.surface {
            SceneSurface::Mesh(mesh) => return Patch::cut(mesh, contact_in_scene),
            SceneSurface::Flat => Surface::Flat,
            SceneSurface::Sphere { radius_mm } => Surface::Sphere { radius_mm: *radius_mm },
            SceneSurface::FovealPit { radius_mm, depth_mm, sigma_mm } => {
                Surface::FovealPit { radius_mm: *radius_mm, depth_mm: *depth_mm, sigma_mm: *sigma_mm }
            }
        };
        Ok(Patch::grid(surface, self.scene_from_patch))
    }
}
