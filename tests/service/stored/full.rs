//! No room: quotas, a disk that is full, a place that does not answer.

use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::body::{Body, to_bytes};
use axum::http::{Request, header};
use clap::Parser as _;
use futures_util::stream::BoxStream;
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{
    CopyOptions, Error, GetOptions, GetResult, ListResult, MultipartUpload, ObjectMeta, ObjectStore,
    PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};
use retina_server::config::CommandLine;
use retina_server::library::Store;
use retina_server::{App, AppState, app};
use serde_json::{Value, json};
use tower::ServiceExt as _;

use crate::harness::{Running, runtime};
use crate::stored::{call, id, shifted};

/// A place that can be full, or gone.
#[derive(Debug, Default)]
struct Faulty {
    there: InMemory,
    full: AtomicBool,
    gone: AtomicBool,
}

impl fmt::Display for Faulty {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("faulty")
    }
}

impl Faulty {
    fn works(&self, writes: bool) -> Result<()> {
        let fault = |kind: io::ErrorKind| Error::Generic { store: "faulty", source: io::Error::from(kind).into() };
        match (self.gone.load(Ordering::SeqCst), writes && self.full.load(Ordering::SeqCst)) {
            (true, _) => Err(fault(io::ErrorKind::ConnectionRefused)),
            (_, true) => Err(fault(io::ErrorKind::StorageFull)),
            _ => Ok(()),
        }
    }
}

#[async_trait::async_trait]
impl ObjectStore for Faulty {
    async fn put_opts(&self, at: &Path, payload: PutPayload, options: PutOptions) -> Result<PutResult> {
        self.works(true)?;
        self.there.put_opts(at, payload, options).await
    }

    async fn put_multipart_opts(&self, at: &Path, options: PutMultipartOptions) -> Result<Box<dyn MultipartUpload>> {
        self.works(true)?;
        self.there.put_multipart_opts(at, options).await
    }

    async fn get_opts(&self, at: &Path, options: GetOptions) -> Result<GetResult> {
        self.works(false)?;
        self.there.get_opts(at, options).await
    }

    fn delete_stream(&self, at: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        self.there.delete_stream(at)
    }

    fn list(&self, below: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.there.list(below)
    }

    async fn list_with_delimiter(&self, below: Option<&Path>) -> Result<ListResult> {
        self.works(false)?;
        self.there.list_with_delimiter(below).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.there.copy_opts(from, to, options).await
    }
}

fn over(place: &Arc<Faulty>) -> AppState {
    let config = CommandLine::try_parse_from(["retina-server", "--threads", "1"]).expect("arguments").config;
    let objects: Arc<dyn ObjectStore> = place.clone();
    App::start_over(&config, None, Store::of(objects, true)).expect("threads")
}

fn send(state: &AppState, method: &str, path: &str, body: &Value) -> (u16, Value) {
    let request = Request::builder().method(method).uri(path).header(header::CONTENT_TYPE, "application/json");
    let request = request.body(Body::from(body.to_string())).expect("request");
    runtime().block_on(async {
        let response = app(state.clone()).oneshot(request).await.expect("infallible");
        let status = response.status().as_u16();
        let bytes = to_bytes(response.into_body(), usize::MAX).await.expect("body");
        (status, serde_json::from_slice(&bytes).unwrap_or_default())
    })
}

#[test]
fn a_full_disk_is_said_and_leaves_nothing_behind() {
    let place = Arc::new(Faulty::default());
    let state = over(&place);
    place.full.store(true, Ordering::SeqCst);
    let (status, problem) = send(&state, "POST", "/v1/scenes", &shifted(0.3));
    assert_eq!((status, &problem["type"]), (507, &json!("/problems/store-full")), "{problem}");
    let (_, list) = send(&state, "GET", "/v1/scenes", &json!({}));
    assert_eq!((&list["stored"], &list["store"]["bytes"]), (&json!([]), &json!(0)));
    // With room again the same scene is stored.
    place.full.store(false, Ordering::SeqCst);
    assert_eq!(send(&state, "POST", "/v1/scenes", &shifted(0.3)).0, 201);
}

#[test]
fn a_place_that_does_not_answer_is_said_and_hurts_nobody_else() {
    let place = Arc::new(Faulty::default());
    let state = over(&place);
    let (_, told) = send(&state, "POST", "/v1/scenes", &shifted(0.4));
    place.gone.store(true, Ordering::SeqCst);
    for (method, path) in [("POST", "/v1/scenes".to_owned()), ("DELETE", format!("/v1/scenes/{}", id(&told)))] {
        let (status, problem) = send(&state, method, &path, &shifted(0.5));
        assert_eq!((status, &problem["type"]), (503, &json!("/problems/store-unavailable")), "{problem}");
    }
    let (status, list) = send(&state, "GET", "/v1/scenes", &json!({}));
    assert_eq!((status, list["stored"].as_array().map(Vec::len)), (200, Some(1)), "what was known before");
    assert!(list["store"]["unavailable"].is_string(), "{list}");
    let built_in = crate::harness::request("linear");
    assert_eq!(send(&state, "POST", "/v1/predict", &built_in).0, 200);
    place.gone.store(false, Ordering::SeqCst);
    assert_eq!(send(&state, "DELETE", &format!("/v1/scenes/{}", id(&told)), &json!({})).0, 204);
}

#[test]
fn quotas_bound_number_and_bytes() {
    let service = Running::start(&["--threads", "1", "--stored-scenes", "2"]);
    let scenes = service.url("/v1/scenes");
    let (_, first) = call("POST", &scenes, Some(&shifted(0.1)));
    assert_eq!(call("POST", &scenes, Some(&shifted(0.2))).0, 201);
    let (status, problem) = call("POST", &scenes, Some(&shifted(0.3)));
    assert_eq!((status, &problem["type"]), (507, &json!("/problems/store-full")), "{problem}");
    assert_eq!(call("POST", &scenes, Some(&shifted(0.2))).0, 200, "what is there needs no room");
    assert_eq!(call("DELETE", &format!("{scenes}/{}", id(&first)), None).0, 204);
    assert_eq!(call("POST", &scenes, Some(&shifted(0.3))).0, 201);

    let none = Running::start(&["--threads", "1", "--stored-scene-mib", "0"]);
    let (status, problem) = call("POST", &none.url("/v1/scenes"), Some(&shifted(0.1)));
    assert_eq!((status, &problem["type"]), (413, &json!("/problems/scene-too-large")), "{problem}");
    let none = Running::start(&["--threads", "1", "--scene-store-mib", "0"]);
    let (status, problem) = call("POST", &none.url("/v1/scenes"), Some(&shifted(0.1)));
    assert_eq!((status, &problem["type"]), (507, &json!("/problems/store-full")), "{problem}");
}

#[test]
fn a_place_that_cannot_be_used_is_refused_at_the_start() {
    let below_a_file = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml/scenes");
    for (place, reason) in [("ftp://somewhere/scenes", "ftp"), (below_a_file, "Cargo.toml/scenes")] {
        let config = CommandLine::try_parse_from(["retina-server", "--scene-store", place]).expect("arguments").config;
        let error = App::start(&config).err().expect("refused").to_string();
        assert!(error.contains(reason), "{error}");
    }
}
