//! A scene written out in a request.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use retina_core::scene::bleb::{self, Filling, SubretinalFluid};
use retina_core::scene::conditions::{EYE_PRESSURE, FRICTION_COEFFICIENT};
use retina_core::scene::puncture::{Puncture, PunctureForce};
use retina_core::scene::{Scene, SceneSurface};
use retina_core::surface::mesh_file::{MeshFormat, read_mesh};
use retina_core::surface::{EYE_RADIUS, MeshError, PIT_DEPTH, PIT_SIGMA, TriangleMesh};
use retina_core::tissue::ranges::{CHOROID, INNER_LIMITING_MEMBRANE, LayerRanges, RETINA, RETINA_SUBLAYER, SCLERA};
use retina_core::tissue::rate::{PronyTerm, RateProperties};
use retina_core::tissue::{Layer, RetinalBond, Tissue};

use super::{DEFAULT_SCENE, both, rotation, unknown_name};
use crate::problem::{Kind, Problem, from_out_of_range};
use crate::wire::fixed::{Triangle, Vector};
use crate::wire::request::SceneChoice;
use crate::wire::scene::{
    BlebSpec, BondSpec, FillingSpec, LayerSpec, PoseSpec, PronyTermSpec, PunctureSpec, RateSpec, RetinaSpec, SceneSpec,
    SurfaceKind, SurfaceSpec, TissueSpec,
};

/// Name of every scene that is written out.
const INLINE_NAME: &str = "inline";

/// The built-in scene of that name.
///
/// # Errors
/// [`Kind::UnknownName`] with the names that there are.
pub fn built_in(name: &str) -> Result<Scene, Problem> {
    Scene::built_in(name).ok_or_else(|| unknown_name("scene", name, Scene::built_in_names()))
}

/// The scene that a request chooses.
///
/// # Errors
/// A problem that names the field.
pub fn chosen(choice: Option<&SceneChoice>) -> Result<Scene, Problem> {
    match choice {
        None => built_in(DEFAULT_SCENE),
        Some(SceneChoice::Name(name)) => built_in(name),
        Some(SceneChoice::Inline(spec)) => scene(spec),
    }
}

/// The core's scene, inside its ranges.
///
/// # Errors
/// A problem that names the field.
pub fn scene(spec: &SceneSpec) -> Result<Scene, Problem> {
    let surface = spec.surface.as_ref().map_or(Ok(SceneSurface::Sphere { radius_mm: EYE_RADIUS.default }), surface)?;
    on_surface(spec, surface)
}

/// As [`scene`], on the surface in a file that came beside the scene.
///
/// # Errors
/// A problem that names the field.
pub fn scene_on_file(spec: &SceneSpec, field: &str, bytes: &[u8], format: MeshFormat) -> Result<Scene, Problem> {
    if let Some(surface) = &spec.surface {
        let nothing_else = SurfaceSpec::of_kind(SurfaceKind::Mesh);
        if *surface != nothing_else {
            return Err(both("scene.surface", field));
        }
    }
    on_surface(spec, SceneSurface::Mesh(Arc::new(mesh_file(field, bytes, format)?)))
}

fn on_surface(spec: &SceneSpec, surface: SceneSurface) -> Result<Scene, Problem> {
    if let (SceneSurface::Mesh(_), Some(_)) = (&surface, &spec.pose) {
        return Err(misplaced("scene.pose", "a mesh, which places its own patch"));
    }
    let scene = Scene {
        name: INLINE_NAME.to_owned(),
        surface,
        tissue: spec.tissue.as_ref().map_or_else(Tissue::default, tissue),
        scene_from_patch: spec.pose.as_ref().map_or(Ok(Isometry3::identity()), pose)?,
        friction_coefficient: spec.friction_coefficient.unwrap_or(FRICTION_COEFFICIENT.default),
        pressure_kpa: spec.pressure_kpa.unwrap_or(EYE_PRESSURE.default),
        rest_pressure_kpa: spec.rest_pressure_kpa.unwrap_or(EYE_PRESSURE.default),
        puncture: puncture(&spec.puncture.unwrap_or_default())?,
        bleb: None,
    };
    let bleb = spec.bleb.map(|spec| bleb(&spec, &scene.scene_from_patch)).transpose()?;
    let scene = Scene { bleb, ..scene };
    scene.validate().map_err(|error| from_out_of_range(field(&error.field, spec), &error))?;
    Ok(scene)
}

/// The path in the request of a field that the core names.
fn field(core: &str, spec: &SceneSpec) -> String {
    if let Some(index) = core.strip_prefix("scene_from_patch.translation_mm") {
        return format!("scene.pose.position_mm{index}");
    }
    let whole =
        matches!(spec.tissue.as_ref().and_then(|tissue| tissue.retina.as_ref()), None | Some(RetinaSpec::Whole(_)));
    match core.strip_prefix("tissue.retina[0]") {
        Some(number) if whole => format!("scene.tissue.retina{number}"),
        _ => format!("scene.{core}"),
    }
}

fn surface(spec: &SurfaceSpec) -> Result<SceneSurface, Problem> {
    let radius_mm = spec.radius_mm.unwrap_or(EYE_RADIUS.default);
    refuse_misplaced(spec)?;
    Ok(match spec.kind {
        SurfaceKind::Flat => SceneSurface::Flat,
        SurfaceKind::Sphere => SceneSurface::Sphere { radius_mm },
        SurfaceKind::FovealPit => SceneSurface::FovealPit {
            radius_mm,
            depth_mm: spec.depth_mm.unwrap_or(PIT_DEPTH.default),
            sigma_mm: spec.sigma_mm.unwrap_or(PIT_SIGMA.default),
        },
        SurfaceKind::Mesh => SceneSurface::Mesh(Arc::new(mesh(spec)?)),
    })
}

/// Refuses fields that do not belong to the kind: they would change nothing.
fn refuse_misplaced(spec: &SurfaceSpec) -> Result<(), Problem> {
    use SurfaceKind::{FovealPit, Mesh, Sphere};
    let fields: [(&str, bool, &[SurfaceKind]); 8] = [
        ("radius_mm", spec.radius_mm.is_some(), &[Sphere, FovealPit]),
        ("depth_mm", spec.depth_mm.is_some(), &[FovealPit]),
        ("sigma_mm", spec.sigma_mm.is_some(), &[FovealPit]),
        ("vertices_mm", spec.vertices_mm.is_some(), &[Mesh]),
        ("triangles", spec.triangles.is_some(), &[Mesh]),
        ("obj", spec.obj.is_some(), &[Mesh]),
        ("ply", spec.ply.is_some(), &[Mesh]),
        ("stl", spec.stl.is_some(), &[Mesh]),
    ];
    let kind = match spec.kind {
        SurfaceKind::Flat => "flat",
        SurfaceKind::Sphere => "sphere",
        SurfaceKind::FovealPit => "foveal_pit",
        SurfaceKind::Mesh => "mesh",
    };
    for (name, given, kinds) in fields {
        if given && !kinds.contains(&spec.kind) {
            return Err(misplaced(&format!("scene.surface.{name}"), &format!("the kind {kind}")));
        }
    }
    Ok(())
}

fn mesh(spec: &SurfaceSpec) -> Result<TriangleMesh, Problem> {
    let files = [
        ("scene.surface.obj", &spec.obj, MeshFormat::Obj),
        ("scene.surface.ply", &spec.ply, MeshFormat::Ply),
        ("scene.surface.stl", &spec.stl, MeshFormat::Stl),
    ];
    let mut given = files.iter().filter_map(|(field, text, format)| Some((field, text.as_ref()?, format)));
    match (&spec.vertices_mm, &spec.triangles, given.next(), given.next()) {
        (Some(vertices), Some(triangles), None, None) => indexed(vertices, triangles),
        (None, None, Some((field, text, format)), None) => mesh_file(field, text.as_bytes(), *format),
        _ => Err(Problem::field(
            Kind::InvalidRequest,
            "scene.surface",
            None,
            "vertices_mm with triangles, or obj, or ply, or stl",
            "a mesh is given as vertices_mm with triangles, or as obj, or as ply, or as stl, and in one way only",
        )),
    }
}

fn indexed(vertices: &[Vector], triangles: &[Triangle]) -> Result<TriangleMesh, Problem> {
    let vertices = vertices.iter().map(|vertex| Point3::from(vertex.0)).collect();
    let triangles = triangles.iter().map(|triangle| triangle.0).collect();
    TriangleMesh::new(vertices, triangles).map_err(|error| {
        let field = match error {
            MeshError::Vertex { vertex, .. } => format!("scene.surface.vertices_mm[{vertex}]"),
            MeshError::DuplicateVertex { second, .. } => {
                format!("scene.surface.vertices_mm[{second}]")
            }
            MeshError::IndexOutOfRange { triangle, .. } | MeshError::NoArea { triangle } => {
                format!("scene.surface.triangles[{triangle}]")
            }
            MeshError::InconsistentOrientation { second, .. } => {
                format!("scene.surface.triangles[{second}]")
            }
        };
        let allowed = "distinct vertices, triangles with an area and a common outward side";
        Problem::field(Kind::InvalidMesh, field, None, allowed, error.to_string())
    })
}

fn mesh_file(field: &str, bytes: &[u8], format: MeshFormat) -> Result<TriangleMesh, Problem> {
    let allowed = "a triangle mesh in mm with a common outward side";
    read_mesh(bytes, format).map_err(|error| Problem::field(Kind::InvalidMesh, field, None, allowed, error.to_string()))
}

fn tissue(spec: &TissueSpec) -> Tissue {
    let retina = match &spec.retina {
        None => vec![RETINA.default_layer()],
        Some(RetinaSpec::Whole(whole)) => vec![layer(whole, &RETINA)],
        Some(RetinaSpec::Sublayers(layers)) => layers.iter().map(|spec| layer(spec, &RETINA_SUBLAYER)).collect(),
    };
    let or_default = |spec: &Option<LayerSpec>, ranges| layer(&spec.unwrap_or_default(), ranges);
    Tissue {
        inner_limiting_membrane: spec.inner_limiting_membrane.map(|spec| layer(&spec, &INNER_LIMITING_MEMBRANE)),
        retina,
        choroid: or_default(&spec.choroid, &CHOROID),
        sclera: or_default(&spec.sclera, &SCLERA),
        bond: bond(&spec.bond.unwrap_or_default()),
        rate: spec.rate.as_ref().map_or_else(RateProperties::default, rate),
    }
}

fn bond(spec: &BondSpec) -> RetinalBond {
    let default = RetinalBond::default();
    RetinalBond {
        strength_kpa: spec.strength_kpa.unwrap_or(default.strength_kpa),
        fracture_energy_mn_per_mm: spec.fracture_energy_mn_per_mm.unwrap_or(default.fracture_energy_mn_per_mm),
        rate_exponent: spec.rate_exponent.unwrap_or(default.rate_exponent),
        reference_speed_mm_per_s: spec.reference_speed_mm_per_s.unwrap_or(default.reference_speed_mm_per_s),
    }
}

fn bleb(spec: &BlebSpec, scene_from_patch: &Isometry3<f64>) -> Result<SubretinalFluid, Problem> {
    let center = spec.center_mm.map(|center| Point3::from(center.0));
    Ok(SubretinalFluid {
        filling: filling("scene.bleb", &FillingSpec { volume_mm3: spec.volume_mm3, pressure_kpa: spec.pressure_kpa })?,
        center_mm: center.unwrap_or_else(|| scene_from_patch * Point3::origin()),
        radius_mm: spec.radius_mm.unwrap_or(bleb::RADIUS.default),
    })
}

/// The filling at `path`.
pub(super) fn filling(path: &str, spec: &FillingSpec) -> Result<Filling, Problem> {
    let [volume, pressure] = ["volume_mm3", "pressure_kpa"].map(|number| format!("{path}.{number}"));
    match (spec.volume_mm3, spec.pressure_kpa) {
        (Some(_), Some(_)) => Err(both(&pressure, &volume)),
        (Some(volume_mm3), None) => Ok(Filling::Volume(volume_mm3)),
        (None, Some(pressure_kpa)) => Ok(Filling::Pressure(pressure_kpa)),
        (None, None) => {
            let allowed = format!("{} to {} mm³, or {pressure}", bleb::VOLUME.min, bleb::VOLUME.max);
            let detail = format!("{volume} or {pressure} must be given");
            Err(Problem::field(Kind::InvalidRequest, volume, None, allowed, detail))
        }
    }
}

fn puncture(spec: &PunctureSpec) -> Result<Puncture, Problem> {
    let default = Puncture::default();
    let force = match (spec.pressure_per_modulus, spec.max_force_mn) {
        (Some(_), Some(_)) => {
            return Err(both("scene.puncture.max_force_mn", "scene.puncture.pressure_per_modulus"));
        }
        (Some(share), None) => PunctureForce::PressurePerModulus(share),
        (None, Some(force_mn)) => PunctureForce::Force(force_mn),
        (None, None) => default.force,
    };
    Ok(Puncture { force, max_strain: spec.max_strain.unwrap_or(default.max_strain) })
}

fn rate(spec: &RateSpec) -> RateProperties {
    let default = RateProperties::default();
    let term = |term: &PronyTermSpec| PronyTerm { relaxation_time_s: term.relaxation_time_s, share: term.share };
    RateProperties {
        retina_relaxation: match &spec.retina_relaxation {
            Some(terms) => terms.iter().map(term).collect(),
            None => default.retina_relaxation,
        },
        density_kg_per_mm3: spec.density_kg_per_mm3.unwrap_or(default.density_kg_per_mm3),
        vitreous_drag_kpa_s_per_mm: spec.vitreous_drag_kpa_s_per_mm.unwrap_or(default.vitreous_drag_kpa_s_per_mm),
    }
}

fn layer(spec: &LayerSpec, ranges: &LayerRanges) -> Layer {
    let default = ranges.default_layer();
    Layer {
        thickness_mm: spec.thickness_mm.unwrap_or(default.thickness_mm),
        youngs_modulus_kpa: spec.youngs_modulus_kpa.unwrap_or(default.youngs_modulus_kpa),
        poisson_ratio: spec.poisson_ratio.unwrap_or(default.poisson_ratio),
    }
}

fn pose(spec: &PoseSpec) -> Result<Isometry3<f64>, Problem> {
    let position = spec.position_mm.map_or([0.0; 3], |position| position.0);
    let orientation = match spec.orientation_xyzw {
        Some(xyzw) => rotation("scene.pose.orientation_xyzw", xyzw.0)?,
        None => UnitQuaternion::identity(),
    };
    Ok(Isometry3::from_parts(Translation3::from(position), orientation))
}

fn misplaced(field: &str, at: &str) -> Problem {
    let detail = format!("{field} does not belong to {at}");
    let allowed = format!("left out for {at}");
    Problem::field(Kind::InvalidRequest, field, None, allowed, detail)
}
