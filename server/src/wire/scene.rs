//! A scene written out: surface, tissue and placement.
//!
//! Contract: every part and every number may be left out; what then holds is said field by field and listed with ranges and sources
//! by `GET /v1/scenes`. Written and read by the same types, so a scene of that list can be sent back as it stands.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::fixed::{Quaternion, Triangle, Vector};
use super::object;

/// A scene written out.
#[derive(Clone, Debug, Default, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// The inner surface of the retina at rest; a sphere of 12 mm radius when left out.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceSpec>,
    /// The layers under it; retina on choroid on sclera with their defaults when left out.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub tissue: Option<TissueSpec>,
    /// Where the patch stands in the scene frame; the identity when left out. Refused for a mesh, which places its own patch.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseSpec>,
    /// Coulomb's coefficient of friction between needle and retina, 0 to 2; 0 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_coefficient: Option<f64>,
    /// Pressure in the eye, kPa (1 mmHg is 0.1333 kPa), 0 to 8; 2.07 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_kpa: Option<f64>,
    /// Pressure in the eye when the surface was measured, kPa, 0 to 8; 2.07 when left out. The difference of the two presses on the surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_pressure_kpa: Option<f64>,
    /// Where the tissue punctures; the limits of the tissue model when left out.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub puncture: Option<PunctureSpec>,
    /// Fluid between retina and choroid; none when left out. Levels `coarse` and `reference` have it.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub bleb: Option<BlebSpec>,
}

/// Fluid between retina and choroid, where the retina is detached. Displacements are those from the surface without it.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BlebSpec {
    /// Volume, mm³ (the same number in µl), 0 to 0.5; the pressure is then part of the answer. It or `pressure_kpa` must be given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_mm3: Option<f64>,
    /// Pressure above that in the eye, kPa, 0 to 8; the volume is then part of the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_kpa: Option<f64>,
    /// Centre of the detached disc, scene frame, mm; that of the patch when left out. Its depth does not matter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center_mm: Option<Vector>,
    /// Radius of the detached disc, mm, 0.2 to 1; 0.5 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
}

/// How much fluid there is on the scene's detached disc: one of the two.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FillingSpec {
    /// Volume, mm³ (the same number in µl), 0 to 0.5; the pressure is then part of the answer. At 0 the detached retina lies on what is below.
    pub volume_mm3: Option<f64>,
    /// Pressure above that in the eye, kPa, 0 to 8; the volume is then part of the answer.
    pub pressure_kpa: Option<f64>,
}

/// Where the tissue punctures: an answer beyond a limit says so, by its contact's state. A number left out is the default.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PunctureSpec {
    /// Force over the needle's cross-section, in Young's moduli of the softest retina, 0.005 to 0.75; 0.75 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_per_modulus: Option<f64>,
    /// Force under the needle, mN, 0.001 to 100; in place of `pressure_per_modulus`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_force_mn: Option<f64>,
    /// Largest principal stretch less one, in magnitude, 0.01 to 5; 1 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_strain: Option<f64>,
}

/// What a surface is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceKind {
    /// A plane.
    Flat,
    /// A ball seen from inside.
    Sphere,
    /// A ball seen from inside with a foveal pit.
    FovealPit,
    /// Triangles in the scene frame; the 64 vertices nearest to the contact are the nodes.
    Mesh,
}

/// The inner surface of the retina at rest. A field that does not belong to the kind is refused.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"kind": "foveal_pit", "radius_mm": 12.0, "depth_mm": 0.1, "sigma_mm": 0.25}))]
pub struct SurfaceSpec {
    /// What it is.
    pub kind: SurfaceKind,
    /// `sphere`, `foveal_pit`: radius of the eye at the inner surface, mm; 12 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// `foveal_pit`: how much thinner the retina is at the floor of the pit, mm; 0.13 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// `foveal_pit`: standard deviation of the pit's bell, mm; 0.25 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_mm: Option<f64>,
    /// `mesh`: vertices, scene frame, mm; together with `triangles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices_mm: Option<Vec<Vector>>,
    /// `mesh`: triangles, counter-clockwise seen from the vitreous.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<Vec<Triangle>>,
    /// `mesh`: the text of an OBJ file in mm, in place of `vertices_mm` and `triangles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub obj: Option<String>,
    /// `mesh`: the text of an ASCII PLY file in mm, in place of `vertices_mm` and `triangles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ply: Option<String>,
    /// `mesh`: the text of an ASCII STL file in mm, in place of `vertices_mm` and `triangles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stl: Option<String>,
}

impl SurfaceSpec {
    /// A surface of that kind and nothing said of it.
    pub fn of_kind(kind: SurfaceKind) -> Self {
        Self {
            kind,
            radius_mm: None,
            depth_mm: None,
            sigma_mm: None,
            vertices_mm: None,
            triangles: None,
            obj: None,
            ply: None,
            stl: None,
        }
    }
}

/// The layers of the eye wall, from the vitreous outwards.
#[derive(Clone, Debug, Default, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TissueSpec {
    /// The membrane between vitreous and retina; none when left out, the default one for `{}`.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub inner_limiting_membrane: Option<LayerSpec>,
    /// The retina as one layer, or its sublayers from the vitreous outwards.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retina: Option<RetinaSpec>,
    /// Choroid with Bruch's membrane and the pigment epithelium.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub choroid: Option<LayerSpec>,
    /// Sclera.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub sclera: Option<LayerSpec>,
    /// The bond between retina and choroid.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub bond: Option<BondSpec>,
    /// What of the tissue depends on time; read by `POST /v1/simulate` alone.
    #[serde(default, deserialize_with = "object::optional", skip_serializing_if = "Option::is_none")]
    pub rate: Option<RateSpec>,
}

/// How the retina holds on to the pigment epithelium under it; a number left out is the default.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BondSpec {
    /// Largest traction, kPa, 1 to 100; 40 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength_kpa: Option<f64>,
    /// Energy that letting go costs, mN/mm (the same number in N/m), 0.06 to 0.6; 0.14 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy_mn_per_mm: Option<f64>,
    /// Power with which both grow with the speed of opening, 0 to 0.6; 0 (they do not) when left out. Read by `POST /v1/simulate` alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_exponent: Option<f64>,
    /// Speed of opening from about which on they grow, mm/s, 1e-6 to 100; 0.01 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_speed_mm_per_s: Option<f64>,
}

/// What of the tissue depends on time; a number left out is its default.
#[derive(Clone, Debug, Default, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RateSpec {
    /// Prony series of the retina's shear modulus above the lasting one, which is that of the layer; seven terms when left out, none for `[]`.
    #[serde(default, deserialize_with = "object::optional_list", skip_serializing_if = "Option::is_none")]
    pub retina_relaxation: Option<Vec<PronyTermSpec>>,
    /// Density of every layer, kg/mm³.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_kg_per_mm3: Option<f64>,
    /// Pressure of the vitreous on the surface for its velocity, kPa·s/mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vitreous_drag_kpa_s_per_mm: Option<f64>,
}

/// One term of a Prony series.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PronyTermSpec {
    /// Relaxation time, s.
    pub relaxation_time_s: f64,
    /// Share of the instantaneous shear modulus that relaxes with it; all shares together leave the lasting one.
    pub share: f64,
}

/// The retina as one layer or as several.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum RetinaSpec {
    /// One layer.
    Whole(LayerSpec),
    /// Sublayers from the vitreous outwards.
    Sublayers(Vec<LayerSpec>),
}

/// One homogeneous, isotropic elastic layer; a number left out is that of the layer's default.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerSpec {
    /// Thickness along the inward normal, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness_mm: Option<f64>,
    /// Young's modulus at small strain, kPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub youngs_modulus_kpa: Option<f64>,
    /// Poisson's ratio, 0 to 0.4999.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<f64>,
}

/// Where the patch of an analytic surface stands in the scene.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseSpec {
    /// Origin of the patch frame, scene frame, mm; the scene's origin when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<Vector>,
    /// Rotation from the patch's frame to the scene's, as x, y, z, w; none when left out. Its length may differ from 1 by 0.001.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation_xyzw: Option<Quaternion>,
}
