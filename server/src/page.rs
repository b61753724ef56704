//! The page at `/`, from inside the program.
//!
//! Contract: no file is read and nothing is fetched from elsewhere, and the browser is told to allow neither. Names of assets carry a
//! hash of their content, so they may be kept for good; the page itself is asked for anew each time. A program that was built
//! without the page says at `/` how to get it.
//!
//! Not here: how the page is built (`build.rs`) and what it does (`web/`).

use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::{HeaderName, Uri, header};
use axum::response::{Html, IntoResponse, Response};

use crate::handlers::not_found;

/// What the build left.
struct Embedded {
    /// Every file of the page: its name and its bytes.
    files: &'static [(&'static str, &'static [u8])],
    /// Why there is none.
    missing: Option<&'static str>,
}

static PAGE: Embedded = include!(concat!(env!("OUT_DIR"), "/embedded.rs"));

/// Scripts, styles, pictures and answers come from this server; pictures that the page makes itself are blobs.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

type Headers = [(HeaderName, &'static str); 4];

/// Why the program has no page; `None` where it has one.
pub fn missing() -> Option<&'static str> {
    PAGE.missing
}

/// `GET /`.
pub async fn index(uri: Uri) -> Response {
    let Some(reason) = PAGE.missing else {
        return file("index.html", "no-cache", uri).await;
    };
    let page = include_str!("../assets/no_page.html").replace("{reason}", &escaped(reason));
    (headers("text/html; charset=utf-8", "no-cache"), Html(page)).into_response()
}

/// `GET /assets/{name}`.
pub async fn asset(name: Result<Path<String>, PathRejection>, uri: Uri) -> Response {
    let name = name.map_or_else(|_| String::new(), |Path(name)| name);
    file(&format!("assets/{name}"), "public, max-age=31536000, immutable", uri).await
}

async fn file(name: &str, cache: &'static str, uri: Uri) -> Response {
    match PAGE.files.iter().find(|(known, _)| *known == name) {
        Some((_, bytes)) => (headers(media_type(name), cache), *bytes).into_response(),
        None => not_found(uri).await.into_response(),
    }
}

fn headers(media_type: &'static str, cache: &'static str) -> Headers {
    [
        (header::CONTENT_TYPE, media_type),
        (header::CACHE_CONTROL, cache),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ]
}

fn media_type(name: &str) -> &'static str {
    match name.rsplit_once('.') {
        Some((_, "html")) => "text/html; charset=utf-8",
        Some((_, "js")) => "text/javascript; charset=utf-8",
        Some((_, "css")) => "text/css; charset=utf-8",
        Some((_, "svg")) => "image/svg+xml",
        _ => "application/octet-stream",
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
