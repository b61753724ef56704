//! The page at `/`: embedded, with what a browser must know about it, and nothing from elsewhere.

use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, X_CONTENT_TYPE_OPTIONS};
use retina_server::page::missing;

use crate::harness::{Reply, get};

fn text(reply: &Reply) -> &str {
    reply.body.as_str().expect("text")
}

fn header<'a>(reply: &'a Reply, name: &axum::http::HeaderName) -> &'a str {
    reply.headers[name].to_str().expect("text")
}

/// What the page loads: the values of its `src` and of the `href` of its links to files.
fn files(page: &str) -> Vec<String> {
    let values = |attribute: &str| -> Vec<String> {
        page.split(attribute).skip(1).filter_map(|part| part.split('"').next().map(str::to_owned)).collect()
    };
    let named = |file: &String| file.rsplit('/').next().is_some_and(|name| name.contains('.'));
    [values("src=\""), values("href=\"")]
        .concat()
        .into_iter()
        .filter(|file| named(file) && file != "/openapi.json")
        .collect()
}

#[test]
fn the_page_is_html_under_a_strict_policy() {
    let page = get("/");
    assert_eq!((page.status.as_u16(), page.media_type()), (200, "text/html; charset=utf-8"));
    assert_eq!(header(&page, &CACHE_CONTROL), "no-cache");
    assert_eq!(header(&page, &X_CONTENT_TYPE_OPTIONS), "nosniff");
    let policy = header(&page, &CONTENT_SECURITY_POLICY);
    assert!(policy.starts_with("default-src 'none';"), "{policy}");
    for loose in ["unsafe", "http", "*", "data:"] {
        assert!(!policy.contains(loose), "{policy}");
    }
    assert!(text(&page).contains("/docs"), "the page links to the API");
}

#[test]
fn every_file_of_the_page_is_in_the_program_and_may_be_kept() {
    let page = get("/");
    let files = files(text(&page));
    assert_eq!(files.is_empty(), missing().is_some(), "{files:?}");
    for file in &files {
        assert!(file.starts_with("/assets/"), "{file} is elsewhere");
        let asset = get(file);
        assert_eq!(asset.status, 200, "{file}");
        assert!(header(&asset, &CACHE_CONTROL).contains("immutable"), "{file}");
        let expected = match file.rsplit('.').next() {
            Some("js") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            other => panic!("{file}: {other:?}"),
        };
        assert_eq!(asset.media_type(), expected);
    }
}

#[test]
fn an_asset_that_there_is_not_is_a_problem() {
    for path in ["/assets/nothing.js", "/assets/", "/assets/..%2findex.html", "/assets/%ff", "/index.html"] {
        let lost = get(path);
        assert_eq!((lost.status.as_u16(), lost.media_type()), (404, "application/problem+json"), "{path}");
    }
}

#[test]
fn a_program_without_the_page_says_how_to_get_it() {
    let page = get("/");
    match missing() {
        Some(reason) => assert!(text(&page).contains("install Node.js") && !reason.is_empty()),
        None => assert!(!text(&page).contains("install Node.js")),
    }
}
