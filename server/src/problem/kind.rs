//! Every kind of problem: its address, status, title and explanation, in one table.

use axum::http::StatusCode;

macro_rules! kinds {
    ($($kind:ident = $name:literal, $status:ident, $title:literal, $explanation:literal;)*) => {
        /// A kind of problem.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Kind { $(#[doc = $title] $kind,)* }

        impl Kind {
            /// Every kind.
            pub const ALL: &'static [Kind] = &[$(Kind::$kind,)*];

            /// The last part of the kind's address, `/problems/{name}`.
            pub fn name(self) -> &'static str {
                match self { $(Kind::$kind => $name,)* }
            }

            /// The status of a response that tells of it.
            pub fn status(self) -> StatusCode {
                match self { $(Kind::$kind => StatusCode::$status,)* }
            }

            /// What it is, in a few words that never change.
            pub fn title(self) -> &'static str {
                match self { $(Kind::$kind => $title,)* }
            }

            /// What it means and what to do about it.
            pub fn explanation(self) -> &'static str {
                match self { $(Kind::$kind => $explanation,)* }
            }
        }
    };
}

kinds! {
    MalformedJson = "malformed-json", BAD_REQUEST, "The body is not JSON",
        "The body ends early or does not follow RFC 8259. `detail` says in which line and column. JSON has no NaN and no infinity.";
    InvalidRequest = "invalid-request", UNPROCESSABLE_ENTITY, "The body is not a request",
        "A field is unknown, missing, of the wrong type, or two fields contradict each other. `errors` names it. The schema of every \
         field is at /openapi.json, and /docs shows it.";
    OutOfRange = "out-of-range", UNPROCESSABLE_ENTITY, "A number is outside its range",
        "`errors` names the field, the value and the allowed range, bounds included. GET /v1/scenes lists the ranges of a scene with \
         their sources. Values are refused, never moved.";
    UnknownName = "unknown-name", UNPROCESSABLE_ENTITY, "There is nothing of that name",
        "A scene, gauge, level or effect that does not exist, or that the level cannot do. `errors` lists the known ones.";
    Damaged = "damaged", BAD_REQUEST, "The message is damaged",
        "A message of a binary protocol does not have the checksum or the sizes that its header tells. Send it again.";
    NotPossible = "not-possible", UNPROCESSABLE_ENTITY, "No level keeps what is promised",
        "`accuracy.strict` was asked for, and no level is expected to keep the error or the time. `detail` says by how much. Ask for less, or \
         without `strict` for the best there is.";
    PointsAway = "points-away", UNPROCESSABLE_ENTITY, "The needle or the force points away from the tissue",
        "Needle and force must point into the tissue: +z of the patch frame is the vitreous, so a needle pushes towards -z. `errors` \
         says by how much the direction is off.";
    OutsidePatch = "outside-patch", UNPROCESSABLE_ENTITY, "The needle meets the tissue outside of the patch",
        "The contact must lie on the patch: move the needle's tip, or the scene's pose, or give a larger mesh.";
    BeyondPuncture = "beyond-puncture", UNPROCESSABLE_ENTITY, "The force would puncture the tissue",
        "The tissue model holds up to a pressure under the needle. Use a smaller force or a thicker needle. What punctures earlier, by \
         scene.puncture, is answered, and says so.";
    TooDeep = "too-deep", UNPROCESSABLE_ENTITY, "The needle stands too deep in the tissue",
        "Under pose control the needle may be pressed in no deeper than the tissue model holds.";
    InvalidMesh = "invalid-mesh", UNPROCESSABLE_ENTITY, "The surface cannot be used",
        "The mesh is malformed, is not the surface of one side, or leaves no room for a patch or for the tissue under it. `detail` says \
         which vertex or triangle.";
    NoEquilibrium = "no-equilibrium", UNPROCESSABLE_ENTITY, "No equilibrium was found",
        "The solver did not converge, and an unconverged state is never an answer. `detail` has the residual. A smaller force, a \
         stiffer tissue or another level may help.";
    SceneTooLarge = "scene-too-large", PAYLOAD_TOO_LARGE, "The scene is too large to be stored",
        "GET /v1/scenes says under `store` what one scene may take. Thin out the mesh, or cut it around where the needle goes.";
    StoreFull = "store-full", INSUFFICIENT_STORAGE, "There is no room for another scene",
        "The quota of stored scenes is used up, or the disk is full. Nothing was stored. GET /v1/scenes says under `store` what is allowed; \
         DELETE /v1/scenes/{id} makes room.";
    StoreUnavailable = "store-unavailable", SERVICE_UNAVAILABLE, "The place of the stored scenes does not answer",
        "The folder or the object store where scenes are kept cannot be read or written; the server's log says why. Built-in scenes and scenes \
         written out in a request work all the same.";
    CorruptScene = "corrupt-scene", UNPROCESSABLE_ENTITY, "The stored scene is corrupt",
        "What is stored under the id is not what was given, so it is not used. Store the scene again, which replaces it, or delete it.";
    NotFound = "not-found", NOT_FOUND, "There is no such page",
        "GET / links to what there is.";
    MethodNotAllowed = "method-not-allowed", METHOD_NOT_ALLOWED, "The page does not take this method",
        "The header Allow lists the methods that it takes.";
    RequestTimeout = "request-timeout", REQUEST_TIMEOUT, "The body did not arrive in time",
        "The body of a request must arrive within ten seconds, or what the server is configured with.";
    BodyTooLarge = "body-too-large", PAYLOAD_TOO_LARGE, "The body is too large",
        "A body may have 8 MiB. Thin out the mesh, or cut it around the needle: the nodes are the 64 vertices nearest to the contact.";
    UnsupportedMediaType = "unsupported-media-type", UNSUPPORTED_MEDIA_TYPE, "The body is not announced as what it must be",
        "Send the header Content-Type: application/json; POST /v1/scenes takes multipart/form-data too.";
    Unauthorized = "unauthorized", UNAUTHORIZED, "A token is needed",
        "This server answers those who have a token: send the header Authorization: Bearer TOKEN.";
    ForeignOrigin = "foreign-origin", FORBIDDEN, "The page comes from elsewhere",
        "A browser tells which site its page is from, and this server takes streams from its own pages and from the origins that it is \
         configured with.";
    UpgradeRequired = "upgrade-required", UPGRADE_REQUIRED, "The page speaks WebSocket",
        "GET /v1/stream begins with the WebSocket handshake of RFC 6455, version 13.";
    Busy = "busy", SERVICE_UNAVAILABLE, "Too much work is waiting",
        "The queue of the numerical threads is full. Try again after the seconds in the header Retry-After.";
    TooLate = "too-late", SERVICE_UNAVAILABLE, "The answer would come too late",
        "The wait for a numerical thread is longer than `accuracy.max_time_ms`, or than the server lets a request wait. Try again after the \
         seconds in the header Retry-After, or elsewhere at once.";
    TookTooLong = "took-too-long", SERVICE_UNAVAILABLE, "The answer took too long",
        "The work was stopped at the time limit of the server. Use a cheaper level.";
    NotReady = "not-ready", SERVICE_UNAVAILABLE, "The service is warming up",
        "The built-in scenes are being prepared. Requests are accepted already; the first ones wait.";
    Internal = "internal", INTERNAL_SERVER_ERROR, "The server failed",
        "A fault of the server, which its log describes under the request's x-request-id.";
}
