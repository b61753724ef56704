//! Scenes as forms: the file of a mesh as it lies on a disk, and the rest beside it.

use axum::body::Body;
use axum::http::{Request, header};
use serde_json::{Value, json};

use crate::answers::{plane, plane_obj, plane_ply};
use crate::harness::{Reply, send};
use crate::stored::id;

/// A part of a form: name, the rest of its disposition with its type, content.
type Part<'a> = (&'a str, &'a str, &'a [u8]);

fn form(parts: &[Part]) -> Reply {
    let mut body = Vec::new();
    for (name, rest, content) in parts {
        body.extend(format!("--line\r\ncontent-disposition: form-data; name=\"{name}\"{rest}\r\n\r\n").bytes());
        body.extend_from_slice(content);
        body.extend(b"\r\n");
    }
    body.extend(b"--line--\r\n");
    let request = Request::post("/v1/scenes").header(header::CONTENT_TYPE, "multipart/form-data; boundary=line");
    send(request.body(Body::from(body)).expect("request"))
}

fn json_id(scene: &Value) -> String {
    let request = Request::post("/v1/scenes").header(header::CONTENT_TYPE, "application/json");
    id(&send(request.body(Body::from(scene.to_string())).expect("request")).body).to_owned()
}

fn binary_stl() -> Vec<u8> {
    let (vertices, triangles) = plane();
    let mut bytes = [b"solid as many programs begin".to_vec(), vec![b' '; 52]].concat();
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        bytes.extend([0; 12]);
        let numbers = corners.into_iter().flat_map(|corner| vertices[corner]);
        bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn the_file_of_a_mesh_is_taken_as_it_is() {
    let whole = json_id(&json!({"surface": {"kind": "mesh", "obj": plane_obj()}}));
    for (rest, content) in [
        ("; filename=\"retina.obj\"", plane_obj().into_bytes()),
        ("; filename=\"C:\\retina.PLY\"\r\ncontent-type: application/octet-stream", plane_ply().into_bytes()),
        ("\r\ncontent-type: application/x-ply", plane_ply().into_bytes()),
    ] {
        let reply = form(&[("mesh", rest, &content)]);
        assert!(matches!(reply.status.as_u16(), 200 | 201), "{rest}: {}", reply.body);
        assert_eq!(id(&reply.body), whole, "{rest}");
    }
    let reply = form(&[("mesh", "; filename=\"a.stl\"", &binary_stl())]);
    assert_eq!(reply.body["surface"], Value::Null, "not read yet: {}", reply.body);
    assert_eq!(reply.headers[header::LOCATION], format!("/v1/scenes/{}", id(&reply.body)));
}

#[test]
fn the_rest_of_the_scene_stands_beside_the_file() {
    let tissue = json!({"retina": {"youngs_modulus_kpa": 15}});
    let whole = json_id(&json!({"surface": {"kind": "mesh", "obj": plane_obj()}, "tissue": tissue}));
    let rest = json!({"tissue": tissue, "surface": {"kind": "mesh"}}).to_string();
    let obj = plane_obj();
    let reply = form(&[("scene", "", rest.as_bytes()), ("mesh", "; filename=\"retina.obj\"", obj.as_bytes())]);
    assert_eq!(id(&reply.body), whole);
}

#[test]
fn a_form_that_is_wrong_names_its_part() {
    let (obj, named) = (plane_obj(), "; filename=\"retina.obj\"");
    let mesh = ("mesh", named, obj.as_bytes());
    for (parts, status, field) in [
        (vec![("scene", "", &b"{}"[..])], 422, "mesh"),
        (vec![("mesh", "; filename=\"retina.blend\"", obj.as_bytes())], 422, "mesh"),
        (vec![mesh, mesh], 422, "mesh"),
        (vec![mesh, ("colour", "", b"red")], 422, "colour"),
        (vec![mesh, ("scene", "", br#"{"tissue": {"retina": 3}}"#)], 422, "scene.tissue.retina"),
        (vec![mesh, ("scene", "", br#"{"surface": {"kind": "flat"}}"#)], 422, "scene.surface"),
        (vec![mesh, ("scene", "", br#"{"pressure_kpa": 90}"#)], 422, "scene.pressure_kpa"),
        (vec![("mesh", "; filename=\"a.stl\"", obj.as_bytes())], 422, "mesh"),
    ] {
        let reply = form(&parts);
        assert_eq!(reply.status, status, "{}", reply.body);
        assert_eq!(reply.body["errors"][0]["field"], field, "{}", reply.body);
    }
    for (content_type, status) in
        [("multipart/form-data", 422), ("multipart/form-data; boundary=other", 422), ("text/plain", 415)]
    {
        let request = Request::post("/v1/scenes").header(header::CONTENT_TYPE, content_type);
        let reply = send(request.body(Body::from("--line--")).expect("request"));
        assert_eq!(reply.status, status, "{content_type}: {}", reply.body);
    }
}
