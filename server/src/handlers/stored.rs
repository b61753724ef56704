//! What the routes of stored scenes do.

use axum::Json;
use axum::body::Body;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use retina_core::scene::Scene;

use crate::catalog;
use crate::library::{Id, built_in};
use crate::problem::{Kind, MEDIA_TYPE, Problem, ProblemDocument};
use crate::state::AppState;
use crate::wire::{SceneForm, SceneList, SceneSpec, StoredScene};

/// The scenes: built in, and stored; and every parameter of a scene with its default, range and source.
#[utoipa::path(get, path = "/v1/scenes", tag = "scenes", responses((status = 200, body = SceneList)))]
pub async fn scenes(State(app): State<AppState>) -> Json<SceneList> {
    Json(catalog::scenes(app.library.list().await))
}

/// Stores a scene of one's own: with its answer's `id` every request can name it.
///
/// As JSON it is a scene as a request writes it out. As a form it is the file of a mesh (PLY, OBJ or STL, text or binary, in mm) and perhaps the
/// rest of the scene. What is wrong with it is said at once, by field. It is prepared in the background; `GET /v1/scenes/{id}` says how far it is.
/// The same scene, in whatever form, has the same id, and is stored once.
#[utoipa::path(
    post,
    path = "/v1/scenes",
    tag = "scenes",
    request_body(content((SceneSpec = "application/json"), (SceneForm = "multipart/form-data"))),
    responses(
        (status = 201, description = "It is stored", body = StoredScene, headers(("location" = String, description = "Its page"))),
        (status = 200, description = "It was there", body = StoredScene, headers(("location" = String, description = "Its page"))),
        (status = 400, description = "Not JSON", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 408, description = "The body did not arrive in time", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 413, description = "Larger than 8 MiB, or than a stored scene may be", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 415, description = "Announced as neither JSON nor a form", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 422, description = "A field is wrong", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 500, description = "A fault of the server", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "Too much work is waiting, or the place of the scenes does not answer", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 507, description = "No room", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn store_scene(State(app): State<AppState>, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let (stored, is_new) = app.store_scene(&headers, body).await?;
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, location(&stored.id), Json(stored)).into_response())
}

fn location(id: &str) -> [(HeaderName, String); 1] {
    [(header::LOCATION, format!("/v1/scenes/{id}"))]
}

/// How far a scene is.
#[utoipa::path(
    get,
    path = "/v1/scenes/{id}",
    tag = "scenes",
    params(("id" = String, Path, description = "The id of a stored scene, or the name of a built-in one")),
    responses(
        (status = 200, body = StoredScene),
        (status = 404, description = "No such scene", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "The place of the scenes does not answer", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn scene(
    State(app): State<AppState>,
    name: Result<Path<String>, PathRejection>,
) -> Result<Json<StoredScene>, Problem> {
    let name = name.map_or_else(|_| String::new(), |Path(name)| name);
    if let Some(scene) = Scene::built_in(&name) {
        return Ok(Json(built_in(&scene)));
    }
    let id = Id::parse(&name).ok_or_else(|| nothing(&name))?;
    app.library.get(id).await?.map(Json).ok_or_else(|| nothing(&name))
}

/// Deletes a stored scene. Requests that are at work with it are answered.
#[utoipa::path(
    delete,
    path = "/v1/scenes/{id}",
    tag = "scenes",
    params(("id" = String, Path, description = "The id of a stored scene")),
    responses(
        (status = 204, description = "It is deleted"),
        (status = 404, description = "No such scene", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 405, description = "It is built in", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
        (status = 503, description = "The place of the scenes does not answer", body = ProblemDocument<'static>, content_type = MEDIA_TYPE),
    )
)]
pub async fn delete_scene(
    State(app): State<AppState>,
    name: Result<Path<String>, PathRejection>,
) -> Result<StatusCode, Response> {
    let name = name.map_or_else(|_| String::new(), |Path(name)| name);
    if Scene::built_in(&name).is_some() {
        let detail = format!("{name} is built in and cannot be deleted.");
        let problem = Problem::new(Kind::MethodNotAllowed, detail).into_response();
        return Err(([(header::ALLOW, "GET,HEAD")], problem).into_response());
    }
    let id = Id::parse(&name).ok_or_else(|| nothing(&name).into_response())?;
    match app.library.delete(id).await {
        Ok(true) => Ok(StatusCode::NO_CONTENT),
        Ok(false) => Err(nothing(&name).into_response()),
        Err(problem) => Err(problem.into_response()),
    }
}

fn nothing(name: &str) -> Problem {
    let shown: String = name.chars().take(80).collect();
    Problem::new(Kind::NotFound, format!("There is no scene {shown:?}; GET /v1/scenes lists those that there are."))
}
