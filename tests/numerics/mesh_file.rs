//! Reading meshes: every format gives the same, and nothing malformed gets through or brings the reader down.

use retina_core::surface::mesh_file::{MeshFileError, MeshFormat, VERTEX_LIMIT, read_mesh};
use retina_core::surface::{MeshError, TriangleMesh};

const OBJ: &str = "# a square and a triangle\nmtllib none.mtl\no thing\nv 0 0 0.125\nv 1 0 0\nv 1 1 0 1.0\nv 0 1 0\nv 2 0.5 1e-9\n\
                   vt 0 0\nvn 0 0 1\ns off\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf 2//1 -1//1 3//1\n";

const PLY: &str = "ply\nformat ascii 1.0\ncomment a square and a triangle\nelement vertex 5\nproperty float x\nproperty double y\n\
                   property double z\nproperty uchar red\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
                   0 0 0.125 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n2 0.5 1e-9 9\n4 0 1 2 3\n3 1 4 2\n";

fn obj(text: &str) -> Result<TriangleMesh, MeshFileError> {
    read_mesh(text.as_bytes(), MeshFormat::Obj)
}

fn ply(text: &str) -> Result<TriangleMesh, MeshFileError> {
    read_mesh(text.as_bytes(), MeshFormat::Ply)
}

/// The PLY sample as binary, with doubles.
fn binary_ply(big_endian: bool) -> Vec<u8> {
    let encoding = if big_endian { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n\
         element edge 1\nproperty ushort a\nelement face 2\nproperty list uchar uint vertex_index\nend_header\n"
    )
    .into_bytes();
    let double = |value: f64| {
        if big_endian { value.to_be_bytes() } else { value.to_le_bytes() }
    };
    let uint = |value: u32| {
        if big_endian { value.to_be_bytes() } else { value.to_le_bytes() }
    };
    for value in [0., 0., 0.125, 1., 0., 0., 1., 1., 0., 0., 1., 0., 2., 0.5, 1e-9] {
        bytes.extend(double(value));
    }
    bytes.extend([1, 2]);
    for face in [&[0, 1, 2, 3][..], &[1, 4, 2]] {
        bytes.push(face.len() as u8);
        bytes.extend(face.iter().flat_map(|&corner| uint(corner)));
    }
    bytes
}

#[test]
fn every_encoding_gives_the_same_mesh() {
    let mesh = obj(OBJ).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
    assert_eq!(mesh.vertices()[0].z, 0.125);
    assert_eq!(mesh.vertices()[4].z, 1e-9, "coordinates keep the digits of f64");
    assert_eq!(ply(PLY).unwrap(), mesh);
    for big_endian in [false, true] {
        assert_eq!(read_mesh(&binary_ply(big_endian), MeshFormat::Ply).unwrap(), mesh);
    }
}

/// The sample as the text of an STL file: triangles with corners of their own.
fn stl(name: &str) -> String {
    let mesh = obj(OBJ).unwrap();
    let facet = |corners: &[usize; 3]| {
        let corner = |&at: &usize| {
            let vertex = mesh.vertices()[at];
            format!("   vertex {} {} {}\n", vertex.x, vertex.y, vertex.z)
        };
        let corners: String = corners.iter().map(corner).collect();
        format!(" facet normal 0 0 1\n  outer loop\n{corners}  endloop\n endfacet\n")
    };
    let facets: String = mesh.triangles().iter().map(facet).collect();
    format!("solid{name}\n{facets}endsolid{name}\n")
}

/// The sample as a binary STL file that begins with these bytes.
fn binary_stl(header: &str) -> Vec<u8> {
    let mesh = obj(OBJ).unwrap();
    let mut bytes = format!("{header:80}").into_bytes();
    bytes.extend((mesh.triangles().len() as u32).to_le_bytes());
    for corners in mesh.triangles() {
        bytes.extend([0; 12]);
        let numbers =
            corners.iter().flat_map(|&corner| mesh.vertices()[corner].coords.iter().copied().collect::<Vec<_>>());
        bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
        bytes.extend([7, 7]);
    }
    bytes
}

#[test]
fn every_encoding_of_stl_gives_the_same_mesh() {
    // Vertices come in the order of the triangles: 0, 1, 2, 3, and 4 as the sample's fifth.
    let mesh = obj(OBJ).unwrap();
    for text in [stl(""), stl(" a thing"), stl("").replace('\n', "\r\n")] {
        let read = read_mesh(text.as_bytes(), MeshFormat::Stl).unwrap();
        assert_eq!(
            (read.vertices()[..4].to_vec(), read.triangles()),
            (mesh.vertices()[..4].to_vec(), mesh.triangles())
        );
        assert!((read.vertices()[4] - mesh.vertices()[4]).norm() < 1e-15, "as near as f32 has it");
    }
    for header in ["", "solid but binary", "anything"] {
        let read = read_mesh(&binary_stl(header), MeshFormat::Stl).unwrap();
        assert_eq!(read.triangles(), mesh.triangles(), "{header}");
    }
}

#[test]
fn stl_files_that_are_wrong_are_refused() {
    let refused = |bytes: &[u8]| read_mesh(bytes, MeshFormat::Stl).unwrap_err().to_string();
    let two = stl(" one") + &stl(" two");
    assert!(refused(two.as_bytes()).contains("2 solids"), "{}", refused(two.as_bytes()));
    let mut announced = binary_stl("");
    announced[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refused(&announced).contains("4294967295 triangles take"), "{}", refused(&announced));
    assert!(refused(b"nonsense").contains("neither"));
    assert!(refused(stl("").replace("vertex 1 0 0", "vertex 1 nan 0").as_bytes()).contains("triangle 0"));
    assert_eq!(read_mesh(b"solid\nendsolid\n", MeshFormat::Stl), Err(MeshFileError::Empty));
}

#[test]
fn names_tell_formats() {
    for (name, format) in [
        ("retina.ply", Some(MeshFormat::Ply)),
        ("a.b.OBJ", Some(MeshFormat::Obj)),
        (".stl", Some(MeshFormat::Stl)),
        ("stl", None),
        ("retina.stl.gz", None),
    ] {
        assert_eq!(MeshFormat::of_name(name), format, "{name}");
    }
}

#[test]
fn truncated_files_are_errors_and_never_panics() {
    // The last number may lose digits and still be one, so the cut stops short of it.
    for (bytes, format, tail) in [
        (OBJ.as_bytes().to_vec(), MeshFormat::Obj, OBJ.len()),
        (PLY.as_bytes().to_vec(), MeshFormat::Ply, 3),
        (binary_ply(false), MeshFormat::Ply, 1),
        // Nothing is read after `endsolid`.
        (stl("").into_bytes(), MeshFormat::Stl, 2),
        (binary_stl("solid"), MeshFormat::Stl, 1),
    ] {
        for length in 0..bytes.len() {
            let result = read_mesh(&bytes[..length], format);
            assert!(result.is_err() || length > bytes.len() - tail, "{format:?} {length} of {}", bytes.len());
        }
    }
}

#[test]
fn garbage_is_an_error() {
    let mut state = 1u64;
    for round in 0..300 {
        let mut bytes = match round % 4 {
            0 => vec![0; 200],
            1 => binary_stl("solid"),
            other => binary_ply(other == 2),
        };
        for _ in 0..=(round / 10) {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let place = (state >> 33) as usize % bytes.len();
            bytes[place] = (state >> 24) as u8;
        }
        for format in [MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Stl] {
            // Some changes leave a mesh; what counts is that every input comes back as one or as an error.
            if let Ok(mesh) = read_mesh(&bytes, format) {
                assert!(format != MeshFormat::Obj && !mesh.triangles().is_empty());
            }
        }
    }
    assert!(matches!(obj("v 0 0\n"), Err(MeshFileError::Malformed { .. })));
    assert_eq!(obj(""), Err(MeshFileError::Empty));
    assert!(matches!(ply("nonsense"), Err(MeshFileError::Malformed { .. })));
    assert!(matches!(read_mesh(&[0xff, 0xfe], MeshFormat::Obj), Err(MeshFileError::Malformed { .. })));
}

#[test]
fn numbers_that_are_none_are_refused_with_their_vertex() {
    let error = obj(&OBJ.replace("v 1 0 0\n", "v 1 NaN 0\n")).unwrap_err();
    assert!(matches!(error, MeshFileError::Mesh(MeshError::Vertex { vertex: 1, .. })), "{error}");
    // Text PLY has no word for infinity; the bits of one stand in for the x of vertex 2 in the binary sample.
    assert!(matches!(ply(&PLY.replace("1 1 0 9", "1 inf 0 9")), Err(MeshFileError::Malformed { .. })));
    let mut bytes = binary_ply(false);
    let header = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    bytes[header + 48..header + 56].copy_from_slice(&f64::INFINITY.to_le_bytes());
    let error = read_mesh(&bytes, MeshFormat::Ply).unwrap_err();
    assert!(matches!(error, MeshFileError::Mesh(MeshError::Vertex { vertex: 2, .. })), "{error}");
}

#[test]
fn indices_out_of_range_are_refused() {
    for face in ["f 1 2 6", "f 1 2 0", "f 1 2 -6", "f 1 2 -9223372036854775808", "f 1 2 99999999999999999999", "f 1 2"]
    {
        let error = obj(&OBJ.replace("f 2//1 -1//1 3//1", face)).unwrap_err();
        let at_line_or_triangle = matches!(&error, MeshFileError::Malformed { reason, .. } if reason.contains("line 13"))
            || matches!(error, MeshFileError::Mesh(MeshError::IndexOutOfRange { triangle: 2, .. }));
        assert!(at_line_or_triangle, "{face}: {error}");
    }
    let error = ply(&PLY.replace("3 1 4 2", "3 1 5 2")).unwrap_err();
    assert!(matches!(error, MeshFileError::Mesh(MeshError::IndexOutOfRange { triangle: 2, vertex: 5, .. })), "{error}");
    assert!(matches!(ply(&PLY.replace("3 1 4 2", "3 1 -1 2")), Err(MeshFileError::Malformed { .. })));
}

#[test]
fn announced_counts_cost_nothing() {
    for count in ["18446744073709551615", "4000000000", "2000000"] {
        for text in
            [PLY.replace("vertex 5", &format!("vertex {count}")), PLY.replace("face 2", &format!("face {count}"))]
        {
            let error = ply(&text).unwrap_err();
            assert!(
                matches!(error, MeshFileError::TooLarge { .. } | MeshFileError::Malformed { .. }),
                "{count}: {error}"
            );
        }
    }
    let error = ply(&PLY.replace("vertex 5", "vertex 2000001")).unwrap_err();
    assert_eq!(error, MeshFileError::TooLarge { what: "vertices", count: 2_000_001, limit: VERTEX_LIMIT });
    // A list that announces four thousand million corners, in a file that ends there.
    let mut bytes =
        "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint uint vertex_index\nend_header\n"
            .as_bytes()
            .to_vec();
    bytes.extend(u32::MAX.to_le_bytes());
    assert!(matches!(read_mesh(&bytes, MeshFormat::Ply), Err(MeshFileError::Malformed { .. })));
    // Elements without properties would be read for ever from no bytes at all.
    let empty = "ply\nformat binary_little_endian 1.0\nelement nothing 4000000\nend_header\n";
    assert!(matches!(ply(empty), Err(MeshFileError::Malformed { .. })));
}

#[test]
fn split_vertices_are_merged_and_faces_without_area_dropped() {
    let mesh = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 -0\nf 1 2 3\nf 4 5 6\nf 2 4 5\n").unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles()), (4, &[[0, 1, 2], [1, 3, 2]][..]));
    let error = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n").unwrap_err();
    assert!(matches!(error, MeshFileError::Mesh(MeshError::InconsistentOrientation { .. })), "{error}");
}
