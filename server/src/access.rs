//! Who may ask: bearer tokens, and which web pages.
//!
//! Contract: without a token configured everybody who reaches the port may ask; with one, whatever is under `/v1`, `/v2/models` and `/metrics` needs it, and
//! the page, its documentation and the two health checks do not. Tokens are compared in a time that does not depend on where they differ. A
//! stream from a web page of another origin is refused unless that origin is configured, because browsers ask nobody before they open one.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use subtle::{Choice, ConstantTimeEq as _};
use tower_http::cors::{AllowOrigin, CorsLayer};

use crate::problem::{Kind, Problem};

/// Shortest token, in characters: one that cannot be guessed.
pub const SHORTEST_TOKEN: usize = 16;

/// Tokens and origins.
#[derive(Clone, Default)]
pub struct Access {
    /// The tokens; none for a service that needs none.
    pub tokens: Arc<[String]>,
    /// Origins of web pages that may ask, beside the service's own.
    pub origins: Arc<[HeaderValue]>,
}

impl Access {
    /// Whether the header `Authorization` has one of the tokens, or none is needed.
    fn allows(&self, headers: &HeaderMap) -> bool {
        let given = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
        let given =
            given.and_then(|value| value.split_once(' ')).filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
        let given = given.map_or("", |(_, token)| token.trim());
        self.tokens.is_empty() || self.knows(given)
    }

    /// Whether this is one of the tokens.
    pub fn knows(&self, given: &str) -> bool {
        let same = |token: &String| token.as_bytes().ct_eq(given.as_bytes());
        self.tokens.iter().map(same).fold(Choice::from(0), |any, same| any | same).into()
    }

    /// Whether a stream may be opened from where the browser says that its page is; programs say nothing.
    ///
    /// # Errors
    /// [`Kind::ForeignOrigin`].
    pub fn check_origin(&self, headers: &HeaderMap) -> Result<(), Problem> {
        let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
        let host = headers.get(header::HOST).map_or(&b""[..], HeaderValue::as_bytes);
        let text = origin.as_bytes();
        let own = [&b"http://"[..], b"https://"].iter().any(|scheme| text.strip_prefix(*scheme) == Some(host));
        if own || self.origins.contains(origin) {
            return Ok(());
        }
        let origin: String = String::from_utf8_lossy(text).chars().take(120).collect();
        Err(Problem::new(Kind::ForeignOrigin, format!("This server takes no streams from pages of {origin}.")))
    }

    /// What browsers are told when a page of another origin asks.
    pub fn cors(&self) -> CorsLayer {
        CorsLayer::new()
            .allow_origin(AllowOrigin::list(self.origins.iter().cloned()))
            .allow_methods([Method::GET, Method::POST, Method::DELETE])
            .allow_headers([header::CONTENT_TYPE, header::AUTHORIZATION])
    }
}

/// Lets those through who may ask.
pub async fn check(State(access): State<Access>, request: Request, next: Next) -> Response {
    let path = request.uri().path();
    let below = |root: &str| path.strip_prefix(root).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    let guarded = path == "/metrics" || below("/v1") || below("/v2/models");
    if guarded && !access.allows(request.headers()) {
        return Problem::new(Kind::Unauthorized, "The header Authorization has no token of this server.")
            .into_response();
    }
    next.run(request).await
}
