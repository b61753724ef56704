//! A scene that is sent to be stored: as JSON, or as a form with the file of a mesh in it.
//!
//! Contract: JSON is a scene as a request writes it out. A form (`multipart/form-data`) has a part `mesh`, the bytes of a PLY, OBJ or STL file,
//! and perhaps a part `scene`, JSON without a surface. What is wrong names the part or the field in it. A file's format is told by the ending of
//! its name, or by its media type; its name leads to no file here.

use std::convert::Infallible;

use axum::body::Bytes;
use axum::http::HeaderValue;
use futures_util::stream;
use multer::{Field, Multipart};
use retina_core::surface::mesh_file::MeshFormat;

use crate::library::content::content;
use crate::problem::{Kind, Problem};
use crate::read::read;
use crate::understand;
use crate::wire::SceneSpec;

/// Media types of mesh files.
const MEDIA_TYPES: [(&str, MeshFormat); 7] = [
    ("model/stl", MeshFormat::Stl),
    ("application/sla", MeshFormat::Stl),
    ("application/vnd.ms-pki.stl", MeshFormat::Stl),
    ("model/obj", MeshFormat::Obj),
    ("model/ply", MeshFormat::Ply),
    ("application/ply", MeshFormat::Ply),
    ("application/x-ply", MeshFormat::Ply),
];

/// The field of a form that holds the mesh.
const MESH: &str = "mesh";

/// The field of a form that holds the rest.
const SCENE: &str = "scene";

/// What was sent, taken apart.
pub enum Upload {
    /// A scene written out.
    Json(Bytes),
    /// The parts of a form.
    Form {
        /// JSON, where there is any.
        scene: Option<Bytes>,
        /// A file.
        mesh: Bytes,
        /// Its format.
        format: MeshFormat,
    },
}

impl Upload {
    /// Takes a body apart that is announced as JSON or as a form.
    ///
    /// # Errors
    /// [`Kind::InvalidRequest`] naming the part at fault.
    pub async fn take_apart(body: Bytes, content_type: Option<&HeaderValue>) -> Result<Self, Problem> {
        let content_type = content_type.and_then(|value| value.to_str().ok()).unwrap_or_default();
        if !is_form(content_type) {
            return Ok(Self::Json(body));
        }
        let boundary = multer::parse_boundary(content_type).map_err(malformed)?;
        let mut form = Multipart::new(stream::iter([Ok::<_, Infallible>(body)]), boundary);
        let (mut scene, mut mesh) = (None, None);
        while let Some(part) = form.next_field().await.map_err(malformed)? {
            let name = part.name().unwrap_or_default().to_owned();
            let twice = || wrong(&name, "given once", format!("the part {name} is given more than once"));
            match name.as_str() {
                SCENE if scene.is_some() => return Err(twice()),
                MESH if mesh.is_some() => return Err(twice()),
                SCENE => scene = Some(part.bytes().await.map_err(malformed)?),
                MESH => {
                    let format = format(&part)?;
                    mesh = Some((part.bytes().await.map_err(malformed)?, format));
                }
                other => {
                    let shown: String = other.chars().take(60).collect();
                    let detail = format!("there is no part {shown:?}; a form has the parts {MESH} and {SCENE}");
                    return Err(wrong(&shown, "mesh or scene", detail));
                }
            }
        }
        let missing = || wrong(MESH, "required", format!("the part {MESH} is missing, the file of a mesh"));
        let (mesh, format) = mesh.ok_or_else(missing)?;
        Ok(Self::Form { scene, mesh, format })
    }

    /// The content to store of it.
    ///
    /// # Errors
    /// A problem that names the field.
    pub fn content(&self) -> Result<Vec<u8>, Problem> {
        let (spec, scene) = match self {
            Self::Json(body) => {
                let spec: SceneSpec = read(body)?;
                let scene = understand::scene(&spec)?;
                (spec, scene)
            }
            Self::Form { scene, mesh, format } => {
                let spec = scene.as_ref().map_or_else(|| Ok(SceneSpec::default()), |body| read(body));
                let spec = spec.map_err(|problem| problem.within(SCENE))?;
                let scene = understand::scene_on_file(&spec, MESH, mesh, *format)?;
                (spec, scene)
            }
        };
        content(&scene, spec.pose.as_ref())
    }
}

/// Whether a body of this media type is a form.
pub fn is_form(media_type: &str) -> bool {
    media_type.trim_start().to_ascii_lowercase().starts_with("multipart/form-data")
}

fn format(part: &Field) -> Result<MeshFormat, Problem> {
    let by_name = part.file_name().and_then(MeshFormat::of_name);
    let essence = part.content_type().map(|media_type| media_type.essence_str().to_ascii_lowercase());
    let by_type =
        || MEDIA_TYPES.iter().find(|(known, _)| Some(*known) == essence.as_deref()).map(|(_, format)| *format);
    by_name.or_else(by_type).ok_or_else(|| {
        let allowed = "a file named .ply, .obj or .stl, or of a media type such as model/stl";
        wrong(MESH, allowed, format!("{MESH}: neither name nor media type of the file tell its format"))
    })
}

fn wrong(field: &str, allowed: &str, detail: String) -> Problem {
    Problem::field(Kind::InvalidRequest, field, None, allowed, detail)
}

fn malformed(error: multer::Error) -> Problem {
    Problem::new(Kind::InvalidRequest, format!("The body is not the form that it is announced as: {error}."))
}
